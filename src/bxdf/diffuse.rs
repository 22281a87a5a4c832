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

/// A direction drawn at a point of a surface, for any diffuse lobe: it depends on the normals alone.
#[derive(Clone, Copy, Debug, Default)]
pub struct DiffuseDirection {
    /// Unit length.
    pub wi: Vec3,
    /// Density over solid angle, in 1/sr; zero for a direction into the surface.
    pub pdf: f32,
}

impl DiffuseDirection {
    /// About the shading normal `n` of a surface with geometric normal `ng`. `u` is in `[0, 1)`. Has no branch, so that
    /// several are drawn side by side.
    #[inline(always)]
    pub fn draw(n: Vec3, ng: Vec3, u: [f32; 2]) -> Self {
        let local = warp::cosine_hemisphere(u);
        let wi = renormalized(Frame::new(n).to_world(local));
        let leaves = (local.z > 0.0) & (ng.dot(wi) > 0.0);
        Self { wi, pdf: if leaves { warp::cosine_hemisphere_pdf(local.z) } else { 0.0 } }
    }
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
        self.sample_along(&DiffuseDirection::draw(at.n, at.ng, u))
    }

    /// The sample in a direction that was drawn at this point.
    #[inline(always)]
    pub fn sample_along(&self, drawn: &DiffuseDirection) -> Option<LobeSample> {
        let DiffuseDirection { wi, pdf } = *drawn;
        (pdf > 0.0).then_some(LobeSample { wi, weight: self.reflectance, pdf })
    }

    #[inline]
    pub(super) fn albedo(&self, _: &Incidence) -> Rgb {
        self.reflectance
    }
}
