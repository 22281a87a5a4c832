//! Asks recorded rays again, and nothing else.

use super::{Batch, clock};
use crate::accel::{Accelerator, Coherence};
use crate::core::Hit;
use crate::integrator::RayClass;
use rayon::prelude::*;

/// One class of recorded rays on one backend.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct ClassTiming {
    /// What the rays are for.
    pub class: RayClass,
    /// How many there are.
    pub rays: u64,
    /// How many hit something, or are in shadow.
    pub hits: u64,
    /// Seconds within the accelerator, summed over the threads: of the median round. See [`clock`].
    pub seconds: f64,
    /// The same of the fastest round.
    pub fastest_seconds: f64,
    /// The same of the slowest round.
    pub slowest_seconds: f64,
}

/// All classes of a file on one backend.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Replay {
    /// The backend's own name.
    pub backend: String,
    /// Classes that have rays.
    pub classes: Vec<ClassTiming>,
}

impl Replay {
    /// The timing of a class that has rays.
    pub fn class(&self, class: RayClass) -> Option<&ClassTiming> {
        self.classes.iter().find(|timing| timing.class == class)
    }
}

/// What asking some batches once took and gave.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Round {
    /// Seconds within the accelerator, summed over the threads. See [`clock`].
    pub seconds: f64,
    /// Rays that hit something, or are in shadow.
    pub hits: u64,
}

/// Asks all batches of `accel`, `rounds` times over, on the calling thread pool.
pub fn replay(accel: &dyn Accelerator, batches: &[Batch], rounds: usize) -> Replay {
    let classes = RayClass::ALL.into_iter().filter_map(|class| {
        let of_class: Vec<&Batch> = batches.iter().filter(|b| b.class == class).collect();
        let rays = of_class.iter().map(|b| b.rays.len() as u64).sum();
        if rays == 0 {
            return None;
        }
        let mut timings: Vec<Round> = (0..rounds.max(1)).map(|_| ask_all(accel, &of_class)).collect();
        timings.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
        let Round { seconds, hits } = timings[timings.len() / 2];
        let (fastest_seconds, slowest_seconds) = (timings[0].seconds, timings[timings.len() - 1].seconds);
        Some(ClassTiming { class, rays, hits, seconds, fastest_seconds, slowest_seconds })
    });
    Replay { backend: accel.info().name, classes: classes.collect() }
}

/// Asks all batches once, on the calling thread pool.
pub fn ask_all(accel: &dyn Accelerator, batches: &[&Batch]) -> Round {
    let answers = batches.par_iter().with_max_len(1).map_init(
        || (Vec::<Option<Hit>>::new(), Vec::<bool>::new()),
        |(hits, occluded), batch| {
            hits.clear();
            hits.resize(batch.rays.len(), None);
            occluded.clear();
            occluded.resize(batch.rays.len(), false);
            let started = clock::thread_seconds();
            ask(accel, batch, hits, occluded);
            let seconds = clock::thread_seconds() - started;
            let hits = hits.iter().flatten().count() + occluded.iter().filter(|o| **o).count();
            Round { seconds, hits: hits as u64 }
        },
    );
    answers.reduce(Round::default, |a, b| Round { seconds: a.seconds + b.seconds, hits: a.hits + b.hits })
}

/// Asks one batch as the integrator does: shadow rays for any hit, into `occluded`; the others for the closest, into
/// `hits`. The other slice is left as it is.
///
/// # Panics
/// If the slice that is filled has another length than the batch.
pub fn ask(accel: &dyn Accelerator, batch: &Batch, hits: &mut [Option<Hit>], occluded: &mut [bool]) {
    match batch.class {
        RayClass::Shadow => accel.occluded(&batch.rays, Coherence::Incoherent, occluded),
        RayClass::Primary => accel.intersect(&batch.rays, Coherence::Coherent, hits),
        RayClass::Glossy | RayClass::Diffuse => accel.intersect(&batch.rays, Coherence::Incoherent, hits),
    }
}
