//! Into how many rays the first glossy hit of a path is worth splitting.
//!
//! With V1 the variance that a pixel has without the lobe's own, V2 that of one lobe sample, and c1, c2 what a camera
//! sample and a lobe sample cost, m rays have the variance `V1 + V2 / m` at the cost `c1 + m c2`: the product is
//! least at `m = sqrt(V2 c1 / (V1 c2))`. Both sides are measured by a pilot: two pixels of each 128, side by side,
//! one of which splits and one does not. Their ratio hardly hangs on how many samples there are (in six scenes, from
//! 4 to 64 samples, that of 4 rays to one moved by 0.02 to 0.17), so that the first few tell it.
//!
//! The pilot's samples stay in the picture, and its pixels keep their number of rays to the end: the rays of sample i
//! take the numbers `i m` to `i m + m - 1` of the pixel's sequence, so that samples of two kinds would share numbers
//! and leave others out, which costs more than all that a pilot can win. What it costs is that one pixel in 64
//! splits, or another does not, where that is the wrong thing. All other pixels get one number of rays: what is the
//! best of the fixed numbers for the picture as a whole.

use super::cost::cost;
use crate::film::{Film, Pixel};
use crate::integrator::Tally;
use crate::scene::settings::{EVEN_SAMPLES, MAX_AUTO_SPLIT};
use serde::{Deserialize, Serialize};

/// Rays per glossy hit of the pilot's pixels that split.
const PILOT_SPLIT: u32 = 4;

/// Parts of a pilot's samples whose means are compared: each is well spread by itself, as samples of one pixel are.
pub(super) const PARTS: u32 = 8;

/// Samples of each part, at most: with those of all parts a pixel is where it must be when noise is looked for.
const MOST_OF_PART: u32 = EVEN_SAMPLES / PARTS;

/// The least of the variance that is left with [`PILOT_SPLIT`] rays. A quarter would be left if all of it were the lobe's,
/// which is not so in any scene; and what little is not the lobe's is known least, but decides about large numbers.
const LEAST_LEFT: f64 = 0.3;

/// The power of variances at which two kinds of pixels are compared: a rare bright path weighs less than in the variance.
const POWER: f64 = 0.7;

/// Splitting must promise to be better than not to split by this factor: promises are not as good as they look.
const WORTH_IT: f64 = 0.97;

/// Samples of each part of a pilot, where there are `count` in all: none where they are too few to learn from.
pub(super) fn samples_of_part(count: u32) -> u32 {
    (count / PARTS).min(MOST_OF_PART)
}

/// What a pixel is to a pilot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    /// It splits into [`PILOT_SPLIT`].
    Many,
    /// It does not split.
    One,
    /// It does as the pilot finds to be best.
    Other,
}

impl Role {
    /// Rays at the first glossy hits of a pilot's pixels.
    pub(super) fn split(self) -> u32 {
        if self == Self::Many { PILOT_SPLIT } else { 1 }
    }

    /// Pairs of neighbours on a lattice, about 8 pixels from each other.
    pub(super) fn of(&(x, y): &(u32, u32)) -> Self {
        match ((x / 2).wrapping_add(y.wrapping_mul(9)) % 32, x % 2) {
            (0, 0) => Self::Many,
            (0, _) => Self::One,
            _ => Self::Other,
        }
    }
}

/// Into how many rays each pixel's first glossy hits split.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Splits {
    /// Those of no pilot.
    pub others: u32,
    /// Whether there is a pilot.
    has_pilot: bool,
}

impl Splits {
    /// The same everywhere.
    pub(super) fn constant(split: u32) -> Self {
        Self { others: split, has_pilot: false }
    }

    /// What a pilot has found best, outside of its own pixels.
    pub(super) fn chosen(trials: impl Iterator<Item = Trials>) -> Self {
        Self { others: best_split(trials), has_pilot: true }
    }

    /// Whether a pixel is the pilot's.
    pub(super) fn is_pilot(&self, pixel: &(u32, u32)) -> bool {
        self.has_pilot && Role::of(pixel) != Role::Other
    }

    /// Rays at a pixel's first glossy hits.
    pub(super) fn of(&self, pixel: &(u32, u32)) -> u32 {
        if self.is_pilot(pixel) { Role::of(pixel).split() } else { self.others }
    }
}

/// What the pilot's pixels of a tile were like.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Trials {
    one: Trial,
    many: Trial,
}

/// Pixels of one kind.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Trial {
    /// Of each pixel the mean luminance, and the variance of the means of its parts.
    pixels: Vec<[f32; 2]>,
    /// What the samples cost.
    cost: f64,
    /// Camera samples.
    samples: f64,
}

impl Trials {
    /// The trial of a kind of pixels, to be filled in.
    pub(super) fn of(&mut self, role: Role) -> &mut Trial {
        if role == Role::Many { &mut self.many } else { &mut self.one }
    }
}

/// The luminance of a trial's pixels, part by part.
pub(super) struct Parts {
    /// Sums of all parts so far.
    before: Vec<f64>,
    /// Means of each part.
    means: Vec<Vec<f64>>,
}

impl Parts {
    /// Of so many pixels.
    pub(super) fn new(pixels: usize) -> Self {
        Self { before: vec![0.0; pixels], means: vec![vec![]; pixels] }
    }

