//! Rays of a scene's own render, kept in memory: some tiles all over the picture, whole waves of each.

use super::Batch;
use crate::accel::Accelerator;
use crate::core::Ray;
use crate::film::PixelRect;
use crate::integrator::{RayClass, RayLog};
use crate::render::{DEFAULT_TILE_SIZE, Prepared, RenderOptions, Silent};
use crate::scene::Scene;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

/// Samples per pixel of the recorded tiles: with these, a wave of camera rays is full.
const SAMPLES: u32 = 16;

/// Keeps what is asked.
#[derive(Default)]
struct Recorder(Mutex<Vec<Batch>>);

impl RayLog for Recorder {
    fn record(&self, class: RayClass, rays: &[Ray]) {
        let batch = Batch { class, rays: rays.to_vec() };
        self.0.lock().expect("no thread panics while it records").push(batch);
    }
}

/// Batches of rays as a render of `scene` asks them: of tiles spread over a part of the picture, until there are at
/// least `enough` rays or the whole part is done.
///
/// The same scene and backend give the same batches. Raising `stop` ends it early.
///
/// # Panics
/// If the part is not within the picture.
pub fn record(
    scene: &Scene,
    accel: &dyn Accelerator,
    part: PixelRect,
    enough: usize,
    stop: &AtomicBool,
) -> Vec<Batch> {
    let recorder = Recorder::default();
    // Once: it takes longer than many tiles.
    let prepared = Prepared::new(scene, accel, stop);
    let mut kept = 0;
    let mut batches = Vec::new();
    for crop in spread_tiles(part) {
        if kept >= enough || stop.load(Ordering::Relaxed) {
            break;
        }
        let options = RenderOptions {
            threads: 1,
            crop: Some(crop),
            samples: Some(0..scene.settings.spp.min(SAMPLES)),
            log: Some(&recorder),
            ..RenderOptions::default()
        };
        prepared.render(&options, &Silent, stop);
        let new = std::mem::take(&mut *recorder.0.lock().expect("the render is over"));
        kept += new.iter().map(|batch| batch.rays.len()).sum::<usize>();
        batches.extend(new);
    }
    batches
}

/// All tiles of a rectangle, in an order whose every beginning is spread over it: steps of the golden section.
fn spread_tiles(part: PixelRect) -> impl Iterator<Item = PixelRect> {
    let size = DEFAULT_TILE_SIZE;
    let columns = part.width().div_ceil(size);
    let count = columns * part.height().div_ceil(size);
    let mut step = ((f64::from(count) * 0.618_034) as u32).max(1);
    while gcd(step, count) != 1 {
        step += 1;
    }
    (0..u64::from(count)).map(move |i| {
        let tile = (i * u64::from(step) % u64::from(count)) as u32;
        let (x0, y0) = (part.x0 + tile % columns * size, part.y0 + tile / columns * size);
        PixelRect { x0, y0, x1: part.x1.min(x0 + size), y1: part.y1.min(y0 + size) }
    })
}

fn gcd(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { gcd(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(width: u32, height: u32) -> PixelRect {
        PixelRect { x0: 3, y0: 5, x1: 3 + width, y1: 5 + height }
    }

    #[test]
    fn every_tile_comes_once_and_the_first_ones_are_far_apart() {
        for (width, height) in [(1, 1), (16, 12), (100, 70), (640, 480), (33, 1000)] {
            let tiles: Vec<PixelRect> = spread_tiles(picture(width, height)).collect();
            let area: usize = tiles.iter().map(|t| t.area()).sum();
            assert_eq!(area, (width * height) as usize, "{width} x {height}");
            let mut corners: Vec<_> = tiles.iter().map(|t| (t.x0, t.y0)).collect();
            corners.sort_unstable();
            corners.dedup();
            assert_eq!(corners.len(), tiles.len(), "{width} x {height}");
        }
        let quarters: std::collections::BTreeSet<u32> =
            spread_tiles(picture(640, 480)).take(8).map(|t| (t.y0 - 5) / 120).collect();
        assert_eq!(quarters.len(), 4, "eight tiles lie in all four quarters of the height");
    }
}
