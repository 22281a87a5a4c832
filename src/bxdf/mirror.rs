//! The perfect mirror.

use super::{Incidence, LobeSample};
use crate::core::Rgb;
use glam::Vec3;

/// All light from the mirror direction, and none from elsewhere. Directional albedo: `reflectance`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mirror {
    /// `kr cr`, in `[0, 1]`.
    pub reflectance: Rgb,
}

/// The mirror direction `r = -wo + 2 (n . wo) n`.
#[inline]
pub fn reflect(wo: Vec3, n: Vec3) -> Vec3 {
    2.0 * n.dot(wo) * n - wo
}

impl Mirror {
    pub(super) fn f_cos(&self, _: &Incidence, _: Vec3) -> Rgb {
        Rgb::BLACK
    }

    pub(super) fn ln_pdf(&self, _: &Incidence, _: Vec3) -> f32 {
        f32::NEG_INFINITY
    }

    pub(super) fn sample(&self, at: &Incidence, _: [f32; 2]) -> Option<LobeSample> {
        Some(LobeSample { wi: reflect(at.wo, at.n), weight: self.reflectance, ln_pdf: f32::INFINITY })
    }

    pub(super) fn albedo(&self, _: &Incidence) -> Rgb {
        self.reflectance
    }
}
