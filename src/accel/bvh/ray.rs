//! What a ray is turned into once, before it meets any box or primitive.

use super::data::{BLOCK, Hierarchy, Place};
use super::mode::Mode;
use crate::core::{Hit, Ray, Skip};
use glam::{Vec3, Vec3A};

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
pub(super) struct Prepared<M: Mode> {
    pub(super) origin: Vec3A,
    pub(super) dir: Vec3A,
    /// What the triangle test needs beside these.
    pub(super) line: M::Line,
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
    /// `origin / dir`; in the watertight mode for the last origin along the ray that [`SLACK`] allows.
    pub(super) near: Vec3A,
    /// The same, there for the first.
    pub(super) far: Vec3A,
}

impl Slabs {
    #[inline(always)]
    fn new<M: Mode>(origin: Vec3A, dir: Vec3A) -> Self {
        let rcp = (1.0 / dir).clamp(Vec3A::splat(-GREATEST_RECIPROCAL), Vec3A::splat(GREATEST_RECIPROCAL));
        let middle = origin * rcp;
        if !M::WATERTIGHT {
            return Self { rcp, near: middle, far: middle };
        }
        let slack = SLACK * origin.abs().element_sum() * rcp.abs();
        Self { rcp, near: middle + slack, far: middle - slack }
    }
}

impl<M: Mode> Prepared<M> {
    /// The inner form of a ray. An inactive one ends before it starts.
    #[inline(always)]
    pub(super) fn new(ray: &Ray) -> Self {
        let (mut origin, mut dir) = (Vec3A::from(ray.origin), Vec3A::from(ray.dir));
        let (mut t_min, mut t_max, mut t_scale) = (ray.t_min, ray.t_max, 1.0);

        // NaN and infinity stay in the sums and fail the comparisons.
        let is_usual = origin.abs().element_sum() < f32::INFINITY
            && (LEAST_LENGTH..=GREATEST_LENGTH).contains(&dir.abs().element_sum())
            && t_min <= t_max;
        if !is_usual {
            let (scaled, scale) = unusual(ray);
            (origin, dir) = (scaled.origin.into(), scaled.dir.into());
            (t_min, t_max, t_scale) = (scaled.t_min, scaled.t_max, scale);
        }

        let slabs = Slabs::new::<M>(origin, dir);
        Self {
            origin,
            dir,
            line: M::line(origin, dir, slabs.rcp),
            octant: slabs.rcp.is_negative_bitmask(),
            slabs,
            t_min,
            t_max: if t_max < f32::MAX { t_max } else { f32::MAX },
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
}

/// A ray that is inactive, or whose direction has an extreme length, in numbers that are usual, and one `t` of the given
/// ray in its own.
#[cold]
#[inline(never)]
pub(super) fn unusual(ray: &Ray) -> (Ray, f32) {
    if !ray.is_active() {
        return (Ray { t_min: 1.0, t_max: 0.0, ..Ray::new(Vec3::ZERO, Vec3::Z) }, 1.0);
    }
    let scale = power_of_two_below(ray.dir.abs().max_element());
    let (t_min, t_max) = (ray.t_min * scale, ray.t_max * scale);
    (Ray { dir: ray.dir / scale, t_min, t_max, ..*ray }, scale)
}

/// The greatest power of two that is at most `x`, for a positive finite `x`, but at least the least normal number.
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
    pub(super) fn loses_to(&self, data: &Hierarchy, skip: Skip, t: f32, place: Place) -> bool {
        (t < self.t || comes_first(data, place, self.place))
            && !(skip != Skip::None && is_skipped(data, skip, place))
    }

    /// The hit as callers know it, if there is one.
    #[inline(always)]
    pub(super) fn hit<M: Mode>(&self, data: &Hierarchy, ray: &Prepared<M>, weights: &Weights) -> Option<Hit> {
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
fn is_skipped(data: &Hierarchy, skip: Skip, place: Place) -> bool {
    let (geom_id, prim_id) = data.ids(place);
    skip.rejects(geom_id, prim_id)
}
