//! Light that comes straight from a light: by a shadow ray towards a sampled point, or by a lobe's ray that finds
//! an emitter, each weighted where it is the better (Veach and Guibas 1995).

use super::bounce::{Dimension, Leaving, Reached};
use super::eight::Eight;
use super::guided::{self, Guide};
use super::path::Path;
use super::wave::Integrator;
use crate::bxdf::{Bsdf, Bxdf, LobeKind};
use crate::core::lanes::LANES;
use crate::core::{Ray, Rgb};
use crate::guiding::Cell;
use crate::scene::{
    DirectLight, EightSamples, EmitterHit, Interactions, LightSample, Receivers, Rivals, SurfaceInteraction,
};
use std::borrow::Cow;

/// Light that arrives if nothing is in the way of a ray.
pub(super) struct Unoccluded {
    /// Radiance times the path's weight.
    pub radiance: Rgb,
    /// The way that must be free; `None` for a light that casts no shadow.
    pub ray: Option<Ray>,
}

/// The power heuristic for a technique of the density `mine` against one of the density `other`.
///
/// Of their quotient, since the square of a sharp lobe's density may overflow.
#[inline(always)]
pub(super) fn power_heuristic(mine: f32, other: f32) -> f32 {
    if other == 0.0 || mine == f32::INFINITY {
        return 1.0;
    }
    let ratio = other / mine;
    1.0 / (1.0 + ratio * ratio)
}

/// Radiance of which no channel is above `most`.
#[inline(always)]
pub(super) fn bounded_by(most: f32, radiance: Rgb) -> Rgb {
    let channel = radiance.max_channel();
    // What is not finite is the film's to count.
    let exceeds = (channel > most) & channel.is_finite();
    radiance * if exceeds { most / channel } else { 1.0 }
}

