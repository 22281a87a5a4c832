//! Camera rays: the first wave.

use super::edges::Looks;
use super::path::{Path, Wave};
use super::roots::Roots;
use super::tally::RayClass;
use super::wave::{Integrator, Work};
use crate::core::lanes::{LANES, Vectors};
use crate::core::{Ray, Sampler, Wide};
use crate::film::PixelRect;
use crate::scene::Settings;

/// [`Integrator::start`], to be compiled for wide instructions.
pub(super) struct Start<'a, 'b> {
    pub integrator: &'a Integrator<'b>,
    /// The film's.
    pub rect: PixelRect,
    pub work: &'a Work<'a>,
    /// The camera samples that the rays begin.
    pub roots: &'a mut Roots,
    /// The wave to be filled.
    pub wave: &'a mut Wave,
    /// Rays that look for emitters.
    pub looks: &'a mut Looks,
}

impl Wide for Start<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.integrator.start(self.rect, self.work, self.roots, (self.wave, self.looks));
    }
}

impl Integrator<'_> {
    /// Fills the first wave with camera rays, in blocks of 4 x 2 pixels: sample by sample within a block, so that
    /// eight neighbours in the wave are neighbours in the image and all samples of a pixel stay close together.
    #[inline(always)]
    fn start(&self, rect: PixelRect, work: &Work, roots: &mut Roots, (wave, looks): (&mut Wave, &mut Looks)) {
        let Settings { sampler, spp, .. } = self.scene.settings;
        let camera = &self.scene.camera;
        roots.clear();
        wave.clear();
        looks.clear();
        for block in work.pixels.chunks(LANES) {
            // Lanes without a pixel of their own repeat others.
            let corners: [(u32, u32); LANES] = std::array::from_fn(|i| block[i % block.len()]);
            let samplers = corners.map(|(x, y)| Sampler::new(sampler, self.seed, x, y).for_samples(spp));
            let mut pixels = [0; LANES];
            for (lane, &(x, y)) in block.iter().enumerate() {
                let index = (y - rect.y0) * rect.width() + (x - rect.x0);
                pixels[lane] = roots.add_pixel(index, samplers[lane]);
            }
            for index in work.samples.clone() {
                let within = Sampler::pairs(samplers.each_ref(), [index; LANES], [0; LANES]);
                let mut directions = Vectors::default();
                for lane in 0..LANES {
                    let ((x, y), [dx, dy]) = (corners[lane], within.map(|offsets| offsets[lane]));
                    directions.set(lane, camera.direction(x as f32 + dx, y as f32 + dy));
                }
                for lane in 0..block.len() {
                    let mut path = Path::from_camera(roots.push(pixels[lane]), index, work.split);
                    if self.edges.is_some_and(|edges| edges.at(corners[lane])) {
                        path.emission_apart = true;
                        looks.add(camera, corners[lane], (path.slot, &samplers[lane]), index);
                    }
                    wave.push(RayClass::Primary, path, Ray::new(camera.eye, directions.get(lane)));
                }
            }
        }
    }
}

/// The pixels of a tile along a Z-order curve of blocks of 4 x 2.
pub fn z_order(rect: PixelRect) -> Vec<(u32, u32)> {
    let mut order: Vec<_> =
        (rect.y0..rect.y1).flat_map(|y| (rect.x0..rect.x1).map(move |x| (x, y))).collect();
    order.sort_by_cached_key(|&(x, y)| (interleave(x / 4) | interleave(y / 2) << 1, y, x));
    order
}

/// Spreads the 32 bits of a number over the even bits of another.
fn interleave(x: u32) -> u64 {
    (0..32).fold(0, |z, bit| z | u64::from(x >> bit & 1) << (2 * bit))
}
