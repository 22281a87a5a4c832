//! Lobes that rays leave with guides: the rays of wide ones are in part sent where caustics and other reflected light come from.

use super::bounce::Leaving;
use super::wave::Integrator;
use crate::bxdf::{Bsdf, Bxdf, Drawn, Incidence, LobeSample, Width};
use crate::core::Rgb;
use crate::guiding::{Cell, CellNumbers, Guides, Lobe, unguided};
use glam::Vec3;
use std::borrow::{Borrow, Cow};

/// The guides of the rays of a lobe.
#[derive(Clone, Copy)]
pub(super) struct Guide<C> {
    /// The first has its share of all rays, the second of those that are left.
    pub cells: [Option<C>; 2],
    /// The point that looks.
    pub p: Vec3,
}

impl<C: Borrow<Cell>> Guide<C> {
    /// The share of rays that the lobe alone draws.
    #[inline(always)]
    pub fn own(&self) -> f32 {
        self.cells.iter().flatten().map(Borrow::borrow).map(|cell: &Cell| 1.0 - cell.share).product()
    }

    /// What is left of a number for the lobe, where that does not ask a guide.
    #[inline(always)]
    pub fn unguided(&self, u: f32) -> f32 {
        self.cells.iter().flatten().map(Borrow::borrow).fold(u, |u, cell: &Cell| unguided(cell.share, u))
    }

    /// The direction that the numbers `u` draw from a guide, if they ask one.
    #[inline(always)]
    pub fn draw(&self, [mut x, y]: [f32; 2]) -> Option<Vec3> {
        for cell in self.cells.iter().flatten().map(Borrow::<Cell>::borrow) {
            let drawn = cell.draw(self.p, [x, y]);
            if drawn.is_some() {
                return drawn;
            }
            x = unguided(cell.share, x);
        }
        None
    }

    /// The densities along two unit vectors of rays that follow guides, times the share of those: in 1/sr.
    #[inline(always)]
    pub fn densities(&self, wi: [Vec3; 2]) -> [f32; 2] {
        let (mut left, mut densities) = (1.0, [0.0; 2]);
        for cell in self.cells.iter().flatten().map(Borrow::<Cell>::borrow) {
            let pdfs = cell.mixture.pdfs(self.p, wi);
            for (density, pdf) in densities.iter_mut().zip(pdfs) {
                *density += left * cell.share * pdf;
            }
            left *= 1.0 - cell.share;
        }
        densities
    }
}

impl<'a> Guide<Cow<'a, Cell>> {
    /// The guide of the rays of a lobe of this width that leave a point with a normal towards `wo`: where a glossy one leads, within
    /// its lobe, to caustics alone.
    #[inline(always)]
    pub fn of(
        guides: &'a Guides,
        numbers: CellNumbers,
        width: Width,
        (p, n, wo): (Vec3, Vec3, Vec3),
    ) -> Self {
        if width == Width::EVERYWHERE {
            return Self { cells: guides.cells(numbers).map(|cell| cell.map(Cow::Borrowed)), p };
        }
        let lobe = Lobe { weight: 1.0, axis: 2.0 * n.dot(wo) * n - wo, nearness: 0.0, width: width.0 };
        let [caustics, _] = guides.cells(numbers);
        Self { cells: [caustics.map(|cell| Cow::Owned(cell.within(p, n, &lobe))), None], p }
    }
}

impl<'a> Integrator<'a> {
    /// The numbers of a surface's guides, if rays leave it that need any.
    #[inline(always)]
    pub(super) fn needed(guide: CellNumbers, bsdf: &Bsdf, leaving: &Leaving) -> CellNumbers {
        if guide == CellNumbers::NONE {
            return guide;
        }
        let mut lobes = bsdf.lobes().iter().enumerate();
        let goes_on = lobes.any(|(lobe, bxdf)| {
            bxdf.width().is_wide() && leaving.rate[lobe] > 0.0 && !leaving.emission_only[lobe]
        });
        if goes_on { guide } else { CellNumbers::NONE }
    }

    /// The guides of these numbers for the rays of a lobe that leave `p`, where `at` is: only wide ones need any.
    #[inline]
    pub(super) fn guide(
        &self,
        numbers: CellNumbers,
        bxdf: &Bxdf,
        p: Vec3,
        at: &Incidence,
    ) -> Option<Guide<Cow<'a, Cell>>> {
        if numbers == CellNumbers::NONE || !bxdf.width().is_wide() {
            return None;
        }
        let guides = self.guides?;
        Some(Guide::of(guides, numbers, bxdf.width(), (p, at.n, at.wo)))
    }
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
    guide: Option<Guide<Cow<Cell>>>,
    u: [f32; 2],
    drawn: Option<Drawn>,
) -> Option<GuidedSample> {
    let of_lobe = |u: [f32; 2]| match drawn {
        Some(drawn) => bxdf.sample_along(&drawn),
        None => bxdf.sample(at, u),
    };
    let Some(guide) = guide else {
        return of_lobe(u).map(|sample| GuidedSample { sample, favour: 1.0 });
    };
    let wi = match guide.draw(u) {
        Some(wi) => wi,
        None => of_lobe([guide.unguided(u[0]), u[1]])?.wi,
    };
    let (f_cos, alone) = bxdf.evaluate(at, wi);
    let pdf = mix(guide.densities([wi; 2])[0], guide.own(), alone);
    (!f_cos.is_black())
        .then(|| GuidedSample { sample: LobeSample { wi, weight: f_cos / pdf, pdf }, favour: pdf / alone })
}

/// A lobe's value times the cosine, and the density with which [`sample`] goes along `wi`, in 1/sr.
#[inline(always)]
pub(super) fn evaluate(bxdf: &Bxdf, at: &Incidence, guide: Option<Guide<Cow<Cell>>>, wi: Vec3) -> (Rgb, f32) {
    let (f_cos, pdf) = bxdf.evaluate(at, wi);
    match guide {
        Some(guide) => (f_cos, mix(guide.densities([wi; 2])[0], guide.own(), pdf)),
        None => (f_cos, pdf),
    }
}

/// The density where rays that follow guides have the density `guided`, and those that do not, a share `own` of all, the density
/// `alone`.
#[inline(always)]
pub(super) fn mix(guided: f32, own: f32, alone: f32) -> f32 {
    guided + own * alone
}