impl Integrator<'_> {
    /// Samples of lights for a hit whose lobes have so many rays each: one, or as many as each lobe has.
    #[inline(always)]
    pub(super) fn light_samples_of(&self, rays: impl Iterator<Item = u32>) -> u32 {
        if self.splits_lights { rays.min().unwrap_or(1) } else { 1 }
    }

    /// Sample `number` of lights for each of eight surfaces that take light from lights, where they take that many.
    #[inline(always)]
    pub(super) fn sample_lights(
        &self,
        drawn: &Eight,
        bsdfs: &[Option<&Bsdf>; LANES],
        (leaving, number): (&[Leaving; LANES], u32),
        samples: &mut EightSamples,
    ) {
        let (mut rivals, mut there) = ([Rivals::None; LANES], [false; LANES]);
        // Samples of lights, and candidates of each.
        let mut counts = [[1; 2]; LANES];
        for (lane, leaving) in leaving.iter().enumerate() {
            rivals[lane] = leaving.rivals;
            counts[lane] = [leaving.light_samples.max(1), leaving.light_candidates.max(1)];
            there[lane] = bsdfs[lane].is_some_and(|bsdf| {
                number < leaving.light_samples
                    && self.asks_lights(leaving.rivals, drawn.portals[lane])
                    && bsdf.lobes().iter().any(|bxdf| self.takes_light(bxdf))
            });
        }
        let Interactions { p, n, .. } = drawn.points;
        let receivers = Receivers { p: *p, n: *n, rivals, there };
        if receivers.is_empty() {
            return;
        }
        let numbers = (counts.map(|[samples, n]| samples * n), counts.map(|[_, n]| number * n));
        self.sample_lights_at(drawn, &receivers, numbers, samples);
        if counts.iter().any(|[_, candidates]| *candidates > 1) {
            self.choose_lights((drawn, bsdfs), (leaving, number), (&receivers, &counts), samples);
        }
    }

    /// Samples of lights of these numbers, of so many, for each of eight receivers, each with its part of the light.
    #[inline(always)]
    pub(super) fn sample_lights_at(
        &self,
        drawn: &Eight,
        to: &Receivers,
        (of, numbers): ([u32; LANES], [u32; LANES]),
        samples: &mut EightSamples,
    ) {
        if of == [1; LANES] {
            self.sample_through_portals(drawn, to, || drawn.fine(), &drawn.light(), samples);
            return;
        }
        let mut indices = [0; LANES];
        for (lane, path) in drawn.from.iter().enumerate() {
            indices[lane] = path.index_of(numbers[lane], of[lane]);
        }
        let light = drawn.draw_at(Dimension::LightDirection, indices);
        let fine = || drawn.draw_at(Dimension::Choice, indices)[1];
        self.sample_through_portals(drawn, to, fine, &light, samples);
        for lane in 0..LANES {
            let of = of[lane] as f32;
            samples.pdf[lane] *= of;
            for le in &mut samples.le_over_pdf {
                le[lane] /= of;
            }
        }
    }

    /// What the surface reflects towards the viewer of a light sample.
    #[inline(always)]
    pub(super) fn reflect_light(
        &self,
        from: &Reached,
        leaving: &Leaving,
        light: &LightSample,
    ) -> Option<Unoccluded> {
        let Reached { path, point, .. } = from;
        let reflected = self.reflected(from, leaving, light);
        let radiance = self.bounded(path.beta * reflected * light.le_over_pdf, path.depth + 1);
        if radiance.is_black() {
            return None;
        }
        let ray =
            light.shadow.then(|| point.spawn_shadow(light.wi, light.t_max, self.scene.settings.self_hit));
        Some(Unoccluded { radiance, ray })
    }

    /// What all lobes of the surface reflect of a light sample, by how much that counts beside their rays.
    #[inline(always)]
    pub(super) fn reflected(&self, from: &Reached, leaving: &Leaving, light: &LightSample) -> Rgb {
        let Reached { path, point, bsdf } = from;
        let mut reflected = Rgb::BLACK;
        for (lobe, bxdf) in bsdf.lobes().iter().enumerate() {
            let rays = (leaving.rate[lobe], self.guide(leaving.guide, bxdf, point.p, &point.at));
            reflected += self.lit(path, point, bxdf, rays, light);
        }
        reflected
    }

    /// Whether light samples are worth taking for this lobe.
    #[inline]
    pub(super) fn takes_light(&self, bxdf: &Bxdf) -> bool {
        match bxdf.kind() {
            LobeKind::Delta => false,
            LobeKind::Glossy => self.scene.settings.highlights,
            LobeKind::Diffuse => true,
        }
    }

    /// What a lobe reflects of a light sample, by how much that counts where `rate` rays of the lobe, drawn with its `guide`,
    /// might find the same light.
    #[inline(always)]
    fn lit(
        &self,
        path: &Path,
        point: &SurfaceInteraction,
        bxdf: &Bxdf,
        (rate, guide): (f32, Option<Guide<Cow<Cell>>>),
        light: &LightSample,
    ) -> Rgb {
        let settings = &self.scene.settings;
        let beyond_reach = light.pdf == f32::INFINITY;
        match bxdf.kind() {
            LobeKind::Delta => Rgb::BLACK,
            LobeKind::Glossy if !settings.highlights => Rgb::BLACK,
            // The environment is seen another way; samples of it are those without end that a ray can find.
            LobeKind::Glossy if self.approximates(bxdf) && light.t_max == f32::INFINITY && !beyond_reach => {
                Rgb::BLACK
            }
            // What a glossy lobe shows lies one reflection further on, which the path may not take.
            LobeKind::Glossy if rate == 0.0 && self.is_last(path) => Rgb::BLACK,
            _ => {
                let (f_cos, pdf) = guided::evaluate(bxdf, &point.at, guide, light.wi);
                f_cos
                    * match settings.direct_light {
                        _ if beyond_reach => 1.0,
                        DirectLight::Light => 1.0,
                        DirectLight::Lobe => 0.0,
                        DirectLight::Mis => power_heuristic(light.pdf, pdf * rate),
                    }
            }
        }
    }

    /// Radiance that was reflected so often, no more of it than the settings allow.
    #[inline]
    pub(super) fn bounded(&self, radiance: Rgb, reflections: u32) -> Rgb {
        match self.scene.settings.clamp_indirect {
            Some(most) if reflections > 1 => bounded_by(most, radiance),
            _ => radiance,
        }
    }

    /// How much the emission counts that a path's ray has found on a surface.
    pub(super) fn emitter_weight(&self, path: &Path, ray: &Ray, hit: &EmitterHit) -> f32 {
        self.found_weight(path, || {
            let receiver = path.receiver(ray.origin);
            self.beside_portal(path.portal, path.rivals) * self.scene.lights.pdf(&receiver, hit)
        })
    }

    /// What a path's ray has found of the environment, by how much it counts.
    #[inline(always)]
    pub(super) fn environment_seen(&self, path: &Path, ray: &Ray) -> Rgb {
        let lights = &self.scene.lights;
        match &lights.environment {
            None => Rgb::BLACK,
            Some(environment) if path.rate == f32::INFINITY => environment.le(ray.dir),
            Some(_) => {
                let (le, pdf) = lights.environment_and_pdf(&path.receiver(ray.origin), ray.dir);
                le * self.found_weight(path, || self.through_portal(path, ray, pdf))
            }
        }
    }

    /// How much light counts that a path's ray has found, where lights are sampled there with the density `pdf_of_light`.
    #[inline(always)]
    pub(super) fn found_weight(&self, path: &Path, pdf_of_light: impl FnOnce() -> f32) -> f32 {
        if path.rate == f32::INFINITY {
            return 1.0;
        }
        match self.scene.settings.direct_light {
            DirectLight::Lobe => 1.0,
            DirectLight::Mis => power_heuristic(path.rate, pdf_of_light()),
            DirectLight::Light if pdf_of_light() == 0.0 => 1.0,
            DirectLight::Light => 0.0,
        }
    }
}

/// The emitter that a ray has found.
pub(super) fn emitter_hit(light: u32, ray: &Ray, t: f32, point: &SurfaceInteraction) -> EmitterHit {
    EmitterHit { light, prim_id: point.prim_id, wi: ray.dir, t, ng: point.at.ng }
}
