//! Surfaces that focus light, and points of them.

use crate::bxdf::Bxdf;
use crate::core::{Hit, Ray, warp};
use crate::geometry::{Shape, TriangleMesh};
use crate::scene::{Scene, SurfaceInteraction};
use glam::Vec3;
use std::f32::consts::PI;

/// Triangles of a shape among which points are chosen, at most: of a larger one, every so-manieth.
const MOST_TRIANGLES: usize = 1 << 18;

/// Roughness beyond which a lobe makes no caustic that other rays would miss.
const WIDEST_ALPHA: f32 = 0.25;

/// Whether what a lobe reflects of a small light is a caustic that rays drawn from a diffuse lobe hardly find.
pub fn focuses(bxdf: &Bxdf) -> bool {
    bxdf.is_sharp(WIDEST_ALPHA)
}

/// Normal of a triangle, as long as twice its area.
fn cross(mesh: &TriangleMesh, prim_id: u32) -> Vec3 {
    let [a, b, c] = mesh.triangle(prim_id);
    (b - a).cross(c - a)
}

/// Primitives of the surfaces that focus light, by the running sum of their areas.
pub struct Reflectors {
    primitives: Vec<(u32, u32)>,
    areas: Vec<f64>,
}

impl Reflectors {
    /// Those of a scene.
    pub fn of(scene: &Scene) -> Self {
        let mut reflectors = Self { primitives: vec![], areas: vec![] };
        for (geom_id, (shape, geometry)) in scene.shapes.iter().zip(&scene.geometries).enumerate() {
            let material = &scene.materials[geometry.material as usize];
            // Whether a lobe focuses light is the same all over a material.
            if material.bsdf(Vec3::ZERO).lobes().iter().any(focuses) {
                reflectors.add(geom_id as u32, shape);
            }
        }
        reflectors
    }

    fn add(&mut self, geom_id: u32, shape: &Shape) {
        let stride = shape.primitive_count().div_ceil(MOST_TRIANGLES).max(1);
        for prim_id in (0..shape.primitive_count() as u32).step_by(stride) {
            let area = match shape {
                Shape::Mesh(mesh) => 0.5 * cross(mesh, prim_id).length(),
                Shape::Spheres(spheres) => 4.0 * PI * spheres[prim_id as usize].radius.powi(2),
            };
            self.primitives.push((geom_id, prim_id));
            self.areas.push(self.area() + f64::from(area) * stride as f64);
        }
    }

    /// The area of all, in unit lengths squared.
    pub fn area(&self) -> f64 {
        self.areas.last().copied().unwrap_or(0.0)
    }

    /// A point, uniform by area, seen along its normal from one side.
    pub fn sample(&self, scene: &Scene, u: f32, v: [f32; 2], outside: bool) -> SurfaceInteraction {
        let number = self.areas.partition_point(|&area| area <= f64::from(u) * self.area());
        let (geom_id, prim_id) = self.primitives[number.min(self.areas.len() - 1)];
        let turned = |n: Vec3| if outside { -n } else { n };
        match &scene.shapes[geom_id as usize] {
            Shape::Mesh(mesh) => {
                let normal = cross(mesh, prim_id).normalize_or(Vec3::Z);
                let [u, v] = warp::uniform_triangle(v);
                let hit = Hit { t: 1.0, u, v, geom_id, prim_id };
                // Of a triangle's point only the ray's direction counts.
                scene.interaction(&Ray::new(Vec3::ZERO, turned(normal)), &hit)
            }
            Shape::Spheres(spheres) => {
                let sphere = spheres[prim_id as usize];
                let normal = warp::uniform_sphere(v);
                let hit = Hit { t: sphere.radius, u: 0.0, v: 0.0, geom_id, prim_id };
                let from = if outside { 2.0 } else { 0.0 };
                let origin = sphere.center + from * sphere.radius * normal;
                scene.interaction(&Ray::new(origin, turned(normal)), &hit)
            }
        }
    }
}
