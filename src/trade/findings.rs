//! What a run has found: costs and errors of each way, who is beaten by whom, and advice.

use super::advice::{Advice, Law, Target, advise};
use super::catalogue::{LeftOut, Turned};
use super::estimate::{Errors, Estimate};
use super::run::LEAST_ROUNDS;
use super::state::{Cost, Measured, State};
use super::way::{Claim, Way};
use crate::compare::diff::{Range, compare};
use crate::compare::flip;
use crate::core::Rgb;
use crate::image_io::Image;
use serde::{Deserialize, Serialize};

/// A number that was measured round by round.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// The middle one.
    pub median: f64,
    /// The least.
    pub least: f64,
    /// The greatest.
    pub most: f64,
    /// The mean's 95 % interval.
    pub mean: Estimate,
}

impl Spread {
    fn of(measured: &[f64]) -> Self {
        let mut sorted = measured.to_vec();
        sorted.sort_by(f64::total_cmp);
        let at = |i: usize| sorted.get(i).copied().unwrap_or_default();
        let median = 0.5 * (at((sorted.len().max(1) - 1) / 2) + at(sorted.len() / 2));
        let last = sorted.len().saturating_sub(1);
        Self { median, least: at(0), most: at(last), mean: Estimate::of(measured) }
    }
}

/// What the error of a way comes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// No bias was found, and none was claimed.
    Unbiased,
    /// There may be a bias, but none was found: it is smaller than the measurement shows.
    NoBiasFound,
    /// A bias was found where there may be one.
    Floor,
    /// A bias was found where there should be none.
    UnexpectedBias,
}

impl Verdict {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Unbiased => "unbiased",
            Self::NoBiasFound => "no bias found",
            Self::Floor => "bias",
            Self::UnexpectedBias => "unexpected bias",
        }
    }
}

/// What was found of one way.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Found {
    /// The way.
    pub way: Way,
    /// CPU seconds of a picture, of all threads.
    pub cpu_seconds: Spread,
    /// Wall seconds of a picture.
    pub wall_seconds: Spread,
    /// Its error.
    pub errors: Errors,
    /// FLIP of a picture, as a display shows it.
    pub flip: Estimate,
    /// What the error comes to.
    pub verdict: Verdict,
    /// `1 / (relMSE x CPU seconds)`.
    pub efficiency: f64,
    /// That of the base is 1.
    pub relative_efficiency: f64,
    /// Rays, mean samples per pixel, memory and build of the first picture.
    pub cost: Cost,
    /// How it does with more or fewer samples.
    pub law: Law,
    /// Whether no other way is both faster and more exact.
    pub on_front: bool,
    /// Number of a way that is both faster and more exact, beyond both intervals.
    pub dominated_by: Option<usize>,
}

/// Everything that was found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Findings {
    /// Version of gloss.
    pub version: String,
    /// How the user calls the scene.
    pub scene: String,
    /// Columns and rows that were measured.
    pub resolution: [u32; 2],
    /// Columns and rows of the scene: what advice is for.
    pub full_resolution: [u32; 2],
    /// The machine.
    pub machine: String,
    /// Who answers rays in the base.
    pub backend: String,
    /// Rounds: pictures of each way.
    pub rounds: u32,
    /// Wall seconds of the run.
    pub seconds: f64,
    /// Samples per pixel of the reference.
    pub reference_spp: u32,
    /// relMSE of the reference itself.
    pub reference_error: Estimate,
    /// The ways; the first is the base.
    pub ways: Vec<Found>,
    /// The knobs.
    pub knobs: Vec<Turned>,
    /// What was not measured.
    pub left_out: Vec<LeftOut>,
    /// What to take for the targets that were asked for.
    pub advice: Vec<Advice>,
}

/// What the run itself does not know.
#[derive(Clone, Debug, Default)]
pub struct About {
    /// How the user calls the scene.
    pub scene: String,
    /// Columns and rows of the scene.
    pub full_resolution: [u32; 2],
    /// The machine.
    pub machine: String,
    /// Who answers rays in the base.
    pub backend: String,
}

