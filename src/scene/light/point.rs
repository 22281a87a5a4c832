//! Lights that no ray can hit: from one point, and from one direction.

use super::{LightSample, shadow_end};
use crate::core::Rgb;
use glam::Vec3;

/// Light from one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointLight {
    /// Where.
    pub position: Vec3,
    /// Radiant intensity (per square of the unit world's length) with `falloff`; without, what arrives on a surface
    /// that faces the light, at any distance (the textbook's).
    pub intensity: Rgb,
    /// Whether it dims with the square of the distance.
    pub falloff: bool,
    /// Whether it casts shadows.
    pub shadow: bool,
}

impl PointLight {
    /// The one way to the light.
    #[inline]
    pub(super) fn sample(&self, p: Vec3) -> Option<LightSample> {
        let way = self.position.as_dvec3() - p.as_dvec3();
        let distance = way.length();
        if distance == 0.0 {
            return None;
        }
        let weaken = if self.falloff { (distance * distance).recip() as f32 } else { 1.0 };
        Some(LightSample {
            wi: (way / distance).as_vec3(),
            t_max: shadow_end(p, distance as f32),
            le_over_pdf: self.intensity * weaken,
            pdf: f32::INFINITY,
            shadow: self.shadow,
        })
    }
}

/// Parallel light from beyond everything.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DirectionalLight {
    /// Towards the light; unit length.
    pub wi: Vec3,
    /// What arrives on a surface that faces the light.
    pub irradiance: Rgb,
    /// Whether it casts shadows.
    pub shadow: bool,
}

impl DirectionalLight {
    /// The one way to the light.
    #[inline]
    pub(super) fn sample(&self) -> LightSample {
        LightSample {
            wi: self.wi,
            t_max: f32::INFINITY,
            le_over_pdf: self.irradiance,
            pdf: f32::INFINITY,
            shadow: self.shadow,
        }
    }
}
