//! Random numbers as a pure function of (seed, pixel, sample index, dimension).
//!
//! Nothing here has state, so thread count, tile size, sharding and packet width change no number. Dimensions come
//! in pairs: each pair is the two-dimensional Sobol sequence, its order shuffled and its values scrambled by
//! Owen's nested uniform permutation with keys of its own, so that any contiguous run of indices is stratified in
//! every pair and pairs are independent of each other. Beside it stand the textbook's own patterns, for its figures.
//!
//! Sources: Burley 2020, *Practical Hash-based Owen Scrambling*; Ahmed 2024, *An Implementation Algorithm of 2D
//! Sobol Sequence Fast, Elegant, and Compact*; Vegdahl 2021 for the hash's constants.

use super::blue_noise;
use super::lanes::{Floats, LANES};

/// Which sequence of numbers a render draws from.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum SamplerKind {
    /// Owen-scrambled Sobol points: stratified in each pair of dimensions.
    #[default]
    Sobol,
    /// The same points, shared out among neighbouring pixels so that their errors differ: as much noise as with `sobol`,
    /// but finer, so that an eye or a filter averages it out sooner. The numbers depend on the number of samples.
    BlueNoise,
    /// Independent uniform numbers: the textbook's `PureRandom`.
    Independent,
    /// The middles of a square grid of as many cells as a pixel has samples (if they are no square number, of the
    /// next one), in an order of each pair's own. Suffern 2007, chapter 5; has the error of its grid.
    Regular,
    /// The Hammersley points of as many samples as a pixel has, the same in every pixel and pair but for their order.
    /// Suffern 2007, chapter 5; has the error of its pattern.
    Hammersley,
}

impl SamplerKind {
    /// Whether a pixel's numbers are the same however many samples it has: those of more go on where those of fewer end.
    pub fn is_sequence(self) -> bool {
        matches!(self, Self::Sobol | Self::Independent)
    }
}

/// The numbers of one pixel.
#[derive(Clone, Copy, Debug)]
pub struct Sampler {
    kind: SamplerKind,
    key: u32,
    /// The part of the key that all pixels share, and the pixel.
    shared_key: u32,
    pixel: [u32; 2],
    /// Points of a pattern, or samples of a pixel.
    count: u32,
}

impl Sampler {
    /// The numbers of pixel `(x, y)` of the full image under `seed`.
    #[inline]
    pub fn new(kind: SamplerKind, seed: u32, x: u32, y: u32) -> Self {
        let shared_key = hash(seed ^ 0x9e37_79b9);
        Self { kind, key: hash(hash(shared_key ^ x) ^ y), shared_key, pixel: [x, y], count: 1 }
    }

    /// The same for a pixel of `samples` samples: what the patterns of a fixed number of points need to know.
    #[inline]
    pub fn for_samples(mut self, samples: u32) -> Self {
        let edge = (f64::from(samples.max(1)).sqrt().ceil() as u32).min(0xffff);
        self.count = if self.kind == SamplerKind::Regular { edge * edge } else { samples.max(1) };
        self
    }

    /// Sample `index` of pair `dimension`, both coordinates multiples of `2^-24` in `[0, 1)`.
    #[inline]
    pub fn pair(&self, index: u32, dimension: u32) -> [f32; 2] {
        let key = pair_key(self.key, dimension);
        let [x, y] = match self.kind {
            SamplerKind::Sobol => {
                // The points' coordinates with their bits reversed, as the permutation wants them.
                let [x, y] = reversed_sobol_pair(owen_scramble(index, key));
                [permute(x, hash(key ^ X_KEY)), permute(y, hash(key ^ Y_KEY))].map(u32::reverse_bits)
            }
            SamplerKind::BlueNoise => {
                let shared = pair_key(self.shared_key, dimension);
                let (number, sequence) = blue_noise::number(self.pixel, self.count, index, shared);
                let key = hash(shared ^ sequence);
                let [x, y] = reversed_sobol_pair(number);
                [permute(x, hash(key ^ X_KEY)), permute(y, hash(key ^ Y_KEY))].map(u32::reverse_bits)
            }
            SamplerKind::Independent => {
                let x = hash(key ^ hash(index.wrapping_add(0x632b_e5ab)));
                [x, hash(x ^ 0x1b56_c4e9)]
            }
            SamplerKind::Regular => self.grid(index, key),
            SamplerKind::Hammersley => {
                let i = self.shuffled(index, key);
                [fraction(i, 1, self.count), i.reverse_bits()]
            }
        };
        [to_unit(x), to_unit(y)]
    }

