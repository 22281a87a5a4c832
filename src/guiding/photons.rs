//! Photons: from a light to a reflector, and on to diffuse surfaces.

use super::map::Photon;
use super::reflectors::{Reflectors, focuses};
use crate::accel::{Accelerator, Coherence};
use crate::bxdf::{Bsdf, Bxdf, Diffuse, Incidence};
use crate::core::{Hit, Ray, Rgb, Sampler, SamplerKind};
use crate::scene::{Receiver, Rivals, Scene, SurfaceInteraction};
use glam::Vec3;
use std::f32::consts::PI;

/// Reflections that a photon may take before it lands on a diffuse surface.
const MOST_REFLECTIONS: usize = 4;

/// One of the lobes that focus light, chosen by albedo with the number `u`; with the probability.
fn choose_focusing<'a>(bsdf: &'a Bsdf, at: &Incidence, u: f32) -> Option<(&'a Bxdf, f32)> {
    let albedo = |bxdf: &Bxdf| bxdf.albedo(at).max_channel();
    let total: f32 = bsdf.lobes().iter().filter(|bxdf| focuses(bxdf)).map(albedo).sum();
    let mut before = 0.0;
    let mut lobes = bsdf.lobes().iter().filter(|bxdf| focuses(bxdf));
    let chosen = lobes.find(|bxdf| {
        before += albedo(bxdf);
        u * total < before
    })?;
    Some((chosen, albedo(chosen) / total))
}

/// One light's irradiance on a surface: the way that must be free, the direction, and how much.
pub fn light(
    scene: &Scene,
    point: &SurfaceInteraction,
    rivals: Rivals,
    u: [f32; 2],
) -> Option<(Ray, Vec3, f32)> {
    let receiver = Receiver { p: point.p, n: point.at.n, rivals };
    let sample = scene.lights.sample(&receiver, 0.0, u)?;
    let cos = sample.wi.dot(point.at.n).min(sample.wi.dot(point.at.ng));
    let t_max = if sample.shadow { sample.t_max } else { 0.0 };
    let ray = point.spawn_shadow(sample.wi, t_max, scene.settings.self_hit);
    (cos > 0.0).then(|| (ray, sample.wi, sample.le_over_pdf.luminance() * cos))
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

/// A photon on a diffuse surface.
struct Landed {
    photon: Photon,
    index: u32,
    point: SurfaceInteraction,
}

/// One of so many photons looks what else its surface sees.
const LOOKING: u32 = 4;

/// Shoots photons that meet a light first and then a reflector.
pub struct Shooter<'a> {
    pub scene: &'a Scene,
    pub accel: &'a dyn Accelerator,
    pub reflectors: &'a Reflectors,
    /// Photons in all.
    pub count: u32,
    /// Luminance of the mean radiance of the environment: what is brighter is found by light samples.
    pub environment_mean: f32,
}

