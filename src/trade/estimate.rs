//! Error taken apart into noise and bias, from pictures of the same kind with independent random numbers.
//!
//! With n pictures x_i of a pixel, and two independent halves a and b of a reference whose mean is r = (a + b) / 2:
//!
//! * noise, the variance of one picture, is `(sum x^2 - (sum x)^2 / n) / (n - 1)`;
//! * squared bias is the mean over i != j of `(x_i - a)(x_j - b)`: neither the pictures' nor the reference's noise
//!   enters, since no factor's noise meets itself;
//! * relMSE, the expected error of one picture against the truth, is their sum.
//!
//! All are weighted by `1 / (r + 0.01)^2` per channel, as `gloss diff` weights its relMSE. Pixels have independent
//! random numbers, so the spread over pixels gives each mean its standard error, and the reference's own error is in it.
//! Where a bias varies over the picture, that spread is too large rather than too small.

use crate::core::Rgb;
use serde::{Deserialize, Serialize};

/// A number and its 95 % confidence interval.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// The number.
    pub value: f64,
    /// Lower end of the interval.
    pub low: f64,
    /// Upper end of the interval.
    pub high: f64,
}

/// Standard errors from the middle to either end of a 95 % interval of a normal variable.
const NORMAL_95: f64 = 1.959_964;

/// Standard errors beyond which chance alone goes to one side once in a thousand times.
const ONE_IN_A_THOUSAND: f64 = 3.090_232;

impl Estimate {
    /// A mean whose error is normal.
    fn normal(value: f64, standard_error: f64) -> Self {
        let reach = NORMAL_95 * standard_error;
        Self { value, low: value - reach, high: value + reach }
    }

    /// The mean of a few measurements, by Student's t.
    pub fn of(measured: &[f64]) -> Self {
        let n = measured.len() as f64;
        let mean = measured.iter().sum::<f64>() / n.max(1.0);
        if measured.len() < 2 {
            return Self { value: mean, low: f64::NEG_INFINITY, high: f64::INFINITY };
        }
        let variance = measured.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
        let reach = student_95(measured.len() - 1) * (variance / n).sqrt();
        Self { value: mean, low: mean - reach, high: mean + reach }
    }

    /// Half of the interval by the number.
    pub fn relative_reach(&self) -> f64 {
        0.5 * (self.high - self.low) / self.value.abs().max(1e-300)
    }

    /// Whether the intervals of both have something in common.
    pub fn agrees(&self, other: &Self) -> bool {
        self.low <= other.high && other.low <= self.high
    }

    /// The most that it may well be.
    pub fn bound(&self) -> f64 {
        self.high.max(0.5 * (self.high - self.low))
    }

    /// Whether it is above 0 by more than chance does once in a thousand times.
    pub fn is_positive(&self) -> bool {
        let standard_error = (self.high - self.low) / (2.0 * NORMAL_95);
        self.value > ONE_IN_A_THOUSAND * standard_error && self.value > 0.0
    }
}

/// The 97.5 % quantile of Student's t distribution with so many degrees of freedom.
///
/// The expansion of Abramowitz and Stegun 1964, 26.7.5, from 3 on good to 0.2 %; the table's own values below.
pub fn student_95(degrees: usize) -> f64 {
    match degrees {
        0 => f64::INFINITY,
        1 => 12.706,
        2 => 4.303,
        3 => 3.182,
        _ => {
            let (z, n) = (NORMAL_95, degrees as f64);
            let g1 = (z.powi(3) + z) / 4.0;
            let g2 = (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / 96.0;
            let g3 = (3.0 * z.powi(7) + 19.0 * z.powi(5) + 17.0 * z.powi(3) - 15.0 * z) / 384.0;
            let g4 =
                (79.0 * z.powi(9) + 776.0 * z.powi(7) + 1482.0 * z.powi(5) - 1920.0 * z.powi(3) - 945.0 * z)
                    / 92160.0;
            z + g1 / n + g2 / n.powi(2) + g3 / n.powi(3) + g4 / n.powi(4)
        }
    }
}

/// Sums over pictures with independent random numbers: per pixel and channel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sums {
    /// Pictures.
    pub count: u32,
    /// Sum.
    pub sum: Vec<f64>,
    /// Sum of squares.
    pub square: Vec<f64>,
}