    /// [`pair`](Self::pair) of eight samplers of a kind, each with its index and dimension: the same numbers, sooner. The
    /// first of all pairs, then the second.
    ///
    /// # Panics
    /// If the samplers are of several kinds.
    #[inline(always)]
    pub fn pairs(samplers: [&Self; LANES], indices: [u32; LANES], dimensions: [u32; LANES]) -> [Floats; 2] {
        let kind = samplers[0].kind;
        assert!(samplers.iter().all(|sampler| sampler.kind == kind), "one kind of sampler");
        if kind != SamplerKind::Sobol {
            return Self::pairs_one_by_one(samplers, indices, dimensions);
        }
        let mut keys = [0; LANES];
        for (key, sampler) in keys.iter_mut().zip(samplers) {
            *key = sampler.key;
        }
        let mut pairs = [Floats::default(); 2];
        for i in 0..LANES {
            let key = pair_key(keys[i], dimensions[i]);
            let [reversed_x, reversed_y] = reversed_sobol_pair(owen_scramble(indices[i], key));
            pairs[0][i] = to_unit(permute(reversed_x, hash(key ^ X_KEY)).reverse_bits());
            pairs[1][i] = to_unit(permute(reversed_y, hash(key ^ Y_KEY)).reverse_bits());
        }
        pairs
    }

    #[cold]
    fn pairs_one_by_one(
        samplers: [&Self; LANES],
        indices: [u32; LANES],
        dimensions: [u32; LANES],
    ) -> [Floats; 2] {
        let mut pairs = [Floats::default(); 2];
        for i in 0..LANES {
            [pairs[0][i], pairs[1][i]] = samplers[i].pair(indices[i], dimensions[i]);
        }
        pairs
    }

    /// The middle of a cell.
    fn grid(&self, index: u32, key: u32) -> [u32; 2] {
        let edge = self.count.isqrt();
        let cell = self.shuffled(index, key);
        [cell % edge, cell / edge].map(|i| fraction(2 * i + 1, 2, edge))
    }

    /// Which point of the pattern is number `index`; after each whole pattern comes another order.
    fn shuffled(&self, index: u32, key: u32) -> u32 {
        permuted(index % self.count, self.count, hash(key ^ (index / self.count)))
    }

    /// Sample `index` of `dimension`, one number.
    #[inline]
    pub fn single(&self, index: u32, dimension: u32) -> f32 {
        self.pair(index, dimension)[0]
    }
}

/// Tell the scrambling of a pair's two coordinates apart.
const X_KEY: u32 = 0x68bc_21eb;
const Y_KEY: u32 = 0x02e5_be93;

/// The key of a pair, from that of its pixel.
#[inline(always)]
fn pair_key(pixel_key: u32, dimension: u32) -> u32 {
    hash(pixel_key ^ dimension.wrapping_mul(0x9e37_79b9).wrapping_add(0x85eb_ca6b))
}

/// The upper 24 bits as a number in `[0, 1)`.
#[inline(always)]
fn to_unit(x: u32) -> f32 {
    // Signed, which converts faster.
    (x >> 8) as i32 as f32 * (1.0 / (1 << 24) as f32)
}

/// A bijective 32-bit hash of low bias (Wellons' search, `lowbias32`).
#[inline(always)]
pub fn hash(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x21f0_aaad);
    x ^= x >> 15;
    x = x.wrapping_mul(0xd35a_2d97);
    x ^ (x >> 15)
}

/// `i / (parts count)` as a 32-bit fraction, `i < parts count`.
fn fraction(i: u32, parts: u32, count: u32) -> u32 {
    ((u64::from(i) << 32) / (u64::from(parts) * u64::from(count))) as u32
}

/// Where a permutation of `0..count`, chosen by `seed`, takes `i`.
///
/// Scrambles the numbers below the next power of two, again and again until one below `count` comes (Kensler 2013,
/// *Correlated Multi-Jittered Sampling*).
fn permuted(mut i: u32, count: u32, seed: u32) -> u32 {
    let bits = count.next_power_of_two().trailing_zeros();
    if bits == 0 {
        return 0;
    }
    loop {
        i = owen_scramble(i << (32 - bits), seed) >> (32 - bits);
        // Nested scrambling keeps neighbours together: a second pass from the other end parts them.
        i = owen_scramble(i.reverse_bits(), hash(seed)).reverse_bits() & (u32::MAX >> (32 - bits));
        if i < count {
            return i;
        }
    }
}

/// Owen scrambling of a number whose most significant bit decides first.
///
/// The Laine-Karras permutation wants the bits reversed, so this takes and gives them in the natural order.
#[inline(always)]
fn owen_scramble(x: u32, seed: u32) -> u32 {
    permute(x.reverse_bits(), seed).reverse_bits()
}

