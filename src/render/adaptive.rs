//! Where samples are worth most: more of them where the picture is noisy, fewer where it is not.
//!
//! A pilot round is kept in two halves, and what these differ by is its error (which counts the gain of well-spread
//! samples, as a variance of single samples would not). From then on blocks of pixels are brought, each from one number
//! of samples to the next, in the order of what their squared error falls by for what the samples cost, until all
//! samples are used. The numbers are powers of two, at which Sobol points are spread best, and later the middles between
//! them. This order does not depend on how many samples there are: a picture of more has at least as many at each
//! pixel, so that a finished picture can grow.
//!
//! The error is that of the luminance by the square root of the brightness, half way between the absolute error (by
//! which bright parts would get all) and the relative one (by which dark parts would). No pixel is left with less than
//! the pilot's samples, half of all: where the picture is smooth its error falls faster than the pilot can tell, and a
//! picture of half the samples there is one of several times the error.
//!
//! How many samples a pixel gets must not depend on what they were, or dark pixels that have missed a bright path would
//! be left alone: the picture would be too dark. So the pixels are coloured like a chessboard, and the number of
//! either colour's samples comes from the other colour's error, in blocks and their neighbours. Nothing is decided
//! later, so that each pixel's mean is that of a number of samples which its own samples had no part in (but for the
//! place in the order at which the samples are used up, which is one number of the whole picture).

use super::decisions::Block;
use super::noise::block_of;
use super::split::SplitMap;
use super::{Picture, StopReason};
use crate::film::{Film, PixelRect};
use crate::integrator::{RayClass, Tally, Work};
use serde::{Deserialize, Serialize};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};
use std::sync::atomic::Ordering;
use std::time::Instant;

/// What the pilot round found in a block of pixels, by the colour of the chessboard.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Found {
    /// Sum over the pixels of the absolute error of the pilot's luminance: a rare bright path weighs less in it than in
    /// squares.
    error: [f64; 2],
    /// Sum of the luminance.
    luminance: [f64; 2],
    /// Pixels.
    pixels: [u32; 2],
    /// What a camera sample costs in the block's tile, in rays beyond the camera's own.
    cost: f64,
}

/// Samples of each block's pixels, by the colour of the chessboard.
pub(super) type Shares = BTreeMap<Block, [u32; 2]>;

/// Samples per pixel of the pilot round, of `count` in all; 0 where there are too few to share out.
///
/// It is the same for all counts from [`GROWS_FROM`] on.
fn pilot_samples(count: u32) -> u32 {
    match count {
        0..16 => 0,
        16..GROWS_FROM => 8,
        GROWS_FROM.. => 16,
    }
}

/// From so many samples per pixel on, a picture whose samples are shared out can get more.
pub const GROWS_FROM: u32 = 32;

/// An error that is more than this many times the picture's mean error counts as so many times: one block cannot take
/// all samples.
const MOST_ERROR: f64 = 8.0;

/// Fraction of the picture's mean luminance that is added to a pixel's: an error below it is seen less and less.
const FLOOR: f64 = 0.1;

/// A camera ray's cost by that of a ray that leaves a surface, which is less coherent and brings shading with it.
const CAMERA_RAY: f64 = 0.5;

/// Up to this number of samples it grows in powers of two.
const COARSE: u32 = 32;

/// The colour of a pixel on the chessboard.
fn colour(&(x, y): &(u32, u32)) -> usize {
    (x + y) as usize & 1
}

/// Measures what two films of as many samples of the same pixels differ by.
fn measure(halves: &[Film; 2], pixels: &[(u32, u32)], tally: &Tally) -> BTreeMap<Block, Found> {
    let camera = tally.class(RayClass::Primary).rays as f64;
    let cost = (tally.all_rays().rays as f64 - (1.0 - CAMERA_RAY) * camera) / tally.samples.max(1) as f64;
    let mut blocks: BTreeMap<Block, Found> = BTreeMap::new();
    for pixel in pixels {
        let [a, b] =
            [0, 1].map(|half: usize| f64::from(halves[half].pixel(pixel.0, pixel.1).mean().luminance()));
        let (found, colour) = (blocks.entry(block_of(pixel)).or_default(), colour(pixel));
        found.error[colour] += 0.5 * (a - b).abs();
        found.luminance[colour] += 0.5 * (a + b);
        found.pixels[colour] += 1;
        found.cost = cost;
    }
    blocks
}

