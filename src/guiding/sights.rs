//! What diffuse surfaces see of the light that other surfaces reflect, as camera paths find it.
//!
//! A cell of surfaces needs thousands of sights: of fewer, most of which are dark and some very bright, a mixture tells
//! noise. So cells are large, and lobes that turn with the point that looks must do the rest.

use super::fit::fit;
use super::map::{Cell, GREATEST_SHARE, GuideMap, Making, Photon, odds, unguided};
use super::photons::{Shooter, choose, hits, in_parallel, light, occluded};
use super::reflectors::focuses;
use crate::bxdf::{Bxdf, Diffuse, LobeSample};
use crate::core::lanes::LANES;
use crate::core::{Hit, Ray, Sampler, SamplerKind, Wide, widely};
use crate::geometry::Aabb;
use crate::scene::{Interactions, Rivals, SurfaceInteraction};
use std::ops::Range;

/// Pixels for each camera path.
const PIXELS_PER_PATH: u32 = 4;

/// Camera paths at most, and at least.
const PATHS: std::ops::RangeInclusive<u32> = 1 << 12..=1 << 16;

/// One of so many paths goes first, to tell whether the others are worth it.
const FIRST: u32 = 8;

/// Surfaces that a path comes to, at most.
const MOST_SURFACES: u32 = 8;

/// Cells: as many sights as it takes to tell directions from noise.
const INDIRECT: Making = Making { most: 2048, counts_dark: true, cell: Cell::to_indirect };

/// Those of the paths that go first.
const ROUGH: Making = Making { cell: Cell::to_indirect_roughly, ..INDIRECT };

/// Sights that tell something, at least.
const LEAST_SIGHTS: usize = 256;

/// What may be left of the second moment of what rays bring, for a guide to be worth asking.
const WORTH_IT: f32 = 0.85;

/// The same for a rough guide, from which the others may learn.
const WORTH_A_TRY: f32 = 0.97;

/// Shares that are tried.
const SHARES: u32 = 8;

/// Pairs of random numbers: the pixel's, and of each surface these.
mod dimension {
    pub const PIXEL: u32 = 0;
    pub const LIGHT: u32 = 1;
    pub const CHOICE: u32 = 2;
    pub const LOBE: u32 = 3;
    pub const PER_SURFACE: u32 = 3;
}

/// A camera path on its way.
#[derive(Clone, Copy)]
struct Walker {
    /// Its number, which its random numbers go by.
    path: u32,
    /// How much of what its ray meets the camera sees.
    weight: f32,
    ray: Ray,
}

/// A ray that has left a diffuse surface.
struct Sight {
    path: u32,
    /// Its power is that of one unit of what the path will bring.
    photon: Photon,
    /// What the path had brought before.
    before: f32,
}

/// Light that a path has come to, if nothing is in its way.
struct Lit {
    path: u32,
    radiance: f32,
    way: Ray,
}

/// What some surfaces do to the paths that have come to them.
#[derive(Default)]
struct Step {
    lit: Vec<Lit>,
    sights: Vec<Sight>,
    onward: Vec<Walker>,
}

