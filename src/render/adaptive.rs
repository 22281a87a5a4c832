//! Where samples are worth most: more of them where the picture is noisy, fewer where it is not.
//!
//! A pilot round, up to a quarter of all samples, is kept in two halves, and what these differ by is its error (which
//! counts the gain of well-spread samples, as a variance of single samples would not). From then on a pixel gets
//! samples in proportion to that error relative to its brightness, and never fewer than the pilot's: the division that
//! makes the mean squared relative error least, were there no bound.
//!
//! How many samples a pixel gets must not depend on what they were, or dark pixels that have missed a bright path would
//! be left alone: the picture would be too dark. So the pixels are coloured like a chessboard, and the number of
//! either colour's samples comes from the other colour's error, in blocks and their neighbours. Nothing is decided
//! later, so that each pixel's mean is that of a number of samples which its own samples had no part in (but for the
//! common factor that makes the total right, which is one number of the whole picture).

use super::decisions::Block;
use super::noise::block_of;
use super::split::SplitMap;
use super::{Picture, State, StopReason};
use crate::film::{Film, PixelRect};
use crate::integrator::{Tally, Work};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::atomic::Ordering;
use std::time::Instant;

/// What the pilot round found in a block of pixels, by the colour of the chessboard.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Found {
    /// Sum of the absolute error of the pilot's luminance: a rare bright path weighs less in it than in squares.
    error: [f64; 2],
    /// Sum of the luminance.
    luminance: [f64; 2],
    /// Pixels.
    pixels: [u32; 2],
}

/// Samples of each block's pixels at the end, by the colour of the chessboard.
pub(super) type Shares = BTreeMap<Block, [u32; 2]>;

/// Samples per pixel of the pilot round, of `count` in all; 0 where there are too few to share out.
fn pilot_samples(count: u32) -> u32 {
    if count < 8 { 0 } else { (count / 4).min(MOST_PILOT) & !1 }
}

/// More samples than these in a pilot round tell no more.
const MOST_PILOT: u32 = 64;

/// No pixel gets more samples than this many times their mean number.
const MOST_SHARE: u32 = 4;

/// Fraction of the picture's mean luminance that is added to a pixel's: an error below it is seen less and less.
const FLOOR: f64 = 0.1;

/// Steps in numbers of samples, since Sobol points come in fours; of one where there are fewer samples than
/// [`COARSE`].
const STEP: f64 = 4.0;
const COARSE: u32 = 32;

/// The colour of a pixel on the chessboard.
fn colour(&(x, y): &(u32, u32)) -> usize {
    (x + y) as usize & 1
}

/// Measures what two films of as many samples of the same pixels differ by.
fn measure(halves: &[Film; 2], pixels: &[(u32, u32)]) -> BTreeMap<Block, Found> {
    let mut blocks: BTreeMap<Block, Found> = BTreeMap::new();
    for pixel in pixels {
        let [a, b] =
            [0, 1].map(|half: usize| f64::from(halves[half].pixel(pixel.0, pixel.1).mean().luminance()));
        let (found, colour) = (blocks.entry(block_of(pixel)).or_default(), colour(pixel));
        found.error[colour] += 0.5 * (a - b).abs();
        found.luminance[colour] += 0.5 * (a + b);
        found.pixels[colour] += 1;
    }
    blocks
}

