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
    #[inline(always)]
    fn entering(&self) -> f32 {
        1.0 - self.energy.average()
    }

    /// The table of its directional albedo.
    #[inline(always)]
    pub fn energy(&self) -> &'static CoatEnergy {
        self.energy
    }
}

/// What directions at a plastic depend on beside its coat's table: the same functions for one and for several side by side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layers {
    /// The coat's index of refraction.
    pub eta: f32,
    /// The coat's roughness.
    pub alpha: f32,
    /// The mean of `1 - E` over diffuse light from outside.
    pub entering: f32,
    /// The brightest channel of [`Plastic::transmitted`].
    pub base: f32,
}

/// A plastic's value at two directions; zeros below the horizon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlasticValue {
    /// `f cos` of the base without [`Plastic::transmitted`], in 1/sr.
    pub base: f32,
    /// `f cos` of the coat, in 1/sr.
    pub coat: f32,
    /// Density over solid angle of [`Layers::draw`].
    pub pdf: f32,
}

impl PlasticValue {
    /// `f cos` of a plastic over whose base so much is [`transmitted`](Plastic::transmitted).
    #[inline(always)]
    pub fn f_cos(&self, transmitted: Rgb) -> Rgb {
        transmitted * self.base + Rgb::grey(self.coat)
    }
}

impl Layers {
    /// The probability of sampling the coat where it reflects `e` of what comes from `wo`.
    #[inline(always)]
    fn chance_of_coat(&self, e: f32) -> f32 {
        let base = self.base * (1.0 - e) * self.entering;
        if base > 0.0 { e / (e + base) } else { 1.0 }
    }

    /// A direction, where the coat's albedo towards `wo` is `e`; it may be below the horizon.
    ///
    /// One number chooses the coat or the base, and what is left of it samples there: both, so that no branch parts several
    /// that are drawn side by side.
    #[inline(always)]
    pub fn draw(&self, at: &Incidence, e: f32, u: [f32; 2]) -> Vec3 {
        let (frame, choice) = (Frame::new(at.n), self.chance_of_coat(e));
        let is_coat = u[0] < choice;
        let rest = if is_coat { u[0] / choice } else { (u[0] - choice) / (1.0 - choice) };
        let rest = [rest.min(1.0 - 0.5 * f32::EPSILON), u[1]];
        let coat = Ggx { alpha: self.alpha }.sample(at.local_wo(&frame), rest).wi;
        let base = warp::cosine_hemisphere(rest);
        renormalized(frame.to_world(if is_coat { coat } else { base }))
    }

    /// Value and density for `wi`, where the coat's albedos towards `wo` and `wi` are `e_o` and `e_i`.
    #[inline(always)]
    pub fn value(&self, at: &Incidence, [e_o, e_i]: [f32; 2], wi: Vec3) -> PlasticValue {
        let coat = Ggx { alpha: self.alpha }.evaluate(at.n, at.wo, wi);
        let cosine = warp::cosine_hemisphere_pdf(at.n.dot(wi));
        let chance = self.chance_of_coat(e_o);
        let base = (1.0 - e_o) * (1.0 - e_i) * cosine;
        let reflected = fresnel::dielectric(coat.cos_half, self.eta).0 * coat.f_cos;
        let pdf = chance * coat.pdf + (1.0 - chance) * cosine;
        let above = at.is_above(wi);
        let [base, coat, pdf] = [base, reflected, pdf].map(|x| if above { x } else { 0.0 });
        PlasticValue { base, coat, pdf }
    }
}

impl Plastic {
    /// A coat over a base of reflectance `base`.
    #[inline]
    pub fn new(base: Rgb, coat: Coat) -> Self {
        let eta2 = coat.eta * coat.eta;
        let inside = 1.0 - coat.entering() / eta2;
        Self { coat, transmitted: base.map(|rho| rho / (eta2 * (1.0 - rho * inside))) }
    }

    /// Its coat.
    #[inline(always)]
    pub fn coat(&self) -> &Coat {
        &self.coat
    }

    /// What the base does to light that the coat lets in and out: `rho / (eta^2 (1 - rho F_in))`.
    #[inline(always)]
    pub fn transmitted(&self) -> Rgb {
        self.transmitted
    }

    /// What directions depend on.
    #[inline(always)]
    pub fn layers(&self) -> Layers {
        let Coat { eta, ggx, .. } = self.coat;
        Layers { eta, alpha: ggx.alpha, entering: self.coat.entering(), base: self.transmitted.max_channel() }
    }

    /// The coat's albedo towards `wi`.
    #[inline(always)]
    fn reflected(&self, at: &Incidence, wi: Vec3) -> f32 {
        self.coat.energy.albedo(at.n.dot(wi))
    }

    #[inline(never)]
    pub(super) fn f_cos_and_pdf(&self, at: &Incidence, wi: Vec3) -> (Rgb, f32) {
        let value = self.layers().value(at, [at.wo, wi].map(|w| self.reflected(at, w)), wi);
        (value.f_cos(self.transmitted), value.pdf)
    }

    #[inline(never)]
    pub(super) fn sample(&self, at: &Incidence, u: [f32; 2]) -> Option<LobeSample> {
        let (layers, e) = (self.layers(), self.reflected(at, at.wo));
        let wi = layers.draw(at, e, u);
        let value = layers.value(at, [e, self.reflected(at, wi)], wi);
        (value.pdf > 0.0).then(|| LobeSample {
            wi,
            weight: value.f_cos(self.transmitted) / value.pdf,
            pdf: value.pdf,
        })
    }

    pub(super) fn albedo(&self, at: &Incidence) -> Rgb {
        let entering = 1.0 - self.reflected(at, at.wo);
        self.transmitted * (entering * self.coat.entering()) + Rgb::grey(1.0 - entering)
    }
}
