//! Edges of emitters that the camera sees: in pixels where there is one, camera rays of their own find their light.
//!
//! A lamp is much brighter than what it lights, so that samples of a pixel that it covers in part differ by more than those of
//! any other; and a ray that is not shaded costs a fraction of a sample. What a sample of such a pixel shows of emitters is
//! therefore the mean of [`RAYS`] rays, well spread by themselves and from sample to sample, and the sample's own first hit
//! leaves its emission out. Where edges are is found by rays through the corners of pixels, and by the place of what is small:
//! it hangs on no sample, so that nothing is biased, wherever an edge is overlooked.

use super::bounce::Dimension;
use super::roots::Roots;
use super::tally::{RayClass, Tally};
use super::wave::Integrator;
use crate::accel::{Accelerator, Coherence};
use crate::core::lanes::LANES;
use crate::core::{Hit, Ray, Rgb, Sampler, Wide, widely};
use crate::film::PixelRect;
use crate::scene::{Camera, Plan, Scene};
use glam::Vec2;
use rayon::prelude::*;

/// Rays per sample that look for emitters.
const RAYS: u32 = 16;

/// Pixels of the rectangle about an emitter so small that the corners of pixels may miss it.
const SMALL: usize = 36;

/// The pixels of a picture in which edges of emitters are seen.
#[derive(Clone, Debug)]
pub struct EmitterEdges {
    /// Outside of it there is none.
    rect: PixelRect,
    /// By rows of the rectangle.
    marks: Vec<bool>,
}

impl EmitterEdges {
    /// Those of a whole picture; none where the scene's settings want none.
    pub fn of(scene: &Scene, accel: &dyn Accelerator) -> Self {
        let mut rect = NOWHERE;
        let mut small = vec![];
        if Plan::of(scene).emitter_edges {
            let Camera { resolution, .. } = scene.camera;
            let everywhere = PixelRect { x0: 0, y0: 0, x1: resolution[0], y1: resolution[1] };
            for bounds in scene.emitters() {
                let image = scene.camera.image_of(bounds);
                let seen = image.map_or(everywhere, |image| pixels_between(image, resolution));
                rect = union(rect, seen);
                small.extend((seen.area() <= SMALL).then_some(seen));
            }
        }
        let marks = if rect == NOWHERE { vec![] } else { marked_by_corners(scene, accel, rect) };
        let mut edges = Self { rect, marks };
        for seen in small {
            for pixel in (seen.y0..seen.y1).flat_map(|y| (seen.x0..seen.x1).map(move |x| (x, y))) {
                let index = edges.index(pixel);
                edges.marks[index] = true;
            }
        }
        edges
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        !self.marks.contains(&true)
    }

    /// Whether an edge may be seen in a pixel.
    #[inline(always)]
    pub fn at(&self, (x, y): (u32, u32)) -> bool {
        let PixelRect { x0, y0, x1, y1 } = self.rect;
        x0 <= x && x < x1 && y0 <= y && y < y1 && self.marks[self.index((x, y))]
    }

    /// Of a pixel of the rectangle.
    #[inline(always)]
    fn index(&self, (x, y): (u32, u32)) -> usize {
        (y - self.rect.y0) as usize * self.rect.width() as usize + (x - self.rect.x0) as usize
    }
}

/// The rectangle without pixels.
const NOWHERE: PixelRect = PixelRect { x0: 0, y0: 0, x1: 0, y1: 0 };

/// The least rectangle with the pixels of both.
fn union(a: PixelRect, b: PixelRect) -> PixelRect {
    match (a.area(), b.area()) {
        (0, _) => b,
        (_, 0) => a,
        _ => PixelRect { x0: a.x0.min(b.x0), y0: a.y0.min(b.y0), x1: a.x1.max(b.x1), y1: a.y1.max(b.y1) },
    }
}

/// The pixels between two points of an image, and one more on each side.
fn pixels_between([least, most]: [Vec2; 2], [width, height]: [u32; 2]) -> PixelRect {
    // A conversion of what is negative gives zero.
    let [x0, y0] = (least.floor() - 1.0).to_array().map(|c| c as u32);
    let [x1, y1] = (most.ceil() + 1.0).to_array().map(|c| c as u32);
    let rect = PixelRect { x0, y0, x1: x1.min(width), y1: y1.min(height) };
    if rect.x0 < rect.x1 && rect.y0 < rect.y1 { rect } else { NOWHERE }
}

