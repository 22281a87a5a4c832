//! Whether two pictures of one scene differ by more than their noise.
//!
//! Two rules, both of which must hold, for pictures whose bits differ:
//!
//! * **Bias.** Let `d` be a pixel's difference in luminance, zero if it is below the roundings ([`ROUNDING`]). If both
//!   backends show the same scene, `d` and `-d` are equally likely, so `T = sum d / sqrt(sum d^2)` exceeds x with
//!   a probability of at most `2 exp(-x^2 / 2)` whatever the noise looks like (Hoeffding 1963, for random signs). T is
//!   looked at over the whole picture and over each block of 16 x 16 pixels, with limits that fail one comparison
//!   in 10^5 of equals.
//! * **Outliers.** `z = d / sqrt(var A + var B)` is beyond 3 in no more pixels than five standard errors above their
//!   number among equals. For renders of one seed that number is at most that of independent renders: Student's
//!   tail with `2 spp - 2` degrees of freedom. For independent seeds it is measured, by a second render of A with
//!   another seed: given A, that and B are exchangeable (McNemar 1947).
//!
//! Renders of one seed share their random numbers, so that what differs is the backends' own: far smaller biases show.

use super::diff::{self, Range};
use super::flip::DEFAULT_PPD;
use super::verdict::Verdict;
use crate::film::{Film, Pixel};
use crate::image_io::Image;
use serde::Serialize;
use std::collections::BTreeMap;

/// Differences up to this fraction of the brighter pixel are roundings.
pub const ROUNDING: f64 = 1e-5;

/// Edge of the blocks whose bias is looked at.
const BLOCK: usize = 16;

/// The probability, at most, with which a rule about bias fails equals.
const FALSE_ALARM: f64 = 1e-5;

/// Standard errors of the number of outliers.
const SIGMAS: f64 = 5.0;

/// Two pictures of one scene: numbers, maps and the verdict.
#[derive(Clone, Debug, Serialize)]
pub struct PictureDifference {
    /// How many pixels there are.
    pub pixels: u64,
    /// How many have the same bits in both.
    pub equal_pixels: u64,
    /// Root of the mean squared difference of the channels.
    pub rmse: f64,
    /// Greatest difference of a channel.
    pub max: f64,
    /// Mean of second minus first over the channels.
    pub mean: f64,
    /// Mean of LDR-FLIP.
    pub flip: f64,
    /// Pixels with `|z| > 3`.
    pub outliers: u64,
    /// Outliers that equals may have.
    pub outliers_allowed: f64,
    /// Greatest `|z|`.
    pub z_max: f64,
    /// `|T|` of the whole picture.
    pub bias: f64,
    /// What equals may have.
    pub bias_allowed: f64,
    /// The greatest `|T|` of a block.
    pub block_bias: f64,
    /// Column and row of that block's first pixel.
    pub block_at: [usize; 2],
    /// What equals may have.
    pub block_bias_allowed: f64,
    /// What the numbers come to.
    pub verdict: Verdict,
    /// Second minus first in luminance, row by row.
    #[serde(skip)]
    pub difference: Vec<f32>,
    /// The same in standard errors.
    #[serde(skip)]
    pub z: Vec<f32>,
}

/// Compares two films of the same size and number of samples.
///
/// `control` is what the first backend makes of another seed, where the two films were made with different seeds.
///
/// # Panics
/// If the sizes differ.
pub fn compare_pictures(first: &Film, second: &Film, control: Option<&Film>) -> PictureDifference {
    assert_eq!(first.rect, second.rect, "pictures of one scene have the same size");
    let width = first.rect.width() as usize;
    let pairs = || first.pixels.iter().zip(&second.pixels);
    let difference: Vec<f64> = pairs().map(|(a, b)| material_difference(a, b)).collect();
    let z: Vec<f64> = pairs().map(|(a, b)| z_score(a, b)).collect();

    let (outliers, outliers_allowed) = outliers(first, &z, control);
    let (block_at, block_bias, blocks) = worst_block(&difference, width);
    let [image_a, image_b] = [first, second].map(image);
    let numbers = diff::compare(&image_b, &image_a, Range::Ldr, DEFAULT_PPD);
    let (rmse, max, mean, flip) = numbers.map_or((0.0, 0.0, 0.0, 0.0), |d| (d.rmse, d.max, d.mean, d.flip));
    let mut found = PictureDifference {
        pixels: first.pixels.len() as u64,
        equal_pixels: pairs().filter(|(a, b)| a.sum == b.sum).count() as u64,
        rmse,
        max,
        mean,
        flip,
        outliers,
        outliers_allowed,
        z_max: z.iter().fold(0.0, |most, z| most.max(z.abs())),
        bias: bias(difference.iter().copied()),
        bias_allowed: bias_allowed(1),
        block_bias,
        block_at,
        block_bias_allowed: bias_allowed(blocks),
        verdict: Verdict::Identical,
        difference: pairs().map(|(a, b)| (luminance(b) - luminance(a)) as f32).collect(),
        z: z.iter().map(|&z| z as f32).collect(),
    };
    found.verdict = found.judge();
    found
}

impl PictureDifference {
    fn judge(&self) -> Verdict {
        if self.equal_pixels == self.pixels {
            Verdict::Identical
        } else if self.broken_rules().is_empty() {
            Verdict::StatisticallyEqual
        } else {
            Verdict::Differs
        }
    }

