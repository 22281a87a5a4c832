//! Into how many rays the first glossy hit of a path is worth splitting, tile by tile.
//!
//! With V1 the variance that a pixel has without the lobe's own, V2 that of one lobe sample, and c1, c2 what a camera
//! sample and a lobe sample cost, m rays have the variance `V1 + V2 / m` at the cost `c1 + m c2`: the product is
//! least at `m = sqrt(V2 c1 / (V1 c2))`. Both sides are measured, in two small rounds that stay in the picture. The
//! cost is counted in rays and not in seconds, so that a seed gives the same picture on every machine.

use crate::film::Film;
use crate::integrator::Tally;
use crate::scene::settings::MAX_AUTO_SPLIT;

/// Rays per glossy hit in the second pilot round.
pub(super) const PILOT_SPLIT: u32 = 4;

/// Samples per pixel of each pilot round, of `count` in all: few, since they may be of the wrong kind.
pub(super) fn pilot_samples(count: u32) -> u32 {
    (count / 16).clamp(2, 8).min(count / 2).max(1)
}

/// What a tile's samples of one round were like.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct Measured {
    /// Sum over the pixels of the samples' variance relative to the squared mean.
    variance: f64,
    /// Rays.
    rays: f64,
    /// Camera samples.
    samples: f64,
}

impl Measured {
    pub(super) fn new(film: &Film, tally: &Tally) -> Self {
        let relative = |pixel: &crate::film::Pixel| {
            let mean = f64::from(pixel.mean().luminance());
            let variance = pixel.variance_of_mean() * f64::from(pixel.count);
            if mean > 0.0 { variance / (mean * mean) } else { 0.0 }
        };
        Self {
            variance: film.pixels.iter().map(relative).sum(),
            rays: tally.all_rays().rays as f64,
            samples: tally.samples as f64,
        }
    }

    fn add(&mut self, other: &Self) {
        self.variance += other.variance;
        self.rays += other.rays;
        self.samples += other.samples;
    }
}

/// The number of rays for each tile.
pub(super) struct SplitMap(Vec<u32>);

impl SplitMap {
    /// The same everywhere.
    pub(super) fn constant(split: u32, tiles: usize) -> Self {
        Self(vec![split; tiles])
    }

    /// From the rounds of one ray and of [`PILOT_SPLIT`] rays, each tile of the grid of so many columns judged with
    /// its neighbours.
    pub(super) fn choose(one: &[Measured], many: &[Measured], columns: usize) -> Self {
        let rows = one.len() / columns.max(1);
        let around = |centre: usize, end: usize| centre.saturating_sub(1)..(centre + 2).min(end);
        let neighbourhood = |row: usize, column: usize, measured: &[Measured]| {
            let mut sum = Measured::default();
            for r in around(row, rows) {
                around(column, columns).for_each(|c| sum.add(&measured[r * columns + c]));
            }
            sum
        };
        let cells = (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
        let best =
            |(row, column)| best_split(&neighbourhood(row, column, one), &neighbourhood(row, column, many));
        Self(cells.map(best).collect())
    }

    pub(super) fn of_tile(&self, number: usize) -> u32 {
        self.0[number]
    }
}

/// `sqrt(V2 c1 / (V1 c2))`, from variance and cost at one ray and at [`PILOT_SPLIT`] rays.
fn best_split(one: &Measured, many: &Measured) -> u32 {
    if one.samples == 0.0 || many.samples == 0.0 {
        return 1;
    }
    let m = f64::from(PILOT_SPLIT);
    let lobe_cost = (many.rays / many.samples - one.rays / one.samples) / (m - 1.0);
    let lobe_variance = (one.variance - many.variance) * m / (m - 1.0);
    if lobe_cost <= 0.0 || lobe_variance <= 0.0 {
        return 1;
    }
    let camera_cost = (one.rays / one.samples - lobe_cost).max(1.0);
    let camera_variance = (one.variance - lobe_variance).max(1e-3 * one.variance);
    let best = (lobe_variance * camera_cost / (camera_variance * lobe_cost)).sqrt();
    best.round().clamp(1.0, f64::from(MAX_AUTO_SPLIT)) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measured(v1: f64, v2: f64, glossy: f64, m: f64) -> Measured {
        Measured { variance: v1 + v2 / m, rays: 1.0 + glossy * m, samples: 1.0 }
    }

    #[test]
    fn the_best_split_is_the_closed_form() {
        for (v1, v2, expected) in [(0.01, 0.21, 5), (0.05, 0.21, 2), (0.2, 0.2, 1), (0.21, 0.0, 1)] {
            let m = f64::from(PILOT_SPLIT);
            assert_eq!(best_split(&measured(v1, v2, 1.0, 1.0), &measured(v1, v2, 1.0, m)), expected);
        }
        assert_eq!(best_split(&Measured::default(), &Measured::default()), 1);
    }
}