/// The Laine-Karras permutation, in which each bit depends on those below it only (Vegdahl 2021).
#[inline(always)]
fn permute(mut v: u32, seed: u32) -> u32 {
    v ^= v.wrapping_mul(0x3d20_adea);
    v = v.wrapping_add(seed);
    v = v.wrapping_mul((seed >> 16) | 1);
    v ^= v.wrapping_mul(0x0552_6c56);
    v ^ v.wrapping_mul(0x53a2_2864)
}

/// Point `index` of the two-dimensional Sobol sequence, as 32-bit fractions with their bits reversed.
#[inline(always)]
fn reversed_sobol_pair(index: u32) -> [u32; 2] {
    let mut v = index;
    // Output bit i is the sum of the index bits j that contain i (Pascal's triangle mod 2): a superset sum.
    v ^= v >> 16;
    v ^= (v >> 8) & 0x00ff_00ff;
    v ^= (v >> 4) & 0x0f0f_0f0f;
    v ^= (v >> 2) & 0x3333_3333;
    v ^= (v >> 1) & 0x5555_5555;
    [index, v]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The second Sobol dimension by its direction numbers, one bit at a time.
    fn sobol_by_direction_numbers(mut index: u32) -> u32 {
        let (mut direction, mut x) = (1u32 << 31, 0);
        while index != 0 {
            if index & 1 == 1 {
                x ^= direction;
            }
            index >>= 1;
            direction ^= direction >> 1;
        }
        x
    }

    #[test]
    fn the_bit_parallel_sobol_is_the_sequence() {
        for index in (0..100_000).chain([u32::MAX, 0x8000_0000, 0xdead_beef]) {
            assert_eq!(
                reversed_sobol_pair(index)[1].reverse_bits(),
                sobol_by_direction_numbers(index),
                "{index}"
            );
        }
    }

    #[test]
    fn eight_pairs_at_once_are_the_pairs() {
        for kind in [SamplerKind::Sobol, SamplerKind::Independent, SamplerKind::Regular] {
            let samplers: [_; LANES] =
                std::array::from_fn(|i| Sampler::new(kind, 3, 17 + i as u32, 4).for_samples(12));
            for index in (0..1000).chain([u32::MAX, 0x8000_0000]) {
                let indices = std::array::from_fn(|i| index ^ i as u32);
                let dimensions = [index % 7, 9, 4, 123_456, 0, 5, index, u32::MAX];
                let one_by_one: [_; LANES] =
                    std::array::from_fn(|i| samplers[i].pair(indices[i], dimensions[i]));
                let [x, y] = Sampler::pairs(samplers.each_ref(), indices, dimensions);
                assert_eq!(std::array::from_fn(|i| [x[i], y[i]]), one_by_one);
            }
        }
    }

    #[test]
    fn every_aligned_run_is_stratified_in_both_coordinates_and_in_boxes() {
        let sampler = Sampler::new(SamplerKind::Sobol, 7, 3, 5);
        for dimension in 0..8 {
            for start in [0u32, 64, 1 << 20] {
                let points: Vec<_> = (start..start + 64).map(|i| sampler.pair(i, dimension)).collect();
                for (nx, ny) in [(64, 1), (32, 2), (8, 8), (2, 32), (1, 64)] {
                    let mut count = vec![0; 64];
                    for p in &points {
                        count[(p[0] * nx as f32) as usize * ny + (p[1] * ny as f32) as usize] += 1;
                    }
                    assert!(count.iter().all(|&c| c == 1), "{dimension} {start} {nx}x{ny}");
                }
            }
        }
    }

    /// Mean squared error of the mean of 16 samples of a smooth function, and of the mean of 4 x 4 pixels of it.
    fn errors(kind: SamplerKind) -> [f64; 2] {
        let (edge, spp) = (64u32, 16u32);
        // Of mean 1/2: a disk's worth of light with an edge, and a slope.
        let f = |[u, v]: [f32; 2]| {
            let inside = (u - 0.5) * (u - 0.5) + (v - 0.4) * (v - 0.4) < 0.1;
            f64::from(u8::from(inside)) - f64::from(std::f32::consts::PI) * 0.1 + f64::from(u * v) + 0.25
        };
        let mut sums = [0.0; 2];
        for dimension in 0..24 {
            let error = |x: u32, y: u32| {
                let sampler = Sampler::new(kind, 3, x, y).for_samples(spp);
                (0..spp).map(|i| f(sampler.pair(i, dimension)) - 0.5).sum::<f64>() / f64::from(spp)
            };
            let errors: Vec<f64> = (0..edge * edge).map(|i| error(i % edge, i / edge)).collect();
            sums[0] += errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64;
            for block in 0..(edge * edge / 16) as usize {
                let (x, y) = (block % 16 * 4, block / 16 * 4);
                let mean = (0..16).map(|i| errors[(y + i / 4) * 64 + x + i % 4]).sum::<f64>() / 16.0;
                sums[1] += mean * mean / 256.0;
            }
        }
        sums
    }

    #[test]
    fn errors_of_blue_noise_are_as_large_and_cancel_among_neighbours() {
        let [sobol, sobol_blurred] = errors(SamplerKind::Sobol);
        let [blue, blue_blurred] = errors(SamplerKind::BlueNoise);
        // All pixels share a scrambling, so that the error of a whole picture varies.
        assert!(blue < 1.1 * sobol && blue > 0.7 * sobol, "{blue} {sobol}");
        // A white error's variance falls to a sixteenth, a blue one's further.
        assert!((sobol_blurred / sobol * 16.0 - 1.0).abs() < 0.1, "{sobol_blurred} {sobol}");
        assert!(blue_blurred < 0.3 * sobol_blurred, "{blue_blurred} {sobol_blurred}");
    }

    #[test]
    fn patterns_hold_each_of_their_points_once_in_an_order_of_their_own() {
        let points = |kind, dimension, start| {
            let sampler = Sampler::new(kind, 1, 4, 5).for_samples(9);
            (start..start + 9).map(|i| sampler.pair(i, dimension)).collect::<Vec<_>>()
        };
        let sorted = |mut points: Vec<[f32; 2]>| {
            points.sort_by(|a, b| a.partial_cmp(b).unwrap());
            points
        };
        let near = |a: &[[f32; 2]], b: &[[f32; 2]]| {
            a.iter().zip(b).all(|(a, b)| (a[0] - b[0]).abs() < 1e-6 && (a[1] - b[1]).abs() < 1e-6)
        };
        let grid: Vec<_> =
            (0..9).map(|i| [(2 * (i / 3) + 1) as f32 / 6.0, (2 * (i % 3) + 1) as f32 / 6.0]).collect();
        let inverse = [0.0, 0.5, 0.25, 0.75, 0.125, 0.625, 0.375, 0.875, 0.0625];
        let hammersley: Vec<_> = (0..9).map(|i| [i as f32 / 9.0, inverse[i]]).collect();
        for (kind, pattern) in [(SamplerKind::Regular, grid), (SamplerKind::Hammersley, hammersley)] {
            for (dimension, start) in [(0, 0), (5, 0), (0, 9), (3, 27)] {
                assert!(
                    near(&sorted(points(kind, dimension, start)), &pattern),
                    "{kind:?} {dimension} {start}"
                );
            }
            assert_ne!(points(kind, 0, 0), points(kind, 1, 0), "{kind:?}");
        }
        let alone = |kind| Sampler::new(kind, 1, 4, 5).for_samples(1).pair(3, 2);
        assert_eq!(alone(SamplerKind::Regular), [0.5, 0.5]);
        assert_eq!(alone(SamplerKind::Hammersley), [0.0, 0.0]);
    }

    #[test]
    fn a_permutation_takes_each_number_once() {
        for count in [1, 2, 3, 9, 64, 83, 100] {
            for seed in 0..20 {
                let mut seen: Vec<u32> = (0..count).map(|i| permuted(i, count, hash(seed))).collect();
                seen.sort_unstable();
                assert_eq!(seen, (0..count).collect::<Vec<_>>());
            }
        }
    }

    #[test]
    fn numbers_stay_below_one_and_pairs_are_uncorrelated() {
        for kind in [SamplerKind::Sobol, SamplerKind::BlueNoise, SamplerKind::Independent] {
            let sampler = Sampler::new(kind, 1, 0, 0);
            let n = 1 << 14;
            let (mut sum, mut cross) = (0.0f64, 0.0f64);
            for i in 0..n {
                let ([a, b], [c, _]) = (sampler.pair(i, 4), sampler.pair(i, 5));
                assert!((0.0..1.0).contains(&a) && (0.0..1.0).contains(&b));
                sum += f64::from(a + b);
                cross += (f64::from(a) - 0.5) * (f64::from(c) - 0.5);
            }
            let n = f64::from(n);
            assert!((sum / n - 1.0).abs() < 5.0 * (1.0 / 6.0 / n).sqrt(), "{kind:?}");
            assert!((cross / n).abs() < 5.0 / 12.0 / n.sqrt(), "{kind:?}");
        }
    }
}
