//! Every primitive against every ray, in f64: the oracle that the other backends are held against.

use super::{AccelInfo, Accelerator, Coherence};
use crate::core::{Hit, Ray};
use crate::geometry::{Shape, Sphere};
use glam::{DVec3, Vec3};

/// The shapes as they are.
pub struct Brute {
    shapes: Vec<Shape>,
}

impl Brute {
    /// Keeps the shapes; builds nothing.
    pub fn new(shapes: &[Shape]) -> Self {
        Self { shapes: shapes.to_vec() }
    }

    fn closest(&self, ray: &Ray) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        if !ray.is_active() {
            return None;
        }
        for (geom_id, shape) in (0u32..).zip(&self.shapes) {
            for prim_id in 0..shape.primitive_count() as u32 {
                if ray.skip.rejects(geom_id, prim_id) {
                    continue;
                }
                let t_max = best.map_or(ray.t_max, |hit| hit.t);
                let found = match shape {
                    Shape::Mesh(mesh) => intersect_triangle(ray, mesh.triangle(prim_id), t_max),
                    Shape::Spheres(spheres) => intersect_sphere(ray, spheres[prim_id as usize], t_max),
                };
                if let Some((t, u, v)) = found
                    && best.is_none_or(|hit| t < hit.t)
                {
                    best = Some(Hit { t, u, v, geom_id, prim_id });
                }
            }
        }
        best
    }
}

/// Scalar triple products of the edges seen from the origin, in f64 (Woop, Benthin and Wald 2013 without the
/// shear, which f64 does not need). Edges belong to both of their triangles; a triangle without area is not hit.
fn intersect_triangle(ray: &Ray, corners: [Vec3; 3], t_max: f32) -> Option<(f32, f32, f32)> {
    let d = ray.dir.as_dvec3();
    let [a, b, c] = corners.map(|p| p.as_dvec3() - ray.origin.as_dvec3());
    let [u, v, w] = [(c, b), (a, c), (b, a)].map(|(p, q): (DVec3, DVec3)| p.cross(q).dot(d));
    if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
        return None;
    }
    let det = u + v + w;
    if det == 0.0 {
        return None;
    }
    let normal = (b - a).cross(c - a);
    let t = (normal.dot(a) / normal.dot(d)) as f32;
    (t >= ray.t_min && t <= t_max).then(|| (t, (v / det) as f32, (w / det) as f32))
}

/// The nearer root in the interval, from the point of the ray that is closest to the centre.
fn intersect_sphere(ray: &Ray, sphere: Sphere, t_max: f32) -> Option<(f32, f32, f32)> {
    let d = ray.dir.as_dvec3();
    let to_center = sphere.center.as_dvec3() - ray.origin.as_dvec3();
    let t_closest = to_center.dot(d) / d.length_squared();
    let radius = f64::from(sphere.radius);
    let discriminant = radius * radius - (to_center - t_closest * d).length_squared();
    if discriminant < 0.0 {
        return None;
    }
    let half_chord = (discriminant / d.length_squared()).sqrt();
    [t_closest - half_chord, t_closest + half_chord]
        .map(|t| t as f32)
        .into_iter()
        .find(|&t| t >= ray.t_min && t <= t_max)
        .map(|t| (t, 0.0, 0.0))
}

impl Accelerator for Brute {
    fn intersect(&self, rays: &[Ray], _: Coherence, hits: &mut [Option<Hit>]) {
        assert_eq!(rays.len(), hits.len(), "one hit per ray");
        for (hit, ray) in hits.iter_mut().zip(rays) {
            *hit = self.closest(ray);
        }
    }

    fn occluded(&self, rays: &[Ray], _: Coherence, occluded: &mut [bool]) {
        assert_eq!(rays.len(), occluded.len(), "one answer per ray");
        for (occluded, ray) in occluded.iter_mut().zip(rays) {
            *occluded = self.closest(ray).is_some();
        }
    }

    fn info(&self) -> AccelInfo {
        AccelInfo { name: "brute".into(), memory_bytes: 0, build_seconds: 0.0 }
    }
}
