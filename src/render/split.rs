//! Into how many rays the first hit of a path is worth splitting, whether samples of lights are worth it too, whether those
//! of glossy hits are worth choosing among candidates, and whether guides to all light that surfaces reflect are worth asking.
//!
//! With V1 the variance that a pixel has without the lobe's own, V2 that of one lobe sample, and c1, c2 what a camera
//! sample and a lobe sample cost, m rays have the variance `V1 + V2 / m` at the cost `c1 + m c2`: the product is
//! least at `m = sqrt(V2 c1 / (V1 c2))`. Both sides are measured by a pilot before the picture: some pixels take a few samples
//! that do not split, and as many that do. The ratio of the variances hardly hangs on how many samples there are (in six scenes,
//! from 4 to 64 samples, that of 4 rays to one moved by 0.02 to 0.17), so that a few tell it.
//!
//! The pilot's samples have numbers of their own and are not the picture's: so its answer hangs on the scene and its settings
//! alone, and every part of a picture finds the same. All pixels get one number of rays, since the rays of sample i take the
//! numbers `i m` to `i m + m - 1` of the pixel's sequence: samples of two kinds would share numbers and leave others out,
//! which costs more than there is to win.

use super::cost::cost;
use super::tile::{Tile, tiles};
use crate::film::{Film, Pixel, PixelRect};
use crate::integrator::{Integrator, Scratch, Tally, Work};
use crate::scene::settings::MAX_AUTO_SPLIT;
use crate::scene::{LightCandidates, LightSamples, Plan, Scene};
use rayon::prelude::*;
use std::sync::atomic::AtomicBool;

/// Rays per hit of the pilot's samples that split.
const PILOT_SPLIT: u32 = 4;

/// Parts of a pilot's samples whose means are compared: each is well spread by itself, as samples of one pixel are.
const PARTS: u32 = 8;

/// Samples of each part.
const SAMPLES_OF_PART: u32 = 2;

/// Of so many pixels one is the pilot's, at least.
const PIXELS_PER_TRIED: u32 = 128;

/// Pixels of a pilot, at most: they tell the ratio of variances to a few percent.
const MOST_TRIED: u32 = 2048;

/// Edge of the tiles in which a pilot works, so that each has a wave's worth of samples.
const TILE_SIZE: u32 = 128;

/// Neighbouring pixels of a pilot whose noise is added up before it is compared with that of others.
const TOGETHER: usize = 8;

/// The least of the variance that is left with [`PILOT_SPLIT`] rays, of a pilot's few samples. Less than a quarter can be left,
/// since more numbers of a sequence are better spread too; but what little is not the lobe's is known least, and decides about
/// large numbers.
const LEAST_LEFT: f64 = 0.29;

/// The power of variances at which two kinds of samples are compared: a rare bright path weighs less than in the variance.
const POWER: f64 = 0.7;

/// Numbers of rays whose promises differ by less than this factor count as equally good; the least of them is taken: what
/// more rays promise for smooth parts of a picture, they do not keep at edges, and where errors fall faster than by the number of
/// samples, more samples bring more than more rays.
const AS_GOOD: f64 = 1.04;

/// Splitting must promise to be better than not to split by this factor: promises are not as good as they look.
const WORTH_IT: f64 = 0.96;

/// Splitting samples of lights too must promise to be better than splitting rays alone by this factor.
const LIGHTS_WORTH_IT: f64 = 0.93;

/// Guides to all light that surfaces reflect must promise to be better than those to caustics alone by this factor: to ask them
/// takes a sixth to a third of the time, which costs in rays do not tell.
const GUIDES_WORTH_IT: f64 = 0.8;

/// What a pilot has found best.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Best {
    /// What a first hit is worth splitting into.
    pub split: Split,
    /// Candidates for each sample of lights at a glossy hit.
    pub light_candidates: u32,
    /// Whether diffuse surfaces look for all light that others reflect.
    pub guides_indirect: bool,
}

impl Best {
    /// An integrator that does so.
    pub(super) fn of<'a>(&self, integrator: Integrator<'a>) -> Integrator<'a> {
        integrator
            .guided_to_indirect(self.guides_indirect)
            .with_light_candidates(self.light_candidates)
            .splitting_lights(self.split.lights)
    }
}

/// What a first hit is worth splitting into.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Split {
    /// Rays that leave it.
    pub rays: u32,
    /// Whether it takes as many samples of lights.
    pub lights: bool,
}