impl Findings {
    /// What a state comes to; `None` before [`LEAST_ROUNDS`].
    pub fn of(state: &State, about: &About, targets: &[Target]) -> Option<Self> {
        if state.rounds < LEAST_ROUNDS {
            return None;
        }
        let ways = state.catalogue.ways.iter().zip(&state.measured);
        let mut found: Vec<Found> = ways.map(|(way, measured)| found(way, measured, state)).collect();
        judge_front(&mut found);
        let base = found[0].efficiency;
        found.iter_mut().for_each(|f| f.relative_efficiency = f.efficiency / base);
        let pixels = about.full_resolution.map(f64::from).iter().product();
        let advice = targets.iter().filter_map(|target| advise(&found, *target, pixels)).collect();
        Some(Self {
            version: env!("CARGO_PKG_VERSION").into(),
            scene: about.scene.clone(),
            resolution: state.resolution,
            full_resolution: about.full_resolution,
            machine: about.machine.clone(),
            backend: about.backend.clone(),
            rounds: state.rounds,
            seconds: state.seconds,
            reference_spp: state.reference_spp,
            reference_error: state.reference.error(),
            ways: found,
            knobs: state.catalogue.knobs.clone(),
            left_out: state.catalogue.left_out.clone(),
            advice,
        })
    }

    /// The best way for a target in a picture of so many pixels.
    pub fn advise(&self, target: Target, pixels: f64) -> Option<Advice> {
        advise(&self.ways, target, pixels)
    }
}

fn found(way: &Way, measured: &Measured, state: &State) -> Found {
    let Measured { sums, costs, pictures } = measured;
    let each = |of: &dyn Fn(&Cost) -> f64| Spread::of(&costs.iter().map(of).collect::<Vec<_>>());
    let cpu_seconds = each(&|cost| cost.cpu_seconds);
    let errors = Errors::of(sums, &state.reference);
    let verdict = match (way.claim, errors.bias.is_positive()) {
        (Claim::Unbiased, false) => Verdict::Unbiased,
        (Claim::Biased, false) => Verdict::NoBiasFound,
        (Claim::Biased, true) => Verdict::Floor,
        (Claim::Unbiased, true) => Verdict::UnexpectedBias,
    };
    let spp = each(&|cost| cost.spp).mean.value;
    let [width, height] = state.resolution.map(f64::from);
    let flips: Vec<f64> = pictures.iter().map(|picture| flip_of(picture, state).0).collect();
    Found {
        way: way.clone(),
        cpu_seconds,
        wall_seconds: each(&|cost| cost.wall_seconds),
        errors,
        flip: Estimate::of(&flips),
        verdict,
        efficiency: (errors.relmse.value.max(1e-30) * cpu_seconds.median.max(1e-9)).recip(),
        relative_efficiency: 1.0,
        cost: costs[0],
        law: Law {
            spp,
            noise: errors.noise.value,
            floor: match verdict {
                Verdict::Unbiased => 0.0,
                Verdict::NoBiasFound => errors.bias.bound(),
                Verdict::Floor | Verdict::UnexpectedBias => errors.bias.value,
            },
            seconds_per_pixel: cpu_seconds.median / (width * height),
            uncertainty: cpu_seconds.mean.relative_reach().hypot(errors.noise.relative_reach()),
        },
        on_front: false,
        dominated_by: None,
    }
}

/// FLIP of a picture against the reference, and its map.
pub(super) fn flip_of(picture: &[Rgb], state: &State) -> (f64, Vec<u8>) {
    let [width, height] = state.resolution;
    let image = |pixels: &[Rgb]| Image::new(width, height, pixels.to_vec());
    let reference = image(&state.reference.picture());
    match compare(&image(picture), &reference, Range::Ldr, flip::DEFAULT_PPD) {
        Ok(difference) => (difference.flip, difference.map_rgb8()),
        // Films drop what is not finite, so that this is a picture without pixels.
        Err(_) => (0.0, vec![]),
    }
}

/// Marks who is on the front of time and error, and who is beaten beyond doubt.
fn judge_front(found: &mut [Found]) {
    let place = |f: &Found| (f.cpu_seconds.median, f.errors.relmse.value);
    for i in 0..found.len() {
        let (time, error) = place(&found[i]);
        let better = |f: &Found| {
            let (t, e) = place(f);
            t <= time && e <= error && (t < time || e < error)
        };
        found[i].on_front = !found.iter().any(better);
        let me = &found[i];
        let beats = |f: &Found| {
            f.cpu_seconds.mean.high < me.cpu_seconds.mean.low && f.errors.relmse.high < me.errors.relmse.low
        };
        let beaten = (0..found.len()).filter(|j| beats(&found[*j]));
        let best = beaten.max_by(|a, b| found[*a].efficiency.total_cmp(&found[*b].efficiency));
        found[i].dominated_by = best;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_of_an_even_number_is_between_the_middle_ones() {
        let spread = Spread::of(&[4.0, 1.0, 3.0, 100.0]);
        assert_eq!((spread.median, spread.least, spread.most), (3.5, 1.0, 100.0));
        assert_eq!(Spread::of(&[7.0]).median, 7.0);
    }
}
