//! What a render counts.

use crate::core::{Ray, Rgb};
use crate::film::{Dropped, RadianceSum};
use std::time::Instant;

/// What a ray is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum RayClass {
    /// From the camera.
    Primary,
    /// From mirrors and glossy lobes.
    Glossy,
    /// From diffuse lobes.
    Diffuse,
    /// Towards lights.
    Shadow,
}

impl RayClass {
    /// All of them, in the order of their numbers.
    pub const ALL: [Self; 4] = [Self::Primary, Self::Glossy, Self::Diffuse, Self::Shadow];

    /// Its name for people.
    pub fn name(self) -> &'static str {
        ["primary", "glossy", "diffuse", "shadow"][self as usize]
    }
}

/// Is told of every slice of rays before it is asked; called from any thread.
pub trait RayLog: Sync {
    /// These rays of a class are asked next.
    fn record(&self, class: RayClass, rays: &[Ray]);
}

/// Rays of one class and the time that the accelerator took for them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct ClassCount {
    /// Rays asked.
    pub rays: u64,
    /// Time within the accelerator, summed over the threads.
    pub nanoseconds: u64,
}

/// Counts of a tile, or of a whole render once merged; the order of merging changes nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Tally {
    /// Rays by class.
    classes: [ClassCount; 4],
    /// Contributions that could not be added.
    pub dropped: Dropped,
    /// Camera samples.
    pub samples: u64,
    /// Candidates for samples of lights beyond one for each.
    #[serde(default)]
    pub candidates: u64,
    /// Sum over the camera samples of the throughput cut off at the greatest depth.
    lost: RadianceSum,
}

impl Tally {
    /// Adds another's counts.
    pub fn merge(&mut self, other: &Self) {
        for (mine, other) in self.classes.iter_mut().zip(other.classes) {
            mine.rays += other.rays;
            mine.nanoseconds += other.nanoseconds;
        }
        self.dropped.merge(other.dropped);
        self.samples += other.samples;
        self.candidates += other.candidates;
        self.lost += other.lost;
    }

    /// Rays of a class and their time.
    pub fn class(&self, class: RayClass) -> ClassCount {
        self.classes[class as usize]
    }

    /// Rays of all classes and their time.
    pub fn all_rays(&self) -> ClassCount {
        self.classes.iter().fold(ClassCount::default(), |sum, c| ClassCount {
            rays: sum.rays + c.rays,
            nanoseconds: sum.nanoseconds + c.nanoseconds,
        })
    }

    /// Calls the accelerator by `ask` for so many rays of a class, and notes the time that it takes.
    pub(super) fn time(&mut self, class: RayClass, rays: usize, ask: impl FnOnce()) {
        let started = Instant::now();
        ask();
        let count = &mut self.classes[class as usize];
        count.rays += rays as u64;
        count.nanoseconds += started.elapsed().as_nanos() as u64;
    }

    /// Notes throughput that goes no further.
    pub(super) fn lose(&mut self, throughput: Rgb) {
        let share = throughput.luminance();
        if share.is_finite() {
            self.lost += RadianceSum::from_finite(share);
        }
    }

    /// Mean throughput per camera sample that was cut off at the greatest depth: 0 where nothing was.
    ///
    /// Between surfaces that reflect the fraction k of everything, depth D loses `k^(D+1)`.
    pub fn lost_throughput(&self) -> f64 {
        self.lost.to_f64() / self.samples.max(1) as f64
    }
}
