//! Photons from sharp glossy surfaces.

use super::map::Photon;
use crate::accel::{Accelerator, Coherence};
use crate::bxdf::{Bsdf, Bxdf, Incidence, LobeKind};
use crate::core::{Hit, Ray, Rgb, Sampler, SamplerKind, warp};
use crate::geometry::Shape;
use crate::scene::{Receiver, Scene, SurfaceInteraction};
use glam::Vec3;
use std::f32::consts::PI;

/// Triangles of a shape among which points are chosen, at most: of a larger one, every so-manieth.
const MOST_TRIANGLES: usize = 1 << 18;

/// Reflections that a photon may take before it lands on a diffuse surface.
const MOST_REFLECTIONS: usize = 4;

/// Roughness beyond which a lobe makes no caustic that other rays would miss.
const WIDEST_ALPHA: f32 = 0.25;

/// Whether what a lobe reflects of a small light is a caustic that rays drawn from a diffuse lobe hardly find.
fn focuses(bxdf: &Bxdf) -> bool {
    match bxdf {
        Bxdf::Mirror(_) | Bxdf::Dielectric(_) => true,
        Bxdf::Conductor(lobe) => lobe.alpha <= WIDEST_ALPHA,
        Bxdf::CosinePower(lobe) => lobe.exponent >= 2.0 / (WIDEST_ALPHA * WIDEST_ALPHA) - 2.0,
        Bxdf::Diffuse(_) | Bxdf::Plastic(_) => false,
    }
}

