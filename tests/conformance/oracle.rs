//! Answers held against brute force in f64.
//!
//! A backend computes in f32, so its answer is called right where it is the exact answer to a ray, or of a scene,
//! some roundings away (backward error). Where brute force and the backend differ, the backend's answer must be
//! the exact one for a ray that starts or points a few units in the last place elsewhere: on an edge either
//! triangle is right, on a silhouette both a hit and a miss.

use crate::scenes::Rng;
use crate::subject::{HINTS, any, closest};
use glam::DVec3;
use gloss::accel::{Accelerator, brute::Brute};
use gloss::core::{Hit, Ray, Vec3};
use gloss::geometry::Shape;

/// Roundings that an answer may be away from the exact one, as a part of the largest coordinate that it comes from.
pub(crate) const ROUNDINGS: f64 = 32.0 * (f32::EPSILON as f64);

/// Asks brute force and the subject, with both hints, for closest and any hits, and compares.
pub(crate) fn assert_agrees(accel: &dyn Accelerator, shapes: &[Shape], rays: &[Ray]) {
    let oracle = Brute::new(shapes);
    let exact = closest(&oracle, rays, HINTS[0]);
    for hint in HINTS {
        let (hits, occluded) = (closest(accel, rays, hint), any(accel, rays, hint));
        for (i, ray) in rays.iter().enumerate() {
            let context =
                || format!("ray {i} {ray:?} hinted {hint:?}: {:?}, exactly {:?}", hits[i], exact[i]);
            if let Some(hit) = hits[i] {
                assert_on_primitive(shapes, ray, hit, &context);
            }
            if !alike(shapes, ray, hits[i], exact[i]) {
                assert!(is_near_exact(&oracle, shapes, ray, hits[i]), "{}", context());
            }
            if occluded[i] != hits[i].is_some() {
                let near = |hit: Option<Hit>| hit.is_some() == occluded[i];
                assert!(perturbed(shapes, ray).any(|r| near(one(&oracle, &r))), "occluded {}", context());
            }
        }
    }
}

/// The closest hit of one ray.
pub(crate) fn one(accel: &dyn Accelerator, ray: &Ray) -> Option<Hit> {
    closest(accel, std::slice::from_ref(ray), HINTS[1])[0]
}

/// The hit is in the interval, obeys the rule, and its point by `t` is its point by `(u, v)`, up to rounding.
pub(crate) fn assert_on_primitive(shapes: &[Shape], ray: &Ray, hit: Hit, context: &dyn Fn() -> String) {
    assert!(hit.t >= ray.t_min && hit.t <= ray.t_max, "outside the interval: {}", context());
    assert!(!ray.skip.rejects(hit.geom_id, hit.prim_id), "rejected: {}", context());
    let point = ray.origin.as_dvec3() + f64::from(hit.t) * ray.dir.as_dvec3();
    let slack = ROUNDINGS * extent(shapes, ray);
    match &shapes[hit.geom_id as usize] {
        Shape::Spheres(spheres) => {
            let sphere = spheres[hit.prim_id as usize];
            assert_eq!((hit.u, hit.v), (0.0, 0.0), "{}", context());
            // Where the ray grazes, t is as uncertain as the square root of the rounding and the height is not.
            let height = point.distance(sphere.center.as_dvec3()) - f64::from(sphere.radius);
            assert!(height.abs() <= slack, "{height:e} off the sphere: {}", context());
        }
        Shape::Mesh(mesh) => {
            let [p0, p1, p2] = mesh.triangle(hit.prim_id).map(Vec3::as_dvec3);
            let normal = (p1 - p0).cross(p2 - p0).normalize();
            let height = normal.dot(point - p0);
            assert!(height.abs() <= slack, "{height:e} off the plane: {}", context());
            let (u, v) = (f64::from(hit.u), f64::from(hit.v));
            let by_uv = (1.0 - u - v) * p0 + u * p1 + v * p2;
            let beside = distance_to_line(by_uv, ray);
            assert!(beside <= slack, "(u, v) is {beside:e} beside the ray: {}", context());
            let outside = [-u, -v, u + v - 1.0].into_iter().fold(0.0, f64::max);
            assert!(outside <= 1e-5, "(u, v) outside: {}", context());
        }
    }
}

fn distance_to_line(p: DVec3, ray: &Ray) -> f64 {
    (p - ray.origin.as_dvec3()).cross(ray.dir.as_dvec3().normalize()).length()
}

/// The same primitive, or another one at the same place.
fn alike(shapes: &[Shape], ray: &Ray, a: Option<Hit>, b: Option<Hit>) -> bool {
    match (a, b) {
        (None, None) => true,
        (Some(a), Some(b)) if (a.geom_id, a.prim_id) == (b.geom_id, b.prim_id) && a.u + a.v != 0.0 => true,
        (Some(a), Some(b)) => {
            let apart = (f64::from(a.t) - f64::from(b.t)).abs() * ray.dir.as_dvec3().length();
            apart <= ROUNDINGS * extent(shapes, ray)
        }
        _ => false,
    }
}

/// Whether the answer is brute force's to a ray some roundings away.
fn is_near_exact(oracle: &Brute, shapes: &[Shape], ray: &Ray, hit: Option<Hit>) -> bool {
    perturbed(shapes, ray).any(|near| alike(shapes, ray, hit, one(oracle, &near)))
}

/// Rays some roundings away from this one.
fn perturbed(shapes: &[Shape], ray: &Ray) -> impl Iterator<Item = Ray> {
    let (ray, slack) = (*ray, (ROUNDINGS * extent(shapes, ray)) as f32);
    let length = ray.dir.length();
    let mut rng = Rng::new(1);
    (0..200).map(move |_| {
        let origin = ray.origin + slack * rng.direction();
        Ray { origin, dir: ray.dir + ROUNDINGS as f32 * length * rng.direction(), ..ray }
    })
}

/// The largest coordinate that a hit is made of.
fn extent(shapes: &[Shape], ray: &Ray) -> f64 {
    let bounds = shapes.iter().map(Shape::bounds).filter(|b| !b.is_empty());
    let largest = bounds.map(|b| b.min.abs().max(b.max.abs()).max_element()).fold(0.0, f32::max);
    f64::from(largest.max(ray.origin.abs().max_element()))
}
