//! Light that comes straight from a light: by a shadow ray towards a sampled point, or by a lobe's ray that finds
//! an emitter, each weighted where it is the better (Veach and Guibas 1995).

use super::bounce::{Leaving, Numbers, Reached, ln_rate};
use super::guided;
use super::path::Path;
use super::wave::Integrator;
use crate::bxdf::{Bxdf, LobeKind};
use crate::core::{Ray, Rgb};
use crate::guiding::Cell;
use crate::scene::{DirectLight, EmitterHit, LightSample, Receiver, SurfaceInteraction};

/// Light that arrives if nothing is in the way of a ray.
pub(super) struct Unoccluded {
    /// Radiance times the path's weight.
    pub radiance: Rgb,
    /// The way that must be free; `None` for a light that casts no shadow.
    pub ray: Option<Ray>,
}

/// The power heuristic for a technique of density `exp(ln_mine)` against one of `exp(ln_other)`.
///
/// In logarithms, since the density of a sharp lobe squared overflows.
#[inline]
fn power_heuristic(ln_mine: f32, ln_other: f32) -> f32 {
    if ln_other == f32::NEG_INFINITY || ln_mine == f32::INFINITY {
        return 1.0;
    }
    1.0 / (1.0 + (2.0 * (ln_other - ln_mine)).exp())
}

impl Integrator<'_> {
    /// One light's share of the radiance that leaves `point` towards the viewer.
    #[inline(always)]
    pub(super) fn sample_light(
        &self,
        from: &Reached,
        leaving: &Leaving,
        numbers: &Numbers,
    ) -> Option<Unoccluded> {
        let Reached { path, point, bsdf } = from;
        if !bsdf.lobes().any(|bxdf| self.takes_light(bxdf)) {
            return None;
        }
        let receiver = Receiver { p: point.p, n: point.at.n, lobes_look: leaving.lobes_look };
        let light = self.scene.lights.sample(&receiver, numbers.choice[1], numbers.light)?;
        let mut reflected = Rgb::BLACK;
        for (lobe, bxdf) in bsdf.lobes().enumerate() {
            let rays = (leaving.rate[lobe], self.guide(leaving.guide, bxdf));
            reflected += self.lit(path, point, bxdf, rays, &light);
        }
        let radiance = self.bounded(path.beta * reflected * light.le_over_pdf, path.depth + 1);
        if radiance.is_black() {
            return None;
        }
        let ray =
            light.shadow.then(|| point.spawn_shadow(light.wi, light.t_max, self.scene.settings.self_hit));
        Some(Unoccluded { radiance, ray })
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
        (rate, guide): (f32, Option<&Cell>),
        light: &LightSample,
    ) -> Rgb {
        let settings = &self.scene.settings;
        let beyond_reach = light.ln_pdf == f32::INFINITY;
        match bxdf.kind() {
            LobeKind::Delta => Rgb::BLACK,
            LobeKind::Glossy if !settings.highlights => Rgb::BLACK,
            // The environment is seen another way; samples of it are those without end that a ray can find.
            LobeKind::Glossy if self.approximates(bxdf) && light.t_max == f32::INFINITY && !beyond_reach => {
                Rgb::BLACK
            }
            // What a glossy lobe shows lies one reflection further on, which the path may not take.
            LobeKind::Glossy if rate == 0.0 && self.is_last(path) => Rgb::BLACK,
            _ if beyond_reach => bxdf.f_cos(&point.at, light.wi),
            _ => match settings.direct_light {
                DirectLight::Light => bxdf.f_cos(&point.at, light.wi),
                DirectLight::Lobe => Rgb::BLACK,
                DirectLight::Mis if rate == 0.0 => bxdf.f_cos(&point.at, light.wi),
                DirectLight::Mis => {
                    let (f_cos, ln_pdf) = guided::evaluate(bxdf, &point.at, guide, light.wi);
                    f_cos * power_heuristic(light.ln_pdf, ln_pdf + ln_rate(rate))
                }
            },
        }
    }

    /// Radiance that was reflected so often, no more of it than the settings allow.
    #[inline]
    pub(super) fn bounded(&self, radiance: Rgb, reflections: u32) -> Rgb {
        match self.scene.settings.clamp_indirect {
            Some(most) if reflections > 1 => {
                let channel = radiance.max_channel();
                // What is not finite is the film's to count.
                if channel > most && channel.is_finite() { radiance * (most / channel) } else { radiance }
            }
            _ => radiance,
        }
    }

    /// How much the emission counts that a path's ray has found on a surface.
    pub(super) fn emitter_weight(&self, path: &Path, ray: &Ray, hit: &EmitterHit) -> f32 {
        self.found_weight(path, || {
            let receiver = path.receiver(ray.origin);
            self.scene.lights.ln_pdf(&receiver, hit)
        })
    }

    /// How much the environment counts that a path's ray has found.
    pub(super) fn environment_weight(&self, path: &Path, ray: &Ray) -> f32 {
        self.found_weight(path, || {
            let receiver = path.receiver(ray.origin);
            self.scene.lights.ln_pdf_environment(&receiver, ray.dir)
        })
    }

    fn found_weight(&self, path: &Path, ln_pdf_of_light: impl FnOnce() -> f32) -> f32 {
        if path.ln_rate == f32::INFINITY {
            return 1.0;
        }
        match self.scene.settings.direct_light {
            DirectLight::Lobe => 1.0,
            DirectLight::Mis => power_heuristic(path.ln_rate, ln_pdf_of_light()),
            DirectLight::Light if ln_pdf_of_light() == f32::NEG_INFINITY => 1.0,
            DirectLight::Light => 0.0,
        }
    }
}

/// The emitter that a ray has found.
pub(super) fn emitter_hit(light: u32, ray: &Ray, t: f32, point: &SurfaceInteraction) -> EmitterHit {
    EmitterHit { light, prim_id: point.prim_id, wi: ray.dir, t, ng: point.at.ng }
}
