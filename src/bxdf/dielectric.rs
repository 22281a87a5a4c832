//! Glass: a smooth boundary that reflects and refracts.

use super::{Incidence, LobeSample, above_horizon, fresnel, renormalized};
use crate::core::Rgb;
use glam::Vec3;

/// A smooth boundary between dielectrics, with exact Fresnel reflectance.
///
/// One sample either reflects (`wi . ng > 0`) or transmits (`wi . ng < 0`), chosen by the reflectance. A transmitted
/// sample's weight is that of radiance: it is divided by the square of the relative index, which a path gets back
/// when it leaves (Veach 1997, 5.2). Power is conserved: reflectance and transmittance sum to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dielectric {
    /// Colour that multiplies the reflection.
    pub reflectance: Rgb,
    /// Colour that multiplies the transmission.
    pub transmittance: Rgb,
    /// Index of the inner side over that of the outer side.
    pub eta: f32,
}

/// The direction into the far side: `wo` refracted about `n`, with the relative index and the cosine on that side.
#[inline]
fn refract(wo: Vec3, n: Vec3, eta: f32, cos_far: f32) -> Vec3 {
    renormalized((n.dot(wo) / eta - cos_far) * n - wo / eta)
}

impl Dielectric {
    /// Index of the far side over that of `wo`'s side.
    #[inline]
    fn relative_eta(&self, at: &Incidence) -> f32 {
        if at.front { self.eta } else { 1.0 / self.eta }
    }

    #[inline(never)]
    pub(super) fn sample(&self, at: &Incidence, u: [f32; 2]) -> Option<LobeSample> {
        let eta = self.relative_eta(at);
        let (reflected, cos_far) = fresnel::dielectric(at.n.dot(at.wo), eta);
        if u[0] < reflected {
            let wi = at.mirror_direction();
            return Some(LobeSample { wi, weight: self.reflectance, pdf: f32::INFINITY });
        }
        let wi = above_horizon(refract(at.wo, at.n, eta, cos_far), -at.ng);
        Some(LobeSample { wi, weight: self.transmittance * (1.0 / (eta * eta)), pdf: f32::INFINITY })
    }

    pub(super) fn albedo(&self, at: &Incidence) -> Rgb {
        let (reflected, _) = fresnel::dielectric(at.n.dot(at.wo), self.relative_eta(at));
        self.reflectance * reflected + self.transmittance * (1.0 - reflected)
    }
}
