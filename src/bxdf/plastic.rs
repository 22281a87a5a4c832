//! Plastic: a rough dielectric coat over a diffuse base.

use super::microfacet::Ggx;
use super::{Incidence, LobeSample, energy, fresnel, renormalized};
use crate::core::{Frame, Rgb, warp};
use glam::Vec3;

/// A rough clear coat of GGX microfacets over a Lambertian base.
///
/// The coat reflects by exact Fresnel reflectance; its directional albedo is `E`. What it lets through reaches the
/// base, is lost there to the base's colour, and is reflected back by the coat's inside any number of times:
/// `f = coat + rho / pi (1 - E(cos_o)) (1 - E(cos_i)) / (eta^2 (1 - rho F_in))`, with `1 - F_in` the mean of `1 - E`
/// over `eta^2`. Reciprocal; over a white base it returns everything at every roughness, to the precision of the
/// table of `E`. Both sides of a surface are coated.
///
/// Sources: Jakob 2010, Mitsuba's `roughplastic` with its nonlinear colour shifts; Kelemen and Szirmay-Kalos 2001,
/// *A Microfacet Based Coupled Specular-Matte BRDF Model*, for the energy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plastic {
    eta: f32,
    ggx: Ggx,
    /// `rho / (eta^2 (1 - rho F_in))`.
    transmitted: Rgb,
    /// `1 - E` averaged over diffuse light from outside.
    entering: f32,
}

/// What does not depend on `wi`.
struct Outgoing {
    /// `1 - E(cos_o)`.
    entering: f32,
    /// The probability of sampling the coat.
    coat: f32,
}

/// The plastic's terms at two directions.
struct Value {
    f_cos: Rgb,
    pdf: f32,
}

impl Plastic {
    /// A coat of index `eta >= 1` and roughness `alpha`, at least [`Ggx::SMOOTH`], over a base of reflectance
    /// `base`.
    pub fn new(base: Rgb, eta: f32, alpha: f32) -> Self {
        let ggx = Ggx { alpha: alpha.max(Ggx::SMOOTH) };
        let entering = 1.0 - energy::dielectric_average(ggx, eta);
        let inside = 1.0 - entering / (eta * eta);
        Self { eta, ggx, transmitted: base.map(|rho| rho / (eta * eta * (1.0 - rho * inside))), entering }
    }

    #[inline]
    fn outgoing(&self, wo: Vec3) -> Outgoing {
        let reflected = energy::dielectric_albedo(self.ggx, self.eta, wo.z);
        let base = self.transmitted.max_channel() * (1.0 - reflected) * self.entering;
        let coat = if base > 0.0 { reflected / (reflected + base) } else { 1.0 };
        Outgoing { entering: 1.0 - reflected, coat }
    }

    /// `wo` and `wi` in the shading frame.
    #[inline]
    fn evaluate(&self, wo: Vec3, outgoing: &Outgoing, wi: Vec3) -> Value {
        let coat = self.ggx.evaluate(wo, wi);
        let cosine = warp::cosine_hemisphere_pdf(wi.z);
        let leaving = 1.0 - energy::dielectric_albedo(self.ggx, self.eta, wi.z);
        let reflected = fresnel::dielectric(coat.cos_half, self.eta).0 * coat.f_cos;
        Value {
            f_cos: self.transmitted * (outgoing.entering * leaving * cosine) + Rgb::grey(reflected),
            pdf: outgoing.coat * coat.pdf + (1.0 - outgoing.coat) * cosine,
        }
    }

    /// [`evaluate`](Self::evaluate) in world space; `None` below the horizon.
    #[inline]
    fn value(&self, at: &Incidence, wi: Vec3) -> Option<Value> {
        let (wo, wi) = at.local_pair(wi)?;
        Some(self.evaluate(wo, &self.outgoing(wo), wi))
    }

    #[inline]
    pub(super) fn f_cos(&self, at: &Incidence, wi: Vec3) -> Rgb {
        self.value(at, wi).map_or(Rgb::BLACK, |value| value.f_cos)
    }

    #[inline]
    pub(super) fn ln_pdf(&self, at: &Incidence, wi: Vec3) -> f32 {
        self.value(at, wi).map_or(f32::NEG_INFINITY, |value| value.pdf.ln())
    }

    #[inline]
    pub(super) fn sample(&self, at: &Incidence, u: [f32; 2]) -> Option<LobeSample> {
        let frame = Frame::new(at.n);
        let wo = at.local_wo(&frame);
        let outgoing = self.outgoing(wo);

        // One number chooses the coat or the base, and what is left of it samples there.
        let choice = outgoing.coat;
        let local = if u[0] < choice {
            self.ggx.sample(wo, [u[0] / choice, u[1]]).wi
        } else {
            let rest = (u[0] - choice) / (1.0 - choice);
            warp::cosine_hemisphere([rest.min(1.0 - 0.5 * f32::EPSILON), u[1]])
        };

        let wi = renormalized(frame.to_world(local));
        if local.z <= 0.0 || at.ng.dot(wi) <= 0.0 {
            return None;
        }
        let value = self.evaluate(wo, &outgoing, local);
        (value.pdf > 0.0).then(|| LobeSample { wi, weight: value.f_cos / value.pdf, ln_pdf: value.pdf.ln() })
    }

    pub(super) fn albedo(&self, at: &Incidence) -> Rgb {
        let entering = 1.0 - energy::dielectric_albedo(self.ggx, self.eta, at.n.dot(at.wo));
        self.transmitted * (entering * self.entering) + Rgb::grey(1.0 - entering)
    }
}
