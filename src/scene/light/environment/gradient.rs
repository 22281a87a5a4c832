//! A sky without a sun.

use crate::core::Rgb;
use glam::Vec3;

/// Radiance that is linear in the cosine to `up`, from the horizon to either pole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gradient {
    /// Where the zenith is; unit length.
    pub up: Vec3,
    /// Radiance along `up`.
    pub zenith: Rgb,
    /// Radiance at right angles to `up`.
    pub horizon: Rgb,
    /// Radiance against `up`.
    pub nadir: Rgb,
}

impl Gradient {
    /// Radiance from the unit direction `wi`.
    #[inline(always)]
    pub fn le(&self, wi: Vec3) -> Rgb {
        let cos = self.up.dot(wi).clamp(-1.0, 1.0);
        let pole = if cos >= 0.0 { self.zenith } else { self.nadir };
        self.horizon * (1.0 - cos.abs()) + pole * cos.abs()
    }

    /// Mean radiance of all directions: the cosine is uniform, its mean on either side 1/2.
    pub(super) fn mean(&self) -> Rgb {
        self.horizon * 0.5 + (self.zenith + self.nadir) * 0.25
    }
}
