//! Tiny, huge, thin and flat.

use crate::oracle::{assert_agrees, assert_on_primitive};
use crate::scenes::{Rng, dented_ball, mesh, random_rays, right_triangle, triangle};
use crate::subject::{HINTS, Subject, any, closest};
use gloss::core::{Ray, Vec3};

pub(crate) fn scale_changes_nothing(subject: &Subject) {
    let (points, triangles) = dented_ball(1);
    let unit_rays = random_rays(&mut Rng::new(21), 300);
    for scale in [1e-10f32, 1e-5, 1.0, 1e6, 1e9] {
        let shapes = [mesh(points.iter().map(|&p| scale * p).collect(), triangles.clone())];
        let rays: Vec<_> = unit_rays.iter().map(|ray| Ray::new(scale * ray.origin, ray.dir)).collect();
        assert_agrees(&*subject.build(&shapes), &shapes, &rays);
    }
}

pub(crate) fn slivers_are_hit_where_they_are(subject: &Subject) {
    // Needles of aspect 1e3 to 1e6 in a fan, and the rays that cross them far from grazing.
    let mut rng = Rng::new(22);
    for thickness in [1e-3f32, 1e-6] {
        let needles = 200u32;
        let positions = (0..needles).flat_map(|_| {
            let (p, d) = (0.5 * rng.point(), rng.direction());
            [p, p + d, p + 0.5 * d + thickness * rng.direction()]
        });
        let positions: Vec<_> = positions.collect();
        let indices: Vec<_> = (0..needles).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let rays: Vec<_> = positions
            .chunks_exact(3)
            .map(|c| {
                let middle = (c[0] + c[1] + c[2]) / 3.0;
                let normal = (c[1] - c[0]).cross(c[2] - c[0]).normalize();
                Ray::new(middle + normal + 0.2 * rng.point(), Vec3::ZERO).towards(middle)
            })
            .collect();
        let shapes = [mesh(positions, indices)];
        assert_agrees(&*subject.build(&shapes), &shapes, &rays);
    }
}

/// Embree alone puts these anywhere along the ray (its issue 387).
pub(crate) fn grazed_slivers_are_hit_where_they_are(subject: &Subject) {
    let mut rng = Rng::new(23);
    for thickness in [1e-1f32, 1e-3, 1e-5] {
        let (mut positions, mut rays) = (vec![], vec![]);
        for _ in 0..100 {
            let (p, d) = (0.5 * rng.point(), rng.direction());
            let corners = [p, p + d, p + 0.5 * d + thickness * rng.direction()];
            let middle = 0.3 * corners[0] + 0.3 * corners[1] + 0.4 * corners[2];
            let normal = (corners[1] - p).cross(corners[2] - p).normalize();
            let aside = rng.direction();
            let along = (aside - normal.dot(aside) * normal).normalize();
            for steepness in [0.1, 0.01, 0.001] {
                let origin = middle + 2.0 * (along + steepness * normal);
                rays.push(Ray::new(origin, Vec3::ZERO).towards(middle));
            }
            positions.extend(corners);
        }
        let shapes = [mesh(positions, (0..100).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())];
        let accel = subject.build(&shapes);
        for hint in HINTS {
            for (ray, hit) in rays.iter().zip(closest(&*accel, &rays, hint)) {
                let Some(hit) = hit else { continue };
                assert_on_primitive(&shapes, ray, hit, &|| format!("{thickness} {ray:?} {hit:?}"));
            }
        }
    }
}

trait Towards {
    fn towards(self, p: Vec3) -> Self;
}

impl Towards for Ray {
    fn towards(self, p: Vec3) -> Self {
        Self { dir: (p - self.origin).normalize(), ..self }
    }
}

pub(crate) fn triangles_without_area_are_never_hit(subject: &Subject) {
    let (a, b) = (Vec3::new(-1.0, 0.0, 0.0), Vec3::new(1.0, 0.0, 0.0));
    let flat = [[a, a, a], [a, b, b], [a, b, a], [a, Vec3::ZERO, b]];
    for corners in flat {
        // A sound triangle behind, so that the hierarchy is not empty.
        let accel = subject.build(&[triangle(corners), triangle(right_triangle(-5.0))]);
        let at_points = [-1.0, -0.5, 0.0, 0.5, 1.0].map(|x| Vec3::new(x, 0.0, 0.0));
        let from = [Vec3::new(0.0, 0.0, 1.0), Vec3::new(0.3, 1.0, 0.7), Vec3::new(-3.0, 0.0, 0.0)];
        let rays: Vec<_> =
            at_points.iter().flat_map(|&p| from.map(|o| Ray::new(o, Vec3::ZERO).towards(p))).collect();
        for hint in HINTS {
            for hit in closest(&*accel, &rays, hint).into_iter().flatten() {
                assert_eq!(hit.geom_id, 1, "{corners:?}");
            }
        }
        let only_flat = subject.build(&[triangle(corners)]);
        for hint in HINTS {
            assert!(!any(&*only_flat, &rays, hint).contains(&true), "{corners:?}");
        }
    }
}

pub(crate) fn coincident_triangles_give_either(subject: &Subject) {
    let shapes = [triangle(right_triangle(0.0)), triangle(right_triangle(0.0))];
    let accel = subject.build(&shapes);
    let rays = [Ray::new(Vec3::new(0.25, 0.25, 1.0), -Vec3::Z); 20];
    for hint in HINTS {
        for hit in closest(&*accel, &rays, hint) {
            let hit = hit.expect("two triangles are there");
            assert!(hit.geom_id < 2 && (hit.t - 1.0).abs() < 1e-6);
        }
    }
}