/// How much a block's pixels of one colour want samples.
#[derive(Clone, Copy, Debug)]
struct Want {
    /// Their error by the square roots of brightness and cost: samples in proportion to it make the sum of squared
    /// errors least.
    error: f64,
    pixels: u32,
}

impl Want {
    /// What the squared error falls by, for its cost, from `n` to `more` samples: `(1/n - 1/more) / (more - n)` of it.
    fn worth(&self, n: u32, more: u32) -> f64 {
        self.error * self.error / (f64::from(n) * f64::from(more))
    }
}

/// What each block wants, by the colour of the chessboard.
fn wants(found: &BTreeMap<Block, Found>) -> Vec<[Want; 2]> {
    let pixels: f64 = found.values().map(|f| f64::from(f.pixels[0] + f.pixels[1])).sum();
    let mean = found.values().map(|f| f.luminance[0] + f.luminance[1]).sum::<f64>() / pixels.max(1.0);
    let scaled = |f: &Found, colour: usize| {
        let n = f64::from(f.pixels[colour].max(1));
        let scale = (f.luminance[colour] / n).hypot(FLOOR * mean);
        if scale > 0.0 { f.error[colour] / n / scale.sqrt() } else { 0.0 }
    };
    // Half by the block itself, half by all around it: a block that has missed what its neighbours found is like them.
    let wanted = |block: &Block, own: &Found, colour: usize| {
        let around = around(found, *block);
        let sum: f64 = around.iter().map(|f| scaled(f, colour)).sum();
        0.5 * (scaled(own, colour) + sum / around.len() as f64) / own.cost.max(CAMERA_RAY).sqrt()
    };
    let mut wants: Vec<[Want; 2]> = found
        .iter()
        .map(|(block, own)| {
            [1, 0].map(|other| Want { error: wanted(block, own, other), pixels: own.pixels[1 - other] })
        })
        .collect();
    let sum: f64 = wants.iter().flatten().map(|want| want.error * f64::from(want.pixels)).sum();
    let most = MOST_ERROR * sum / pixels.max(1.0);
    wants.iter_mut().flatten().for_each(|want| want.error = want.error.min(most));
    wants
}

/// A block and its neighbours.
fn around(found: &BTreeMap<Block, Found>, (x, y): Block) -> Vec<&Found> {
    let near = |c: u32| c.saturating_sub(1)..=c.saturating_add(1);
    near(y).flat_map(|y| near(x).map(move |x| (x, y))).filter_map(|block| found.get(&block)).collect()
}

/// The next number of samples after `n`.
fn next_step(n: u32) -> u32 {
    let power = (n + 1).next_power_of_two();
    let middle = power / 4 * 3;
    if n >= COARSE && n < middle { middle } else { power }
}

/// Shares `count` samples per pixel out, of which each has had `start`.
fn share_out(found: &BTreeMap<Block, Found>, start: u32, count: u32) -> Shares {
    let wants = wants(found);
    let mut shares = vec![[start; 2]; wants.len()];
    let pixels: u64 = wants.iter().flatten().map(|want| u64::from(want.pixels)).sum();
    let mut left = pixels * u64::from(count.saturating_sub(start));
    // No worth is negative, and the bits of such numbers are in their order; of equal ones the first goes first.
    let entry = |block: usize, colour: usize, n: u32| {
        (wants[block][colour].worth(n, next_step(n)).to_bits(), Reverse((block, colour)))
    };
    let all = (0..wants.len()).flat_map(|block| [0, 1].map(|colour| entry(block, colour, start)));
    let mut queue: BinaryHeap<_> = all.filter(|(worth, _)| *worth > 0).collect();
    while let Some((_, Reverse((block, colour)))) = queue.pop() {
        let n = &mut shares[block][colour];
        let more = next_step(*n);
        let cost = u64::from(more - *n) * u64::from(wants[block][colour].pixels);
        if cost > left {
            break;
        }
        left -= cost;
        *n = more;
        queue.push(entry(block, colour, more));
    }
    found.keys().copied().zip(shares).collect()
}

/// How many samples a pixel is to have, if they are shared out so.
pub(super) fn share(shares: &Shares, pixel: &(u32, u32)) -> Option<u32> {
    shares.get(&block_of(pixel)).map(|share| share[colour(pixel)])
}

/// The samples that all pixels together will have.
fn total(shares: &Shares, rect: PixelRect, count: u32) -> u64 {
    let pixels = (rect.y0..rect.y1).flat_map(|y| (rect.x0..rect.x1).map(move |x| (x, y)));
    pixels.map(|p| u64::from(share(shares, &p).unwrap_or(count))).sum()
}