/// Whether the corners of each pixel of a rectangle see different light of emitters.
fn marked_by_corners(scene: &Scene, accel: &dyn Accelerator, rect: PixelRect) -> Vec<bool> {
    let row = |y: u32| {
        let direction = |x: u32| scene.camera.direction(x as f32, y as f32);
        let rays: Vec<_> = (rect.x0..=rect.x1).map(|x| Ray::new(scene.camera.eye, direction(x))).collect();
        let mut hits = vec![None; rays.len()];
        accel.intersect(&rays, Coherence::Coherent, &mut hits);
        let emission =
            rays.chunks(LANES).zip(hits.chunks(LANES)).map(|(rays, hits)| emission(scene, rays, hits));
        let mut row = emission.flatten().collect::<Vec<_>>();
        row.truncate(rays.len());
        row
    };
    let rows: Vec<Vec<Rgb>> = (rect.y0..=rect.y1).into_par_iter().map(row).collect();
    let pixels = rows.windows(2).flat_map(|rows| rows[0].windows(2).zip(rows[1].windows(2)));
    pixels.map(|(above, below)| above[0] != above[1] || above != below).collect()
}

/// What the surfaces that up to eight rays hit show of their own light.
#[inline(always)]
fn emission(scene: &Scene, rays: &[Ray], hits: &[Option<Hit>]) -> [Rgb; LANES] {
    let (mut found, mut one_sided) = ([Rgb::BLACK; LANES], [None; LANES]);
    for (lane, (ray, hit)) in rays.iter().zip(hits).enumerate() {
        let Some(hit) = hit else { continue };
        let material = scene.material(hit.geom_id);
        if let Some(emission) = material.emission {
            found[lane] = emission;
            one_sided[lane] = (!material.emits_both_sides).then_some((ray, hit));
        }
    }
    let Some(&any) = one_sided.iter().flatten().next() else { return found };
    let points = scene.interactions(one_sided.map(|seen| seen.unwrap_or(any)));
    for lane in 0..LANES {
        if one_sided[lane].is_some() && !points.front[lane] {
            found[lane] = Rgb::BLACK;
        }
    }
    found
}

/// The rays of samples that look for emitters, [`RAYS`] by [`RAYS`].
#[derive(Default)]
pub(super) struct Looks {
    slots: Vec<u32>,
    rays: Vec<Ray>,
    hits: Vec<Option<Hit>>,
}

impl Looks {
    /// Forgets all of them.
    pub(super) fn clear(&mut self) {
        self.slots.clear();
        self.rays.clear();
    }

    /// Adds the rays of sample `index` of a pixel, whose slot and numbers these are.
    #[inline(always)]
    pub(super) fn add(
        &mut self,
        camera: &Camera,
        (x, y): (u32, u32),
        (slot, sampler): (u32, &Sampler),
        index: u32,
    ) {
        self.slots.push(slot);
        for first in (0..RAYS).step_by(LANES) {
            let start = index.wrapping_mul(RAYS).wrapping_add(first);
            let indices = std::array::from_fn(|lane| start.wrapping_add(lane as u32));
            let [dx, dy] = Sampler::pairs([sampler; LANES], indices, [Dimension::Emitters.at(0); LANES]);
            for lane in 0..LANES {
                let direction = camera.direction(x as f32 + dx[lane], y as f32 + dy[lane]);
                self.rays.push(Ray::new(camera.eye, direction));
            }
        }
    }
}

impl Integrator<'_> {
    /// Adds to samples what their rays find of emitters.
    pub(super) fn find_emitters(&self, looks: &mut Looks, roots: &mut Roots, tally: &mut Tally) {
        self.intersect(RayClass::Primary, &looks.rays, &mut looks.hits, tally);
        widely(Found { scene: self.scene, looks, roots, tally });
    }
}

/// What looks for emitters have found, to be added to samples with wide instructions.
struct Found<'a> {
    scene: &'a Scene,
    looks: &'a Looks,
    roots: &'a mut Roots,
    tally: &'a mut Tally,
}

impl Wide for Found<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Looks { slots, rays, hits } = self.looks;
        let of_samples = rays.chunks(RAYS as usize).zip(hits.chunks(RAYS as usize));
        for (&slot, (rays, hits)) in slots.iter().zip(of_samples) {
            let mut sum = Rgb::BLACK;
            for (rays, hits) in rays.chunks(LANES).zip(hits.chunks(LANES)) {
                for found in emission(self.scene, rays, hits) {
                    sum += found;
                }
            }
            self.roots.add(slot, sum * (1.0 / RAYS as f32), self.tally);
        }
    }
}
