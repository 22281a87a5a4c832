//! What samples of one kind are like, in a pilot's pixels: how noisy, and how dear.

use super::cost::cost;
use crate::film::{Film, Pixel};
use crate::integrator::Tally;

/// Neighbouring pixels of a pilot whose noise is added up before it is compared with that of others.
pub(super) const TOGETHER: usize = 8;

/// The power of variances at which two kinds of samples are compared: a rare bright path weighs less than in the variance.
pub(super) const POWER: f64 = 0.7;

/// Pixels with samples of one kind.
#[derive(Default)]
pub(super) struct Trial {
    /// Of each pixel the mean luminance, and the variance of the means of its parts.
    pub(super) pixels: Vec<[f32; 2]>,
    /// What the samples cost.
    pub(super) cost: f64,
    /// Camera samples.
    pub(super) samples: f64,
}

impl Trial {
    /// This, and pixels that come after these.
    pub(super) fn and(mut self, next: Self) -> Self {
        self.pixels.extend(next.pixels);
        Self { pixels: self.pixels, cost: self.cost + next.cost, samples: self.samples + next.samples }
    }

    /// Variance times cost by that of other samples of the same pixels: in the geometric mean of errors by the brightness of each
    /// pixel, which dark ones make, and of errors as they are, which bright ones make.
    pub(super) fn left_beside(&self, other: &Self) -> f64 {
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
    pub(super) fn noise(&self, level: f64) -> Vec<f64> {
        let relative = |&[mean, variance]: &[f32; 2]| {
            let square = f64::from(mean).powi(2) + (0.1 * level).powi(2);
            if square > 0.0 { f64::from(variance) / square } else { 0.0 }
        };
        let sum = |pixels: &[[f32; 2]]| pixels.iter().map(|pixel| relative(pixel).powf(POWER)).sum();
        self.pixels.chunks(TOGETHER).map(sum).collect()
    }

    pub(super) fn mean_luminance(&self) -> f64 {
        self.pixels.iter().map(|[mean, _]| f64::from(*mean)).sum::<f64>() / self.pixels.len().max(1) as f64
    }

    pub(super) fn mean_cost(&self) -> f64 {
        self.cost / self.samples.max(1.0)
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

#[cfg(test)]
mod tests {
    use super::*;

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
}
