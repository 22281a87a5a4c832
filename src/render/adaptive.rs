//! Where samples are worth most: more of them where the picture is noisy, fewer where it is not.
//!
//! The first samples of every pixel are kept in two halves, and what these differ by is their error (which counts the gain
//! of well-spread samples, as a variance of single samples would not). From then on blocks of pixels are brought, each
//! from one number of samples to the next, in the order of what their squared error falls by for what the samples cost,
//! until all samples are used. The numbers are powers of two, at which Sobol points are spread best, and later the middles
//! between them. This order does not depend on how many samples there are: a picture of more has at least as many at
//! each pixel, so that a finished picture can grow.
//!
//! The error is that of the luminance by the square root of the brightness, half way between the absolute error (by
//! which bright parts would get all) and the relative one (by which dark parts would). It is never taken for less than
//! half of the picture's mean: where the picture is smooth its error falls faster than the first samples tell, and what
//! they have missed must not be left alone.
//!
//! How many samples a pixel gets must not depend on what they were, or dark pixels that have missed a bright path would
//! be left alone: the picture would be too dark. So the pixels are coloured like a chessboard, and the number of
//! either colour's samples comes from the other colour's error, in blocks and their neighbours. Either has samples of its own
//! to share out: of one store, a colour with a rare bright path would get less, and keep that path's weight. Nothing is
//! decided later, so that each pixel's mean is that of a number of samples which its own samples had no part in.

use super::cost::cost;
use super::decisions::Block;
use super::tile::{Lack, Tile};
use super::{Picture, RenderOptions, StopReason};
use crate::film::{Film, PixelRect};
use crate::integrator::{Scratch, Tally};
use crate::scene::Settings;
use crate::scene::settings::EVEN_SAMPLES;
use serde::{Deserialize, Serialize};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};
use std::sync::atomic::Ordering;
use std::time::Instant;

/// What the first samples have found in a block of pixels, by the colour of the chessboard.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Found {
    /// Sum over the pixels of the absolute error of their luminance: a rare bright path weighs less in it than in squares.
    error: [f32; 2],
    /// Sum of the luminance.
    luminance: [f32; 2],
    /// Pixels.
    pixels: [u32; 2],
    /// What a camera sample costs in the block's tile, in rays that leave surfaces.
    cost: f32,
}

/// Samples of each block's pixels, by the colour of the chessboard.
pub(super) type Shares = BTreeMap<Block, [u32; 2]>;

/// Samples in each of the two halves that every pixel has; those beyond are shared out.
const HALF: u32 = EVEN_SAMPLES / 2;

/// Edge of the blocks of pixels that get equal numbers of samples: as small as an edge that makes noise needs it, as large as
/// a tolerable estimate of the noise needs it.
const BLOCK: u32 = 4;

/// An error that is more than this many times the picture's mean error counts as so many times: one block cannot take
/// all samples.
const MOST_ERROR: f64 = 8.0;

/// One that is less than this many times the mean counts as so many times.
const LEAST_ERROR: f64 = 0.5;

/// What a block's own error weighs beside the mean of it and its neighbours: the few pixels of a block know little.
const OWN: f64 = 0.25;

/// Fraction of the picture's mean luminance that is added to a pixel's: an error below it is seen less and less.
const FLOOR: f64 = 0.1;

/// Up to this number of samples it grows in powers of two.
const COARSE: u32 = 32;

fn block_of(&(x, y): &(u32, u32)) -> Block {
    (x / BLOCK, y / BLOCK)
}

/// The colour of a pixel on the chessboard.
fn colour(&(x, y): &(u32, u32)) -> usize {
    (x + y) as usize & 1
}

/// Whether samples are shared out by noise, where there are `count` per pixel; a threshold says by itself where they go.
pub(super) fn shares_out(settings: &Settings, options: &RenderOptions<'_>, count: u32) -> bool {
    settings.shares_out(count) && options.noise.is_none()
}

/// Whether a picture of these settings can get more samples per pixel: not where all its numbers are others then, and not
/// when the second half has only begun, since the first is no longer told from it.
pub fn can_grow(settings: &Settings) -> bool {
    let is_between = settings.spp > HALF && settings.spp < 2 * HALF;
    settings.sampler.is_sequence() && !(settings.adaptive && is_between)
}