/// Shares `count` samples per pixel out, of which each has had `pilot`.
fn share_out(found: &BTreeMap<Block, Found>, pilot: u32, count: u32) -> Shares {
    let pixels: f64 = found.values().map(|f| f64::from(f.pixels[0] + f.pixels[1])).sum();
    let mean = found.values().map(|f| f.luminance[0] + f.luminance[1]).sum::<f64>() / pixels.max(1.0);
    let relative = |f: &Found, colour: usize| {
        let n = f64::from(f.pixels[colour].max(1));
        let luminance = f.luminance[colour] / n;
        let scale = luminance * luminance + (FLOOR * mean) * (FLOOR * mean);
        if scale > 0.0 { f.error[colour] / n / scale.sqrt() } else { 0.0 }
    };
    // Half by the block itself, half by all around it: a block that has missed what its neighbours found is like them.
    let wanted = |&(x, y): &Block, colour: usize| {
        let around = (-1..=1i64).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy))).filter_map(|(dx, dy)| {
            let block = (u32::try_from(i64::from(x) + dx).ok()?, u32::try_from(i64::from(y) + dy).ok()?);
            found.get(&block).map(|f| relative(f, colour))
        });
        let (sum, n) = around.fold((0.0, 0.0), |(sum, n), error| (sum + error, n + 1.0));
        0.5 * relative(&found[&(x, y)], colour) + 0.5 * sum / f64::max(n, 1.0)
    };
    let weights: Vec<([f64; 2], [u32; 2])> =
        found.iter().map(|(block, f)| ([1, 0].map(|other| wanted(block, other)), f.pixels)).collect();
    let factor = factor(&weights, pilot, count);
    let samples = |weight: f64| {
        let wanted = bounded(factor * weight, pilot, count);
        let step = if count < COARSE { 1.0 } else { STEP };
        pilot + (((wanted - f64::from(pilot)) / step).round() * step) as u32
    };
    found.keys().copied().zip(weights.iter().map(|(weight, _)| weight.map(samples))).collect()
}

fn bounded(samples: f64, pilot: u32, count: u32) -> f64 {
    samples.clamp(f64::from(pilot), f64::from(count) * f64::from(MOST_SHARE))
}

/// What to multiply the weights with, so that the bounded products use all samples; by bisection.
fn factor(weights: &[([f64; 2], [u32; 2])], pilot: u32, count: u32) -> f64 {
    let total = |factor: f64| -> f64 {
        let of = |(weight, pixels): &([f64; 2], [u32; 2])| {
            (0..2).map(|c| f64::from(pixels[c]) * bounded(factor * weight[c], pilot, count)).sum::<f64>()
        };
        weights.iter().map(of).sum()
    };
    let pixels: f64 = weights.iter().map(|(_, pixels)| f64::from(pixels[0] + pixels[1])).sum();
    let most = weights.iter().flat_map(|(weight, _)| *weight).fold(0.0, f64::max);
    if most == 0.0 {
        return 0.0;
    }
    let budget = pixels * f64::from(count);
    let (mut low, mut high) = (0.0, f64::from(count) * f64::from(MOST_SHARE) * 1e6 / most);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if total(middle) > budget { high = middle } else { low = middle }
    }
    low
}

/// How many samples a pixel is to have when a pixel of mean noise has `target` of `count`.
pub(super) fn target(shares: &Shares, pixel: &(u32, u32), pilot: u32, target: u32, count: u32) -> u32 {
    let (true, Some(share)) = (target > pilot, shares.get(&block_of(pixel))) else { return target };
    let more = u64::from(share[colour(pixel)] - pilot) * u64::from(target - pilot);
    pilot + (more / u64::from(count - pilot)) as u32
}

/// The most samples that all pixels together will have.
fn total(shares: &Shares, rect: PixelRect, count: u32) -> u64 {
    let pixels = (rect.y0..rect.y1).flat_map(|y| (rect.x0..rect.x1).map(move |x| (x, y)));
    pixels.map(|p| u64::from(shares.get(&block_of(&p)).map_or(count, |share| share[colour(&p)]))).sum()
}

