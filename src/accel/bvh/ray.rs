//! What a ray is turned into once, before it meets any box or primitive.

use super::data::NO_ID;
use crate::core::{Hit, Ray, Skip};
use glam::{Vec3, Vec3A};

/// What the slab test multiplies exits by: room for its own three roundings at either end and for those of the
/// triangle test, several times over (after Ize 2013, "Robust BVH Ray Traversal").
pub(super) const EXIT_INFLATION: f32 = 1.0 + 16.0 * f32::EPSILON;

/// A box that starts this much behind the closest hit so far is still looked into, so that rounding in `t` does
/// not make the answer depend on who was looked at first.
pub(super) const CULL_INFLATION: f32 = 1.0 + 1e-5;

/// Directions outside these lengths are scaled by a power of two first.
pub(super) const LEAST_LENGTH: f32 = 1e-6;
pub(super) const GREATEST_LENGTH: f32 = 1e6;

/// A ray in the form that the inner loops read.
///
/// `t` of a box plane is `(origin - plane) * neg_rcp`, which is right to three roundings however near or far the
/// plane is. Parallel to the plane it is infinite, or NaN on it, which the slab test takes for "no bound".
#[derive(Clone, Copy, Debug)]
pub(super) struct Prepared {
    /// Origin, and the axes in the order of the shear: `axes[2]` is the one along which the ray is fastest.
    pub(super) origin: [f32; 3],
    pub(super) axes: [usize; 3],
    /// `dir[axes[0]] / dir[axes[2]]`, `dir[axes[1]] / dir[axes[2]]`, `1 / dir[axes[2]]`
    /// (Woop, Benthin and Wald 2013, "Watertight Ray/Triangle Intersection").
    pub(super) shear: [f32; 3],
    /// `-1 / dir`, by axis.
    pub(super) neg_rcp: [f32; 3],
    /// The same with [`EXIT_INFLATION`].
    pub(super) neg_rcp_far: [f32; 3],
    /// 1 where the direction is negative: which plane of a slab comes first.
    pub(super) sign: [usize; 3],
    pub(super) t_min: f32,
    pub(super) t_max: f32,
    /// `t` here, for one `t` of the ray as it was given: a power of two.
    pub(super) t_scale: f32,
    pub(super) skip: Skip,
}

impl Prepared {
    /// The inner form of a ray; `None` for an inactive one.
    #[inline(always)]
    pub(super) fn new(ray: &Ray) -> Option<Self> {
        let (origin, mut dir) = (Vec3A::from(ray.origin), Vec3A::from(ray.dir));
        // The test of `Ray::is_active` without its branches: zero times anything infinite or NaN is NaN.
        let zero = (0.0 * origin + 0.0 * dir).element_sum();
        if !(ray.t_min <= ray.t_max && zero == 0.0) {
            return None;
        }
        let mut t_scale = 1.0;
        let longest = dir.abs().max_element();
        if !(LEAST_LENGTH..=GREATEST_LENGTH).contains(&longest) {
            if longest == 0.0 {
                return None;
            }
            t_scale = power_of_two_below(longest);
            dir /= t_scale;
        }
        let neg_rcp = -1.0 / dir;
        let signs = neg_rcp.cmpgt(Vec3A::ZERO).bitmask() as usize;

        let neg_rcp_far = (EXIT_INFLATION * neg_rcp).to_array();
        let (dir, neg_rcp) = (dir.to_array(), neg_rcp.to_array());
        let axes = AXES[fastest_axis(dir)];
        let z = -neg_rcp[axes[2]];
        Some(Self {
            origin: origin.to_array(),
            axes,
            shear: [dir[axes[0]] * z, dir[axes[1]] * z, z],
            neg_rcp,
            neg_rcp_far,
            sign: [signs & 1, signs >> 1 & 1, signs >> 2 & 1],
            t_min: ray.t_min * t_scale,
            t_max: ray.t_max * t_scale,
            t_scale,
            skip: ray.skip,
        })
    }

    /// The direction, for the tests that need it.
    pub(super) fn dir(&self) -> Vec3 {
        let mut dir = Vec3::ZERO;
        let [x, y, z] = self.axes;
        (dir[x], dir[y], dir[z]) =
            (self.shear[0] / self.shear[2], self.shear[1] / self.shear[2], 1.0 / self.shear[2]);
        dir
    }

    /// The octant of the direction: bit k is set where axis k is negative.
    #[inline(always)]
    pub(super) fn octant(&self) -> u32 {
        (self.sign[0] | self.sign[1] << 1 | self.sign[2] << 2) as u32
    }
}

/// Axes of the shear for each fastest axis.
pub(super) const AXES: [[usize; 3]; 3] = [[1, 2, 0], [2, 0, 1], [0, 1, 2]];

/// Index of the greatest component, without branches: incoherent rays would mispredict them.
#[inline(always)]
fn fastest_axis(dir: [f32; 3]) -> usize {
    let [x, y, z] = dir.map(f32::abs);
    let is_z = usize::from(z > x.max(y));
    let is_y = usize::from(y > x) & (is_z ^ 1);
    2 * is_z + is_y
}

/// The greatest power of two that is at most `x`, for a positive finite `x`, but at least the least normal number.
#[cold]
fn power_of_two_below(x: f32) -> f32 {
    f32::from_bits(x.to_bits() & 0xff80_0000).max(f32::MIN_POSITIVE)
}

/// The closest hit so far, in the inner form.
#[derive(Clone, Copy, Debug)]
pub(super) struct Best {
    pub(super) t: f32,
    pub(super) geom_id: u32,
    pub(super) prim_id: u32,
    /// Edge functions of the second and third corner, and the sum of all: the barycentrics are divided out for the
    /// one hit that remains.
    pub(super) weights: [f32; 3],
}

impl Best {
    /// Nothing yet, before `t_max`.
    #[inline(always)]
    pub(super) fn none(t_max: f32) -> Self {
        Self { t: t_max, geom_id: NO_ID, prim_id: NO_ID, weights: [0.0, 0.0, 1.0] }
    }

    /// Whether anything was hit.
    #[inline(always)]
    pub(super) fn is_hit(&self) -> bool {
        self.geom_id != NO_ID
    }

    /// The hit as callers know it, if there is one.
    #[inline(always)]
    pub(super) fn hit(&self, ray: &Prepared) -> Option<Hit> {
        if !self.is_hit() {
            return None;
        }
        let [v, w, det] = self.weights;
        let t = self.t / ray.t_scale;
        Some(Hit { t, u: v / det, v: w / det, geom_id: self.geom_id, prim_id: self.prim_id })
    }
}
