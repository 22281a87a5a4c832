//! Every primitive against every ray, in f64: the oracle that the other backends are held against.

use super::exact::{self, Point};
use super::{AccelInfo, Accelerator, Coherence};
use crate::core::{Hit, Ray};
use crate::geometry::{Shape, Sphere};
use glam::Vec3;

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
                let found = match shape {
                    Shape::Mesh(mesh) => triangle(ray, mesh.triangle(prim_id)),
                    Shape::Spheres(spheres) => sphere(ray, spheres[prim_id as usize]),
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

fn triangle(ray: &Ray, corners: [Vec3; 3]) -> Option<(f32, f32, f32)> {
    exact::crossing(ray, corners).and_then(|p| in_interval(ray, p))
}

/// The nearer end in the interval.
fn sphere(ray: &Ray, sphere: Sphere) -> Option<(f32, f32, f32)> {
    exact::sphere_ends(ray, sphere).into_iter().filter(|p| p.beside == 0.0).find_map(|p| in_interval(ray, p))
}

fn in_interval(ray: &Ray, point: Point) -> Option<(f32, f32, f32)> {
    let t = point.t as f32;
    (t >= ray.t_min && t <= ray.t_max).then_some((t, point.u as f32, point.v as f32))
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
