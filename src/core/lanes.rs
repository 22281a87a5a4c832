//! Eight of a kind side by side, so that a loop over them compiles to wide instructions.
//!
//! Written as plain loops over arrays: inside [`widely`](super::widely), a compiler turns each operation on eight
//! numbers into one instruction, and every lane has the bits that it would have alone.

use super::Rgb;
use glam::Vec3;

/// Lanes of a group.
pub const LANES: usize = 8;

/// A number in each lane.
pub type Floats = [f32; LANES];

/// A vector in each lane, by component.
#[derive(Clone, Copy, Debug, Default)]
pub struct Vectors {
    x: Floats,
    y: Floats,
    z: Floats,
}

impl Vectors {
    /// Puts a vector into a lane.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, v: Vec3) {
        (self.x[lane], self.y[lane], self.z[lane]) = (v.x, v.y, v.z);
    }

    /// The vector in a lane.
    #[inline(always)]
    pub fn get(&self, lane: usize) -> Vec3 {
        Vec3::new(self.x[lane], self.y[lane], self.z[lane])
    }
}

/// A colour in each lane, by channel.
#[derive(Clone, Copy, Debug, Default)]
pub struct Colours {
    r: Floats,
    g: Floats,
    b: Floats,
}

impl Colours {
    /// Puts a colour into a lane.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, colour: Rgb) {
        (self.r[lane], self.g[lane], self.b[lane]) = (colour.r, colour.g, colour.b);
    }

    /// The colour in a lane.
    #[inline(always)]
    pub fn get(&self, lane: usize) -> Rgb {
        Rgb::new(self.r[lane], self.g[lane], self.b[lane])
    }
}