impl Shooter<'_> {
    /// Guides to the light that surfaces reflect, besides caustics; empty where it comes from everywhere.
    pub(super) fn to_indirect(&self) -> GuideMap {
        let [width, height] = self.scene.camera.resolution;
        let count = (width.saturating_mul(height) / PIXELS_PER_PATH).clamp(*PATHS.start(), *PATHS.end());
        let unguided = GuideMap::default();
        let first = in_parallel(0..count / FIRST, |paths| self.see(paths, &unguided));
        let rough = GuideMap::new(first.clone(), ROUGH);
        if rough.is_empty() {
            return rough;
        }
        let rest = in_parallel(count / FIRST..count, |paths| self.see(paths, &rough));
        GuideMap::new([first, rest].concat(), INDIRECT)
    }

    /// What the diffuse surfaces see that these camera paths come to, each along the path's next ray, which may follow a guide.
    fn see(&self, paths: Range<u32>, guides: &GuideMap) -> Vec<Photon> {
        let most = self.scene.settings.most_reflections().saturating_add(1).min(MOST_SURFACES);
        let mut brought = vec![0.0; paths.len()];
        let place = |path: u32| (path - paths.start) as usize;
        let mut walkers: Vec<Walker> = paths.clone().map(|path| self.walker(path)).collect();
        let mut sights = vec![];
        for surface in 0..most {
            let rays: Vec<Ray> = walkers.iter().map(|walker| walker.ray).collect();
            let (mut arrived, mut step) = (vec![], Step::default());
            for (walker, hit) in walkers.iter().zip(hits(self.accel, &rays)) {
                match hit {
                    Some(hit) => arrived.push((*walker, hit)),
                    None => brought[place(walker.path)] += walker.weight * self.sky(&walker.ray),
                }
            }
            for eight in arrived.chunks(LANES) {
                self.arrive_together(eight, surface, guides, &mut step);
            }
            let ways: Vec<Ray> = step.lit.iter().map(|lit| lit.way).collect();
            for (lit, occluded) in step.lit.iter().zip(occluded(self.accel, &ways)) {
                brought[place(lit.path)] += if occluded { 0.0 } else { lit.radiance };
            }
            if surface + 1 == most {
                // Nobody goes on to where these would look.
                break;
            }
            let begun = step.sights.into_iter().map(|s| Sight { before: brought[place(s.path)], ..s });
            sights.extend(begun);
            walkers = step.onward;
        }
        let seen = |Sight { path, photon, before }: Sight| {
            let power = photon.power * (brought[place(path)] - before).max(0.0);
            Photon { power: if power.is_finite() { power } else { 0.0 }, ..photon }
        };
        sights.into_iter().map(seen).collect()
    }

    /// Where camera paths take their numbers from.
    fn numbers_of_paths(&self) -> Sampler {
        Sampler::new(SamplerKind::Sobol, self.scene.settings.seed ^ 0x73_65_65_6e, 0, 0)
    }

    /// A path at the camera.
    fn walker(&self, path: u32) -> Walker {
        let camera = &self.scene.camera;
        let [width, height] = camera.resolution.map(|n| n as f32);
        let [x, y] = self.numbers_of_paths().pair(path, dimension::PIXEL);
        Walker { path, weight: 1.0, ray: Ray::new(camera.eye, camera.direction(x * width, y * height)) }
    }

    /// What up to eight paths do where they have come to a surface.
    fn arrive_together(&self, eight: &[(Walker, Hit)], surface: u32, guides: &GuideMap, step: &mut Step) {
        let lanes = std::array::from_fn(|lane| eight.get(lane).unwrap_or(&eight[0]));
        let arrive = Arrive { shooter: self, lanes, sampler: self.numbers_of_paths(), surface, guides };
        let (points, numbers, cells) = widely(arrive);
        for (lane, (walker, _)) in eight.iter().enumerate() {
            let numbers = numbers.map(|[x, y]| [x[lane], y[lane]]);
            let guide = cells[lane].map(|cell| guides.cell(cell));
            self.arrive_on(walker, (&points.get(lane), guide), numbers, step);
        }
    }

    /// What a path does at a surface, by the numbers for a light, a lobe, and that lobe's ray.
    fn arrive_on(
        &self,
        walker: &Walker,
        (point, guide): (&SurfaceInteraction, Option<&Cell>),
        [of_light, [choice, _], of_lobe]: [[f32; 2]; 3],
        Step { lit, sights, onward }: &mut Step,
    ) {
        let (Walker { path, weight, .. }, bsdf) = (*walker, self.bsdf(point));
        // Photons tell of light that lobes focus.
        let lobes = || bsdf.lobes().iter().filter(|lobe| !focuses(lobe));
        if lobes().next().is_some()
            && let Some((way, wi, irradiance)) = light(self.scene, point, Rivals::Lobes, of_light)
        {
            let reflected: f32 = lobes().map(|lobe| lobe.evaluate(&point.at, wi).0.luminance()).sum();
            let radiance = weight * irradiance * reflected / wi.dot(point.at.n);
            if radiance > 0.0 && radiance.is_finite() {
                lit.push(Lit { path, radiance, way });
            }
        }
        let Some((lobe, probability)) = choose(&bsdf, &point.at, |_| true, choice) else { return };
        let (p, n, is_diffuse) = (point.p, point.at.n, matches!(lobe, Bxdf::Diffuse(_)));
        let Some(sample) = draw(lobe, point, guide.filter(|_| is_diffuse), of_lobe) else { return };
        let LobeSample { wi, pdf, .. } = sample;
        let weight = weight * sample.weight.luminance() / probability;
        if !(weight > 0.0 && weight.is_finite()) {
            return;
        }
        if is_diffuse {
            let power = Diffuse::density(n, point.at.ng, wi) / (pdf * weight);
            let photon = Photon { p, n, wi, power, other: None, pdf };
            sights.push(Sight { path, photon, before: 0.0 });
        }
        let ray = point.spawn(wi, f32::INFINITY, self.scene.settings.self_hit);
        onward.push(Walker { path, weight, ray });
    }
}

