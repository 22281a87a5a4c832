//! Lobes that rays leave with a guide: a diffuse lobe's rays are in part sent where caustics come from.

use super::bounce::Leaving;
use super::wave::Integrator;
use crate::bxdf::{Bsdf, Bxdf, DiffuseDirection, Incidence, LobeKind, LobeSample};
use crate::core::Rgb;
use crate::guiding::Cell;
use glam::Vec3;

impl<'a> Integrator<'a> {
    /// The `guide` of a surface, if rays leave it that need one.
    #[inline(always)]
    pub(super) fn needed(guide: Option<u32>, bsdf: &Bsdf, leaving: &Leaving) -> Option<u32> {
        let guide = guide?;
        let mut lobes = bsdf.lobes().iter().enumerate();
        let goes_on = lobes.any(|(lobe, bxdf)| {
            bxdf.kind() == LobeKind::Diffuse && leaving.rate[lobe] > 0.0 && !leaving.emission_only[lobe]
        });
        goes_on.then_some(guide)
    }

    /// The guide of this number for the rays of a lobe: only diffuse ones need any.
    #[inline]
    pub(super) fn guide(&self, number: Option<u32>, bxdf: &Bxdf) -> Option<&'a Cell> {
        let number = number.filter(|_| bxdf.kind() == LobeKind::Diffuse)?;
        self.caustics.map(|caustics| caustics.cell(number))
    }
}

/// The part of a number in `[low, low + width)` that it is in, in `[0, 1)`.
#[inline(always)]
fn within(u: f32, low: f32, width: f32) -> f32 {
    ((u - low) / width).min(1.0 - 0.5 * f32::EPSILON)
}

/// What is left of a number for the lobe itself, where the number does not ask the guide.
#[inline(always)]
pub(super) fn unguided(guide: &Cell, u: f32) -> f32 {
    within(u, guide.share, 1.0 - guide.share)
}

/// Draws a direction from the mixture of a lobe and its guide; `drawn` is what the numbers `u` draw from the lobe, should
/// it be a diffuse one, where that is at hand.
#[inline(always)]
pub(super) fn sample(
    bxdf: &Bxdf,
    at: &Incidence,
    guide: Option<&Cell>,
    u: [f32; 2],
    drawn: Option<DiffuseDirection>,
) -> Option<LobeSample> {
    let of_lobe = |u: [f32; 2]| match (bxdf, drawn) {
        (Bxdf::Diffuse(lobe), Some(drawn)) => lobe.sample_along(&drawn),
        _ => bxdf.sample(at, u),
    };
    let Some(guide) = guide else { return of_lobe(u) };
    let wi = if u[0] < guide.share {
        guide.directions.sample([within(u[0], 0.0, guide.share), u[1]])
    } else {
        of_lobe([unguided(guide, u[0]), u[1]])?.wi
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