/// What a pilot's pixels were like, in order, with samples that do not split and with samples that do.
#[derive(Default)]
struct Trials {
    one: Trial,
    /// With one sample of lights per hit, and with as many as rays; empty where that is not to be tried.
    many: [Trial; 2],
}

/// Pixels with samples of one kind.
#[derive(Default)]
struct Trial {
    /// Of each pixel the mean luminance, and the variance of the means of its parts.
    pixels: Vec<[f32; 2]>,
    /// What the samples cost.
    cost: f64,
    /// Camera samples.
    samples: f64,
}

/// What is best for a picture of the scene, as far as a pilot can tell; anything if `stop` becomes true.
///
/// `integrator` makes one that draws other numbers than the picture.
pub(super) fn best<'a>(scene: &'a Scene, integrator: impl Fn() -> Integrator<'a>, stop: &AtomicBool) -> Best {
    let [width, height] = scene.camera.resolution;
    let whole = PixelRect { x0: 0, y0: 0, x1: width, y1: height };
    let is_tried = |pixel: &&(u32, u32)| is_tried(pixel, whole.area());
    let tiles = tiles(whole, TILE_SIZE).into_iter().map(|tile| {
        let pixels: Vec<_> = tile.active.iter().filter(is_tried).copied().collect();
        (tile, pixels)
    });
    let tiles: Vec<_> = tiles.collect();
    let try_with = |integrator: &Integrator, split| {
        let of_tiles: Vec<Trial> = tiles
            .par_iter()
            .map(|(tile, pixels)| try_splitting(scene, integrator, (tile, pixels), split, stop))
            .collect();
        of_tiles.into_iter().fold(Trial::default(), Trial::and)
    };

    let (plan, plain) = (Plan::of(scene), integrator());
    let mut best = Best {
        split: Split { rays: plan.split, lights: plain.splits_lights() },
        light_candidates: plain.light_candidates(),
        guides_indirect: plain.guides_indirect(),
    };
    let mut one = try_with(&plain, 1);
    if plan.tries_guides && plain.has_indirect_guides() {
        let guided = try_with(&integrator().guided_to_indirect(true), 1);
        if guided.left_beside(&one) < GUIDES_WORTH_IT {
            (one, best.guides_indirect) = (guided, true);
        }
    }
    if !plan.splits_by_pilot {
        return best;
    }
    if plan.tries_candidates {
        let tried = Best { light_candidates: LightCandidates::TRIED, ..best };
        let chosen = try_with(&tried.of(integrator()), 1);
        if chosen.left_beside(&one) < 1.0 {
            (one, best) = (chosen, tried);
        }
    }
    let splits_lights: &[bool] = match scene.settings.light_samples {
        _ if !plain.samples_lights() => &[false],
        LightSamples::One => &[false],
        LightSamples::Split => &[true],
        LightSamples::Auto => &[false, true],
    };
    let many = [false, true].map(|splits| {
        let integrator = || best.of(integrator()).splitting_lights(splits);
        let wanted = splits_lights.contains(&splits).then(|| try_with(&integrator(), PILOT_SPLIT));
        wanted.unwrap_or_default()
    });
    Best { split: Trials { one, many }.best_split(), ..best }
}

/// Whether a pixel of a picture of `area` pixels is the pilot's: those of a lattice that is even in both directions.
fn is_tried(&(x, y): &(u32, u32), area: usize) -> bool {
    const GOLDEN: f64 = 0.618_033_988_749_895;
    let one_of = (area as u64).div_ceil(u64::from(MOST_TRIED)).max(u64::from(PIXELS_PER_TRIED));
    let step = (one_of as f64 * GOLDEN).round() as u64;
    (u64::from(x) + u64::from(y) * step).is_multiple_of(one_of)
}

/// Takes a pilot's samples of some pixels of a tile, and measures them.
fn try_splitting(
    scene: &Scene,
    integrator: &Integrator,
    (tile, pixels): (&Tile, &[(u32, u32)]),
    split: u32,
    stop: &AtomicBool,
) -> Trial {
    let mut film = Film::new(scene.camera.resolution, tile.rect);
    let (mut parts, mut tally) = (Parts::new(pixels.len()), Tally::default());
    let mut scratch = Scratch::default();
    for part in 0..PARTS {
        let samples = part * SAMPLES_OF_PART..(part + 1) * SAMPLES_OF_PART;
        integrator.render(&mut film, &Work { pixels, samples, split }, &mut scratch, &mut tally, stop);
        parts.note(&film, pixels, SAMPLES_OF_PART);
    }
    parts.trial(&tally)
}

