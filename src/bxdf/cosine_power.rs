//! The glossy lobe: a cosine power about the mirror direction.

use super::{Incidence, LobeSample, mirror::reflect};
use crate::core::{Frame, Rgb};
use glam::Vec3;
use std::f32::consts::TAU;

/// What becomes of a direction that falls below the surface.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    serde::Serialize,
    serde::Deserialize,
    schemars::JsonSchema,
    clap::ValueEnum,
)]
#[serde(rename_all = "kebab-case")]
pub enum Horizon {
    /// Turned by pi about the mirror direction: the lecture's.
    #[default]
    Fold,
    /// Turned likewise and weighted by one over the number of directions that end there.
    FoldWeighted,
    /// Black.
    Clip,
    /// Drawn again.
    Reject,
    /// Lafortune and Willems' reciprocal lobe; black below the surface.
    ModifiedPhong,
}

/// A cosine power about the mirror direction `r`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CosinePower {
    /// `kr cr`.
    pub reflectance: Rgb,
    /// The exponent e, real, at least 0, finite.
    pub exponent: f32,
    /// What becomes of directions below the surface.
    pub horizon: Horizon,
}

impl CosinePower {
    pub(super) fn f_cos(&self, at: &Incidence, wi: Vec3) -> Rgb {
        self.reflectance * self.ln_pdf(at, wi).exp()
    }

    pub(super) fn ln_pdf(&self, at: &Incidence, wi: Vec3) -> f32 {
        let r = reflect(at.wo, at.n);
        let h = 0.5 * (wi - r).length_squared();
        if h >= 1.0 || at.ng.dot(wi) <= 0.0 {
            return f32::NEG_INFINITY;
        }
        let folded = if at.ng.dot(2.0 * wi.dot(r) * r - wi) < 0.0 { 2.0f32 } else { 1.0 };
        (folded * (self.exponent + 1.0) / TAU).ln() + self.exponent * (-h).ln_1p()
    }

    pub(super) fn sample(&self, at: &Incidence, u: [f32; 2]) -> Option<LobeSample> {
        let r = reflect(at.wo, at.n);
        let l = (1.0 - u[0]).ln() / (self.exponent + 1.0);
        let (cos, sin) = (l.exp(), (-(2.0 * l).exp_m1()).sqrt());
        let (sin_phi, cos_phi) = (TAU * u[1]).sin_cos();
        let frame = Frame::new(r);
        let side = sin * cos_phi * frame.s + sin * sin_phi * frame.t;
        let wi = if at.ng.dot(cos * r + side) < 0.0 { cos * r - side } else { cos * r + side };
        Some(LobeSample { wi, weight: self.reflectance, ln_pdf: self.ln_pdf(at, wi) })
    }

    pub(super) fn albedo(&self, _: &Incidence) -> Rgb {
        self.reflectance
    }
}
