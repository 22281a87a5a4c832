//! Glass: a smooth boundary that reflects and refracts.

use super::{Incidence, LobeSample, above_horizon, fresnel, renormalized};
use crate::core::Rgb;
use glam::Vec3;

/// One of the two ways in which light goes on from a smooth boundary between dielectrics, with exact Fresnel reflectance.
///
/// A boundary has a lobe for each: one direction each, with the share of the light that goes there as its weight. That of
/// transmission is the weight of radiance: it is divided by the square of the relative index, which a path gets back when it
/// leaves (Veach 1997, 5.2). Power is conserved: reflectance and transmittance sum to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dielectric {
    /// Which way.
    pub way: DielectricWay,
    /// Colour that multiplies what goes this way.
    pub colour: Rgb,
    /// Index of the inner side over that of the outer side.
    pub eta: f32,
}

/// A way from a boundary.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DielectricWay {
    /// Back from it: `wi . ng > 0`.
    Reflection,
    /// Through it: `wi . ng < 0`.
    Transmission,
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

    /// The share of the light that goes this way, and the cosine on the far side.
    #[inline]
    fn share(&self, at: &Incidence) -> (f32, f32) {
        let (reflected, cos_far) = fresnel::dielectric(at.n.dot(at.wo), self.relative_eta(at));
        let share = match self.way {
            DielectricWay::Reflection => reflected,
            DielectricWay::Transmission => 1.0 - reflected,
        };
        (share, cos_far)
    }

    #[inline(never)]
    pub(super) fn sample(&self, at: &Incidence, _: [f32; 2]) -> Option<LobeSample> {
        let (share, cos_far) = self.share(at);
        // Under total internal reflection there is no way through.
        if share <= 0.0 {
            return None;
        }
        let (wi, scale) = match self.way {
            DielectricWay::Reflection => (at.mirror_direction(), 1.0),
            DielectricWay::Transmission => {
                let eta = self.relative_eta(at);
                (above_horizon(refract(at.wo, at.n, eta, cos_far), -at.ng), 1.0 / (eta * eta))
            }
        };
        Some(LobeSample { wi, weight: self.colour * (share * scale), pdf: f32::INFINITY })
    }

    pub(super) fn albedo(&self, at: &Incidence) -> Rgb {
        self.colour * self.share(at).0
    }
}