impl Sums {
    /// Adds a picture.
    ///
    /// # Panics
    /// If it has another size than those before.
    pub fn add(&mut self, picture: &[Rgb]) {
        if self.count == 0 {
            self.sum = vec![0.0; 3 * picture.len()];
            self.square = self.sum.clone();
        }
        assert_eq!(self.sum.len(), 3 * picture.len(), "pictures have one size");
        let channels = picture.iter().flat_map(|pixel| pixel.to_array()).map(f64::from);
        for ((sum, square), x) in self.sum.iter_mut().zip(&mut self.square).zip(channels) {
            *sum += x;
            *square += x * x;
        }
        self.count += 1;
    }

    /// Mean of a channel.
    fn mean(&self, at: usize) -> f64 {
        self.sum[at] / f64::from(self.count)
    }

    /// The mean picture.
    pub fn picture(&self) -> Vec<Rgb> {
        let channel = |at| self.mean(at) as f32;
        (0..self.sum.len() / 3)
            .map(|p| Rgb::new(channel(3 * p), channel(3 * p + 1), channel(3 * p + 2)))
            .collect()
    }
}

/// What is taken for the truth: two halves with independent random numbers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Reference {
    /// The halves.
    pub halves: [Sums; 2],
}

impl Reference {
    fn mean(&self, at: usize) -> f64 {
        0.5 * (self.halves[0].mean(at) + self.halves[1].mean(at))
    }

    /// The mean picture.
    pub fn picture(&self) -> Vec<Rgb> {
        let [a, b] = self.halves.each_ref().map(Sums::picture);
        a.into_iter().zip(b).map(|(a, b)| (a + b) * 0.5).collect()
    }

    /// The weight of a channel's squared error.
    fn weight(&self, at: usize) -> f64 {
        (self.mean(at) + 0.01).powi(-2)
    }

    /// Its own relMSE: a quarter of the squared difference of its halves.
    pub fn error(&self) -> Estimate {
        let pixels = self.halves[0].sum.len() / 3;
        over_pixels((0..pixels).map(|pixel| {
            mean_of_channels(pixel, |at| {
                let d = self.halves[0].mean(at) - self.halves[1].mean(at);
                0.25 * d * d * self.weight(at)
            })
        }))
    }
}

fn mean_of_channels(pixel: usize, of: impl Fn(usize) -> f64) -> f64 {
    (3 * pixel..3 * pixel + 3).map(of).sum::<f64>() / 3.0
}

/// The mean of independent numbers, one for each pixel.
fn over_pixels(values: impl Iterator<Item = f64>) -> Estimate {
    let (mut n, mut sum, mut square) = (0.0, 0.0, 0.0);
    for value in values {
        n += 1.0;
        sum += value;
        square += value * value;
    }
    let n: f64 = f64::max(n, 1.0);
    let mean = sum / n;
    let variance = ((square / n - mean * mean) * n / (n - 1.0).max(1.0)).max(0.0);
    Estimate::normal(mean, (variance / n).sqrt())
}

/// The error of one way, in parts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Errors {
    /// Expected relMSE of one picture: noise and squared bias.
    pub relmse: Estimate,
    /// Variance of one picture, relative.
    pub noise: Estimate,
    /// Squared bias, relative. Without bias its estimate is negative as often as not.
    pub bias: Estimate,
    /// Mean of the picture over that of the reference, less one: below 0 where light is lost.
    pub brightness: Estimate,
}

