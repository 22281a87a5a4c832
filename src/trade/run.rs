//! The measurement: a reference, then every way in turn, round by round.

use super::catalogue::Catalogue;
use super::state::{Cost, State};
use super::way::Way;
use crate::core::Rgb;
use std::time::Duration;

/// A picture to take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Task<'a> {
    /// How.
    pub way: &'a Way,
    /// Seed of its random numbers.
    pub seed: u32,
    /// Samples per pixel.
    pub spp: u32,
}

/// A picture that was taken, and what it cost.
#[derive(Clone, Debug, PartialEq)]
pub struct Shot {
    /// Linear radiance, row by row.
    pub pixels: Vec<Rgb>,
    /// What it cost.
    pub cost: Cost,
}

/// Who takes pictures and knows the time.
pub trait Workbench {
    /// Takes a picture; `None` if it was told to stop.
    ///
    /// # Errors
    /// If the way cannot be had.
    fn shoot(&mut self, task: &Task<'_>) -> Result<Option<Shot>, String>;

    /// Wall seconds since some moment: what the bound on the whole run is held against.
    fn seconds(&self) -> f64;
}

/// How long to measure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Rounds, at most.
    pub rounds: u32,
    /// Wall time of the whole run, earlier parts of it included; without it, only the rounds end it.
    pub time: Option<Duration>,
    /// Samples per pixel of the reference, both halves together, at most.
    pub reference_spp: u32,
    /// What all seeds come from: each round has its own, and each picture of the reference.
    pub seed: u32,
}

/// Pictures of the reference: each half has every other.
pub const REFERENCE_SHOTS: u32 = 8;

/// Share of the time that the reference may take.
const REFERENCE_SHARE: f64 = 0.35;

/// Rounds without which noise and bias cannot be told apart.
pub const LEAST_ROUNDS: u32 = 2;

/// What ended a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stopped {
    /// All rounds are done.
    Rounds,
    /// The time is up.
    Time,
    /// It was told to stop.
    Interrupted,
}

/// Hears how a run gets on.
pub trait Listener {
    /// What is measured next.
    fn tell(&mut self, line: &str);

    /// There is more that would be a pity to lose.
    ///
    /// # Errors
    /// If it cannot be kept.
    fn keep(&mut self, state: &State) -> Result<(), String>;
}

/// Measures all ways, going on from what the state holds already.
///
/// # Errors
/// If the base cannot be rendered, or the state cannot be kept. Another way that cannot be is left out of the
/// catalogue.
pub fn run(
    state: &mut State,
    options: &Options,
    bench: &mut dyn Workbench,
    listener: &mut dyn Listener,
) -> Result<Stopped, String> {
    let mut run = Run { options, began: bench.seconds() - state.seconds, bench, listener };
    let stopped = match run.reference(state)? {
        Some(stopped) => stopped,
        None => run.rounds(state)?,
    };
    state.seconds = run.elapsed();
    run.listener.keep(state)?;
    Ok(stopped)
}

struct Run<'a> {
    options: &'a Options,
    began: f64,
    bench: &'a mut dyn Workbench,
    listener: &'a mut dyn Listener,
}