/// The luminance of a trial's pixels, part by part.
struct Parts {
    /// Sums of all parts so far.
    before: Vec<f64>,
    /// Means of each part.
    means: Vec<Vec<f64>>,
}

impl Parts {
    /// Of so many pixels.
    fn new(pixels: usize) -> Self {
        Self { before: vec![0.0; pixels], means: vec![vec![]; pixels] }
    }

    /// Notes what the last samples, `n` for each pixel, have added to the film.
    fn note(&mut self, film: &Film, pixels: &[(u32, u32)], n: u32) {
        for ((before, means), (x, y)) in self.before.iter_mut().zip(&mut self.means).zip(pixels) {
            let sum = luminance_sum(film.pixel(*x, *y));
            means.push((sum - *before) / f64::from(n));
            *before = sum;
        }
    }

    /// What they are like, with what was counted on the way.
    fn trial(&self, tally: &Tally) -> Trial {
        let moments = |means: &Vec<f64>| {
            let n = means.len() as f64;
            let mean = means.iter().sum::<f64>() / n;
            let squares = means.iter().map(|part| (part - mean) * (part - mean)).sum::<f64>();
            [mean as f32, (squares / (n - 1.0)) as f32]
        };
        let pixels = self.means.iter().map(moments).collect();
        Trial { pixels, cost: cost(tally), samples: tally.samples as f64 }
    }
}

