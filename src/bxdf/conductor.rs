//! A metal: smooth or rough.

use super::microfacet::{Ggx, GgxValue};
use super::{Drawn, Incidence, LobeKind, LobeSample, energy, fresnel, renormalized};
use crate::core::{Frame, Rgb};
use glam::Vec3;

/// The complex index of refraction `eta + i k` of a metal, per channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ComplexIor {
    /// Real part.
    pub eta: Rgb,
    /// Imaginary part: how the metal absorbs.
    pub k: Rgb,
}

impl ComplexIor {
    /// Reflectance at the cosine of incidence `cos`.
    #[inline(always)]
    pub fn reflectance(&self, cos: f32) -> Rgb {
        Rgb::new(
            fresnel::conductor(cos, self.eta.r, self.k.r),
            fresnel::conductor(cos, self.eta.g, self.k.g),
            fresnel::conductor(cos, self.eta.b, self.k.b),
        )
    }
}

/// A surface of small metal mirrors: GGX with visible-normal sampling; single scattering.
///
/// Directional albedo: `reflectance`, times Fresnel's, times what single scattering keeps ([`energy::mirror_albedo`]).
/// Below the roughness [`Ggx::SMOOTH`] it is a smooth mirror, a delta lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conductor {
    /// Colour that multiplies the reflection.
    pub reflectance: Rgb,
    /// Index of refraction; `None` reflects everything at every angle.
    pub ior: Option<ComplexIor>,
    /// Roughness.
    pub alpha: f32,
}

impl Conductor {
    #[inline]
    fn ggx(&self) -> Ggx {
        Ggx { alpha: self.alpha }
    }

    /// The colour of a reflection at the cosine of incidence `cos`.
    #[inline(always)]
    pub(super) fn colour(&self, cos: f32) -> Rgb {
        match self.ior {
            Some(ior) => self.reflectance * ior.reflectance(cos),
            None => self.reflectance,
        }
    }

    #[inline]
    pub(super) fn kind(&self) -> LobeKind {
        if self.is_rough() { LobeKind::Glossy } else { LobeKind::Delta }
    }

    /// Whether it is no smooth mirror.
    #[inline]
    pub fn is_rough(&self) -> bool {
        !self.ggx().is_smooth()
    }

    /// The value of a rough surface, the same for any metal; zero below the horizon.
    #[inline(always)]
    pub fn value(alpha: f32, at: &Incidence, wi: Vec3) -> GgxValue {
        let GgxValue { cos_half, f_cos, pdf } = Ggx { alpha }.evaluate(at.n, at.wo, wi);
        let above = at.is_above(wi);
        GgxValue { cos_half, f_cos: if above { f_cos } else { 0.0 }, pdf: if above { pdf } else { 0.0 } }
    }

    #[inline(always)]
    pub(super) fn f_cos_and_pdf(&self, at: &Incidence, wi: Vec3) -> (Rgb, f32) {
        if !self.is_rough() {
            return (Rgb::BLACK, 0.0);
        }
        let GgxValue { cos_half, f_cos, pdf } = Self::value(self.alpha, at, wi);
        (self.colour(cos_half) * f_cos, pdf)
    }

    #[inline(always)]
    pub(super) fn sample(&self, at: &Incidence, u: [f32; 2]) -> Option<LobeSample> {
        if self.ggx().is_smooth() {
            let weight = self.colour(at.n.dot(at.wo));
            return Some(LobeSample { wi: at.mirror_direction(), weight, pdf: f32::INFINITY });
        }
        Self::draw(self.alpha, at, u).coloured(|cos| self.colour(cos))
    }

    /// A direction from a rough surface, the same for any metal.
    #[inline(always)]
    pub fn draw(alpha: f32, at: &Incidence, u: [f32; 2]) -> Drawn {
        let frame = Frame::new(at.n);
        let sample = Ggx { alpha }.sample(at.local_wo(&frame), u);
        let wi = renormalized(frame.to_world(sample.wi));
        let weight = if at.ng.dot(wi) > 0.0 { sample.weight } else { 0.0 };
        Drawn { wi, weight, cos_half: sample.cos_half, pdf: sample.pdf }
    }

    pub(super) fn albedo(&self, at: &Incidence) -> Rgb {
        let cos = at.n.dot(at.wo);
        let kept = if self.ggx().is_smooth() { 1.0 } else { energy::mirror_albedo(self.ggx(), cos) };
        self.colour(cos) * kept
    }
}