impl Errors {
    /// The error of pictures against a reference; there must be two pictures at least.
    ///
    /// # Panics
    /// If there are fewer, or sizes differ.
    pub fn of(pictures: &Sums, reference: &Reference) -> Self {
        assert!(pictures.count > 1, "it takes two pictures to tell noise from bias");
        let n = f64::from(pictures.count);
        let parts = |at: usize| {
            let (s, q, w) = (pictures.sum[at], pictures.square[at], reference.weight(at));
            let [a, b] = reference.halves.each_ref().map(|half| half.mean(at));
            let noise = (q - s * s / n) / (n - 1.0);
            let same = q - (a + b) * s + n * a * b;
            let bias = ((s - n * a) * (s - n * b) - same) / (n * (n - 1.0));
            [w * bias, w * noise]
        };
        let pixels = pictures.sum.len() / 3;
        let all: Vec<[f64; 2]> = (0..pixels)
            .map(|pixel| [0, 1].map(|part| mean_of_channels(pixel, |at| parts(at)[part])))
            .collect();
        let total: f64 =
            (0..pictures.sum.len()).map(|at| reference.mean(at)).sum::<f64>() / pixels as f64 / 3.0;
        let difference = over_pixels((0..pixels).map(|pixel| {
            mean_of_channels(pixel, |at| pictures.mean(at) - reference.mean(at)) / total.max(1e-30)
        }));
        Self {
            relmse: over_pixels(all.iter().map(|[bias, noise]| bias + noise)),
            noise: over_pixels(all.iter().map(|[_, noise]| *noise)),
            bias: over_pixels(all.iter().map(|[bias, _]| *bias)),
            brightness: difference,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Uniform numbers of variance 1/12 by a hash.
    fn uniform(seed: u32) -> f32 {
        crate::core::sampler::hash(seed.wrapping_mul(0x9e37_79b9)) as f32 / u32::MAX as f32
    }

    fn picture(seed: u32, level: f32, noise: f32) -> Vec<Rgb> {
        let x = |i: u32, c: u32| {
            level + noise * (uniform(seed.wrapping_mul(10_007).wrapping_add(3 * i + c)) - 0.5)
        };
        (0..4000).map(|i| Rgb::new(x(i, 0), x(i, 1), x(i, 2))).collect()
    }

    /// Within 5 standard errors.
    fn is_near(found: Estimate, expected: f64) -> bool {
        (found.value - expected).abs() < 5.0 * 0.5 * (found.high - found.low) / NORMAL_95
    }

    fn errors(level: f32, noise: f32, reference_noise: f32) -> Errors {
        let mut reference = Reference::default();
        for (half, sums) in reference.halves.iter_mut().enumerate() {
            sums.add(&picture(1000 + half as u32, 1.0, reference_noise));
        }
        let mut sums = Sums::default();
        (0..6).for_each(|seed| sums.add(&picture(seed, level, noise)));
        Errors::of(&sums, &reference)
    }

    #[test]
    fn noise_and_bias_are_told_apart_and_the_references_noise_is_neither() {
        let weight = 1.01f64.powi(-2);
        for reference_noise in [0.0, 0.05] {
            let plain = errors(1.0, 0.3, reference_noise);
            let noise = weight * 0.09 / 12.0;
            assert!((plain.noise.value / noise - 1.0).abs() < 0.03, "{plain:?}");
            assert!(!plain.bias.is_positive() && is_near(plain.bias, 0.0), "{plain:?}");
            let biased = errors(0.95, 0.3, reference_noise);
            assert!(biased.bias.is_positive());
            assert!((biased.bias.value / (weight * 0.0025) - 1.0).abs() < 0.15, "{biased:?}");
            assert!((biased.brightness.value + 0.05).abs() < 5e-3, "{biased:?}");
            assert!((biased.relmse.value - biased.noise.value - biased.bias.value).abs() < 1e-12);
        }
    }

    #[test]
    fn the_references_error_is_that_of_its_mean() {
        let mut reference = Reference::default();
        for (half, sums) in reference.halves.iter_mut().enumerate() {
            sums.add(&picture(7 + half as u32, 1.0, 0.2));
        }
        let expected = 0.04 / 12.0 / 2.0 / 1.01f64.powi(2);
        let found = reference.error();
        assert!(is_near(found, expected), "{found:?} {expected}");
    }

    #[test]
    fn a_few_measurements_have_students_interval() {
        let e = Estimate::of(&[1.0, 2.0, 3.0]);
        assert!((e.value - 2.0).abs() < 1e-12 && (e.high - 2.0 - 4.303 / 3f64.sqrt()).abs() < 1e-3);
        assert!(Estimate::of(&[1.0]).high.is_infinite());
        for (degrees, t) in [(3, 3.182), (5, 2.571), (10, 2.228), (30, 2.042)] {
            assert!((student_95(degrees) / t - 1.0).abs() < 2e-3, "{degrees}");
        }
        assert!(e.agrees(&Estimate::of(&[2.5, 3.0, 3.5])) && !e.agrees(&Estimate::of(&[100.0, 100.1])));
    }
}