/// Measures what two films of as many samples of the same pixels differ by.
fn measure(halves: [&Film; 2], pixels: &[(u32, u32)], tally: &Tally) -> BTreeMap<Block, Found> {
    let cost = cost(tally) / (tally.samples as f64).max(1.0);
    let mut blocks: BTreeMap<Block, Found> = BTreeMap::new();
    for pixel in pixels {
        let [a, b] = [0, 1].map(|half: usize| halves[half].pixel(pixel.0, pixel.1).mean().luminance());
        let (found, colour) = (blocks.entry(block_of(pixel)).or_default(), colour(pixel));
        found.error[colour] += 0.5 * (a - b).abs();
        found.luminance[colour] += 0.5 * (a + b);
        found.pixels[colour] += 1;
        found.cost = cost as f32;
    }
    blocks
}

fn pixels_of(rect: PixelRect) -> impl Iterator<Item = (u32, u32)> {
    (rect.y0..rect.y1).flat_map(move |y| (rect.x0..rect.x1).map(move |x| (x, y)))
}

/// How much the pixels of a block want samples.
#[derive(Clone, Copy, Debug)]
struct Want {
    /// Their error by the square roots of brightness and cost: samples in proportion to its 0.8th power make the sum of
    /// squared errors least, as these [fall](Self::worth).
    error: f64,
    pixels: u32,
}

impl Want {
    /// What the squared error falls by, for its cost, from `n` to `more` samples.
    ///
    /// Of well-spread samples it goes with the power -1.5 of their number: between that of independent ones, -1, and that of
    /// what is smooth. The root is the same on every machine, which a power is not.
    fn worth(&self, n: u32, more: u32) -> f64 {
        let left = |n: u32| (f64::from(n) * f64::from(n).sqrt()).recip();
        self.error * self.error * (left(n) - left(more)) / f64::from(more - n)
    }
}

/// What each block's pixels of a colour of the chessboard want, by what those of the other colour have found.
fn wants(found: &BTreeMap<Block, Found>, colour: usize) -> Vec<Want> {
    let other = 1 - colour;
    let sum = |of: &dyn Fn(&Found) -> f64| -> f64 { found.values().map(of).sum() };
    let luminance = sum(&|f| f64::from(f.luminance[other])) / sum(&|f| f64::from(f.pixels[other])).max(1.0);
    let scaled = |f: &Found| {
        let n = f64::from(f.pixels[other].max(1));
        let scale = (f64::from(f.luminance[other]) / n).hypot(FLOOR * luminance);
        if scale > 0.0 { f64::from(f.error[other]) / n / scale.sqrt() } else { 0.0 }
    };
    // By the block itself for a part, by all around it for the rest: a block that has missed what its neighbours found is
    // like them.
    let wanted = |block: &Block, own: &Found| {
        let around = around(found, *block);
        let sum: f64 = around.iter().map(|f| scaled(f)).sum();
        (OWN * scaled(own) + (1.0 - OWN) * sum / around.len() as f64) / f64::from(own.cost).sqrt()
    };
    let want =
        |(block, own): (&Block, &Found)| Want { error: wanted(block, own), pixels: own.pixels[colour] };
    let mut wants: Vec<Want> = found.iter().map(want).collect();
    let total: f64 = wants.iter().map(|want| want.error * f64::from(want.pixels)).sum();
    let mean = total / sum(&|f| f64::from(f.pixels[colour])).max(1.0);
    // Where there is no noise at all, all are alike.
    let mean = if mean > 0.0 { mean } else { 1.0 };
    wants.iter_mut().for_each(|want| want.error = want.error.clamp(LEAST_ERROR * mean, MOST_ERROR * mean));
    wants
}

/// A block and its neighbours.
fn around(found: &BTreeMap<Block, Found>, (x, y): Block) -> Vec<&Found> {
    let near = |c: u32| c.saturating_sub(1)..=c.saturating_add(1);
    near(y).flat_map(|y| near(x).map(move |x| (x, y))).filter_map(|block| found.get(&block)).collect()
}

/// The next number of samples after `n`.
fn next_step(n: u32) -> u32 {
    let power = n.saturating_add(1).checked_next_power_of_two().unwrap_or(u32::MAX);
    let middle = power / 4 * 3;
    if n >= COARSE && n < middle { middle } else { power }
}

/// Shares `count` samples per pixel out, of which each has had `start`.
fn share_out(found: &BTreeMap<Block, Found>, start: u32, count: u32) -> Shares {
    let [even, odd] = [0, 1].map(|colour| share_out_to(&wants(found, colour), start, count));
    let shares = even.into_iter().zip(odd).map(<[u32; 2]>::from);
    found.keys().copied().zip(shares).collect()
}

