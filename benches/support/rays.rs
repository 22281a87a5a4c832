//! Rays as a renderer makes them: camera rays in 8 x 8 tiles of Z-order, and one ray of each kind for each of their
//! hits, in the same order, about the geometric normal.

use super::Random;
use super::scenes::Scene;
use glam::Vec3;
use gloss::accel::{Accelerator, Coherence};
use gloss::core::{Hit, Ray};
use gloss::geometry::Shape;
use std::f32::consts::TAU;

/// Rays of one kind.
pub struct Class {
    pub name: String,
    pub rays: Vec<Ray>,
    pub coherence: Coherence,
    /// Whether only occlusion is asked for.
    pub any: bool,
}

/// All classes of a scene at the given image size (multiples of 8).
pub fn classes(scene: &Scene, accel: &dyn Accelerator, width: u32, height: u32) -> Vec<Class> {
    let primary = camera_rays(scene, width, height);
    let mut hits = vec![None; primary.len()];
    accel.intersect(&primary, Coherence::Coherent, &mut hits);
    let points: Vec<Point> =
        primary.iter().zip(&hits).filter_map(|(ray, hit)| Point::new(scene, ray, hit.as_ref()?)).collect();
    let mut random = Random(21);
    let mut classes =
        vec![Class { name: "primary".into(), rays: primary, coherence: Coherence::Coherent, any: false }];
    let mut push = |name: &str, any, rays| {
        classes.push(Class { name: name.into(), rays, coherence: Coherence::Incoherent, any });
    };
    for exponent in [10.0, 100.0, 1000.0, 10_000.0] {
        let rays = points.iter().map(|p| p.glossy(scene, exponent, &mut random)).collect();
        push(&format!("glossy e={exponent}"), false, rays);
    }
    for exponent in [100.0, 1000.0] {
        let sixteen = |p: &Point, random: &mut Random| [(); 16].map(|()| p.glossy(scene, exponent, random));
        let rays = points.iter().step_by(16).flat_map(|p| sixteen(p, &mut random)).collect();
        push(&format!("16 x e={exponent}"), false, rays);
    }
    push("diffuse", false, points.iter().map(|p| p.diffuse(scene, &mut random)).collect());
    push("shadow", true, points.iter().map(|p| p.shadow(scene, &mut random)).collect());
    classes
}

fn camera_rays(scene: &Scene, width: u32, height: u32) -> Vec<Ray> {
    let forward = (scene.look_at - scene.eye).normalize();
    let right = forward.cross(Vec3::Y).normalize();
    let up = right.cross(forward);
    let half = (25f32).to_radians().tan();
    let mut random = Random(20);
    let mut rays = Vec::with_capacity((width * height) as usize);
    for tile in 0..(width / 8) * (height / 8) {
        let (tile_x, tile_y) = (tile % (width / 8) * 8, tile / (width / 8) * 8);
        for z in 0..64u32 {
            let every_other = |z: u32| z & 1 | z >> 1 & 2 | z >> 2 & 4;
            let (x, y) = (tile_x + every_other(z), tile_y + every_other(z >> 1));
            let sx = (2.0 * (x as f32 + random.unit()) / width as f32 - 1.0) * half;
            let sy = (1.0 - 2.0 * (y as f32 + random.unit()) / height as f32) * half * height as f32
                / width as f32;
            rays.push(Ray::new(scene.eye, (forward + sx * right + sy * up).normalize()));
        }
    }
    rays
}

/// A point that the camera sees.
struct Point {
    at: Vec3,
    normal: Vec3,
    mirrored: Vec3,
}

impl Point {
    fn new(scene: &Scene, ray: &Ray, hit: &Hit) -> Option<Self> {
        let Shape::Mesh(mesh) = &scene.shapes[hit.geom_id as usize] else { return None };
        let [a, b, c] = mesh.triangle(hit.prim_id);
        let normal = (b - a).cross(c - a).try_normalize()?;
        let normal = if normal.dot(ray.dir) > 0.0 { -normal } else { normal };
        Some(Self { at: ray.at(hit.t), normal, mirrored: ray.dir - 2.0 * ray.dir.dot(normal) * normal })
    }

    fn leaving(&self, scene: &Scene, dir: Vec3) -> Ray {
        Ray { t_min: scene.t_min, ..Ray::new(self.at, dir) }
    }

    /// A direction of the lobe `cos^e` about an axis, turned to the outside by half a turn about the axis.
    fn lobe(&self, axis: Vec3, exponent: f32, random: &mut Random) -> Vec3 {
        let cos = (1.0 - random.unit()).powf(1.0 / (exponent + 1.0));
        let (sin_phi, cos_phi) = (TAU * random.unit()).sin_cos();
        let (tangent, bitangent) = axis.any_orthonormal_pair();
        let across = (1.0 - cos * cos).max(0.0).sqrt() * (cos_phi * tangent + sin_phi * bitangent);
        let dir = cos * axis + across;
        if dir.dot(self.normal) > 0.0 { dir } else { cos * axis - across }
    }

    fn glossy(&self, scene: &Scene, exponent: f32, random: &mut Random) -> Ray {
        self.leaving(scene, self.lobe(self.mirrored, exponent, random))
    }

    fn diffuse(&self, scene: &Scene, random: &mut Random) -> Ray {
        self.leaving(scene, self.lobe(self.normal, 1.0, random))
    }

    fn shadow(&self, scene: &Scene, random: &mut Random) -> Ray {
        let [corner, u, v] = scene.light;
        let to_light = corner + random.unit() * u + random.unit() * v - self.at;
        let distance = to_light.length();
        Ray { t_max: 0.999 * distance, ..self.leaving(scene, to_light / distance) }
    }
}