/// One of the lobes that focus light, chosen by albedo with the number `u`; with the probability.
fn choose_focusing<'a>(bsdf: &'a Bsdf, at: &Incidence, u: f32) -> Option<(&'a Bxdf, f32)> {
    let albedo = |bxdf: &Bxdf| bxdf.albedo(at).max_channel();
    let total: f32 = bsdf.lobes().filter(|bxdf| focuses(bxdf)).map(albedo).sum();
    let mut before = 0.0;
    let mut lobes = bsdf.lobes().filter(|bxdf| focuses(bxdf));
    let chosen = lobes.find(|bxdf| {
        before += albedo(bxdf);
        u * total < before
    })?;
    Some((chosen, albedo(chosen) / total))
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
            if material.bsdf(Vec3::ZERO).lobes().any(focuses) {
                reflectors.add(geom_id as u32, shape);
            }
        }
        reflectors
    }

    fn add(&mut self, geom_id: u32, shape: &Shape) {
        let stride = shape.primitive_count().div_ceil(MOST_TRIANGLES).max(1);
        for prim_id in (0..shape.primitive_count() as u32).step_by(stride) {
            let area = match shape {
                Shape::Mesh(mesh) => {
                    let [a, b, c] = mesh.triangle(prim_id);
                    0.5 * (b - a).cross(c - a).length()
                }
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
    fn sample(&self, scene: &Scene, u: f32, v: [f32; 2], outside: bool) -> SurfaceInteraction {
        let number = self.areas.partition_point(|&area| area <= f64::from(u) * self.area());
        let (geom_id, prim_id) = self.primitives[number.min(self.areas.len() - 1)];
        let turned = |n: Vec3| if outside { -n } else { n };
        match &scene.shapes[geom_id as usize] {
            Shape::Mesh(mesh) => {
                let [a, b, c] = mesh.triangle(prim_id);
                let normal = (b - a).cross(c - a).normalize_or(Vec3::Z);
                let [u, v] = warp::uniform_triangle(v);
                let hit = Hit { t: 1.0, u, v, geom_id, prim_id };
                scene.interaction(&Ray::new(a, turned(normal)), &hit)
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

/// Pairs of random numbers of a photon, by what they decide.
mod dimension {
    pub const POINT: u32 = 0;
    pub const REFLECTOR: u32 = 1;
    pub const LIGHT: u32 = 2;
    pub const OTHER: u32 = 3;
    pub const OTHER_LIGHT: u32 = 4;
    pub const REFLECTION: u32 = 5;
}

/// A photon on its way.
struct Flying {
    /// Its number, which its random numbers go by.
    index: u32,
    power: f32,
    ray: Ray,
}

/// Shoots photons that meet a light first and then a reflector.
pub struct Shooter<'a> {
    pub scene: &'a Scene,
    pub accel: &'a dyn Accelerator,
    pub reflectors: &'a Reflectors,
    /// Photons in all.
    pub count: u32,
}

impl Shooter<'_> {
    /// The photons of these numbers that land on diffuse surfaces, in order.
    pub fn shoot(&self, numbers: std::ops::Range<u32>) -> Vec<Photon> {
        let mut flying = self.lit(numbers);
        let mut landed = vec![];
        for reflection in 1..=MOST_REFLECTIONS as u32 {
            let rays: Vec<Ray> = flying.iter().map(|photon| photon.ray).collect();
            let hits = self.hits(&rays);
            let mut next = vec![];
            for (photon, hit) in flying.iter().zip(&hits) {
                if let Some(hit) = hit {
                    self.arrive(photon, hit, reflection, &mut landed, &mut next);
                }
            }
            flying = next;
        }
        self.look_around(&mut landed);
        landed.into_iter().map(|(photon, ..)| photon).collect()
    }

    fn sampler(&self) -> Sampler {
        Sampler::new(SamplerKind::Sobol, self.scene.settings.seed ^ 0x70_68_6f_74, 0, 0)
    }

    /// Photons that have left a light and been reflected once.
    fn lit(&self, numbers: std::ops::Range<u32>) -> Vec<Flying> {
        let sampler = self.sampler();
        let (mut flying, mut shadows) = (vec![], vec![]);
        for index in numbers {
            let [u, side] = sampler.pair(index, dimension::REFLECTOR);
            let point =
                self.reflectors.sample(self.scene, u, sampler.pair(index, dimension::POINT), side < 0.5);
            let Some((shadow, wi, irradiance)) = self.light(&point, index, dimension::LIGHT) else {
                continue;
            };
            let at = Incidence { wo: wi, ..point.at };
            let power = irradiance * (2.0 * self.reflectors.area() as f32 / self.count as f32);
            if let Some((wi, share)) = self.reflect(&point, &at, index, 0) {
                let ray = point.spawn(wi, f32::INFINITY, self.scene.settings.self_hit);
                flying.push(Flying { index, power: power * share, ray });
                shadows.push(shadow);
            }
        }
        let mut occluded = vec![false; shadows.len()];
        self.accel.occluded(&shadows, Coherence::Incoherent, &mut occluded);
        let mut free = occluded.iter().map(|occluded| !occluded);
        flying.retain(|_| free.next() == Some(true));
        flying
    }

    /// One light's irradiance on a surface: the way that must be free, the direction, and how much.
    fn light(&self, point: &SurfaceInteraction, index: u32, dimension: u32) -> Option<(Ray, Vec3, f32)> {
        let receiver = Receiver { p: point.p, n: point.at.n, lobes_look: true };
        let u = self.sampler().pair(index, dimension);
        let sample = self.scene.lights.sample(&receiver, 0.0, u)?;
        let cos = sample.wi.dot(point.at.n).min(sample.wi.dot(point.at.ng));
        let t_max = if sample.shadow { sample.t_max } else { 0.0 };
        let ray = point.spawn_shadow(sample.wi, t_max, self.scene.settings.self_hit);
        (cos > 0.0).then(|| (ray, sample.wi, sample.le_over_pdf.luminance() * cos))
    }

    /// Where a photon goes on from a surface that focuses light, and how much of it.
    fn reflect(
        &self,
        point: &SurfaceInteraction,
        at: &Incidence,
        index: u32,
        reflection: u32,
    ) -> Option<(Vec3, f32)> {
        let bsdf = self.bsdf(point);
        let pair = |k: u32| self.sampler().pair(index, dimension::REFLECTION + 2 * reflection + k);
        let (lobe, probability) = choose_focusing(&bsdf, at, pair(1)[0])?;
        let sample = lobe.sample(at, pair(0))?;
        Some((sample.wi, sample.weight.luminance() / probability))
    }

    fn bsdf(&self, point: &SurfaceInteraction) -> Bsdf {
        let geometry = &self.scene.geometries[point.geom_id as usize];
        self.scene.materials[geometry.material as usize].bsdf(point.p)
    }

    /// What a photon does at a surface: it lands, if that is diffuse, and goes on, if it focuses light.
    fn arrive(
        &self,
        photon: &Flying,
        hit: &Hit,
        reflection: u32,
        landed: &mut Vec<(Photon, u32, SurfaceInteraction)>,
        next: &mut Vec<Flying>,
    ) {
        let point = self.scene.interaction(&photon.ray, hit);
        if diffuse(&self.bsdf(&point)).is_some() {
            let (n, wi) = (point.at.n, point.at.wo);
            landed.push((Photon { p: point.p, n, wi, power: photon.power, other: 0.0 }, photon.index, point));
        }
        if let Some((wi, share)) = self.reflect(&point, &point.at, photon.index, reflection) {
            let ray = point.spawn(wi, f32::INFINITY, self.scene.settings.self_hit);
            next.push(Flying { index: photon.index, power: photon.power * share, ray });
        }
    }

    /// Finds what else each landed photon's surface sees, by one ray each.
    fn look_around(&self, landed: &mut [(Photon, u32, SurfaceInteraction)]) {
        let sampler = self.sampler();
        let rays: Vec<Ray> = landed
            .iter()
            .map(|(_, index, point)| {
                let white = crate::bxdf::Diffuse { reflectance: Rgb::WHITE };
                let sample = Bxdf::Diffuse(white).sample(&point.at, sampler.pair(*index, dimension::OTHER));
                sample.map_or(Ray::inactive(), |sample| {
                    point.spawn(sample.wi, f32::INFINITY, self.scene.settings.self_hit)
                })
            })
            .collect();
        let hits = self.hits(&rays);
        let mut shadows = vec![Ray::inactive(); rays.len()];
        for (i, (ray, hit)) in rays.iter().zip(&hits).enumerate() {
            let (photon, index, _) = &mut landed[i];
            if let Some(hit) = hit {
                let point = self.scene.interaction(ray, hit);
                if let (Some(albedo), Some((shadow, _, irradiance))) =
                    (diffuse(&self.bsdf(&point)), self.light(&point, *index, dimension::OTHER_LIGHT))
                {
                    photon.other = albedo * irradiance / PI;
                    shadows[i] = shadow;
                }
            } else if let Some(environment) = &self.scene.lights.environment {
                let mean = environment.irradiance().luminance() / PI;
                photon.other = environment.le(ray.dir).luminance().min(mean);
            }
        }
        let mut occluded = vec![false; shadows.len()];
        self.accel.occluded(&shadows, Coherence::Incoherent, &mut occluded);
        for ((photon, ..), occluded) in landed.iter_mut().zip(occluded) {
            if occluded {
                photon.other = 0.0;
            }
        }
    }

    fn hits(&self, rays: &[Ray]) -> Vec<Option<Hit>> {
        let mut hits = vec![None; rays.len()];
        self.accel.intersect(rays, Coherence::Incoherent, &mut hits);
        hits
    }
}

/// Luminance of what a surface reflects diffusely, if it does.
fn diffuse(bsdf: &Bsdf) -> Option<f32> {
    bsdf.lobes().find_map(|bxdf| match bxdf {
        Bxdf::Diffuse(lobe) if bxdf.kind() == LobeKind::Diffuse => Some(lobe.reflectance.luminance()),
        _ => None,
    })
}