    /// Notes what the last samples, `n` for each pixel, have added to the film.
    pub(super) fn note(&mut self, film: &Film, pixels: &[(u32, u32)], n: u32) {
        for ((before, means), (x, y)) in self.before.iter_mut().zip(&mut self.means).zip(pixels) {
            let sum = luminance_sum(film.pixel(*x, *y));
            means.push((sum - *before) / f64::from(n));
            *before = sum;
        }
    }

    /// What they are like, with what was counted on the way.
    pub(super) fn trial(&self, tally: &Tally) -> Trial {
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

/// The number of rays that is best for the picture as a whole.
fn best_split(trials: impl Iterator<Item = Trials>) -> u32 {
    let (one, many): (Vec<Trial>, Vec<Trial>) = trials.map(|trials| (trials.one, trials.many)).unzip();
    let level = mean_luminance(one.iter().chain(&many));
    let [noise_of_one, noise_of_many] =
        [&one, &many].map(|kind| kind.iter().map(|trial| trial.noise(level)).collect::<Vec<_>>());
    if noise_of_one.iter().sum::<f64>() <= 0.0 {
        return 1;
    }
    let left = left_of_variance(&noise_of_one, &noise_of_many);
    closed_form(left, [mean_cost(&one), mean_cost(&many)])
}

/// The fraction of the variance that is left with [`PILOT_SPLIT`] rays, from the [noise](Trial::noise) of each tile's pixels
/// of both kinds: as much as is to be expected, if all fractions from [`LEAST_LEFT`] to 1 were as likely before.
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

/// `sqrt(V2 c1 / (V1 c2))`, from what is left of the variance with [`PILOT_SPLIT`] rays, and what a camera sample costs
/// without and with them.
fn closed_form(left: f64, cost: [f64; 2]) -> u32 {
    let m = f64::from(PILOT_SPLIT);
    let lobe_cost = (cost[1] - cost[0]) / (m - 1.0);
    let camera_cost = cost[0] - lobe_cost;
    let lobe_variance = (1.0 - left) * m / (m - 1.0);
    let camera_variance = 1.0 - lobe_variance;
    if !(lobe_cost > 0.0 && camera_cost > 0.0 && lobe_variance > 0.0) {
        return 1;
    }
    let best = (lobe_variance * camera_cost / (camera_variance * lobe_cost)).sqrt();
    let best = best.round().clamp(1.0, f64::from(MAX_AUTO_SPLIT));
    let product = |m: f64| (camera_variance + lobe_variance / m) * (camera_cost + lobe_cost * m);
    if product(best) <= WORTH_IT * product(1.0) { best as u32 } else { 1 }
}

impl Trial {
    /// Sum over the pixels of a [power](POWER) of the variance by the square of the mean; a mean below a tenth of the picture's
    /// counts as that.
    fn noise(&self, level: f64) -> f64 {
        let relative = |&[mean, variance]: &[f32; 2]| {
            let square = f64::from(mean).powi(2) + (0.1 * level).powi(2);
            if square > 0.0 { f64::from(variance) / square } else { 0.0 }
        };
        self.pixels.iter().map(|pixel| relative(pixel).powf(POWER)).sum()
    }
}

fn mean_luminance<'a>(trials: impl Iterator<Item = &'a Trial>) -> f64 {
    let (mut sum, mut pixels) = (0.0, 0);
    for [mean, _] in trials.flat_map(|trial| &trial.pixels) {
        sum += f64::from(*mean);
        pixels += 1;
    }
    sum / f64::from(pixels.max(1))
}

fn mean_cost(trials: &[Trial]) -> f64 {
    let sum = |of: fn(&Trial) -> f64| trials.iter().map(of).sum::<f64>();
    sum(|trial| trial.cost) / sum(|trial| trial.samples).max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_best_split_is_the_closed_form() {
        let m = f64::from(PILOT_SPLIT);
        for (v1, v2, expected) in [(0.01, 0.21, 5), (0.05, 0.21, 2), (0.2, 0.2, 1), (0.21, 0.0, 1)] {
            assert_eq!(closed_form((v1 + v2 / m) / (v1 + v2), [2.0, 1.0 + m]), expected);
        }
        assert_eq!(best_split(std::iter::empty()), 1);
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
        let tile = |one: f32, many: f32| {
            let trial = |variance: f32, cost| Trial { pixels: vec![[1.0, variance]; 4], cost, samples: 4.0 };
            Trials { one: trial(one, 8.0), many: trial(many, 20.0) }
        };
        // One tile alone says that splitting helps; a hundred of them are believed.
        let calm = || (0..99).map(|_| tile(0.01, 0.01));
        assert_eq!(best_split(calm().chain([tile(1.0, 0.2)])), 1);
        assert!(best_split((0..100).map(|_| tile(1.0, 0.3))) >= 2);
    }

    #[test]
    fn a_pilot_has_pairs_of_pixels_and_few_of_them() {
        let pixels: Vec<(u32, u32)> = (0..256).flat_map(|y| (0..256).map(move |x| (x, y))).collect();
        let many: Vec<_> = pixels.iter().filter(|p| Role::of(p) == Role::Many).collect();
        assert_eq!(many.len(), 256 * 256 / 64);
        assert!(many.iter().all(|(x, y)| Role::of(&(x + 1, *y)) == Role::One));
        let near =
            |(x, y): (u32, u32)| many.iter().filter(|(a, b)| a.abs_diff(x) + b.abs_diff(y) < 9).count();
        assert!(many.iter().all(|p| near(**p) == 1), "none is near another");
    }
}