/// A ray of a lobe, which may follow a guide.
fn draw(lobe: &Bxdf, point: &SurfaceInteraction, guide: Option<&Cell>, u: [f32; 2]) -> Option<LobeSample> {
    let Some(guide) = guide else { return lobe.sample(&point.at, u) };
    let wi = match guide.draw(point.p, u) {
        Some(wi) => wi,
        None => lobe.sample(&point.at, [unguided(guide.share, u[0]), u[1]])?.wi,
    };
    let (f_cos, alone) = lobe.evaluate(&point.at, wi);
    let pdf = guide.share * guide.mixture.pdf(point.p, wi) + (1.0 - guide.share) * alone;
    Some(LobeSample { wi, weight: f_cos / pdf, pdf })
}

/// Eight paths come to surfaces: the points, three pairs of numbers of each, and their guides, to be compiled for wide
/// instructions.
struct Arrive<'a, 'b> {
    shooter: &'a Shooter<'b>,
    lanes: [&'a (Walker, Hit); LANES],
    sampler: Sampler,
    surface: u32,
    guides: &'a GuideMap,
}

impl Wide for Arrive<'_, '_> {
    type Output = (Interactions, [[[f32; LANES]; 2]; 3], [Option<u32>; LANES]);

    #[inline(always)]
    fn run(self) -> Self::Output {
        let Self { shooter, lanes, sampler, surface, guides } = self;
        let points = shooter.scene.interactions(lanes.map(|(walker, hit)| (&walker.ray, hit)));
        let paths = lanes.map(|(walker, _)| walker.path);
        let numbers = [dimension::LIGHT, dimension::CHOICE, dimension::LOBE].map(|number| {
            let dimension = number + dimension::PER_SURFACE * surface;
            Sampler::pairs([&sampler; LANES], paths, [dimension; LANES])
        });
        let cells = if guides.is_empty() { [None; LANES] } else { guides.find(&points.p, &points.n) };
        (points, numbers, cells)
    }
}

impl Cell {
    /// The guide to what `sights` have seen, for the points of `bounds`.
    fn to_indirect(sights: &[Photon], bounds: &Aabb) -> Option<Self> {
        Self::to_seen(sights, bounds, WORTH_IT)
    }

    /// A guide that may be worth it when more is known.
    fn to_indirect_roughly(sights: &[Photon], bounds: &Aabb) -> Option<Self> {
        Self::to_seen(sights, bounds, WORTH_A_TRY)
    }

    /// The guide to what `sights` have seen, if it leaves so much of the second moment at most.
    ///
    /// Half of the sights say of a guide made of the others what share of rays it is worth: for one made of the same
    /// sights, noise would be worth following.
    fn to_seen(sights: &[Photon], bounds: &Aabb, worth_it: f32) -> Option<Self> {
        if sights.len() < LEAST_SIGHTS {
            return None;
        }
        let (origin, radius) = (0.5 * (bounds.min + bounds.max), 0.5 * bounds.size().length());
        let of_lit = |first: usize, step: usize| {
            let every = sights.iter().skip(first).step_by(step);
            every.filter(|sight| sight.power > 0.0).copied().collect::<Vec<_>>()
        };
        let of_half = fit(&of_lit(0, 2), origin, radius)?;
        let others = of_lit(1, 2);
        let told: Vec<[f32; 3]> = others
            .iter()
            .map(|&Photon { p, n, wi, power, pdf, .. }| {
                // The normal stands for the geometric one.
                let alone = Diffuse::density(n, n, wi);
                [power * power * pdf, alone, of_half.pdf(p, wi)]
            })
            .collect();
        // Of what rays bring of which a share follows the guide.
        let second_moment = |share: f32| -> f32 {
            told.iter().map(|[square, alone, pdf]| square / (share * pdf + (1.0 - share) * alone)).sum()
        };
        let shares = (1..=SHARES).map(|k| k as f32 / SHARES as f32 * GREATEST_SHARE);
        let (share, left) =
            shares.map(|share| (share, second_moment(share))).min_by(|(_, a), (_, b)| a.total_cmp(b))?;
        // Also of no light at all there is nothing to be told.
        let worth_it = left < worth_it * second_moment(0.0);
        let mixture = worth_it.then(|| fit(&of_lit(0, 1), origin, radius))??;
        Some(Self { share, odds: odds(share), mixture })
    }
}

#[cfg(test)]
mod tests {
    use super::super::look::tests::integrating_sphere;
    use super::super::reflectors::Reflectors;
    use super::*;
    use crate::accel::bvh::Bvh;
    use crate::core::warp;
    use glam::Vec3;
    use std::f32::consts::PI;

