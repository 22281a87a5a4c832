//! The pinhole camera.

use crate::geometry::Aabb;
use glam::{DVec3, Vec2, Vec3};

/// A pinhole camera in the unit world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// The pinhole.
    pub eye: Vec3,
    /// Through the middle of the image; unit length.
    pub forward: Vec3,
    /// One pixel to the right on the plane at distance 1.
    pub right: Vec3,
    /// One pixel down on the plane at distance 1.
    pub down: Vec3,
    /// Image size in pixels.
    pub resolution: [u32; 2],
}

impl Camera {
    /// A camera at `eye` that looks at `target`; `pixel` is the size of a (square) pixel on the plane at distance 1.
    pub fn look_at(eye: Vec3, forward: DVec3, up: DVec3, pixel: f64, resolution: [u32; 2]) -> Self {
        let forward = forward.normalize();
        let right = forward.cross(up).normalize();
        let down = forward.cross(right);
        Self {
            eye,
            forward: forward.as_vec3(),
            right: (right * pixel).as_vec3(),
            down: (down * pixel).as_vec3(),
            resolution,
        }
    }

    /// Least and greatest coordinates in the image, in pixels from the upper left corner, of what is within `bounds`; `None`
    /// where not all of that is before the camera.
    pub fn image_of(&self, Aabb { min, max }: Aabb) -> Option<[Vec2; 2]> {
        let half = 0.5 * Vec2::from(self.resolution.map(|n| n as f32));
        let [across, down] = [self.right, self.down].map(|axis| axis / axis.length_squared());
        let corner = |i: usize| Vec3::from_array(std::array::from_fn(|axis| [min, max][i >> axis & 1][axis]));
        let (mut least, mut most) = (Vec2::INFINITY, Vec2::NEG_INFINITY);
        for to_corner in (0..8).map(|i| corner(i) - self.eye) {
            let depth = to_corner.dot(self.forward);
            if depth <= 0.0 {
                return None;
            }
            let seen = half + Vec2::new(to_corner.dot(across), to_corner.dot(down)) / depth;
            (least, most) = (least.min(seen), most.max(seen));
        }
        Some([least, most])
    }

    /// The unit direction through the point `(x, y)` of the image, in pixels from the upper left corner.
    #[inline(always)]
    pub fn direction(&self, x: f32, y: f32) -> Vec3 {
        let [width, height] = self.resolution.map(|n| 0.5 * n as f32);
        (self.forward + (x - width) * self.right + (y - height) * self.down).normalize()
    }
}