impl Picture<'_> {
    /// Finds out where the picture is noisy, after `done` samples that others needed: the samples per pixel from which
    /// on they are shared out, or `None` where they stay even.
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
        self.measure_noise(done, end, splits);
        if let Some(reason) = self.must_stop() {
            return Err(reason);
        }
        let shares = self.shares(end, count);
        self.total = total(&shares, self.state().film.rect, count);
        Ok(Some(end))
    }

    /// How `count` samples per pixel are shared out, of which each has had `start`.
    pub(super) fn shares(&mut self, start: u32, count: u32) -> Shares {
        share_out(&self.state().decisions.found, start, count)
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
                let found = measure(&halves, &pixels, &tally);
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
        let found =
            |e: &f64| Found { error: [32.0 * e; 2], luminance: [32.0; 2], pixels: [32; 2], cost: 1.0 };
        (0..).map(|x| (x, 0)).zip(errors.iter().map(found)).collect()
    }

    fn all(n: usize, e: f64) -> Vec<f64> {
        vec![e; n]
    }

    fn mean(shares: &Shares) -> f64 {
        let total: u32 = shares.values().map(|share| share[0] + share[1]).sum();
        f64::from(total) / (2 * shares.len()) as f64
    }

    #[test]
    fn samples_are_shared_out_by_error_and_in_whole() {
        let errors = [all(20, 0.0), all(20, 1.0), all(20, 4.0)].concat();
        let shares = share_out(&row(&errors), 16, 64);
        assert!((62.0..=64.0).contains(&mean(&shares)), "{}", mean(&shares));
        assert_eq!(shares[&(3, 0)], [16; 2]);
        // In proportion to the error, but for the steps.
        let [one, four] = [30, 50].map(|x| f64::from(shares[&(x, 0)][0]));
        assert!((2.5..=6.0).contains(&(four / one)), "{one} {four}");
        // Neighbours take part.
        let mut lonely = all(60, 0.1);
        lonely[30] = 4.0;
        let shares = share_out(&row(&lonely), 16, 64);
        assert!(shares[&(31, 0)][0] > shares[&(40, 0)][0] && shares[&(30, 0)][0] > 64, "{shares:?}");
    }

    #[test]
    fn even_noise_stays_even_and_none_gets_no_more() {
        for count in [16, 32, 48, 64, 96] {
            let nearly: Vec<f64> = (0..100).map(|i| 1.0 + 0.001 * f64::from(i)).collect();
            assert!(share_out(&row(&nearly), 8, count).values().all(|share| *share == [count; 2]), "{count}");
        }
        assert!(share_out(&row(&all(9, 0.0)), 8, 64).values().all(|share| *share == [8; 2]));
    }

    #[test]
    fn what_costs_more_gets_less() {
        let mut found = row(&all(40, 1.0));
        found.values_mut().take(20).for_each(|f| f.cost = 16.0);
        let shares = share_out(&found, 8, 64);
        let [dear, cheap] = [5, 35].map(|x| f64::from(shares[&(x, 0)][0]));
        assert!((2.5..=6.0).contains(&(cheap / dear)), "{dear} {cheap}");
    }

    #[test]
    fn the_number_of_a_pixels_samples_is_the_business_of_the_other_colour() {
        let mut found = row(&all(9, 1.0));
        let even = share_out(&found, 16, 64);
        found.get_mut(&(4, 0)).expect("there are nine").error[0] *= 9.0;
        let uneven = share_out(&found, 16, 64);
        assert!(uneven[&(4, 0)][1] > even[&(4, 0)][1]);
        // Those of the colour that differs pay for it like those far away.
        assert_eq!(uneven[&(4, 0)][0], uneven[&(8, 0)][0]);
    }

    #[test]
    fn more_samples_leave_no_block_with_fewer() {
        let errors: Vec<f64> = (0..200u32).map(|i| f64::from(i * 7919 % 101).powi(3) / 1e4).collect();
        let counts = [16, 17, 32, 50, 64, 100, 128, 1000];
        let shares = counts.map(|count| share_out(&row(&errors), 16, count));
        for (fewer, more) in shares.iter().zip(&shares[1..]) {
            assert!(fewer.iter().all(|(block, n)| n[0] <= more[block][0] && n[1] <= more[block][1]));
        }
        for (shares, count) in shares.iter().zip(counts).skip(2) {
            assert!((0.97..=1.0).contains(&(mean(shares) / f64::from(count))), "{count}: {}", mean(shares));
        }
    }
}
