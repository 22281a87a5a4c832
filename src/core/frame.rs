//! Orthonormal frames.

use glam::Vec3;

/// A right-handed orthonormal basis about a unit vector `n`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// First tangent.
    pub s: Vec3,
    /// Second tangent.
    pub t: Vec3,
    /// The axis that the frame was built about.
    pub n: Vec3,
}

impl Frame {
    /// The frame about the unit vector `n`; orthonormal to 2e-7 in every direction.
    ///
    /// Source: Duff et al. 2017, *Building an Orthonormal Basis, Revisited*.
    #[inline(always)]
    pub fn new(n: Vec3) -> Self {
        let sign = 1.0f32.copysign(n.z);
        let a = -1.0 / (sign + n.z);
        let b = n.x * n.y * a;
        Self {
            s: Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
            t: Vec3::new(b, sign + n.y * n.y * a, -n.y),
            n,
        }
    }

    /// From this frame's coordinates to those that `n` is given in.
    #[inline(always)]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        self.s * v.x + self.t * v.y + self.n * v.z
    }

    /// From the coordinates that `n` is given in to this frame's.
    #[inline(always)]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.s), v.dot(self.t), v.dot(self.n))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::warp;

    #[test]
    fn frames_are_orthonormal_everywhere_and_at_both_poles() {
        let near_pole = |x: f32, z: f32| Vec3::new(x, -x, z).normalize();
        let mut directions =
            vec![Vec3::Z, -Vec3::Z, Vec3::X, Vec3::Y, near_pole(1e-4, -1.0), near_pole(1e-7, -1.0)];
        for i in 0..10_000u32 {
            directions.push(warp::uniform_sphere([
                (i as f32 + 0.5) / 10_000.0,
                (i.wrapping_mul(2_654_435_769) >> 8) as f32 / (1 << 24) as f32,
            ]));
        }
        for n in directions {
            let f = Frame::new(n);
            for error in [f.s.dot(f.t), f.s.dot(n), f.t.dot(n), f.s.length() - 1.0, f.t.length() - 1.0] {
                assert!(error.abs() < 5e-7, "{n}: {error}");
            }
            assert!((f.s.cross(f.t) - n).length() < 1e-6);
        }
    }
}
