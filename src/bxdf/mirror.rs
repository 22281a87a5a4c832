//! The perfect mirror, and the mirror direction that every glossy lobe is about.

use super::{Incidence, LobeSample, above_horizon, renormalized};
use crate::core::Rgb;
use glam::Vec3;

/// All light from the mirror direction, and none from elsewhere. Directional albedo: `reflectance`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mirror {
    /// `kr cr`, in `[0, 1]`.
    pub reflectance: Rgb,
}

/// The mirror direction `r = -wo + 2 (n . wo) n`, of unit length to f32 rounding when `wo` and `n` nearly are, so
/// that a thousand reflections do not lengthen a ray.
#[inline(always)]
pub fn reflect(wo: Vec3, n: Vec3) -> Vec3 {
    renormalized(2.0 * n.dot(wo) * n - wo)
}

impl Incidence {
    /// The mirror direction, above the horizon whatever the rounding.
    #[inline(always)]
    pub fn mirror_direction(&self) -> Vec3 {
        above_horizon(reflect(self.wo, self.n), self.ng)
    }
}

impl Mirror {
    #[inline]
    pub(super) fn sample(&self, at: &Incidence, _: [f32; 2]) -> Option<LobeSample> {
        Some(LobeSample { wi: at.mirror_direction(), weight: self.reflectance, pdf: f32::INFINITY })
    }

    #[inline]
    pub(super) fn albedo(&self, _: &Incidence) -> Rgb {
        self.reflectance
    }
}
