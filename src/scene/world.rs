//! The unit world: where everything is rendered, whatever the size and place of the scene.

use glam::{DAffine3, DVec3, Vec3};

/// `unit = (scene - center) * scale`, in f64.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct World {
    /// The scene's point that becomes the origin.
    pub center: DVec3,
    /// Unit lengths per scene length; a power of two, so that scaling rounds nothing.
    pub scale: f64,
}

impl World {
    /// The scene file's own coordinates.
    pub const IDENTITY: Self = Self { center: DVec3::ZERO, scale: 1.0 };

    /// The world in which the box from `min` to `max` is about one unit large, at the origin.
    pub fn around(min: DVec3, max: DVec3) -> Self {
        let extent = (max - min).max_element();
        if !(extent.is_finite() && extent > 0.0) {
            return Self::IDENTITY;
        }
        Self { center: 0.5 * (min + max), scale: (-extent.log2().round()).exp2() }
    }

    /// The map from the scene's coordinates to the unit world's.
    pub fn affine(&self) -> DAffine3 {
        DAffine3::from_scale(DVec3::splat(self.scale)) * DAffine3::from_translation(-self.center)
    }

    /// From the scene's coordinates to the unit world's.
    pub fn to_unit(&self, p: DVec3) -> Vec3 {
        ((p - self.center) * self.scale).as_vec3()
    }

    /// From the unit world's coordinates to the scene's.
    pub fn to_scene(&self, p: Vec3) -> DVec3 {
        p.as_dvec3() / self.scale + self.center
    }

    /// A length of the scene in unit lengths.
    pub fn length_to_unit(&self, length: f64) -> f32 {
        (length * self.scale) as f32
    }

    /// A unit length in the scene's.
    pub fn length_to_scene(&self, length: f32) -> f64 {
        f64::from(length) / self.scale
    }
}