    #[test]
    fn paths_see_what_has_come_by_other_surfaces() {
        for (max_depth, at_max_depth, surfaces) in
            [(1, "black", 2), (3, "black", 4), (20, "black", MOST_SURFACES), (3, "roulette", MOST_SURFACES)]
        {
            let scene = integrating_sphere(max_depth, at_max_depth);
            let accel = Bvh::new(&scene.shapes, &Default::default()).expect("the sphere is built");
            let reflectors = Reflectors::of(&scene);
            let shooter = Shooter::new(&scene, &accel, &reflectors, 0.0);
            let sights = shooter.see(3..23, &GuideMap::default());

            assert_eq!(sights.len() as u32, 20 * (surfaces - 1));
            for (k, sight) in sights.iter().enumerate() {
                let others = surfaces - 1 - k as u32 / 20;
                let expected = (1..=others).map(|n| 0.8f32.powi(n as i32)).sum::<f32>() * 2.0 / PI;
                assert!((sight.power / expected - 1.0).abs() < 1e-3, "{k}: {} for {expected}", sight.power);
                assert!((sight.pdf * PI - sight.wi.dot(sight.n)).abs() < 1e-3);
            }
            assert!(shooter.to_indirect().is_empty(), "light comes from everywhere");
        }
    }

    /// Sights from a square, along directions drawn from a diffuse lobe, of a bright disk about an axis in a dim dome.
    fn sights(count: usize, bright: f32, dim: f32) -> Vec<Photon> {
        let axis = Vec3::new(0.6, 0.8, 0.0);
        let sampler = Sampler::new(SamplerKind::Independent, 1, 0, 0);
        let sight = |i: usize| {
            let [x, z] = sampler.pair(i as u32, 0);
            let wi = Diffuse::draw(Vec3::Y, Vec3::Y, sampler.pair(i as u32, 1)).wi;
            let power = if wi.dot(axis) > 0.98 { bright } else { dim };
            let pdf = Diffuse::density(Vec3::Y, Vec3::Y, wi);
            Photon { p: Vec3::new(x, 0.0, z), n: Vec3::Y, wi, power, other: None, pdf }
        };
        (0..count).map(sight).collect()
    }

    fn cell(sights: &[Photon]) -> Option<Cell> {
        Cell::to_indirect(sights, &Aabb::around(sights.iter().map(|sight| sight.p)))
    }

    #[test]
    fn a_guide_is_worth_it_where_light_comes_from_few_directions() {
        // The disk takes 3 % of the rays.
        for bright in [50.0, 1000.0] {
            let cell = cell(&sights(2048, bright, 1.0)).expect("a bright disk");
            assert_eq!(cell.share, GREATEST_SHARE);
            assert!(cell.mixture.pdf(Vec3::ZERO, Vec3::new(0.6, 0.8, 0.0)) > 2.0);
        }
        for (count, bright, dim) in [(2048, 1.0, 1.0), (2048, 2.0, 1.0), (2048, 0.0, 0.0), (100, 1000.0, 1.0)]
        {
            assert!(cell(&sights(count, bright, dim)).is_none(), "{count} sights of {bright} and {dim}");
        }
    }

    #[test]
    fn noise_is_not_followed() {
        // A few sights are bright, wherever they look.
        let sampler = Sampler::new(SamplerKind::Independent, 2, 0, 0);
        let noisy = |(i, sight): (usize, Photon)| {
            let power = if sampler.pair(i as u32, 0)[0] < 0.02 { 100.0 } else { 1.0 };
            Photon { power, ..sight }
        };
        let noisy: Vec<Photon> = sights(2048, 1.0, 1.0).into_iter().enumerate().map(noisy).collect();
        assert!(cell(&noisy).is_none());
    }

    #[test]
    fn sights_along_a_guide_tell_the_same() {
        // Drawn evenly over the sphere, and weighed by that: what the lobe sees is the same.
        let sampler = Sampler::new(SamplerKind::Independent, 3, 0, 0);
        let drawn_otherwise = |(i, sight): (usize, Photon)| {
            let pdf = 1.0 / (4.0 * PI);
            let wi = warp::uniform_sphere(sampler.pair(i as u32, 0));
            let power = if wi.dot(Vec3::new(0.6, 0.8, 0.0)) > 0.98 { 50.0 } else { 1.0 };
            Photon { wi, power: power * Diffuse::density(Vec3::Y, Vec3::Y, wi) / pdf, pdf, ..sight }
        };
        let otherwise: Vec<Photon> =
            sights(1 << 13, 1.0, 1.0).into_iter().enumerate().map(drawn_otherwise).collect();
        let cells =
            [sights(1 << 13, 50.0, 1.0), otherwise].map(|sights| cell(&sights).expect("a bright disk"));
        let [a, b] = cells.map(|cell| cell.mixture.pdf(Vec3::ZERO, Vec3::new(0.6, 0.8, 0.0)));
        assert!((a / b - 1.0).abs() < 0.3, "{a} {b}");
    }
}
