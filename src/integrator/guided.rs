//! Lobes that rays leave with a guide: a diffuse lobe's rays are in part sent where caustics come from.

use super::bounce::Leaving;
use super::wave::Integrator;
use crate::bxdf::{Bsdf, Bxdf, Incidence, LobeKind, LobeSample};
use crate::core::Rgb;
use crate::guiding::Cell;
use crate::scene::SurfaceInteraction;
use glam::Vec3;

impl<'a> Integrator<'a> {
    /// The number of the guide for the rays that leave a surface, where it has one.
    #[inline]
    pub(super) fn find_guide(
        &self,
        point: &SurfaceInteraction,
        bsdf: &Bsdf,
        leaving: &Leaving,
    ) -> Option<u32> {
        let caustics = self.caustics?;
        let mut lobes = bsdf.lobes().iter().enumerate();
        let goes_on = lobes.any(|(lobe, bxdf)| {
            bxdf.kind() == LobeKind::Diffuse && leaving.rate[lobe] > 0.0 && !leaving.emission_only[lobe]
        });
        if goes_on { caustics.find(point.p, point.at.n) } else { None }
    }

    /// The guide of this number for the rays of a lobe: only diffuse ones need any.
    #[inline]
    pub(super) fn guide(&self, number: Option<u32>, bxdf: &Bxdf) -> Option<&'a Cell> {
        let number = number.filter(|_| bxdf.kind() == LobeKind::Diffuse)?;
        self.caustics.map(|caustics| caustics.cell(number))
    }
}

/// Draws a direction from the mixture of a lobe and its guide.
#[inline(always)]
pub(super) fn sample(bxdf: &Bxdf, at: &Incidence, guide: Option<&Cell>, u: [f32; 2]) -> Option<LobeSample> {
    let Some(guide) = guide else { return bxdf.sample(at, u) };
    let within = |u: f32, low: f32, width: f32| ((u - low) / width).min(1.0 - 0.5 * f32::EPSILON);
    let wi = if u[0] < guide.share {
        guide.directions.sample([within(u[0], 0.0, guide.share), u[1]])
    } else {
        bxdf.sample(at, [within(u[0], guide.share, 1.0 - guide.share), u[1]])?.wi
    };
    let (f_cos, pdf) = evaluate(bxdf, at, Some(guide), wi);
    (!f_cos.is_black()).then(|| LobeSample { wi, weight: f_cos / pdf, pdf })
}

/// A lobe's value times the cosine, and the density with which [`sample`] goes along `wi`, in 1/sr.
#[inline(always)]
pub(super) fn evaluate(bxdf: &Bxdf, at: &Incidence, guide: Option<&Cell>, wi: Vec3) -> (Rgb, f32) {
    let (f_cos, pdf) = bxdf.evaluate(at, wi);
    let pdf = guide.map_or(pdf, |guide| guide.share * guide.directions.pdf(wi) + (1.0 - guide.share) * pdf);
    (f_cos, pdf)
}
