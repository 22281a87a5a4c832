//! Asks recorded rays again, and nothing else.

use super::Batch;
use crate::accel::{Accelerator, Coherence};
use crate::core::Hit;
use crate::integrator::RayClass;
use rayon::prelude::*;
use std::time::Instant;

/// One class of recorded rays on one backend.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct ClassTiming {
    /// What the rays are for.
    pub class: RayClass,
    /// How many there are.
    pub rays: u64,
    /// How many hit something, or are in shadow.
    pub hits: u64,
    /// Seconds within the accelerator, summed over the threads: of the median round.
    pub seconds: f64,
}

/// All classes of a file on one backend.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Replay {
    /// The backend's own name.
    pub backend: String,
    /// Classes that have rays.
    pub classes: Vec<ClassTiming>,
}

/// Asks all batches of `accel`, `rounds` times over, on the calling thread pool.
pub fn replay(accel: &dyn Accelerator, batches: &[Batch], rounds: usize) -> Replay {
    let classes = RayClass::ALL.into_iter().filter_map(|class| {
        let of_class: Vec<&Batch> = batches.iter().filter(|b| b.class == class).collect();
        let rays = of_class.iter().map(|b| b.rays.len() as u64).sum();
        if rays == 0 {
            return None;
        }
        let mut timings: Vec<(f64, u64)> = (0..rounds.max(1)).map(|_| ask_all(accel, &of_class)).collect();
        timings.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (seconds, hits) = timings[timings.len() / 2];
        Some(ClassTiming { class, rays, hits, seconds })
    });
    Replay { backend: accel.info().name, classes: classes.collect() }
}

/// Seconds, summed over the threads, and hits of one round.
fn ask_all(accel: &dyn Accelerator, batches: &[&Batch]) -> (f64, u64) {
    let answers = batches.par_iter().with_max_len(1).map_init(
        || (Vec::<Option<Hit>>::new(), Vec::<bool>::new()),
        |(hits, occluded), batch| {
            hits.clear();
            hits.resize(batch.rays.len(), None);
            occluded.clear();
            occluded.resize(batch.rays.len(), false);
            let started = Instant::now();
            match batch.class {
                RayClass::Shadow => accel.occluded(&batch.rays, Coherence::Incoherent, occluded),
                RayClass::Primary => accel.intersect(&batch.rays, Coherence::Coherent, hits),
                RayClass::Glossy | RayClass::Diffuse => {
                    accel.intersect(&batch.rays, Coherence::Incoherent, hits)
                }
            }
            let seconds = started.elapsed().as_secs_f64();
            let hit = hits.iter().flatten().count() + occluded.iter().filter(|o| **o).count();
            (seconds, hit as u64)
        },
    );
    answers.reduce(|| (0.0, 0), |a, b| (a.0 + b.0, a.1 + b.1))
}
