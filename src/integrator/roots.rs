//! The camera samples of the wave in work, where the radiance of each comes together.

use super::tally::Tally;
use crate::core::{Ordinary, Rgb, Sampler};
use crate::film::{RadianceGathered, RadianceSum};

/// The camera samples of a wave, by their slots.
#[derive(Default)]
pub(super) struct Roots {
    pixels: Vec<Pixel>,
    samples: Vec<Root>,
    /// Sums of what the samples' own have no room for: of a few of them.
    rest: Vec<[RadianceSum; 3]>,
}

/// A pixel that the wave has samples of.
struct Pixel {
    /// Its index in the tile's film.
    index: u32,
    /// Its random numbers.
    sampler: Sampler,
}

/// A camera sample: small, since every ray of the wave comes back to its own.
struct Root {
    /// The number of its pixel among those of the wave.
    pixel: u32,
    /// The number of its sum in `rest`, if it has one.
    rest: Option<u32>,
    /// Its radiance so far, but for the rest.
    sum: [Ordinary; 3],
}

impl Roots {
    /// Forgets all samples.
    pub(super) fn clear(&mut self) {
        self.pixels.clear();
        self.samples.clear();
        self.rest.clear();
    }

    /// Samples in the wave.
    #[inline]
    pub(super) fn len(&self) -> usize {
        self.samples.len()
    }

    /// Adds a pixel, by its index in the film. Its number here.
    pub(super) fn add_pixel(&mut self, index: u32, sampler: Sampler) -> u32 {
        self.pixels.push(Pixel { index, sampler });
        self.pixels.len() as u32 - 1
    }

    /// Adds a sample of a pixel. Its slot.
    #[inline(always)]
    pub(super) fn push(&mut self, pixel: u32) -> u32 {
        self.samples.push(Root { pixel, rest: None, sum: Default::default() });
        self.samples.len() as u32 - 1
    }

    /// The random numbers of a sample's pixel.
    #[inline(always)]
    pub(super) fn sampler(&self, slot: u32) -> &Sampler {
        &self.pixels[self.samples[slot as usize].pixel as usize].sampler
    }

    /// Adds light to a sample; what cannot be added is counted.
    #[inline(always)]
    pub(super) fn add(&mut self, slot: u32, radiance: Rgb, tally: &mut Tally) {
        let channels = radiance.to_array();
        if !channels.iter().all(|&c| Ordinary::holds(c)) {
            if tally.dropped.accepts(radiance) {
                self.add_rest(slot, channels.map(RadianceSum::from_finite));
            }
            return;
        }
        let root = &mut self.samples[slot as usize];
        for (sum, channel) in root.sum.iter_mut().zip(channels) {
            sum.add(channel);
        }
        if root.sum.iter().any(|sum| sum.is_full()) {
            let sum = std::mem::take(&mut root.sum);
            self.add_rest(slot, sum.map(RadianceSum::from));
        }
    }

    #[cold]
    fn add_rest(&mut self, slot: u32, radiance: [RadianceSum; 3]) {
        let rest = *self.samples[slot as usize].rest.get_or_insert_with(|| {
            self.rest.push(Default::default());
            self.rest.len() as u32 - 1
        });
        for (sum, channel) in self.rest[rest as usize].iter_mut().zip(radiance) {
            *sum += channel;
        }
    }

    /// What each sample has come to, with the index of its pixel in the film.
    #[inline]
    pub(super) fn sums(&self) -> impl Iterator<Item = (usize, [RadianceGathered; 3])> {
        self.samples.iter().map(|root| {
            let rest = root.rest.map_or_else(Default::default, |rest| self.rest[rest as usize]);
            let sum = |c: usize| RadianceGathered { ordinary: root.sum[c], rest: rest[c] };
            (self.pixels[root.pixel as usize].index as usize, [sum(0), sum(1), sum(2)])
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::SamplerKind;

    #[test]
    fn sums_are_exact_whatever_comes() {
        let (mut roots, mut tally) = (Roots::default(), Tally::default());
        let pixel = roots.add_pixel(7, Sampler::new(SamplerKind::Sobol, 0, 1, 2));
        let (first, second) = (roots.push(pixel), roots.push(pixel));
        let mut expected = [RadianceSum::ZERO; 3];
        for i in 0..3000 {
            let x = (i as f32 * 0.37).sin().exp2() * [2047.0, 1e-9, 0.1, 3e7][i % 4];
            let radiance = Rgb::new(x, 0.5 * x, 2000.0);
            roots.add(second, radiance, &mut tally);
            for (sum, channel) in expected.iter_mut().zip(radiance.to_array()) {
                *sum += RadianceSum::from_finite(channel);
            }
        }
        roots.add(second, Rgb::new(1.0, f32::NAN, 1.0), &mut tally);
        roots.add(first, Rgb::new(1.0, -1.0, 1.0), &mut tally);
        let sums: Vec<_> = roots.sums().collect();
        assert_eq!(sums[1].1.map(|sum| sum.sum()), expected);
        assert_eq!((sums[0].0, sums[0].1.map(|sum| sum.sum())), (7, [RadianceSum::ZERO; 3]));
        assert_eq!((tally.dropped.nan, tally.dropped.negative), (1, 1));
    }
}