impl Shooter<'_> {
    /// The photons of these numbers that land on diffuse surfaces, in order.
    pub fn shoot(&self, numbers: std::ops::Range<u32>) -> Vec<Photon> {
        let mut flying = self.lit(numbers);
        let mut landed = vec![];
        for reflection in 1..=MOST_REFLECTIONS as u32 {
            let rays: Vec<Ray> = flying.iter().map(|photon| photon.ray).collect();
            let hits = hits(self.accel, &rays);
            let mut next = vec![];
            for (photon, hit) in flying.iter().zip(&hits) {
                if let Some(hit) = hit {
                    self.arrive(photon, hit, reflection, &mut landed, &mut next);
                }
            }
            flying = next;
        }
        self.look_around(&mut landed);
        landed.into_iter().map(|landed| landed.photon).collect()
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
        let lit = flying.into_iter().zip(occluded(self.accel, &shadows));
        lit.filter_map(|(photon, occluded)| (!occluded).then_some(photon)).collect()
    }

    fn light(&self, point: &SurfaceInteraction, index: u32, dimension: u32) -> Option<(Ray, Vec3, f32)> {
        light(self.scene, point, Rivals::Lobes, self.sampler().pair(index, dimension))
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
        self.scene.bsdf(point.geom_id, point.p)
    }

    /// What a photon does at a surface: it lands, if that is diffuse, and goes on, if it focuses light.
    fn arrive(
        &self,
        photon: &Flying,
        hit: &Hit,
        reflection: u32,
        landed: &mut Vec<Landed>,
        next: &mut Vec<Flying>,
    ) {
        let point = self.scene.interaction(&photon.ray, hit);
        if diffuse(&self.bsdf(&point)).is_some() {
            let (n, wi) = (point.at.n, point.at.wo);
            let landing = Photon { p: point.p, n, wi, power: photon.power, other: None };
            landed.push(Landed { photon: landing, index: photon.index, point });
        }
        if let Some((wi, share)) = self.reflect(&point, &point.at, photon.index, reflection) {
            let ray = point.spawn(wi, f32::INFINITY, self.scene.settings.self_hit);
            next.push(Flying { index: photon.index, power: photon.power * share, ray });
        }
    }

    /// Finds what else the surfaces of some landed photons see, by one ray each.
    fn look_around(&self, landed: &mut [Landed]) {
        let (scene, sampler) = (self.scene, self.sampler());
        let mut looking: Vec<&mut Landed> = landed.iter_mut().filter(|l| l.index % LOOKING == 0).collect();
        let white = Bxdf::Diffuse(Diffuse { reflectance: Rgb::WHITE });
        let look = |Landed { index, point, .. }: &Landed| {
            let sample = white.sample(&point.at, sampler.pair(*index, dimension::OTHER));
            sample.map_or(Ray::inactive(), |s| point.spawn(s.wi, f32::INFINITY, scene.settings.self_hit))
        };
        let rays: Vec<Ray> = looking.iter().map(|landed| look(landed)).collect();
        let hits = hits(self.accel, &rays);
        let mut shadows = vec![Ray::inactive(); rays.len()];
        for (((landed, ray), hit), shadow) in looking.iter_mut().zip(&rays).zip(&hits).zip(&mut shadows) {
            landed.photon.other = Some(match hit {
                Some(hit) => {
                    let point = scene.interaction(ray, hit);
                    let light = self.light(&point, landed.index, dimension::OTHER_LIGHT);
                    match (diffuse(&self.bsdf(&point)), light) {
                        (Some(albedo), Some((way, _, irradiance))) => {
                            *shadow = way;
                            albedo * irradiance / PI
                        }
                        _ => 0.0,
                    }
                }
                None => scene.lights.environment.as_ref().map_or(0.0, |environment| {
                    environment.le(ray.dir).luminance().min(self.environment_mean)
                }),
            });
        }
        for (landed, occluded) in looking.iter_mut().zip(occluded(self.accel, &shadows)) {
            if occluded {
                landed.photon.other = Some(0.0);
            }
        }
    }
}

/// Whether anything is in the way of each of these rays.
pub fn occluded(accel: &dyn Accelerator, rays: &[Ray]) -> Vec<bool> {
    let mut occluded = vec![false; rays.len()];
    accel.occluded(rays, Coherence::Incoherent, &mut occluded);
    occluded
}

/// What each of these rays hits.
pub fn hits(accel: &dyn Accelerator, rays: &[Ray]) -> Vec<Option<Hit>> {
    let mut hits = vec![None; rays.len()];
    accel.intersect(rays, Coherence::Incoherent, &mut hits);
    hits
}

/// Luminance of what a surface reflects diffusely, if it does.
fn diffuse(bsdf: &Bsdf) -> Option<f32> {
    bsdf.lobes().iter().find_map(|bxdf| match bxdf {
        Bxdf::Diffuse(lobe) => Some(lobe.reflectance.luminance()),
        _ => None,
    })
}
