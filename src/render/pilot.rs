//! What a pilot finds best for a picture: into how many rays first hits split, whether samples of lights are worth splitting too,
//! whether those of glossy hits are worth choosing among candidates, and whether guides to all light that surfaces reflect are worth
//! asking.
//!
//! Before the picture some pixels take a few samples one way and as many another: the variances and the costs tell which is
//! better. The pilot's samples have numbers of their own and are not the picture's: so its answer hangs on the scene and its
//! settings alone, and every part of a picture finds the same.

use super::split::{PILOT_SPLIT, Split, Trials};
use super::tile::{Tile, tiles};
use super::trial::{Parts, Trial};
use crate::film::{Film, PixelRect};
use crate::integrator::{Integrator, Scratch, Tally, Work};
use crate::scene::{LightCandidates, LightSamples, Plan, Scene};
use rayon::prelude::*;
use std::sync::atomic::AtomicBool;

/// Parts of a pilot's samples whose means are compared: each is well spread by itself, as samples of one pixel are.
const PARTS: u32 = 8;

/// Samples of each part.
const SAMPLES_OF_PART: u32 = 2;

/// Of so many pixels one is the pilot's, at least.
const PIXELS_PER_TRIED: u32 = 128;

/// Pixels of a pilot, at most: they tell the ratio of variances to a few percent.
const MOST_TRIED: u32 = 2048;

/// Edge of the tiles in which a pilot works, so that each has a wave's worth of samples.
const TILE_SIZE: u32 = 128;

/// Guides to all light that surfaces reflect must promise to be better than those to caustics alone by this factor: to ask them
/// takes a sixth to a third of the time, which costs in rays do not tell.
const GUIDES_WORTH_IT: f64 = 0.8;

/// What a pilot has found best.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Best {
    /// What a first hit is worth splitting into.
    pub split: Split,
    /// Candidates for each sample of lights at a glossy hit.
    pub light_candidates: u32,
    /// Whether diffuse surfaces look for all light that others reflect.
    pub guides_indirect: bool,
}

impl Best {
    /// What the scene and its settings say, without a pilot.
    pub(super) fn planned(scene: &Scene, integrator: &Integrator) -> Self {
        Self {
            split: Split { rays: Plan::of(scene).split, lights: integrator.splits_lights() },
            light_candidates: integrator.light_candidates(),
            guides_indirect: integrator.guides_indirect(),
        }
    }

    /// An integrator that does so.
    pub(super) fn of<'a>(&self, integrator: Integrator<'a>) -> Integrator<'a> {
        integrator
            .guided_to_indirect(self.guides_indirect)
            .with_light_candidates(self.light_candidates)
            .splitting_lights(self.split.lights)
    }
}

/// What is best for a picture of the scene, as far as a pilot can tell; anything if `stop` becomes true.
///
/// `integrator` makes one that draws other numbers than the picture.
pub(super) fn best<'a>(scene: &'a Scene, integrator: impl Fn() -> Integrator<'a>, stop: &AtomicBool) -> Best {
    let [width, height] = scene.camera.resolution;
    let whole = PixelRect { x0: 0, y0: 0, x1: width, y1: height };
    let is_tried = |pixel: &&(u32, u32)| is_tried(pixel, whole.area());
    let tiles = tiles(whole, TILE_SIZE).into_iter().map(|tile| {
        let pixels: Vec<_> = tile.active.iter().filter(is_tried).copied().collect();
        (tile, pixels)
    });
    let tiles: Vec<_> = tiles.collect();
    let try_with = |integrator: &Integrator, split| {
        let of_tiles: Vec<Trial> = tiles
            .par_iter()
            .map(|(tile, pixels)| try_splitting(scene, integrator, (tile, pixels), split, stop))
            .collect();
        of_tiles.into_iter().fold(Trial::default(), Trial::and)
    };

    let (plan, plain) = (Plan::of(scene), integrator());
    let mut best = Best::planned(scene, &plain);
    let mut one = try_with(&plain, 1);
    if plan.tries_guides && plain.has_indirect_guides() {
        let guided = try_with(&integrator().guided_to_indirect(true), 1);
        if guided.left_beside(&one) < GUIDES_WORTH_IT {
            (one, best.guides_indirect) = (guided, true);
        }
    }
    if !plan.splits_by_pilot {
        return best;
    }
    if plan.tries_candidates {
        let tried = Best { light_candidates: LightCandidates::TRIED, ..best };
        let chosen = try_with(&tried.of(integrator()), 1);
        if chosen.left_beside(&one) < 1.0 {
            (one, best) = (chosen, tried);
        }
    }
    let splits_lights: &[bool] = match scene.settings.light_samples {
        _ if !plain.samples_lights() => &[false],
        LightSamples::One => &[false],
        LightSamples::Split => &[true],
        LightSamples::Auto => &[false, true],
    };
    let many = [false, true].map(|splits| {
        let integrator = || best.of(integrator()).splitting_lights(splits);
        let wanted = splits_lights.contains(&splits).then(|| try_with(&integrator(), PILOT_SPLIT));
        wanted.unwrap_or_default()
    });
    Best { split: Trials { one, many }.best_split(), ..best }
}

/// Whether a pixel of a picture of `area` pixels is the pilot's: those of a lattice that is even in both directions.
fn is_tried(&(x, y): &(u32, u32), area: usize) -> bool {
    const GOLDEN: f64 = 0.618_033_988_749_895;
    let one_of = (area as u64).div_ceil(u64::from(MOST_TRIED)).max(u64::from(PIXELS_PER_TRIED));
    let step = (one_of as f64 * GOLDEN).round() as u64;
    (u64::from(x) + u64::from(y) * step).is_multiple_of(one_of)
}

/// Takes a pilot's samples of some pixels of a tile, and measures them.
fn try_splitting(
    scene: &Scene,
    integrator: &Integrator,
    (tile, pixels): (&Tile, &[(u32, u32)]),
    split: u32,
    stop: &AtomicBool,
) -> Trial {
    let mut film = Film::new(scene.camera.resolution, tile.rect);
    let (mut parts, mut tally) = (Parts::new(pixels.len()), Tally::default());
    let mut scratch = Scratch::default();
    for part in 0..PARTS {
        let samples = part * SAMPLES_OF_PART..(part + 1) * SAMPLES_OF_PART;
        integrator.render(&mut film, &Work { pixels, samples, split }, &mut scratch, &mut tally, stop);
        parts.note(&film, pixels, SAMPLES_OF_PART);
    }
    parts.trial(&tally)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pilot_has_few_pixels_and_they_are_far_from_each_other() {
        for (edge, least) in [(128, 8), (256, 8), (512, 8), (2048, 32)] {
            let pixels = (0..edge).flat_map(|y| (0..edge).map(move |x| (x, y)));
            let tried: Vec<_> = pixels.filter(|p| is_tried(p, (edge * edge) as usize)).collect();
            let expected = (edge * edge / PIXELS_PER_TRIED).min(MOST_TRIED);
            assert!(tried.len().abs_diff(expected as usize) <= edge as usize / 64, "{edge}: {}", tried.len());
            let near = |(x, y): (u32, u32)| {
                tried.iter().filter(|(a, b)| a.abs_diff(x) + b.abs_diff(y) < least).count()
            };
            assert!(tried.iter().step_by(7).all(|p| near(*p) == 1), "{edge}: none is near another");
        }
    }
}