/// The same to blocks of one colour's pixels.
fn share_out_to(wants: &[Want], start: u32, count: u32) -> Vec<u32> {
    let mut shares = vec![start; wants.len()];
    let pixels: u64 = wants.iter().map(|want| u64::from(want.pixels)).sum();
    let mut left = pixels * u64::from(count.saturating_sub(start));
    // No worth is negative, and the bits of such numbers are in their order; of equal ones the first goes first.
    let entry = |block: usize, n: u32| (wants[block].worth(n, next_step(n)).to_bits(), Reverse(block));
    let all = (0..wants.len()).filter(|block| wants[*block].pixels > 0).map(|block| entry(block, start));
    let mut queue: BinaryHeap<_> = all.filter(|(worth, _)| *worth > 0).collect();
    while let Some((_, Reverse(block))) = queue.pop() {
        let n = &mut shares[block];
        let more = next_step(*n);
        let pixels_of_one = u64::from(wants[block].pixels);
        let cost = u64::from(more - *n) * pixels_of_one;
        if cost > left {
            // What is left is not enough for the step, but for a part of it.
            *n += (left / pixels_of_one) as u32;
            break;
        }
        left -= cost;
        *n = more;
        if more < u32::MAX {
            queue.push(entry(block, more));
        }
    }
    shares
}

/// How many samples a pixel is to have, if they are shared out so.
pub(super) fn share(shares: &Shares, pixel: &(u32, u32)) -> Option<u32> {
    shares.get(&block_of(pixel)).map(|share| share[colour(pixel)])
}

/// The samples that all pixels together will have.
fn total(shares: &Shares, rect: PixelRect, count: u32) -> u64 {
    pixels_of(rect).map(|p| u64::from(share(shares, &p).unwrap_or(count))).sum()
}

impl Picture<'_> {
    /// Finds out where the picture is noisy, by the first samples: the samples per pixel from which on they are shared out,
    /// or `None` where all of `count` are even.
    pub(super) fn find_noise(&mut self, count: u32) -> Result<Option<u32>, StopReason> {
        if !shares_out(&self.scene.settings, self.options, count) {
            return Ok(None);
        }
        self.each_tile(|_, tile, scratch| self.measure_noise(tile, scratch));
        if let Some(reason) = self.must_stop() {
            return Err(reason);
        }
        let shares = self.shares(EVEN_SAMPLES, count);
        self.total = total(&shares, self.state().film.rect, count);
        Ok(Some(EVEN_SAMPLES))
    }

    /// How `count` samples per pixel are shared out, of which each has had `start`.
    pub(super) fn shares(&mut self, start: u32, count: u32) -> Shares {
        share_out(&self.state().decisions.found, start, count)
    }

    /// Brings every pixel of a tile to two halves of samples, and measures what these differ by.
    ///
    /// A tile that is interrupted is left as it was: what is measured must be all of it.
    fn measure_noise(&self, tile: &Tile, scratch: &mut Scratch) {
        let started = Instant::now();
        let Some(any) = tile.active.first() else { return };
        let (mut half, lacking) = {
            let state = self.lock();
            if state.decisions.found.contains_key(&block_of(any)) {
                return;
            }
            (part(&state.film, tile.rect), tile.pixels_by_lack(&state.film, |_| HALF))
        };
        if self.must_stop().is_some() {
            return;
        }
        let (mut first, mut second) = (self.film(tile.rect), self.film(tile.rect));
        let mut tally = Tally::default();
        for (lack, pixels) in lacking {
            tally.merge(&self.take_samples(&mut first, &pixels, lack, scratch));
        }
        // The cost is that of the second half: of the first, an earlier render may have taken a part.
        let lack = Lack { count: HALF, target: EVEN_SAMPLES };
        let counted = self.take_samples(&mut second, &tile.active, lack, scratch);
        if !self.stop.load(Ordering::Relaxed) {
            half.merge(&first);
            let found = measure([&half, &second], &tile.active, &counted);
            tally.merge(&counted);
            self.take(&[first, second], &tally, started, |decisions| decisions.found.extend(found));
        }
    }
}

