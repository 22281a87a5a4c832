//! The pinhole camera.

use glam::{DVec3, Vec3};

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

    /// The unit direction through the point `(x, y)` of the image, in pixels from the upper left corner.
    #[inline(always)]
    pub fn direction(&self, x: f32, y: f32) -> Vec3 {
        let [width, height] = self.resolution.map(|n| 0.5 * n as f32);
        (self.forward + (x - width) * self.right + (y - height) * self.down).normalize()
    }
}