impl Run<'_> {
    fn elapsed(&self) -> f64 {
        self.bench.seconds() - self.began
    }

    fn is_over(&self, share: f64) -> bool {
        self.options.time.is_some_and(|time| self.elapsed() >= share * time.as_secs_f64())
    }

    /// The two halves in turn, until they have all samples or their share of the time is up.
    fn reference(&mut self, state: &mut State) -> Result<Option<Stopped>, String> {
        let spp = self.options.reference_spp.div_ceil(REFERENCE_SHOTS).max(1);
        while state.reference_shots < REFERENCE_SHOTS {
            if state.reference_shots >= 2 && self.is_over(REFERENCE_SHARE) {
                break;
            }
            let shot = state.reference_shots;
            self.listener.tell(&format!("reference: {} of {REFERENCE_SHOTS}, {spp} spp", shot + 1));
            let base = &state.catalogue.ways[0];
            let task = Task { way: base, seed: reference_seed(self.options.seed, shot), spp };
            let Some(taken) = self.bench.shoot(&task)? else { return Ok(Some(Stopped::Interrupted)) };
            state.reference.halves[shot as usize % 2].add(&taken.pixels);
            state.reference_spp += spp;
            state.reference_shots += 1;
            state.seconds = self.elapsed();
            self.listener.keep(state)?;
        }
        // From here on the reference is what it is, for all rounds alike.
        state.reference_shots = REFERENCE_SHOTS;
        Ok(None)
    }

    fn rounds(&mut self, state: &mut State) -> Result<Stopped, String> {
        let mut longest = 0.0f64;
        for round in state.rounds..self.options.rounds.max(LEAST_ROUNDS) {
            // A round that the time has no room for would only be thrown away.
            if round >= LEAST_ROUNDS
                && self.options.time.is_some_and(|time| self.elapsed() + longest > time.as_secs_f64())
            {
                return Ok(Stopped::Time);
            }
            let started = self.elapsed();
            if !self.round(state, round)? {
                return Ok(Stopped::Interrupted);
            }
            longest = longest.max(self.elapsed() - started);
            state.seconds = self.elapsed();
            self.listener.keep(state)?;
        }
        Ok(Stopped::Rounds)
    }

    /// One picture of each way, or none of any: what a broken-off round has is forgotten, so that all ways have the
    /// same number.
    fn round(&mut self, state: &mut State, round: u32) -> Result<bool, String> {
        let mut taken: Vec<Option<Shot>> = vec![None; state.catalogue.ways.len()];
        let mut failed: Vec<(usize, String)> = vec![];
        for (turn, way) in order(taken.len(), round).into_iter().enumerate() {
            let Catalogue { ways, .. } = &state.catalogue;
            let name = &ways[way].name;
            self.listener.tell(&format!(
                "round {} of {}, {} of {}: {name}",
                round + 1,
                self.options.rounds.max(LEAST_ROUNDS),
                turn + 1,
                ways.len()
            ));
            let task =
                Task { way: &ways[way], seed: round_seed(self.options.seed, round), spp: ways[way].spp };
            match self.bench.shoot(&task) {
                Ok(Some(shot)) => taken[way] = Some(shot),
                Ok(None) => return Ok(false),
                Err(why) if round == 0 && way > 0 => failed.push((way, why)),
                Err(why) => return Err(why),
            }
        }
        for (way, shot) in taken.iter().enumerate() {
            if let Some(shot) = shot {
                state.measured[way].add(shot);
            }
        }
        failed.sort();
        for (way, why) in failed.iter().rev() {
            state.leave_out(*way, why);
        }
        state.rounds = round + 1;
        Ok(true)
    }
}

/// The order of a round: each begins elsewhere, and every other one goes backwards, so that a machine that slows down
/// slows all ways.
fn order(ways: usize, round: u32) -> Vec<usize> {
    let start = (round as usize).wrapping_mul(7) % ways.max(1);
    let mut order: Vec<usize> = (0..ways).map(|i| (start + i) % ways).collect();
    if round % 2 == 1 {
        order.reverse();
    }
    order
}

fn reference_seed(seed: u32, shot: u32) -> u32 {
    crate::core::sampler::hash(seed ^ 0x5eed_0000).wrapping_add(shot)
}

/// All ways of a round draw the same numbers: where two differ in nothing that the numbers meet, neither do their
/// errors, and what is left to compare is their cost.
fn round_seed(seed: u32, round: u32) -> u32 {
    reference_seed(seed, REFERENCE_SHOTS).wrapping_add(round)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn each_round_has_every_way_once_and_begins_elsewhere() {
        let firsts: BTreeSet<usize> = (0..4).map(|round| order(11, round)[0]).collect();
        assert_eq!(firsts.len(), 4);
        for round in 0..4 {
            let all: BTreeSet<usize> = order(11, round).into_iter().collect();
            assert_eq!(all.len(), 11);
        }
    }

    #[test]
    fn rounds_and_the_pictures_of_the_reference_have_seeds_of_their_own() {
        for seed in [0, 1, 77] {
            let rounds = (0..20).map(|round| round_seed(seed, round));
            let all: BTreeSet<u32> =
                rounds.chain((0..REFERENCE_SHOTS).map(|shot| reference_seed(seed, shot))).collect();
            assert_eq!(all.len(), 20 + REFERENCE_SHOTS as usize);
        }
    }
}