/// A copy of what a film holds of a part of its picture.
fn part(film: &Film, rect: PixelRect) -> Film {
    let pixels = pixels_of(rect).map(|(x, y)| *film.pixel(x, y)).collect();
    Film { pixels, ..Film::new(film.resolution, rect) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Blocks of 4 x 4 pixels in a row, each of one error and luminance 1.
    fn row(errors: &[f32]) -> BTreeMap<Block, Found> {
        let found = |e: &f32| Found { error: [8.0 * e; 2], luminance: [8.0; 2], pixels: [8; 2], cost: 1.0 };
        (0..).map(|x| (x, 0)).zip(errors.iter().map(found)).collect()
    }

    fn all(n: usize, e: f32) -> Vec<f32> {
        vec![e; n]
    }

    fn mean(shares: &Shares) -> f64 {
        let total: u32 = shares.values().map(|share| share[0] + share[1]).sum();
        f64::from(total) / (2 * shares.len()) as f64
    }

    #[test]
    fn samples_are_shared_out_by_error_and_in_whole() {
        let errors = [all(20, 0.0), all(20, 1.0), all(20, 4.0)].concat();
        let shares = share_out(&row(&errors), 16, 256);
        assert!((250.0..=256.0).contains(&mean(&shares)), "{}", mean(&shares));
        // In proportion to the error's 0.8th power, but for the steps and for what is less than half of the mean.
        let [none, one, four] = [3, 30, 50].map(|x| f64::from(shares[&(x, 0)][0]));
        assert!((3.0..=6.0).contains(&(four / one)), "{one} {four}");
        assert!((0.6..=1.0).contains(&(none / one)), "{none} {one}");
        // Neighbours take part.
        let mut lonely = all(60, 0.1);
        lonely[30] = 4.0;
        let shares = share_out(&row(&lonely), 16, 64);
        assert!(shares[&(31, 0)][0] > shares[&(40, 0)][0] && shares[&(30, 0)][0] > 64, "{shares:?}");
    }

    #[test]
    fn even_noise_stays_even_and_none_gets_no_more() {
        for count in [16, 32, 48, 64, 96] {
            let nearly: Vec<f32> = (0..100u8).map(|i| 1.0 + 0.001 * f32::from(i)).collect();
            assert!(
                share_out(&row(&nearly), 16, count).values().all(|share| *share == [count; 2]),
                "{count}"
            );
        }
        assert!(share_out(&row(&all(9, 0.0)), 16, 64).values().all(|share| *share == [64; 2]));
    }

    #[test]
    fn what_costs_more_gets_less() {
        let mut found = row(&all(40, 1.0));
        found.values_mut().take(20).for_each(|f| f.cost = 4.0);
        let shares = share_out(&found, 16, 128);
        let [dear, cheap] = [5, 35].map(|x| f64::from(shares[&(x, 0)][0]));
        assert!((1.3..=3.0).contains(&(cheap / dear)), "{dear} {cheap}");
    }

    #[test]
    fn no_block_is_left_behind() {
        // However much noise there is elsewhere, a third of the mean is everyone's.
        for noisy in [1, 10, 100] {
            let errors = [all(noisy, 1000.0), all(200, 0.0)].concat();
            for count in [32, 64, 256, 1000] {
                let least = share_out(&row(&errors), 16, count).values().flatten().copied().min().unwrap();
                assert!(least >= count / 4, "{noisy} {count}: {least}");
            }
        }
    }

    #[test]
    fn the_number_of_a_pixels_samples_is_the_business_of_the_other_colour_alone() {
        // In a picture of one block as in one of nine.
        for blocks in [1, 2, 9] {
            let mut found = row(&all(blocks, 1.0));
            let even = share_out(&found, 16, 64);
            let first = found.get_mut(&(0, 0)).expect("there is one at least");
            (first.error[0], first.luminance[0]) = (9.0 * first.error[0], 3.0 * first.luminance[0]);
            let uneven = share_out(&found, 16, 64);
            let of =
                |shares: &Shares, colour: usize| -> Vec<u32> { shares.values().map(|n| n[colour]).collect() };
            assert_eq!(of(&uneven, 0), of(&even, 0), "{blocks} blocks");
            if blocks == 9 {
                assert!(uneven[&(0, 0)][1] > even[&(0, 0)][1] && uneven[&(8, 0)][1] < even[&(8, 0)][1]);
            }
        }
    }

    #[test]
    fn more_samples_leave_no_block_with_fewer() {
        let errors: Vec<f32> = (0..200u32).map(|i| (i * 7919 % 101).pow(3) as f32 / 1e4).collect();
        let counts = [17, 32, 50, 64, 100, 128, 1000];
        let shares = counts.map(|count| share_out(&row(&errors), 16, count));
        for (fewer, more) in shares.iter().zip(&shares[1..]) {
            assert!(fewer.iter().all(|(block, n)| n[0] <= more[block][0] && n[1] <= more[block][1]));
        }
        for (shares, count) in shares.iter().zip(counts).skip(1) {
            assert!((0.97..=1.0).contains(&(mean(shares) / f64::from(count))), "{count}: {}", mean(shares));
        }
    }
}
