//! When a part of the picture is clean enough.

use super::tile::Tile;
use crate::film::{Film, Pixel};
use std::collections::HashSet;

/// Edge of the blocks of pixels that are judged together: one pixel's own estimate is too uncertain, and a pixel that
/// has missed a rare bright path would call itself clean.
const BLOCK: u32 = 8;

/// Decides from the film alone, so that the same samples make the same decisions on any number of threads.
///
/// A block is left alone once its error has been below the threshold in two rounds in a row: the decision comes a
/// round late, so that the samples that look clean by luck are not those that decide.
pub(super) struct Convergence {
    threshold: f64,
    below_once: HashSet<(u32, u32)>,
}

impl Convergence {
    pub(super) fn new(threshold: f64) -> Self {
        Self { threshold, below_once: HashSet::new() }
    }

    /// Takes the pixels of clean blocks out of work; whether all are clean.
    pub(super) fn update(&mut self, film: &Film, tiles: &mut [Tile]) -> bool {
        let floor = luminance_floor(film);
        let mut blocks: std::collections::BTreeMap<(u32, u32), (f64, f64)> = Default::default();
        for &(x, y) in tiles.iter().flat_map(|tile| &tile.active) {
            let error = relative_error_squared(film.pixel(x, y), floor);
            let block = blocks.entry((x / BLOCK, y / BLOCK)).or_default();
            *block = (block.0 + error, block.1 + 1.0);
        }
        let below: HashSet<_> = blocks
            .into_iter()
            .filter(|(_, (sum, pixels))| (sum / pixels).sqrt() < self.threshold)
            .map(|(block, _)| block)
            .collect();
        let done = |x: u32, y: u32| {
            let block = (x / BLOCK, y / BLOCK);
            below.contains(&block) && self.below_once.contains(&block)
        };
        for tile in &mut *tiles {
            tile.active.retain(|&(x, y)| !done(x, y));
        }
        self.below_once = below;
        tiles.iter().all(|tile| tile.active.is_empty())
    }
}

/// One hundredth of the picture's mean luminance: below it an error counts absolutely.
fn luminance_floor(film: &Film) -> f64 {
    let sum: f64 = film.pixels.iter().map(|p| f64::from(p.mean().luminance())).sum();
    0.01 * sum / film.pixels.len().max(1) as f64
}

fn relative_error_squared(pixel: &Pixel, floor: f64) -> f64 {
    let scale = f64::from(pixel.mean().luminance()).max(floor);
    if scale > 0.0 { pixel.variance_of_mean() / (scale * scale) } else { 0.0 }
}
