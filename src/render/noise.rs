//! When a part of the picture is clean enough.

use super::decisions::{Block, Decisions};
use super::tile::Tile;
use crate::film::{Film, Pixel};
use std::collections::{BTreeMap, BTreeSet};

/// Edge of the blocks of pixels that are judged together: one pixel's own estimate is too uncertain, and a pixel that
/// has missed a rare bright path would call itself clean.
const BLOCK: u32 = 8;

pub(super) fn block_of(&(x, y): &(u32, u32)) -> Block {
    (x / BLOCK, y / BLOCK)
}

/// Takes the pixels of blocks that were found clean out of work; whether none is left.
pub(super) fn leave_clean(decisions: &Decisions, tiles: &mut [Tile]) -> bool {
    for tile in &mut *tiles {
        tile.active.retain(|pixel| !decisions.clean.contains(&block_of(pixel)));
    }
    tiles.iter().all(|tile| tile.active.is_empty())
}

/// Finds the blocks that are clean at the end of a round.
///
/// Decides from the film alone, so that the same samples make the same decisions on any number of threads. A block is
/// left alone once its error has been below the threshold in two rounds in a row: the decision comes a round late, so
/// that the samples that look clean by luck are not those that decide.
pub(super) fn judge(threshold: f64, film: &Film, tiles: &[Tile], decisions: &mut Decisions) {
    let floor = luminance_floor(film);
    let mut blocks: BTreeMap<Block, (f64, f64)> = BTreeMap::new();
    for pixel in tiles.iter().flat_map(|tile| &tile.active) {
        let error = relative_error_squared(film.pixel(pixel.0, pixel.1), floor);
        let block = blocks.entry(block_of(pixel)).or_default();
        *block = (block.0 + error, block.1 + 1.0);
    }
    let below: BTreeSet<Block> = blocks
        .into_iter()
        .filter(|(_, (sum, pixels))| (sum / pixels).sqrt() < threshold)
        .map(|(block, _)| block)
        .collect();
    decisions.clean.extend(below.intersection(&decisions.below_once));
    decisions.below_once = below;
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
