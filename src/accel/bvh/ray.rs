//! What a ray is turned into once, before it meets any box or primitive.

use super::data::{BLOCK, Hierarchy, Place};
use crate::core::{Hit, Ray, Skip};
use glam::{Vec3, Vec3A, Vec3Swizzles};

/// By how much boxes are wider than their primitives, as a part of their largest coordinate, and origins wider than
/// points: room for the roundings of the slab test (after Ize 2013, "Robust BVH Ray Traversal") and of the triangle
/// test, together at most 12 of these units. So whatever a triangle test accepts lies in boxes that are entered.
pub(super) const SLACK: f32 = 16.0 * f32::EPSILON;

/// Reciprocals of directions are finite in the slab test.
pub(super) const GREATEST_RECIPROCAL: f32 = 1e18;

/// A box that starts this much behind the closest hit so far is still looked into, so that rounding in `t` does
/// not make the answer depend on who was looked at first.
pub(super) const CULL_INFLATION: f32 = 1.0 + 1e-5;

/// Directions outside these lengths (sums of components) are scaled by a power of two first.
pub(super) const LEAST_LENGTH: f32 = 1e-6;
pub(super) const GREATEST_LENGTH: f32 = 1e6;

/// A ray in the form that the inner loops read.
///
/// Its triples are vectors: written and read as one, they pass the store buffer, which separate writes would not.
#[derive(Clone, Copy, Debug)]
pub(super) struct Prepared {
    pub(super) origin: Vec3A,
    /// The same by the axes of the shear.
    pub(super) turned_origin: Vec3A,
    /// The axes in the order of the shear: `axes[2]` is the one along which the ray is fastest.
    pub(super) axes: [usize; 3],
    /// `dir[axes[0]] / dir[axes[2]]`, `dir[axes[1]] / dir[axes[2]]`, `1 / dir[axes[2]]`
    /// (Woop, Benthin and Wald 2013, "Watertight Ray/Triangle Intersection").
    pub(super) shear: Vec3A,
    /// What the slab test needs.
    pub(super) slabs: Slabs,
    /// Bit k is set where the direction is negative along axis k.
    pub(super) octant: u32,
    pub(super) t_min: f32,
    /// Finite: an infinite hit is none.
    pub(super) t_max: f32,
    /// `t` here, for one `t` of the ray as it was given: a power of two.
    pub(super) t_scale: f32,
    pub(super) skip: Skip,
}

/// A ray enters a slab at `plane * rcp - near` and leaves it at `plane * rcp - far`, by axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slabs {
    /// `1 / dir`, finite.
    pub(super) rcp: Vec3A,
    /// `origin / dir`, for the last origin along the ray that [`SLACK`] allows.
    pub(super) near: Vec3A,
    /// The same for the first.
    pub(super) far: Vec3A,
}

impl Slabs {
    #[inline(always)]
    fn new(origin: Vec3A, dir: Vec3A) -> Self {
        let rcp = (1.0 / dir).clamp(Vec3A::splat(-GREATEST_RECIPROCAL), Vec3A::splat(GREATEST_RECIPROCAL));
        let middle = origin * rcp;
        let slack = SLACK * origin.abs().element_sum() * rcp.abs();
        Self { rcp, near: middle + slack, far: middle - slack }
    }
}

impl Prepared {
    /// The inner form of a ray. An inactive one ends before it starts.
    #[inline(always)]
    pub(super) fn new(ray: &Ray) -> Self {
        let (origin, dir) = (Vec3A::from(ray.origin), Vec3A::from(ray.dir));
        // NaN and infinity stay in the sums and fail the comparisons.
        let is_usual = origin.abs().element_sum() < f32::INFINITY
            && (LEAST_LENGTH..=GREATEST_LENGTH).contains(&dir.abs().element_sum())
            && ray.t_min <= ray.t_max;
        if is_usual { Self::scaled(ray, origin, dir, 1.0) } else { Self::unusual(ray) }
    }

    /// Rays that are inactive, or whose direction has an extreme length.
    #[cold]
    #[inline(never)]
    fn unusual(ray: &Ray) -> Self {
        if !ray.is_active() {
            return Self::scaled(&Ray::inactive(), Vec3A::ZERO, Vec3A::Z, 1.0);
        }
        let t_scale = power_of_two_below(ray.dir.abs().max_element());
        Self::scaled(ray, Vec3A::from(ray.origin), Vec3A::from(ray.dir) / t_scale, t_scale)
    }

