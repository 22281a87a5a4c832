//! Analytic spheres.

use super::Aabb;
use glam::Vec3;

/// A sphere; the layout is that of a four-float vertex, centre then radius, as Embree's sphere points read it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(16))]
pub struct Sphere {
    /// Centre.
    pub center: Vec3,
    /// Radius, positive.
    pub radius: f32,
}

impl Sphere {
    /// The box around it.
    pub fn bounds(self) -> Aabb {
        Aabb { min: self.center - self.radius, max: self.center + self.radius }
    }

    /// The unit normal, outward, at a point on or near the sphere.
    #[inline]
    pub fn normal_at(self, p: Vec3) -> Vec3 {
        (p - self.center).normalize()
    }
}
