//! Lambert's lobe.

use super::{Incidence, LobeSample, renormalized};
use crate::core::{Frame, Rgb, warp};
use glam::Vec3;

/// The same radiance in every direction: `f = reflectance / pi`. Directional albedo: `reflectance`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Diffuse {
    /// Reflectance `rho_d`, in `[0, 1]`.
    pub reflectance: Rgb,
}

impl Diffuse {
    /// The value is the reflectance times the density.
    #[inline(always)]
    pub(super) fn f_cos_and_pdf(&self, at: &Incidence, wi: Vec3) -> (Rgb, f32) {
        let pdf = if at.ng.dot(wi) > 0.0 { warp::cosine_hemisphere_pdf(at.n.dot(wi)) } else { 0.0 };
        (self.reflectance * pdf, pdf)
    }

    #[inline(always)]
    pub(super) fn sample(&self, at: &Incidence, u: [f32; 2]) -> Option<LobeSample> {
        let local = warp::cosine_hemisphere(u);
        let wi = renormalized(Frame::new(at.n).to_world(local));
        (local.z > 0.0 && at.ng.dot(wi) > 0.0).then(|| LobeSample {
            wi,
            weight: self.reflectance,
            pdf: warp::cosine_hemisphere_pdf(local.z),
        })
    }

    #[inline]
    pub(super) fn albedo(&self, _: &Incidence) -> Rgb {
        self.reflectance
    }
}
