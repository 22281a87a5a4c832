//! The mixture of lobes that tells photons best, by expectation maximisation.
//!
//! Sources: Vorba et al. 2014, *On-line Learning of Parametric Mixture Models for Light Transport Simulation*; for axes
//! that move with the point that looks, Ruppert et al. 2020, *Robust Fitting of Parallax-Aware Mixtures for Path
//! Guiding*, who take the distances of reflectors. Here the distance of a lobe's source is fitted as its axis is, since
//! what a mirror throws seems to come from the image behind it.

use super::map::Photon;
use super::mixture::{Lobe, Mixture, sum};
use crate::core::lanes::LANES;
use crate::core::{Wide, widely};
use glam::Vec3;

/// Photons for each lobe.
const PHOTONS_PER_LOBE: usize = 8;

/// Rounds, after which little changes.
const ROUNDS: usize = 10;

/// A lobe with fewer is given up.
const LEAST_PHOTONS: f32 = 0.5;

/// How far an axis may turn from the origin to the farthest point, about: the tangent.
const MOST_TURN: f32 = 0.5;

/// Photons that a lobe is thought to have beside its own, of which some are few: they are spread as those of all lobes
/// are, and tell of no near source.
const PRIOR: f32 = 2.0;

/// The mixture for points within `radius` of `origin`; `None` if the photons have no power, or one without end.
pub fn fit(photons: &[Photon], origin: Vec3, radius: f32) -> Option<Mixture> {
    let total: f32 = photons.iter().map(|photon| photon.power).sum();
    if !(total > 0.0 && total.is_finite()) {
        return None;
    }
    let mut lobes = begin(photons);
    for _ in 0..ROUNDS {
        let found = widely(Gather { photons, origin, scale: photons.len() as f32 / total, lobes: &lobes });
        let all = found.iter().fold(Found::default(), |all, found| all.with(found));
        for (lobe, found) in lobes.iter_mut().zip(&found) {
            found.update(lobe, &all, radius);
        }
    }
    Some(Mixture::new(origin, &lobes))
}

/// Lobes at photons that are far from each other, the strongest first.
fn begin(photons: &[Photon]) -> Vec<Lobe> {
    let count = (photons.len() / PHOTONS_PER_LOBE).clamp(1, LANES);
    let mut nearest = vec![4.0f32; photons.len()];
    let mut axes = vec![];
    while axes.len() < count {
        let missing = |i: usize| photons[i].power * nearest[i];
        let farthest = (0..photons.len()).max_by(|&a, &b| missing(a).total_cmp(&missing(b)));
        let Some(farthest) = farthest.filter(|&i| missing(i) > 0.0) else { break };
        let axis = photons[farthest].wi;
        for (nearest, photon) in nearest.iter_mut().zip(photons) {
            *nearest = nearest.min(photon.wi.distance_squared(axis));
        }
        axes.push(axis);
    }
    let width = (nearest.iter().sum::<f32>() / nearest.len() as f32).max(Lobe::LEAST_WIDTH);
    axes.into_iter().map(|axis| Lobe { weight: 1.0, axis, nearness: 0.0, width }).collect()
}

/// What a lobe has of photons: sums, each photon by the part of it that is the lobe's.
#[derive(Clone, Copy, Default)]
struct Found {
    photons: f32,
    /// Of `1 / (a + c)`, on which the likelihood of the width `a` depends.
    closeness: f32,
    /// Of directions.
    wi: Vec3,
    /// Of the ways from the origin, across the lobe's axis as all that follows.
    way: Vec3,
    squared_way: f32,
    /// Of the products of direction and way.
    product: f32,
}

impl Found {
    fn with(self, other: &Self) -> Self {
        Self {
            photons: self.photons + other.photons,
            closeness: self.closeness + other.closeness,
            wi: self.wi + other.wi,
            way: self.way + other.way,
            squared_way: self.squared_way + other.squared_way,
            product: self.product + other.product,
        }
    }

