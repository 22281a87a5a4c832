//! Plastic: a rough dielectric coat over a diffuse base.

use super::energy::CoatEnergy;
use super::microfacet::Ggx;
use super::{Incidence, LobeSample, fresnel, renormalized};
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
    coat: Coat,
    /// `rho / (eta^2 (1 - rho F_in))`.
    transmitted: Rgb,
}

/// A plastic's coat: what its points share, made once for a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coat {
    eta: f32,
    ggx: Ggx,
    energy: &'static CoatEnergy,
}

impl Coat {
    /// A coat of index `eta` in `[1, 100]` and roughness `alpha`, at least [`Ggx::SMOOTH`]; others count as the
    /// nearest of these.
    pub fn new(eta: f32, alpha: f32) -> Self {
        let (eta, ggx) = (eta.clamp(1.0, 100.0), Ggx { alpha: alpha.max(Ggx::SMOOTH) });
        Self { eta, ggx, energy: CoatEnergy::of(ggx, eta) }
    }

    /// Index of refraction.
    pub fn eta(&self) -> f32 {
        self.eta
    }

    /// Roughness.
    pub fn alpha(&self) -> f32 {
        self.ggx.alpha
    }

    /// The mean of `1 - E` over diffuse light from outside.
    #[inline]
    fn entering(&self) -> f32 {
        1.0 - self.energy.average()
    }
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
    /// A coat over a base of reflectance `base`.
    #[inline]
    pub fn new(base: Rgb, coat: Coat) -> Self {
        let eta2 = coat.eta * coat.eta;
        let inside = 1.0 - coat.entering() / eta2;
        Self { coat, transmitted: base.map(|rho| rho / (eta2 * (1.0 - rho * inside))) }
    }

    #[inline]
    fn outgoing(&self, at: &Incidence) -> Outgoing {
        let reflected = self.coat.energy.albedo(at.n.dot(at.wo));
        let base = self.transmitted.max_channel() * (1.0 - reflected) * self.coat.entering();
        let coat = if base > 0.0 { reflected / (reflected + base) } else { 1.0 };
        Outgoing { entering: 1.0 - reflected, coat }
    }

    /// Value and density for a `wi` above the horizon.
    #[inline]
    fn evaluate(&self, at: &Incidence, outgoing: &Outgoing, wi: Vec3) -> Value {
        let (coat, cos_i) = (self.coat.ggx.evaluate(at.n, at.wo, wi), at.n.dot(wi));
        let cosine = warp::cosine_hemisphere_pdf(cos_i);
        let leaving = 1.0 - self.coat.energy.albedo(cos_i);
        let reflected = fresnel::dielectric(coat.cos_half, self.coat.eta).0 * coat.f_cos;
        Value {
            f_cos: self.transmitted * (outgoing.entering * leaving * cosine) + Rgb::grey(reflected),
            pdf: outgoing.coat * coat.pdf + (1.0 - outgoing.coat) * cosine,
        }
    }

    #[inline]
    fn value(&self, at: &Incidence, wi: Vec3) -> Option<Value> {
        at.is_above(wi).then(|| self.evaluate(at, &self.outgoing(at), wi))
    }

    #[inline(never)]
    pub(super) fn f_cos_and_pdf(&self, at: &Incidence, wi: Vec3) -> (Rgb, f32) {
        self.value(at, wi).map_or((Rgb::BLACK, 0.0), |value| (value.f_cos, value.pdf))
    }

    #[inline(never)]
    pub(super) fn sample(&self, at: &Incidence, u: [f32; 2]) -> Option<LobeSample> {
        let frame = Frame::new(at.n);
        let outgoing = self.outgoing(at);

        // One number chooses the coat or the base, and what is left of it samples there.
        let choice = outgoing.coat;
        let local = if u[0] < choice {
            self.coat.ggx.sample(at.local_wo(&frame), [u[0] / choice, u[1]]).wi
        } else {
            let rest = (u[0] - choice) / (1.0 - choice);
            warp::cosine_hemisphere([rest.min(1.0 - 0.5 * f32::EPSILON), u[1]])
        };

        let wi = renormalized(frame.to_world(local));
        if !at.is_above(wi) {
            return None;
        }
        let value = self.evaluate(at, &outgoing, wi);
        (value.pdf > 0.0).then(|| LobeSample { wi, weight: value.f_cos / value.pdf, pdf: value.pdf })
    }

    pub(super) fn albedo(&self, at: &Incidence) -> Rgb {
        let entering = self.outgoing(at).entering;
        self.transmitted * (entering * self.coat.entering()) + Rgb::grey(1.0 - entering)
    }
}