    #[inline(always)]
    fn scaled(ray: &Ray, origin: Vec3A, dir: Vec3A, t_scale: f32) -> Self {
        let slabs = Slabs::new(origin, dir);
        let octant = slabs.rcp.is_negative_bitmask();

        // Which components are at least the next one tells the greatest without branches, which incoherent rays would
        // mispredict.
        let length = dir.abs();
        let axes = AXES_BY_ORDER[length.cmpge(length.yzx()).bitmask() as usize & 7];
        let (dir, from) = (dir.to_array(), origin.to_array());
        let z = slabs.rcp.to_array()[axes[2]];
        Self {
            origin,
            turned_origin: Vec3A::new(from[axes[0]], from[axes[1]], from[axes[2]]),
            axes,
            shear: Vec3A::new(dir[axes[0]] * z, dir[axes[1]] * z, z),
            slabs,
            octant,
            t_min: ray.t_min * t_scale,
            t_max: (ray.t_max * t_scale).min(f32::MAX),
            t_scale,
            skip: ray.skip,
        }
    }

    /// 1 where the direction is negative: which plane of a slab comes first.
    #[inline(always)]
    pub(super) fn sign(&self) -> [usize; 3] {
        let octant = self.octant as usize;
        [octant & 1, octant >> 1 & 1, octant >> 2 & 1]
    }

    /// The direction, for the tests that need it.
    pub(super) fn dir(&self) -> Vec3 {
        let mut dir = Vec3::ZERO;
        let [x, y, z] = self.axes;
        (dir[x], dir[y], dir[z]) =
            (self.shear.x / self.shear.z, self.shear.y / self.shear.z, 1.0 / self.shear.z);
        dir
    }
}

/// Axes of the shear for each fastest axis.
pub(super) const AXES: [[usize; 3]; 3] = [[1, 2, 0], [2, 0, 1], [0, 1, 2]];

/// Axes of the shear by the bits `x >= y`, `y >= z`, `z >= x` of the direction's absolute components.
const AXES_BY_ORDER: [[usize; 3]; 8] =
    [AXES[0], AXES[0], AXES[1], AXES[0], AXES[2], AXES[2], AXES[1], AXES[0]];

/// The greatest power of two that is at most `x`, for a positive finite `x`, but at least the least normal number.
#[cold]
fn power_of_two_below(x: f32) -> f32 {
    f32::from_bits(x.to_bits() & 0xff80_0000).max(f32::MIN_POSITIVE)
}

/// The closest hit so far, in the inner form: small enough for two registers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Best {
    pub(super) t: f32,
    pub(super) place: Place,
}

impl Best {
    /// Nothing yet, before `t_max`.
    #[inline(always)]
    pub(super) fn none(t_max: f32) -> Self {
        Self { t: t_max, place: Place::NONE }
    }

    /// Whether anything was hit.
    #[inline(always)]
    pub(super) fn is_hit(&self) -> bool {
        self.place != Place::NONE
    }

    /// Whether a hit that is no farther counts and is nearer, or as near with smaller ids: a total order, so no path
    /// can disagree.
    #[inline(always)]
    pub(super) fn loses_to(&self, data: &Hierarchy, ray: &Prepared, t: f32, place: Place) -> bool {
        (t < self.t || comes_first(data, place, self.place))
            && !(ray.skip != Skip::None && is_skipped(data, ray, place))
    }

    /// The hit as callers know it, if there is one.
    #[inline(always)]
    pub(super) fn hit(&self, data: &Hierarchy, ray: &Prepared, weights: &Weights) -> Option<Hit> {
        if !self.is_hit() {
            return None;
        }
        let (geom_id, prim_id) = data.ids(self.place);
        let [v, w, det] = weights.0.map(|lanes| lanes[self.place.lane()]);
        Some(Hit { t: self.t / ray.t_scale, u: v / det, v: w / det, geom_id, prim_id })
    }
}

/// Edge functions of the second and third corner and the sum of all, for the block of the closest triangle so far: the
/// barycentrics are divided out for the one that remains.
#[derive(Clone, Copy, Debug)]
pub(super) struct Weights(pub(super) [[f32; BLOCK]; 3]);

impl Weights {
    /// For whatever has no barycentrics.
    pub(super) const NONE: Self = Self([[0.0; BLOCK], [0.0; BLOCK], [1.0; BLOCK]]);
}

/// Whether the ids at a place are smaller than those at another. Seldom asked, and so out of line.
#[cold]
#[inline(never)]
pub(super) fn comes_first(data: &Hierarchy, place: Place, before: Place) -> bool {
    data.ids(place) < data.ids(before)
}

/// Whether the ray must not hit what is at a place. Asked for each of the few hits of a ray with a rule.
#[inline(never)]
fn is_skipped(data: &Hierarchy, ray: &Prepared, place: Place) -> bool {
    let (geom_id, prim_id) = data.ids(place);
    ray.skip.rejects(geom_id, prim_id)
}
