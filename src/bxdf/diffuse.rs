//! Lambert's lobe.

use super::{Drawn, Incidence, LobeSample, renormalized};
use crate::core::{Frame, Rgb, warp};
use glam::Vec3;

/// The same radiance in every direction: `f = reflectance / pi`. Directional albedo: `reflectance`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Diffuse {
    /// Reflectance `rho_d`, in `[0, 1]`.
    pub reflectance: Rgb,
}

impl Diffuse {
    /// A direction about the shading normal `n` of a surface with geometric normal `ng`, the same for any reflectance.
    #[inline(always)]
    pub fn draw(n: Vec3, ng: Vec3, u: [f32; 2]) -> Drawn {
        let local = warp::cosine_hemisphere(u);
        let wi = renormalized(Frame::new(n).to_world(local));
        let leaves = (local.z > 0.0) & (ng.dot(wi) > 0.0);
        let weight = if leaves { 1.0 } else { 0.0 };
        Drawn { wi, weight, cos_half: 1.0, pdf: weight * warp::cosine_hemisphere_pdf(local.z) }
    }

    /// The density of [`draw`](Self::draw) at `wi`, over solid angle, in 1/sr: the same for any reflectance.
    #[inline(always)]
    pub fn density(n: Vec3, ng: Vec3, wi: Vec3) -> f32 {
        let pdf = warp::cosine_hemisphere_pdf(n.dot(wi));
        if ng.dot(wi) > 0.0 { pdf } else { 0.0 }
    }

    /// The value is the reflectance times the density.
    #[inline(always)]
    pub(super) fn f_cos_and_pdf(&self, at: &Incidence, wi: Vec3) -> (Rgb, f32) {
        let pdf = Self::density(at.n, at.ng, wi);
        (self.reflectance * pdf, pdf)
    }

    #[inline(always)]
    pub(super) fn sample(&self, at: &Incidence, u: [f32; 2]) -> Option<LobeSample> {
        Self::draw(at.n, at.ng, u).coloured(|_| self.reflectance)
    }

    #[inline]
    pub(super) fn albedo(&self, _: &Incidence) -> Rgb {
        self.reflectance
    }
}
