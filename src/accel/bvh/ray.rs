//! What a ray is turned into once, before it meets any box or primitive.

use super::data::{BLOCK, NO_ID};
use crate::core::{Hit, Ray, Skip};
use glam::Vec3;

/// Relative error that the slab test grants to exits: 16 times what its own roundings and those of the triangle
/// test can add up to in units of 2^-24 (after Ize 2013, "Robust BVH Ray Traversal").
pub(super) const EXIT_INFLATION: f32 = 1.0 + 16.0 * f32::EPSILON;

/// A box that starts this much behind the closest hit so far is still looked into, so that rounding in `t` does
/// not make the answer depend on who was looked at first.
pub(super) const CULL_INFLATION: f32 = 1.0 + 1e-5;

/// Direction components below this fraction of one are raised to it: their reciprocals stay finite.
const LEAST_DIRECTION: f32 = 1e-18;

/// Directions outside these lengths are scaled by a power of two first.
const LEAST_LENGTH: f32 = 1e-6;
const GREATEST_LENGTH: f32 = 1e6;

/// A ray in the form that the inner loops read.
///
/// `t` of a box plane is `plane * rcp - offset`. The offsets widen every box by `4 ulp` of the origin's coordinate
/// in space, which covers the cancellation in that form on every instruction set; the relative part is
/// [`EXIT_INFLATION`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Prepared {
    /// Origin, and the axes in the order of the shear: `axes[2]` is the one along which the ray is fastest.
    pub(super) origin: [f32; 3],
    pub(super) axes: [usize; 3],
    /// `dir[axes[0]] / dir[axes[2]]`, `dir[axes[1]] / dir[axes[2]]`, `1 / dir[axes[2]]`
    /// (Woop, Benthin and Wald 2013, "Watertight Ray/Triangle Intersection").
    pub(super) shear: [f32; 3],
    pub(super) rcp: [f32; 3],
    pub(super) near_offset: [f32; 3],
    pub(super) far_offset: [f32; 3],
    /// 1 where the direction is negative: which plane of a slab comes first.
    pub(super) sign: [usize; 3],
    pub(super) t_min: f32,
    pub(super) t_max: f32,
    pub(super) dir: [f32; 3],
    /// `t` of the ray as it was given, for one `t` here: a power of two.
    pub(super) t_unscale: f32,
    pub(super) skip: SkipIds,
}

/// A skip rule as two compares.
#[derive(Clone, Copy, Debug)]
pub(super) struct SkipIds {
    geom: u32,
    prim: u32,
    any_prim: bool,
}

impl SkipIds {
    #[inline(always)]
    fn new(skip: Skip) -> Self {
        match skip {
            Skip::None => Self { geom: NO_ID, prim: NO_ID, any_prim: false },
            Skip::Primitive { geom, prim } => Self { geom, prim, any_prim: false },
            Skip::Geometry(geom) => Self { geom, prim: NO_ID, any_prim: true },
        }
    }

    /// Whether the rule rejects a primitive. Unused lanes never get here.
    #[inline(always)]
    pub(super) fn rejects(self, geom: u32, prim: u32) -> bool {
        self.geom == geom && (self.any_prim || self.prim == prim)
    }
}

impl Prepared {
    /// The inner form of a ray among coordinates up to `extent`; `None` for an inactive one.
    #[inline(always)]
    pub(super) fn new(ray: &Ray, extent: f32) -> Option<Self> {
        // The test of `Ray::is_active` without its branches: zero times anything infinite or NaN is NaN.
        let zero = 0.0 * ray.origin + 0.0 * ray.dir;
        if !(ray.t_min <= ray.t_max && zero.x + zero.y + zero.z == 0.0) {
            return None;
        }
        let (mut dir, mut t_scale) = (ray.dir, 1.0);
        let longest = dir.x.abs().max(dir.y.abs()).max(dir.z.abs());
        if !(LEAST_LENGTH..=GREATEST_LENGTH).contains(&longest) {
            if longest == 0.0 {
                return None;
            }
            t_scale = power_of_two_below(longest);
            dir /= t_scale;
        }
        let safe = |d: f32| if d.abs() < LEAST_DIRECTION { LEAST_DIRECTION.copysign(d) } else { d };
        let rcp = Vec3::ONE / Vec3::new(safe(dir.x), safe(dir.y), safe(dir.z));
        let center = ray.origin * rcp;
        let slack = (4.0 * f32::EPSILON * ray.origin.abs() + 1e-12 * extent) * rcp.abs();

        let (dir, rcp) = (dir.to_array(), rcp.to_array());
        let axes = AXES[fastest_axis(dir)];
        let z = rcp[axes[2]];
        Some(Self {
            origin: ray.origin.to_array(),
            axes,
            shear: [dir[axes[0]] * z, dir[axes[1]] * z, z],
            rcp,
            near_offset: (center + slack).to_array(),
            far_offset: (center - slack).to_array(),
            sign: rcp.map(|r| (r.to_bits() >> 31) as usize),
            t_min: ray.t_min * t_scale,
            t_max: ray.t_max * t_scale,
            dir,
            t_unscale: 1.0 / t_scale,
            skip: SkipIds::new(ray.skip),
        })
    }

    /// The octant of the direction: bit k is set where axis k is negative.
    #[inline(always)]
    pub(super) fn octant(&self) -> u32 {
        (self.sign[0] | self.sign[1] << 1 | self.sign[2] << 2) as u32
    }
}

/// Axes of the shear for each fastest axis.
const AXES: [[usize; 3]; 3] = [[1, 2, 0], [2, 0, 1], [0, 1, 2]];

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
    /// Which of the block's triangles it is, and the block's edge functions and their sums: the barycentrics are
    /// divided out for the one hit that remains.
    pub(super) lane: usize,
    pub(super) weights: [[f32; BLOCK]; 3],
}

impl Best {
    /// Nothing yet, before `t_max`.
    #[inline(always)]
    pub(super) fn none(t_max: f32) -> Self {
        Self { t: t_max, geom_id: NO_ID, prim_id: NO_ID, lane: 0, weights: [[0.0; BLOCK]; 3] }
    }

    /// Whether a hit is nearer, or as near with smaller ids: a total order, so no path can disagree.
    #[inline(always)]
    pub(super) fn loses_to(&self, t: f32, geom_id: u32, prim_id: u32) -> bool {
        t < self.t || (t == self.t && (geom_id, prim_id) < (self.geom_id, self.prim_id))
    }

    /// The hit as callers know it.
    #[inline(always)]
    pub(super) fn hit(&self, ray: &Prepared) -> Hit {
        let [v, w, det] = self.weights.map(|lanes| lanes[self.lane % BLOCK]);
        Hit {
            t: self.t * ray.t_unscale,
            u: v / det,
            v: w / det,
            geom_id: self.geom_id,
            prim_id: self.prim_id,
        }
    }
}