impl Picture<'_> {
    /// Decides where the samples go, after `done` that others needed: the samples per pixel at which they part, or `None`
    /// where they stay even.
    pub(super) fn find_noise(
        &mut self,
        done: u32,
        count: u32,
        splits: &SplitMap,
    ) -> Result<Option<u32>, StopReason> {
        let pilot = pilot_samples(count - done);
        if !self.scene.settings.adaptive || pilot == 0 {
            return Ok(None);
        }
        let end = done + pilot;
        if self.state().decisions.shares.is_empty() {
            self.measure_noise(done, end, splits);
            if let Some(reason) = self.must_stop() {
                return Err(reason);
            }
            let decisions = &mut self.state().decisions;
            decisions.shares = share_out(&std::mem::take(&mut decisions.found), end, count);
        }
        let State { film, decisions, .. } = self.state();
        self.total = total(&decisions.shares, film.rect, count);
        Ok(Some(end))
    }

    /// Takes the samples from `done` to `end` of every pixel, in two halves, and measures what they differ by.
    ///
    /// A tile that is interrupted is left as it was: what is measured must be all of it.
    fn measure_noise(&self, done: u32, end: u32, splits: &SplitMap) {
        let middle = done + (end - done) / 2;
        self.each_tile(|number, tile, scratch| {
            let started = Instant::now();
            let pixels = {
                let found = &self.lock().decisions.found;
                tile.active.iter().filter(|p| !found.contains_key(&block_of(p))).copied().collect::<Vec<_>>()
            };
            if pixels.is_empty() || self.must_stop().is_some() {
                return;
            }
            let mut tally = Tally::default();
            let halves = [done..middle, middle..end].map(|samples| {
                let samples = self.samples.start + samples.start..self.samples.start + samples.end;
                let work = Work { pixels: &pixels, samples, split: splits.of_tile(number) };
                let (mut film, mut counted) = (self.film(tile.rect), Tally::default());
                self.integrator.render(&mut film, &work, scratch, &mut counted, self.stop);
                film.dropped = counted.dropped;
                tally.merge(&counted);
                film
            });
            if !self.stop.load(Ordering::Relaxed) {
                let found = measure(&halves, &pixels);
                self.take(&halves, &tally, started, |decisions| decisions.found.extend(found));
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Blocks of 8 x 8 pixels in a row, each of one error and luminance 1.
    fn row(errors: &[f64]) -> BTreeMap<Block, Found> {
        let found = |e: &f64| Found { error: [32.0 * e; 2], luminance: [32.0; 2], pixels: [32; 2] };
        (0..).map(|x| (x, 0)).zip(errors.iter().map(found)).collect()
    }

    #[test]
    fn samples_are_shared_out_by_error_within_bounds_and_in_whole() {
        let all = |n: usize, e: f64| vec![e; n];
        let errors = [all(20, 0.0), all(20, 1.0), all(20, 3.0)].concat();
        let shares = share_out(&row(&errors), 16, 64);
        let total: u32 = shares.values().map(|share| share[0] + share[1]).sum();
        assert!((f64::from(total) / 120.0 - 64.0).abs() < 1.0, "{total}");
        assert_eq!(shares[&(3, 0)], [16, 16]);
        let [one, three] = [shares[&(30, 0)][0], shares[&(50, 0)][0]];
        assert!((f64::from(three) / f64::from(one) - 3.0).abs() < 0.3, "{one} {three}");
        // What one block alone has is bounded, and its neighbours take part.
        let mut lonely = all(60, 0.0);
        lonely[30] = 1.0;
        let shares = share_out(&row(&lonely), 16, 64);
        assert_eq!((shares[&(30, 0)], shares[&(33, 0)]), ([256; 2], [16; 2]));
        assert!(shares[&(31, 0)][0] > 100);
    }

    #[test]
    fn the_number_of_a_pixels_samples_is_the_business_of_the_other_colour() {
        let mut found = row(&[1.0; 9]);
        let even = share_out(&found, 16, 64);
        found.get_mut(&(4, 0)).expect("there are nine").error[0] *= 9.0;
        let uneven = share_out(&found, 16, 64);
        assert!(uneven[&(4, 0)][1] > even[&(4, 0)][1]);
        // The rest pays for it alike.
        assert_eq!(uneven[&(4, 0)][0], uneven[&(8, 0)][0]);
    }

    #[test]
    fn targets_grow_to_the_share() {
        let shares = share_out(&row(&[1.0, 1.0, 0.0, 0.0]), 16, 64);
        for pixel in [(1, 1), (30, 2)] {
            let share = shares[&block_of(&pixel)][colour(&pixel)];
            assert_eq!(target(&shares, &pixel, 16, 8, 64), 8);
            assert_eq!(target(&shares, &pixel, 16, 16, 64), 16);
            assert_eq!(target(&shares, &pixel, 16, 64, 64), share);
            let middle = target(&shares, &pixel, 16, 40, 64);
            assert_eq!(middle, 16 + (share - 16) / 2);
        }
    }
}
