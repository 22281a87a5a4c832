//! Which point of one long sequence is a pixel's sample, so that the errors of neighbours differ.
//!
//! All pixels share one scrambled Sobol sequence. Along a Z-order curve each block of `4^k` pixels takes a run of it, and
//! within a run the parts come in an order of the block's own: what one pixel gets too much of, its neighbours get too
//! little of. The error is as large as that of pixels with sequences of their own, but less of it is in low spatial
//! frequencies, where an eye or a filter cannot remove it.
//!
//! Source: Ahmed and Wonka 2020, *Screen-Space Blue-Noise Diffusion of Monte Carlo Sampling Error via Hierarchical
//! Ordering of Pixels*; the digits are permuted by a hash (base 4, after Vegdahl 2021) instead of a table.

use super::sampler::hash;

/// Number of sample `index` of pixel `(x, y)` in the sequence of a pair of dimensions, and a number that tells the
/// sequences apart that the picture is made of.
///
/// A sequence has room for `samples` samples of each pixel (rounded up to a power of two) and for as many pixels as 32
/// bits leave, which is a square of 8192 for 64 samples; beyond either begins another sequence.
#[inline]
pub(super) fn number(pixel: [u32; 2], samples: u32, index: u32, key: u32) -> (u32, u32) {
    let bits = samples.clamp(1, 1 << 16).next_power_of_two().trailing_zeros();
    let odd = bits & 1;
    let edge_bits = (32 - bits - odd) / 2;
    let low = u32::MAX >> (32 - edge_bits);
    let z = interleave(pixel[0] & low) | interleave(pixel[1] & low) << 1;
    let number = (z << bits) | (index & ((1 << bits) - 1));
    // Digits of two bits from the top; where their number is odd, the lowest one stands alone.
    let scrambled = scramble(number >> odd, key);
    let lowest = (number ^ hash(number >> odd ^ key)) & odd;
    let [tile_x, tile_y] = pixel.map(|x| x.checked_shr(edge_bits).unwrap_or(0));
    ((scrambled << odd) | lowest, (tile_y << 16 | tile_x) ^ hash(index.checked_shr(bits).unwrap_or(0)))
}

/// Owen scrambling in base 4: each digit is permuted by those above it.
#[inline]
fn scramble(x: u32, key: u32) -> u32 {
    let mut v = x.reverse_bits();
    v ^= v.wrapping_mul(0x3d20_adea);
    v ^= (v >> 1) & (v << 1) & 0x5555_5555;
    v = v.wrapping_add(key);
    v = v.wrapping_mul((key >> 16) | 1);
    v ^= (v >> 1) & (v << 1) & 0x5555_5555;
    v ^= v.wrapping_mul(0x0552_6c56);
    v ^= v.wrapping_mul(0x53a2_2864);
    v.reverse_bits()
}

/// Spreads the lower 16 bits of a number over the even bits of another.
#[inline]
fn interleave(x: u32) -> u32 {
    let mut v = x & 0xffff;
    v = (v | v << 8) & 0x00ff_00ff;
    v = (v | v << 4) & 0x0f0f_0f0f;
    v = (v | v << 2) & 0x3333_3333;
    (v | v << 1) & 0x5555_5555
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_block_of_pixels_has_a_whole_run_of_the_sequence() {
        for samples in [1u32, 2, 4, 5, 8, 64] {
            let room = samples.next_power_of_two();
            for edge in [1u32, 2, 4, 8] {
                let pixels = (0..edge * edge).map(|i| [16 + i % edge, 40 + i / edge]);
                let numbers =
                    pixels.flat_map(|pixel| (0..room).map(move |i| number(pixel, samples, i, 77).0));
                let all: BTreeSet<u32> = numbers.collect();
                let run = edge * edge * room;
                assert_eq!(all.len() as u32, run, "{samples} samples, {edge}");
                let first = *all.first().expect("there are some");
                assert!(
                    first.is_multiple_of(run) && all.last() == Some(&(first + run - 1)),
                    "{samples}, {edge}"
                );
            }
        }
    }

    #[test]
    fn pixels_and_samples_beyond_a_sequence_have_another() {
        let of = |x, index| number([x, 0], 64, index, 1).1;
        assert_eq!(of(0, 0), of(8191, 63));
        assert!(of(0, 0) != of(8192, 0) && of(0, 0) != of(0, 64));
        // No shift is too wide for the least and the greatest number of samples.
        for samples in [0, 1, u32::MAX] {
            number([u32::MAX; 2], samples, u32::MAX, 5);
        }
    }
}
