//! Into how many rays the first hit of a path is worth splitting, and whether samples of lights are worth it too.
//!
//! With V1 the variance that a pixel has without the lobe's own, V2 that of one lobe sample, and c1, c2 what a camera
//! sample and a lobe sample cost, m rays have the variance `V1 + V2 / m` at the cost `c1 + m c2`: the product is
//! least at `m = sqrt(V2 c1 / (V1 c2))`. Both sides are measured by a [pilot](super::pilot) before the picture: some pixels take a
//! few samples that do not split, and as many that do. The ratio of the variances hardly hangs on how many samples there are (in six
//! scenes, from 4 to 64 samples, that of 4 rays to one moved by 0.02 to 0.17), so that a few tell it.
//!
//! All pixels get one number of rays, since the rays of sample i take the numbers `i m` to `i m + m - 1` of the pixel's sequence:
//! samples of two kinds would share numbers and leave others out, which costs more than there is to win.

use super::trial::{POWER, Trial};
use crate::scene::settings::MAX_AUTO_SPLIT;

/// Rays per hit of the pilot's samples that split.
pub(super) const PILOT_SPLIT: u32 = 4;

/// The least of the variance that is left with [`PILOT_SPLIT`] rays, of a pilot's few samples. Less than a quarter can be left,
/// since more numbers of a sequence are better spread too; but what little is not the lobe's is known least, and decides about
/// large numbers.
const LEAST_LEFT: f64 = 0.29;

/// Numbers of rays whose promises differ by less than this factor count as equally good; the least of them is taken: what
/// more rays promise for smooth parts of a picture, they do not keep at edges, and where errors fall faster than by the number of
/// samples, more samples bring more than more rays.
const AS_GOOD: f64 = 1.04;

/// Splitting must promise to be better than not to split by this factor: promises are not as good as they look.
const WORTH_IT: f64 = 0.96;

/// Splitting samples of lights too must promise to be better than splitting rays alone by this factor.
const LIGHTS_WORTH_IT: f64 = 0.93;

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
pub(super) struct Trials {
    pub(super) one: Trial,
    /// With one sample of lights per hit, and with as many as rays; empty where that is not to be tried.
    pub(super) many: [Trial; 2],
}

impl Trials {
    /// The splitting that is best for the picture as a whole.
    pub(super) fn best_split(&self) -> Split {
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

#[cfg(test)]
mod tests {
    use super::super::trial::TOGETHER;
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
}
