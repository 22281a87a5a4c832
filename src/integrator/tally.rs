//! What a render counts.

use crate::core::Rgb;
use crate::film::{Dropped, RadianceSum};

/// Rays asked, by class.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct RayCounts {
    /// From the camera.
    pub primary: u64,
    /// From mirrors and glossy lobes.
    pub glossy: u64,
    /// From diffuse lobes.
    pub diffuse: u64,
    /// Towards lights.
    pub shadow: u64,
}

impl RayCounts {
    /// Of all classes.
    pub fn total(&self) -> u64 {
        self.primary + self.glossy + self.diffuse + self.shadow
    }
}

/// Counts of a tile, or of a whole render once merged; the order of merging changes nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Rays asked.
    pub rays: RayCounts,
    /// Contributions that could not be added.
    pub dropped: Dropped,
    /// Camera samples.
    pub samples: u64,
    /// Sum over the camera samples of the throughput cut off at the greatest depth.
    lost: RadianceSum,
}

impl Tally {
    /// Adds another's counts.
    pub fn merge(&mut self, other: &Self) {
        self.rays.primary += other.rays.primary;
        self.rays.glossy += other.rays.glossy;
        self.rays.diffuse += other.rays.diffuse;
        self.rays.shadow += other.rays.shadow;
        self.dropped.merge(other.dropped);
        self.samples += other.samples;
        self.lost += other.lost;
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
