//! Lambert's lobe.

use super::{Incidence, LobeSample, renormalized};
use crate::core::{Frame, Rgb, warp};
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;

/// The same radiance in every direction: `f = reflectance / pi`. Directional albedo: `reflectance`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Diffuse {
    /// Reflectance `rho_d`, in `[0, 1]`.
    pub reflectance: Rgb,
}

impl Diffuse {
    #[inline]
    pub(super) fn f_cos(&self, at: &Incidence, wi: Vec3) -> Rgb {
        if at.ng.dot(wi) <= 0.0 {
            return Rgb::BLACK;
        }
        self.reflectance * (FRAC_1_PI * at.n.dot(wi).max(0.0))
    }

    #[inline]
    pub(super) fn ln_pdf(&self, at: &Incidence, wi: Vec3) -> f32 {
        self.pdf(at, wi).ln()
    }

    #[inline]
    pub(super) fn pdf(&self, at: &Incidence, wi: Vec3) -> f32 {
        if at.ng.dot(wi) <= 0.0 {
            return 0.0;
        }
        warp::cosine_hemisphere_pdf(at.n.dot(wi))
    }

    #[inline]
    pub(super) fn sample(&self, at: &Incidence, u: [f32; 2]) -> Option<LobeSample> {
        let local = warp::cosine_hemisphere(u);
        let wi = renormalized(Frame::new(at.n).to_world(local));
        (local.z > 0.0 && at.ng.dot(wi) > 0.0).then(|| LobeSample {
            wi,
            weight: self.reflectance,
            ln_pdf: warp::cosine_hemisphere_pdf(local.z).ln(),
        })
    }

    #[inline]
    pub(super) fn albedo(&self, _: &Incidence) -> Rgb {
        self.reflectance
    }
}
