//! Plastic: a rough dielectric coat over a diffuse base.

use super::microfacet::Ggx;
use super::{Incidence, LobeSample, fresnel, renormalized};
use crate::core::{Frame, Rgb, warp};
use glam::Vec3;

/// A rough clear coat of GGX microfacets over a Lambertian base.
///
/// The coat reflects by exact Fresnel reflectance. What it lets through reaches the base, is lost there to the
/// base's colour, and is reflected back by the coat's inside any number of times:
/// `f = coat + rho / pi (1 - F(cos_o)) (1 - F(cos_i)) / (eta^2 (1 - rho F_in))`, with the smooth boundary's `F` in
/// both transmissions and `F_in` its diffuse average from inside. Reciprocal; a white base under a smooth coat
/// returns exactly 1, and a rough coat loses what single scattering loses. Both sides of a surface are coated.
///
/// Source: Jakob 2010, Mitsuba's `plastic` with its nonlinear colour shifts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plastic {
    base: Rgb,
    eta: f32,
    ggx: Ggx,
    /// `rho / (eta^2 (1 - rho F_in))`.
    transmitted: Rgb,
    /// `1 - F` averaged over diffuse light from outside.
    entering: f32,
}

/// The plastic's terms at two directions.
struct Value {
    coat: f32,
    base: Rgb,
    pdf: f32,
}

impl Plastic {
    /// A coat of index `eta >= 1` and roughness `alpha`, at least [`Ggx::SMOOTH`], over a base of reflectance
    /// `base`.
    pub fn new(base: Rgb, eta: f32, alpha: f32) -> Self {
        let entering = 1.0 - fresnel::diffuse_average(eta);
        let inside = 1.0 - entering / (eta * eta);
        let transmitted = base.map(|rho| rho / (eta * eta * (1.0 - rho * inside)));
        Self { base, eta, ggx: Ggx { alpha: alpha.max(Ggx::SMOOTH) }, transmitted, entering }
    }

    /// Reflectance of the base.
    pub fn base(&self) -> Rgb {
        self.base
    }

    #[inline]
    fn fresnel(&self, cos: f32) -> f32 {
        fresnel::dielectric(cos.clamp(0.0, 1.0), self.eta).0
    }

    /// What the base returns to `wo` at the cosine `cos` whose reflectance is `reflected`.
    #[inline]
    fn base_albedo(&self, reflected: f32) -> Rgb {
        self.transmitted * ((1.0 - reflected) * self.entering)
    }

    /// The probability of sampling the coat where its smooth reflectance is `reflected`.
    #[inline]
    fn coat_probability(&self, reflected: f32) -> f32 {
        let base = self.base_albedo(reflected).max_channel();
        if base == 0.0 { 1.0 } else { reflected / (reflected + base) }
    }

    /// `wo` and `wi` in the shading frame.
    #[inline]
    fn evaluate(&self, wo: Vec3, wi: Vec3) -> Value {
        let reflected = self.fresnel(wo.z);
        let coat = self.ggx.evaluate(wo, wi);
        let choice = self.coat_probability(reflected);
        let cosine = warp::cosine_hemisphere_pdf(wi.z);
        Value {
            coat: self.fresnel(coat.cos_half) * coat.f_cos,
            base: self.transmitted * ((1.0 - reflected) * (1.0 - self.fresnel(wi.z)) * cosine),
            pdf: choice * coat.pdf + (1.0 - choice) * cosine,
        }
    }

    #[inline]
    pub(super) fn f_cos(&self, at: &Incidence, wi: Vec3) -> Rgb {
        at.local_pair(wi).map_or(Rgb::BLACK, |(wo, wi)| {
            let value = self.evaluate(wo, wi);
            value.base + Rgb::grey(value.coat)
        })
    }

    #[inline]
    pub(super) fn ln_pdf(&self, at: &Incidence, wi: Vec3) -> f32 {
        at.local_pair(wi).map_or(f32::NEG_INFINITY, |(wo, wi)| self.evaluate(wo, wi).pdf.ln())
    }

    #[inline]
    pub(super) fn sample(&self, at: &Incidence, u: [f32; 2]) -> Option<LobeSample> {
        let frame = Frame::new(at.n);
        let wo = at.local_wo(&frame);
        let choice = self.coat_probability(self.fresnel(wo.z));
        let local = if u[0] < choice {
            self.ggx.sample(wo, [u[0] / choice, u[1]]).wi
        } else {
            warp::cosine_hemisphere([((u[0] - choice) / (1.0 - choice)).min(1.0 - f32::EPSILON), u[1]])
        };
        let wi = renormalized(frame.to_world(local));
        if local.z <= 0.0 || at.ng.dot(wi) <= 0.0 {
            return None;
        }
        let value = self.evaluate(wo, local);
        let weight = (value.base + Rgb::grey(value.coat)) / value.pdf;
        (value.pdf > 0.0).then(|| LobeSample { wi, weight, ln_pdf: value.pdf.ln() })
    }

    pub(super) fn albedo(&self, at: &Incidence) -> Rgb {
        let cos = at.n.dot(at.wo);
        let reflected = self.fresnel(cos);
        self.base_albedo(reflected) + Rgb::grey(reflected * self.ggx.albedo(cos))
    }
}
