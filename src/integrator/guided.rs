//! Lobes that rays leave with a guide: a diffuse lobe's rays are in part sent where caustics come from.

use super::bounce::Leaving;
use super::wave::Integrator;
use crate::bxdf::{Bsdf, Bxdf, Drawn, Incidence, LobeKind, LobeSample};
use crate::core::Rgb;
use crate::guiding::Cell;
use glam::Vec3;

/// Where a diffuse surface looks for caustics.
#[derive(Clone, Copy)]
pub(super) struct Guide<'a> {
    pub cell: &'a Cell,
    /// The point that looks.
    pub p: Vec3,
}

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

    /// The guide of this number for the rays of a lobe that leave `p`: only diffuse ones need any.
    #[inline]
    pub(super) fn guide(&self, number: Option<u32>, bxdf: &Bxdf, p: Vec3) -> Option<Guide<'a>> {
        let number = number.filter(|_| bxdf.kind() == LobeKind::Diffuse)?;
        self.caustics.map(|caustics| Guide { cell: caustics.cell(number), p })
    }
}

/// The part of a number in `[low, low + width)` that it is in, in `[0, 1)`.
#[inline(always)]
pub(super) fn within(u: f32, low: f32, width: f32) -> f32 {
    ((u - low) / width).min(1.0 - 0.5 * f32::EPSILON)
}

/// What is left of a number for the lobe itself, where the number does not ask the guide, which has a `share` of them.
#[inline(always)]
pub(super) fn unguided(share: f32, u: f32) -> f32 {
    within(u, share, 1.0 - share)
}

/// A direction drawn from the mixture of a lobe and its guide.
pub(super) struct GuidedSample {
    pub sample: LobeSample,
    /// By how much the guide has made the direction likelier than the lobe alone would, and what comes from there lighter.
    pub favour: f32,
}

/// Draws a direction from the mixture of a lobe and its guide; `drawn` is what the numbers `u` draw from the lobe, where
/// that is at hand.
#[inline(always)]
pub(super) fn sample(
    bxdf: &Bxdf,
    at: &Incidence,
    guide: Option<Guide>,
    u: [f32; 2],
    drawn: Option<Drawn>,
) -> Option<GuidedSample> {
    let of_lobe = |u: [f32; 2]| match drawn {
        Some(drawn) => bxdf.sample_along(&drawn),
        None => bxdf.sample(at, u),
    };
    let Some(Guide { cell, p }) = guide else {
        return of_lobe(u).map(|sample| GuidedSample { sample, favour: 1.0 });
    };
    let wi = if u[0] < cell.share {
        cell.mixture.sample(p, [within(u[0], 0.0, cell.share), u[1]])
    } else {
        of_lobe([unguided(cell.share, u[0]), u[1]])?.wi
    };
    let (f_cos, alone) = bxdf.evaluate(at, wi);
    let pdf = mixed(alone, cell, p, wi);
    (!f_cos.is_black())
        .then(|| GuidedSample { sample: LobeSample { wi, weight: f_cos / pdf, pdf }, favour: pdf / alone })
}

/// A lobe's value times the cosine, and the density with which [`sample`] goes along `wi`, in 1/sr.
#[inline(always)]
pub(super) fn evaluate(bxdf: &Bxdf, at: &Incidence, guide: Option<Guide>, wi: Vec3) -> (Rgb, f32) {
    let (f_cos, pdf) = bxdf.evaluate(at, wi);
    match guide {
        Some(Guide { cell, p }) => (f_cos, mixed(pdf, cell, p, wi)),
        None => (f_cos, pdf),
    }
}

/// The density of the mixture along `wi`, where the lobe alone has the density `alone`.
#[inline(always)]
fn mixed(alone: f32, cell: &Cell, p: Vec3, wi: Vec3) -> f32 {
    mix(cell.share, cell.mixture.pdf(p, wi), alone)
}

/// A density of which `guided` has a share, and the density `alone` the rest.
#[inline(always)]
pub(super) fn mix(share: f32, guided: f32, alone: f32) -> f32 {
    share * guided + (1.0 - share) * alone
}
