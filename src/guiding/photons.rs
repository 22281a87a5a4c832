//! Photons: from a light to a reflector, and on to surfaces whose rays would miss them.

use super::map::{Cell, GuideMap, Making, Photon};
use super::reflectors::{Reflectors, focuses};
use crate::accel::{Accelerator, Coherence};
use crate::bxdf::{Bsdf, Bxdf, Incidence, Width};
use crate::core::{Hit, Ray, Sampler, SamplerKind};
use crate::scene::{Receiver, Rivals, Scene, SurfaceInteraction};
use glam::Vec3;
use rayon::prelude::*;
use std::ops::Range;

/// Photons that are shot, at most, and at least.
const PHOTONS: std::ops::RangeInclusive<u32> = 1 << 12..=1 << 17;

/// Pixels for each photon.
const PIXELS_PER_PHOTON: u32 = 2;

/// Cells of caustics: small, since those have edges.
const CAUSTICS: Making = Making { most: 64, counts_dark: false, cell: Cell::to_caustics };

/// Photons and paths that one thread follows together.
const TOGETHER: u32 = 2048;

/// Reflections that a photon may take before it lands.
const MOST_REFLECTIONS: usize = 4;

/// Which lobes reflect a photon or a look.
pub(super) type Takes = fn(&Bxdf) -> bool;

/// One of the lobes that are taken, chosen by albedo with the number `u`; with the probability.
pub(super) fn choose<'a>(bsdf: &'a Bsdf, at: &Incidence, takes: Takes, u: f32) -> Option<(&'a Bxdf, f32)> {
    let albedo = |bxdf: &Bxdf| bxdf.albedo(at).max_channel();
    let total: f32 = bsdf.lobes().iter().filter(|bxdf| takes(bxdf)).map(albedo).sum();
    let mut before = 0.0;
    let mut lobes = bsdf.lobes().iter().filter(|bxdf| takes(bxdf));
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
pub(super) mod dimension {
    pub const POINT: u32 = 0;
    pub const REFLECTOR: u32 = 1;
    pub const LIGHT: u32 = 2;
    /// Two for each reflection.
    pub const REFLECTION: u32 = 3;
    /// One, and three for each surface that is seen.
    pub const LOOK: u32 = REFLECTION + 2 * (super::MOST_REFLECTIONS as u32 + 1);
}

/// A photon on its way.
struct Flying {
    /// Its number, which its random numbers go by.
    index: u32,
    power: f32,
    /// The [width](Bxdf::width) of the lobe that has reflected it last.
    width: Width,
    ray: Ray,
}

/// A photon on a surface.
pub(super) struct Landed {
    pub photon: Photon,
    pub index: u32,
    pub point: SurfaceInteraction,
}

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

impl<'a> Shooter<'a> {
    /// For a scene's picture.
    pub fn new(
        scene: &'a Scene,
        accel: &'a dyn Accelerator,
        reflectors: &'a Reflectors,
        environment_mean: f32,
    ) -> Self {
        let [width, height] = scene.camera.resolution;
        let count =
            (width.saturating_mul(height) / PIXELS_PER_PHOTON).clamp(*PHOTONS.start(), *PHOTONS.end());
        Self { scene, accel, reflectors, count, environment_mean }
    }

    /// Guides to the caustics of the scene; empty where there are none.
    pub fn to_caustics(&self) -> GuideMap {
        if self.reflectors.area() == 0.0 {
            return GuideMap::default();
        }
        GuideMap::new(in_parallel(0..self.count, |photons| self.shoot(photons)), CAUSTICS)
    }

    /// The photons of these numbers that land, in order.
    fn shoot(&self, numbers: Range<u32>) -> Vec<Photon> {
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

    pub(super) fn sampler(&self) -> Sampler {
        Sampler::new(SamplerKind::Sobol, self.scene.settings.seed ^ 0x70_68_6f_74, 0, 0)
    }

    /// Photons that have left a light and been reflected once.
    fn lit(&self, numbers: Range<u32>) -> Vec<Flying> {
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
            let (bsdf, numbers) = (self.bsdf(&point), dimension::REFLECTION);
            if let Some((ray, share, width)) = self.reflect(&bsdf, (&point, &at), focuses, index, numbers) {
                flying.push(Flying { index, power: power * share, width, ray });
                shadows.push(shadow);
            }
        }
        let lit = flying.into_iter().zip(occluded(self.accel, &shadows));
        lit.filter_map(|(photon, occluded)| (!occluded).then_some(photon)).collect()
    }

    /// One light's irradiance, as [`light`] has it, by the numbers of a photon.
    pub(super) fn light(
        &self,
        point: &SurfaceInteraction,
        index: u32,
        dimension: u32,
    ) -> Option<(Ray, Vec3, f32)> {
        light(self.scene, point, Rivals::Lobes, self.sampler().pair(index, dimension))
    }

    /// The ray with which what comes to a surface goes on, by one of the lobes that are taken, and how much of it; by two pairs of
    /// numbers from `dimension` on.
    pub(super) fn reflect(
        &self,
        bsdf: &Bsdf,
        (point, at): (&SurfaceInteraction, &Incidence),
        takes: Takes,
        index: u32,
        dimension: u32,
    ) -> Option<(Ray, f32, Width)> {
        let pair = |k: u32| self.sampler().pair(index, dimension + k);
        let (lobe, probability) = choose(bsdf, at, takes, pair(1)[0])?;
        let sample = lobe.sample(at, pair(0))?;
        let ray = point.spawn(sample.wi, f32::INFINITY, self.scene.settings.self_hit);
        Some((ray, sample.weight.luminance() / probability, lobe.width()))
    }

    pub(super) fn bsdf(&self, point: &SurfaceInteraction) -> Bsdf {
        self.scene.bsdf(point.geom_id, point.p)
    }

    /// What a photon does at a surface: it lands, if rays from there would miss it, and goes on, if it is focused.
    fn arrive(
        &self,
        photon: &Flying,
        hit: &Hit,
        reflection: u32,
        landed: &mut Vec<Landed>,
        next: &mut Vec<Flying>,
    ) {
        let point = self.scene.interaction(&photon.ray, hit);
        let bsdf = self.bsdf(&point);
        if bsdf.lobes().iter().any(|lobe| lobe.width().misses(photon.width)) {
            let (n, wi) = (point.at.n, point.at.wo);
            let landing = Photon { p: point.p, n, wi, power: photon.power, other: None, pdf: 0.0 };
            landed.push(Landed { photon: landing, index: photon.index, point });
        }
        let numbers = dimension::REFLECTION + 2 * reflection;
        if let Some((ray, share, width)) =
            self.reflect(&bsdf, (&point, &point.at), focuses, photon.index, numbers)
        {
            next.push(Flying { index: photon.index, power: photon.power * share, width, ray });
        }
    }
}

/// What `follow` gives for all of these numbers, in their order.
pub(super) fn in_parallel(
    numbers: Range<u32>,
    follow: impl Fn(Range<u32>) -> Vec<Photon> + Sync,
) -> Vec<Photon> {
    let starts: Vec<u32> = numbers.clone().step_by(TOGETHER as usize).collect();
    let parts: Vec<Vec<Photon>> = starts
        .into_par_iter()
        .map(|start| follow(start..numbers.end.min(start.saturating_add(TOGETHER))))
        .collect();
    parts.concat()
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
pub(super) fn diffuse(bsdf: &Bsdf) -> Option<f32> {
    bsdf.lobes().iter().find_map(|bxdf| match bxdf {
        Bxdf::Diffuse(lobe) => Some(lobe.reflectance.luminance()),
        _ => None,
    })
}