    /// The lobe that is likeliest, given what was found by that of the round before.
    fn update(&self, lobe: &mut Lobe, all: &Self, radius: f32) {
        let photons = self.photons + PRIOR;
        lobe.weight = self.photons;
        if self.photons < LEAST_PHOTONS {
            // It is over: none of its photons would tell where to.
            lobe.weight = 0.0;
            return;
        }
        // Directions turn against the way, by one over the distance of the source: the slope of a line through them.
        let means = self.wi.dot(self.way) / self.photons;
        let spread = self.squared_way - self.way.length_squared() / self.photons;
        let slope = (self.product - means) / (spread + PRIOR * all.squared_way / all.photons);
        lobe.nearness = (-slope).clamp(-MOST_TURN / radius, MOST_TURN / radius);
        lobe.axis = (self.wi + lobe.nearness * self.way).normalize();
        // Where the derivative of `2 ln a - 3 ln (a + c)` is zero in the mean.
        let closeness = self.closeness + PRIOR * all.closeness / all.photons;
        lobe.width = (2.0 / 3.0 * photons / closeness).max(Lobe::LEAST_WIDTH);
    }
}

/// Finds what each lobe has of the photons, to be compiled for wide instructions.
struct Gather<'a> {
    photons: &'a [Photon],
    origin: Vec3,
    /// Photons by their power.
    scale: f32,
    lobes: &'a [Lobe],
}

impl Wide for Gather<'_> {
    type Output = [Found; LANES];

    #[inline(always)]
    fn run(self) -> Self::Output {
        let mixture = Mixture::new(self.origin, self.lobes);
        let mut found = [Found::default(); LANES];
        for photon in self.photons {
            let spans = mixture.spans(photon.p, photon.wi);
            let densities = mixture.densities(&spans);
            let scale = self.scale * photon.power / sum(densities);
            let way = photon.p - self.origin;
            for (k, lobe) in self.lobes.iter().enumerate() {
                let part = scale * densities[k];
                let across = way - lobe.axis * way.dot(lobe.axis);
                let found = &mut found[k];
                found.photons += part;
                found.closeness += part / spans[k];
                found.wi += part * photon.wi;
                found.way += part * across;
                found.squared_way += part * across.length_squared();
                found.product += part * photon.wi.dot(across);
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A part of the light that comes to a square of edge 1 about the origin: a grid of photons.
    fn photons(power: f32, wi: impl Fn(Vec3, u32) -> Vec3) -> Vec<Photon> {
        let photon = |i: u32| {
            let p = Vec3::new(i as f32 % 8.0 / 7.0 - 0.5, 0.0, (i / 8) as f32 / 7.0 - 0.5);
            Photon { p, n: Vec3::Y, wi: wi(p, i).normalize(), power, other: None, pdf: 0.0 }
        };
        (0..64).map(photon).collect()
    }

    #[test]
    fn a_near_source_is_found_where_it_is() {
        for source in [Vec3::new(0.5, 3.0, 1.0), Vec3::new(0.0, -4.0, 0.0), Vec3::new(-2.0, 2.0, 0.0)] {
            // A lens may gather light below the surface: it comes from the other side.
            let side = source.y.signum();
            let mixture =
                fit(&photons(1.0, |p, _| side * (source - p)), Vec3::ZERO, 0.75).expect("there is light");
            for p in [Vec3::ZERO, Vec3::new(0.4, 0.0, -0.3)] {
                // Lobes that do not turn have less than 30.
                let density = mixture.pdf(p, side * (source - p).normalize());
                assert!(density > 300.0, "{source} {p}: {density}");
            }
        }
    }

    #[test]
    fn two_sources_get_their_shares() {
        let [a, b] = [Vec3::new(0.6, 0.8, 0.0), Vec3::new(-0.6, 0.8, 0.0)];
        let blurred =
            |axis: Vec3| move |_: Vec3, i: u32| axis + 0.05 * Vec3::new(0.0, 0.0, (i % 5) as f32 - 2.0);
        let light = [photons(3.0, blurred(a)), photons(1.0, blurred(b))].concat();
        let mixture = fit(&light, Vec3::ZERO, 0.75).expect("there is light");
        let near = |axis: Vec3| {
            let draws = (0..1000).map(|i| mixture.sample(Vec3::ZERO, [(i as f32 + 0.5) / 1000.0, 0.5]));
            draws.filter(|wi| wi.distance(axis) < 0.3).count() as f32 / 1000.0
        };
        assert!((near(a) - 0.75).abs() < 0.05 && (near(b) - 0.25).abs() < 0.05, "{} {}", near(a), near(b));
    }

    #[test]
    fn no_light_is_no_mixture() {
        for power in [0.0, f32::NAN, f32::INFINITY] {
            assert!(fit(&photons(power, |_, _| Vec3::Y), Vec3::ZERO, 1.0).is_none(), "{power}");
        }
        assert!(fit(&[], Vec3::ZERO, 1.0).is_none());
    }
}