fn luminance_sum(pixel: &Pixel) -> f64 {
    let [r, g, b] = pixel.sum.map(|sum| sum.to_f64());
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

impl Trials {
    /// The splitting that is best for the picture as a whole.
    fn best_split(&self) -> Split {
        let tried = [0, 1].map(|lights| self.best_rays(&self.many[lights]));
        let lights = tried[1].1 < LIGHTS_WORTH_IT * tried[0].1;
        Split { rays: tried[usize::from(lights)].0, lights }
    }

    /// The number of rays that is best where many are as in this trial, and what variance times cost is by that of one ray.
    fn best_rays(&self, many: &Trial) -> (u32, f64) {
        let one = &self.one;
        if many.pixels.is_empty() {
            return (1, f64::INFINITY);
        }
        let level = 0.5 * (one.mean_luminance() + many.mean_luminance());
        let [noise_of_one, noise_of_many] = [one, many].map(|trial| trial.noise(level));
        // Nobody knows of a picture without noise, nor of one with hardly a pixel.
        if noise_of_one.len() < 2 || noise_of_one.iter().sum::<f64>() <= 0.0 {
            return (1, 1.0);
        }
        let left = left_in_picture(left_of_variance(&noise_of_one, &noise_of_many));
        closed_form(left, [one.mean_cost(), many.mean_cost()])
    }
}

/// The fraction of the variance that is left with [`PILOT_SPLIT`] rays, from the [noise](Trial::noise) of the same
/// pixels with both kinds of samples: as much as is to be expected, if all fractions from [`LEAST_LEFT`] to 1 were as likely before.
///
/// The product of variance and cost is linear in that fraction, so that the number of rays that is best for its mean is
/// best in the mean.
fn left_of_variance(one: &[f64], many: &[f64]) -> f64 {
    let all = one.iter().sum::<f64>();
    let ratio = many.iter().sum::<f64>() / all;
    let strays = one.iter().zip(many).map(|(one, many)| (many - ratio * one).powi(2));
    let uncertain = strays.sum::<f64>().sqrt() / all;
    // By the derivative of the root.
    let found = ratio.powf(1.0 / POWER);
    let uncertain = if ratio > 0.0 { uncertain * found / (ratio * POWER) } else { 0.0 };
    let uncertain = uncertain.max(0.01);
    // From farther outside of all that is possible, nothing would be likely.
    let found = found.clamp(LEAST_LEFT - 9.0 * uncertain, 1.0 + 9.0 * uncertain);

    const STEPS: u32 = 64;
    let (mut sum, mut weights) = (0.0, 0.0);
    for step in 0..STEPS {
        let left = LEAST_LEFT + (1.0 - LEAST_LEFT) * (f64::from(step) + 0.5) / f64::from(STEPS);
        let weight = (-0.5 * ((left - found) / uncertain).powi(2)).exp();
        sum += weight * left;
        weights += weight;
    }
    sum / weights
}

/// What is left of a whole picture's variance, from what is left of that of a pilot's few samples.
///
/// The noise of edges falls faster with the number of samples than a lobe's, and pilots err, so that there is less between the best
/// and the worst of pictures than of pilots. Of 22 scenes with 32 samples per pixel, 19 were within 0.12 of this line and three
/// 0.17 to 0.19 below it (`benches/RESULTS.md`).
fn left_in_picture(left: f64) -> f64 {
    0.08 + 0.65 * left
}

/// The whole number next to `sqrt(V2 c1 / (V1 c2))`, or a smaller one that is as good, from what is left of the variance
/// with [`PILOT_SPLIT`] rays, and what a camera sample costs without and with them; and what variance times cost is then, by
/// that of one ray.
fn closed_form(left: f64, cost: [f64; 2]) -> (u32, f64) {
    let m = f64::from(PILOT_SPLIT);
    let lobe_cost = (cost[1] - cost[0]) / (m - 1.0);
    let camera_cost = cost[0] - lobe_cost;
    let lobe_variance = (1.0 - left) * m / (m - 1.0);
    let camera_variance = 1.0 - lobe_variance;
    if !(lobe_cost > 0.0 && camera_cost > 0.0 && lobe_variance > 0.0) {
        return (1, 1.0);
    }
    let product = |m: u32| {
        let m = f64::from(m);
        (camera_variance + lobe_variance / m) * (camera_cost + lobe_cost * m)
    };
    let best = (2..=MAX_AUTO_SPLIT).map(product).fold(f64::INFINITY, f64::min);
    let is_as_good = |m: &u32| product(*m) <= AS_GOOD * best;
    let least = (2..=MAX_AUTO_SPLIT).find(is_as_good);
    let rays = least.filter(|m| product(*m) <= WORTH_IT * product(1)).unwrap_or(1);
    (rays, product(rays) / product(1))
}

impl Trial {
    /// This, and pixels that come after these.
    fn and(mut self, next: Self) -> Self {
        self.pixels.extend(next.pixels);
        Self { pixels: self.pixels, cost: self.cost + next.cost, samples: self.samples + next.samples }
    }

    /// Variance times cost by that of other samples of the same pixels: in the geometric mean of errors by the brightness of each
    /// pixel, which dark ones make, and of errors as they are, which bright ones make.
    fn left_beside(&self, other: &Self) -> f64 {
        let level = 0.5 * (self.mean_luminance() + other.mean_luminance());
        let by_brightness = [self, other].map(|trial| trial.noise(level).iter().sum::<f64>());
        let power = |[_, variance]: &[f32; 2]| f64::from(*variance).powf(POWER);
        let as_they_are = [self, other].map(|trial| trial.pixels.iter().map(power).sum::<f64>());
        let left = |[noise, of_other]: [f64; 2]| (noise / of_other).powf(1.0 / POWER);
        let cost = self.mean_cost() / other.mean_cost();
        let left = (left(by_brightness) * left(as_they_are)).sqrt() * cost;
        // Nobody knows of a picture without noise.
        if left.is_finite() { left } else { 1.0 }
    }

    /// A [power](POWER) of the variance by the square of the mean, in sums over a few pixels each; a mean below a tenth of the
    /// picture's counts as that.
    fn noise(&self, level: f64) -> Vec<f64> {
        let relative = |&[mean, variance]: &[f32; 2]| {
            let square = f64::from(mean).powi(2) + (0.1 * level).powi(2);
            if square > 0.0 { f64::from(variance) / square } else { 0.0 }
        };
        let sum = |pixels: &[[f32; 2]]| pixels.iter().map(|pixel| relative(pixel).powf(POWER)).sum();
        self.pixels.chunks(TOGETHER).map(sum).collect()
    }

    fn mean_luminance(&self) -> f64 {
        self.pixels.iter().map(|[mean, _]| f64::from(*mean)).sum::<f64>() / self.pixels.len().max(1) as f64
    }

    fn mean_cost(&self) -> f64 {
        self.cost / self.samples.max(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_best_split_is_the_closed_form() {
        let m = f64::from(PILOT_SPLIT);
        // The roots are 4.6, 2.05, 1 and 0; three rays are within 4 % of five.
        for (v1, v2, expected) in [(0.01, 0.21, 3), (0.05, 0.21, 2), (0.2, 0.2, 1), (0.21, 0.0, 1)] {
            assert_eq!(closed_form((v1 + v2 / m) / (v1 + v2), [2.0, 1.0 + m]).0, expected);
        }
        assert_eq!(Trials::default().best_split(), Split { rays: 1, lights: false });
    }

    #[test]
    fn what_is_left_of_the_variance_is_between_a_bound_and_one() {
        let tiles = |value: f64| vec![value; 100];
        for (ratio, expected) in [(0.5, 0.5), (0.9, 0.9), (0.1, LEAST_LEFT), (0.0, LEAST_LEFT), (1.5, 1.0)] {
            let left = left_of_variance(&tiles(1.0), &tiles(f64::powf(ratio, POWER)));
            assert!((left - expected).abs() < 0.01, "{ratio}: {left} instead of {expected}");
        }
        // Where hardly anything is known, it is the middle.
        let left = left_of_variance(&[1.0, 1e-3], &[1e-3, 1.0]);
        assert!((0.55..0.85).contains(&left), "{left}");
    }

    #[test]
    fn what_may_be_chance_splits_nothing() {
        let trials = |few: [f32; 2], all: [f32; 2]| {
            let pixels = |kind: usize| {
                let variance = |i| if i < TOGETHER { few[kind] } else { all[kind] };
                (0..100 * TOGETHER).map(|i| [1.0, variance(i)]).collect()
            };
            let trial = |kind, cost| Trial { pixels: pixels(kind), cost, samples: 4.0 };
            Trials { one: trial(0, 8.0), many: [trial(1, 20.0), Trial::default()] }
        };
        // A few neighbours alone say that splitting helps; a hundred times as many are believed.
        assert_eq!(trials([1.0, 0.2], [0.01; 2]).best_split().rays, 1);
        assert!(trials([1.0, 0.3], [1.0, 0.3]).best_split().rays >= 2);
    }

    #[test]
    fn samples_of_lights_split_where_they_are_worth_it() {
        let trial = |variance, cost| Trial { pixels: vec![[1.0, variance]; 100], cost, samples: 4.0 };
        let best = |left: f32, cost| {
            let many = [trial(0.6, 20.0), trial(left, cost)];
            Trials { one: trial(1.0, 8.0), many }.best_split()
        };
        assert!(best(0.35, 22.0).lights && best(0.35, 22.0).rays > 1);
        assert!(!best(0.6, 22.0).lights && !best(0.35, 60.0).lights);
    }

    #[test]
    fn candidates_are_told_by_variance_times_cost() {
        let trial = |variance, cost| Trial { pixels: vec![[1.0, variance]; 100], cost, samples: 4.0 };
        assert!((trial(0.5, 12.0).left_beside(&trial(1.0, 8.0)) - 0.75).abs() < 1e-6);
        assert_eq!(trial(0.0, 12.0).left_beside(&trial(0.0, 8.0)), 1.0);
        assert_eq!(Trial::default().left_beside(&Trial::default()), 1.0);
    }

    #[test]
    fn what_a_few_bright_pixels_gain_counts_as_what_many_dark_ones_gain() {
        let trial = |dark: f32, bright: f32, cost| {
            let pixels = [vec![[0.1, dark]; 90], vec![[5.0, bright]; 10]].concat();
            Trial { pixels, cost, samples: 4.0 }
        };
        let plain = trial(1e-3, 4.0, 4.0);
        // A tenth of the bright pixels' variance, and hardly anything by the brightness of all; then the other way round.
        let bright = trial(1e-3, 0.4, 6.0).left_beside(&plain);
        let dark = trial(1e-4, 4.0, 6.0).left_beside(&plain);
        assert!((0.4..0.9).contains(&bright) && (0.4..0.9).contains(&dark), "{bright} {dark}");
    }

    #[test]
    fn a_pilot_has_few_pixels_and_they_are_far_from_each_other() {
        for (edge, least) in [(128, 8), (256, 8), (512, 8), (2048, 32)] {
            let pixels = (0..edge).flat_map(|y| (0..edge).map(move |x| (x, y)));
            let tried: Vec<_> = pixels.filter(|p| is_tried(p, (edge * edge) as usize)).collect();
            let expected = (edge * edge / PIXELS_PER_TRIED).min(MOST_TRIED);
            assert!(tried.len().abs_diff(expected as usize) <= edge as usize / 64, "{edge}: {}", tried.len());
            let near = |(x, y): (u32, u32)| {
                tried.iter().filter(|(a, b)| a.abs_diff(x) + b.abs_diff(y) < least).count()
            };
            assert!(tried.iter().step_by(7).all(|p| near(*p) == 1), "{edge}: none is near another");
        }
    }
}