    /// The rules that the pictures break, a sentence each.
    pub fn broken_rules(&self) -> Vec<String> {
        let mut broken = vec![];
        if self.outliers as f64 > self.outliers_allowed {
            broken.push(format!(
                "{} of {} pixels differ by more than 3 standard errors; equals have at most {:.0}",
                self.outliers, self.pixels, self.outliers_allowed
            ));
        }
        if self.bias > self.bias_allowed {
            broken.push(format!(
                "the whole picture is biased: |T| = {:.1}, equals have at most {:.1}",
                self.bias, self.bias_allowed
            ));
        }
        if self.block_bias > self.block_bias_allowed {
            let [x, y] = self.block_at;
            broken.push(format!(
                "the pixels from column {x}, row {y} on are biased: |T| = {:.1}, equals have at most {:.1}",
                self.block_bias, self.block_bias_allowed
            ));
        }
        broken
    }
}

fn image(film: &Film) -> Image {
    Image::new(film.rect.width(), film.rect.height(), film.image())
}

/// Mean luminance of a pixel's samples.
fn luminance(pixel: &Pixel) -> f64 {
    let [r, g, b] = pixel.sum.map(|sum| sum.to_f64());
    (0.2126 * r + 0.7152 * g + 0.0722 * b) / f64::from(pixel.count.max(1))
}

fn rounding(a: f64, b: f64) -> f64 {
    ROUNDING * a.abs().max(b.abs())
}

/// Second minus first, zero where it may be a rounding.
fn material_difference(a: &Pixel, b: &Pixel) -> f64 {
    let (a, b) = (luminance(a), luminance(b));
    if (b - a).abs() <= rounding(a, b) { 0.0 } else { b - a }
}

/// The difference in standard errors, of which roundings are one part; zero for pixels of one sample, which tell
/// nothing of their noise.
fn z_score(a: &Pixel, b: &Pixel) -> f64 {
    if a.count < 2 || b.count < 2 {
        return 0.0;
    }
    let variance = a.variance_of_mean() + b.variance_of_mean();
    let (a, b) = (luminance(a), luminance(b));
    if a == b { 0.0 } else { (b - a) / (variance + rounding(a, b).powi(2)).sqrt() }
}

fn is_outlier(z: f64) -> bool {
    z.abs() > 3.0
}

/// How many there are and how many there may be.
fn outliers(first: &Film, z: &[f64], control: Option<&Film>) -> (u64, f64) {
    let found = z.iter().filter(|z| is_outlier(**z)).count();
    let allowed = match control {
        Some(control) => {
            let pairs = first.pixels.iter().zip(&control.pixels).map(|(a, b)| is_outlier(z_score(a, b)));
            let of_control: Vec<bool> = pairs.collect();
            let expected = of_control.iter().filter(|o| **o).count() as f64;
            let apart = of_control.iter().zip(z).filter(|(o, z)| **o != is_outlier(**z)).count() as f64;
            expected + SIGMAS * apart.sqrt()
        }
        None => {
            let spp = first.pixels.first().map_or(0, |pixel| pixel.count);
            let (n, p) = (z.len() as f64, student_tail(3.0, spp.saturating_sub(1)));
            n * p + SIGMAS * (n * p * (1.0 - p)).sqrt()
        }
    };
    (found as u64, allowed)
}

/// Probability of `|t| > x` for Student's t with `2 * half` degrees of freedom (Abramowitz and Stegun 1964, 26.7.4).
fn student_tail(x: f64, half: u32) -> f64 {
    let freedom = 2.0 * f64::from(half);
    let cos_squared = freedom / (freedom + x * x);
    let (mut sum, mut term) = (0.0, 1.0);
    for k in 1..=half {
        sum += term;
        term *= cos_squared * f64::from(2 * k - 1) / f64::from(2 * k);
    }
    1.0 - (1.0 - cos_squared).sqrt() * sum
}

/// `|sum d| / sqrt(sum d^2)`.
fn bias(differences: impl Iterator<Item = f64>) -> f64 {
    let (sum, squares) = differences.fold((0.0, 0.0), |(sum, squares), d| (sum + d, squares + d * d));
    if squares > 0.0 { f64::abs(sum) / f64::sqrt(squares) } else { 0.0 }
}

/// The x with `count * 2 exp(-x^2 / 2) = FALSE_ALARM`.
fn bias_allowed(count: usize) -> f64 {
    (2.0 * (2.0 * count.max(1) as f64 / FALSE_ALARM).ln()).sqrt()
}

/// First pixel and bias of the most biased block, and the number of blocks.
fn worst_block(difference: &[f64], width: usize) -> ([usize; 2], f64, usize) {
    let mut blocks: BTreeMap<(usize, usize), Vec<f64>> = BTreeMap::new();
    for (i, d) in difference.iter().enumerate() {
        blocks.entry((i / width / BLOCK, i % width / BLOCK)).or_default().push(*d);
    }
    let count = blocks.len();
    let biases = blocks.into_iter().map(|((y, x), d)| ([x * BLOCK, y * BLOCK], bias(d.into_iter())));
    let worst = biases.fold(([0, 0], 0.0), |worst, block| if block.1 > worst.1 { block } else { worst });
    (worst.0, worst.1, count)
}

#[cfg(test)]
#[path = "picture_tests.rs"]
mod tests;
