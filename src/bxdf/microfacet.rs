//! Rough surfaces of small mirrors: the GGX distribution with height-correlated Smith shadowing.
//!
//! Sources: Walter et al. 2007, *Microfacet Models for
//! Refraction through Rough Surfaces*; Heitz 2014, *Understanding the Masking-Shadowing Function*; Dupuy and Benyoub
//! 2023, *Sampling Visible GGX Normals with Spherical Caps*.

use crate::core::warp;
use glam::Vec3;
use std::f32::consts::PI;

/// The least cosine of a view: the surface is seen, whatever the rounding says.
pub(super) const MIN_COS: f32 = 1e-9;

/// The distribution of an isotropic surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ggx {
    /// Roughness: the root of twice the mean squared slope that a Beckmann surface of this width would have.
    pub alpha: f32,
}

/// A direction drawn from a rough mirror.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GgxSample {
    /// The direction; may be below the surface.
    pub wi: Vec3,
    /// The cosine at the microfacet, for Fresnel's equations.
    pub cos_half: f32,
    /// `f cos / pdf` without Fresnel: the shadowing `G2 / G1`.
    pub weight: f32,
    /// Density over solid angle.
    pub pdf: f32,
}

/// A rough mirror's value at two directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GgxValue {
    /// The cosine at the microfacet, for Fresnel's equations.
    pub cos_half: f32,
    /// `f cos` without Fresnel, in 1/sr.
    pub f_cos: f32,
    /// Density over solid angle of [`Ggx::sample`].
    pub pdf: f32,
}

impl Ggx {
    /// Below this roughness a surface counts as smooth (as in pbrt-v4).
    pub const SMOOTH: f32 = 1e-3;

    /// Whether the surface counts as a smooth mirror.
    #[inline(always)]
    pub fn is_smooth(&self) -> bool {
        self.alpha < Self::SMOOTH
    }

    /// Density of microfacets along `h`, which need not have unit length, about the normal `n`, over solid angle: in
    /// 1/sr.
    #[inline(always)]
    pub fn density(&self, n: Vec3, h: Vec3) -> f32 {
        let (a2, squared_length) = (self.alpha * self.alpha, h.length_squared());
        // cos^2 (alpha^2 + tan^2) with the sine from the cross product: 1 - cos^2 has no digits on a smooth surface.
        let spread = (a2 * n.dot(h).powi(2) + n.cross(h).length_squared()) / squared_length;
        // None halfway between a direction along the surface and its opposite.
        if squared_length < f32::MIN_POSITIVE { 0.0 } else { a2 / (PI * spread * spread) }
    }

    /// `sqrt(cos^2 + alpha^2 sin^2)`, which Smith's functions of both directions are made of.
    #[inline(always)]
    fn stretched(&self, cos: f32) -> f32 {
        (cos * cos + self.alpha * self.alpha * (1.0 - cos * cos).max(0.0)).sqrt()
    }

    /// Value and density for `wo` and `wi`, both above the surface with the normal `n`.
    #[inline(always)]
    pub fn evaluate(&self, n: Vec3, wo: Vec3, wi: Vec3) -> GgxValue {
        let (half, cos_o) = (wo + wi, n.dot(wo).max(MIN_COS));
        let pdf = self.reflected_density(cos_o, self.density(n, half));
        let f_cos = self.shadowing(cos_o, n.dot(wi).max(0.0)) * pdf;
        GgxValue { cos_half: (0.5 * half.length()).min(1.0), f_cos, pdf }
    }

    /// Draws a direction that `wo` sees by a visible microfacet; in the frame whose z is the normal.
    #[inline(always)]
    pub fn sample(&self, wo: Vec3, u: [f32; 2]) -> GgxSample {
        let h = self.sample_visible(wo, u);
        let cos_half = wo.dot(h).clamp(0.0, 1.0);
        let wi = 2.0 * cos_half * h - wo;
        let weight = if wi.z > 0.0 { self.shadowing(wo.z, wi.z) } else { 0.0 };
        GgxSample { wi, cos_half, weight, pdf: self.reflected_density(wo.z, self.density(Vec3::Z, h)) }
    }

    /// `G1(wo) D / (4 cos_o)`, which has no pole at grazing incidence.
    #[inline(always)]
    fn reflected_density(&self, cos_o: f32, density: f32) -> f32 {
        density / (2.0 * (cos_o + self.stretched(cos_o)))
    }

    /// `G2(wo, wi) / G1(wo)`.
    #[inline(always)]
    fn shadowing(&self, cos_o: f32, cos_i: f32) -> f32 {
        let (so, si) = (self.stretched(cos_o), self.stretched(cos_i));
        cos_i * (cos_o + so) / (cos_i * so + cos_o * si)
    }

    /// A normal with the density of those that `wo` sees.
    #[inline(always)]
    fn sample_visible(&self, wo: Vec3, u: [f32; 2]) -> Vec3 {
        // The hemisphere of the stretched surface, on which visible normals are halfway to a uniform cap.
        let stretched = Vec3::new(self.alpha * wo.x, self.alpha * wo.y, wo.z).normalize();
        let z = (1.0 - u[1]) * (1.0 + stretched.z) - stretched.z;
        let sin = (1.0 - z * z).max(0.0).sqrt();
        let cap = (sin * warp::unit_vector(u[0])).extend(z);
        let h = cap + stretched;
        Vec3::new(self.alpha * h.x, self.alpha * h.y, h.z.max(1e-9)).normalize()
    }
}
