//! The surface area heuristic over bins (Wald 2007, "On fast Construction of SAH-based Bounding Volume
//! Hierarchies"): boxes, references, bins and the best plane among them.

use super::data::BLOCK;
use glam::{Vec3, Vec4, Vec4Swizzles};

/// Bins an axis.
pub(super) const BINS: usize = 16;

/// A box in two vectors of four, whose last components mean nothing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    pub(super) lo: Vec4,
    pub(super) hi: Vec4,
}

impl Bounds {
    pub(super) const EMPTY: Self = Self { lo: Vec4::INFINITY, hi: Vec4::NEG_INFINITY };

    #[inline(always)]
    pub(super) fn join(&mut self, lo: Vec4, hi: Vec4) {
        self.lo = self.lo.min(lo);
        self.hi = self.hi.max(hi);
    }

    /// Half the surface area; zero for an empty box.
    #[inline(always)]
    pub(super) fn half_area(&self) -> f32 {
        let d = (self.hi - self.lo).max(Vec4::ZERO);
        let p = d * d.yzxw();
        p.x + p.y + p.z
    }

    /// The part in common with another box.
    pub(super) fn intersection(&self, o: &Self) -> Self {
        Self { lo: self.lo.max(o.lo), hi: self.hi.min(o.hi) }
    }

    /// Whether `lo <= hi` on the three axes.
    pub(super) fn is_valid(&self) -> bool {
        self.lo.xyz().cmple(self.hi.xyz()).all()
    }
}

/// A primitive, or with spatial splits a part of one: its box and its ids.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ref {
    /// Least corner; the last component carries the bits of the primitive's id.
    lo: Vec4,
    /// Greatest corner; the last component carries the bits of the geometry's id.
    hi: Vec4,
}

impl Ref {
    pub(super) const NONE: Self = Self { lo: Vec4::ZERO, hi: Vec4::ZERO };

    pub(super) fn new(lo: Vec3, hi: Vec3, geom_id: u32, prim_id: u32) -> Self {
        Self { lo: lo.extend(f32::from_bits(prim_id)), hi: hi.extend(f32::from_bits(geom_id)) }
    }

    pub(super) fn geom_id(&self) -> u32 {
        self.hi.w.to_bits()
    }

    pub(super) fn prim_id(&self) -> u32 {
        self.lo.w.to_bits()
    }

    #[inline(always)]
    pub(super) fn bounds(&self) -> Bounds {
        Bounds { lo: self.lo, hi: self.hi }
    }

    /// The same primitive with a smaller box.
    pub(super) fn with_bounds(&self, b: &Bounds) -> Self {
        Self::new(b.lo.xyz(), b.hi.xyz(), self.geom_id(), self.prim_id())
    }

    /// Centre of the box; halves first, so that huge coordinates do not overflow.
    #[inline(always)]
    pub(super) fn center(&self) -> Vec4 {
        0.5 * self.lo + 0.5 * self.hi
    }
}

/// Box around the boxes.
pub(super) fn bounds_of(refs: &[Ref]) -> Bounds {
    let mut bounds = Bounds::EMPTY;
    for r in refs {
        bounds.join(r.lo, r.hi);
    }
    bounds
}

/// Box around the centres.
pub(super) fn centers_of(refs: &[Ref]) -> Bounds {
    let mut bounds = Bounds::EMPTY;
    for r in refs {
        let center = r.center();
        bounds.join(center, center);
    }
    bounds
}

/// Blocks that `count` primitives fill: what the heuristic counts, since a block is tested at once.
#[inline(always)]
pub(super) fn blocks(count: usize) -> f32 {
    count.div_ceil(BLOCK) as f32
}

/// The map from centres to bins.
#[derive(Clone, Copy, Debug)]
pub(super) struct Binner {
    base: Vec4,
    /// Zero for an axis without extent (or with one that f32 cannot divide by).
    scale: Vec4,
    bins: usize,
}

impl Binner {
    pub(super) fn new(centers: &Bounds, bins: usize) -> Self {
        let scale = (0.999 * bins as f32) / (centers.hi - centers.lo);
        let scale =
            Vec4::from_array(scale.to_array().map(|s| if s.is_finite() && s > 0.0 { s } else { 0.0 }));
        Self { base: centers.lo, scale, bins }
    }

    /// Bins of the three axes. Rounding to the nearest integer by adding 2^23 leaves that integer in the low bits.
    #[inline(always)]
    pub(super) fn bins_of(&self, r: &Ref) -> [usize; 3] {
        let place = (r.center() - self.base) * self.scale + Vec4::splat(0.5001) + Vec4::splat(8_388_608.0);
        let bin = |x: f32| (x.to_bits().wrapping_sub(0x4b00_0001) as usize) % BINS;
        [bin(place.x), bin(place.y), bin(place.z)]
    }

    /// Whether the reference goes to the left.
    #[inline(always)]
    pub(super) fn is_left(&self, r: &Ref, split: &Split) -> bool {
        self.bins_of(r)[split.axis % 3] < split.bin
    }
}

/// Bins before which to split an axis, and what that would cost.
#[derive(Clone, Copy, Debug)]
pub(super) struct Split {
    pub(super) axis: usize,
    pub(super) bin: usize,
    /// Sum over both sides of half area times blocks; infinite if there is no split.
    pub(super) cost: f32,
    pub(super) left: Side,
    pub(super) right: Side,
}

/// What comes to lie on a side.
#[derive(Clone, Copy, Debug)]
pub(super) struct Side {
    pub(super) bounds: Bounds,
    pub(super) count: usize,
}

impl Side {
    pub(super) const EMPTY: Self = Self { bounds: Bounds::EMPTY, count: 0 };

    pub(super) fn cost(&self) -> f32 {
        self.bounds.half_area() * blocks(self.count)
    }

    fn join(&mut self, bounds: &Bounds, count: u32) {
        self.bounds.join(bounds.lo, bounds.hi);
        self.count += count as usize;
    }
}

impl Split {
    pub(super) const NONE: Self =
        Self { axis: 0, bin: 0, cost: f32::INFINITY, left: Side::EMPTY, right: Side::EMPTY };
}

/// References counted into the bins of each axis; spatial splits count where they begin and where they end.
#[derive(Clone)]
pub(super) struct Bins {
    pub(super) bounds: [[Bounds; BINS]; 3],
    pub(super) begins: [[u32; BINS]; 3],
    pub(super) ends: [[u32; BINS]; 3],
}

impl Bins {
    pub(super) const EMPTY: Self =
        Self { bounds: [[Bounds::EMPTY; BINS]; 3], begins: [[0; BINS]; 3], ends: [[0; BINS]; 3] };

    /// Counts references by their centres.
    pub(super) fn count(refs: &[Ref], binner: &Binner) -> Self {
        let mut bins = Self::EMPTY;
        for r in refs {
            let place = binner.bins_of(r);
            for axis in 0..3 {
                let bin = place[axis] % BINS;
                bins.bounds[axis][bin].join(r.lo, r.hi);
                bins.begins[axis][bin] += 1;
            }
        }
        bins.ends = bins.begins;
        bins
    }

    /// Adds the counts of another part of the references.
    pub(super) fn merge(mut self, o: &Self) -> Self {
        for axis in 0..3 {
            for bin in 0..BINS {
                self.bounds[axis][bin].join(o.bounds[axis][bin].lo, o.bounds[axis][bin].hi);
                self.begins[axis][bin] += o.begins[axis][bin];
                self.ends[axis][bin] += o.ends[axis][bin];
            }
        }
        self
    }

    /// The cheapest place to split an axis into bins before `bin` and the rest.
    pub(super) fn best_split(&self, used: impl Fn(usize) -> bool, bins: usize) -> Split {
        let mut best = Split::NONE;
        for axis in (0..3).filter(|&axis| used(axis)) {
            let mut rights = [Side::EMPTY; BINS];
            let mut right = Side::EMPTY;
            for bin in (1..bins).rev() {
                right.join(&self.bounds[axis][bin], self.ends[axis][bin]);
                rights[bin] = right;
            }
            let mut left = Side::EMPTY;
            for bin in 1..bins {
                left.join(&self.bounds[axis][bin - 1], self.begins[axis][bin - 1]);
                let right = &rights[bin];
                let cost = left.cost() + right.cost();
                if left.count > 0 && right.count > 0 && cost < best.cost {
                    best = Split { axis, bin, cost, left, right: *right };
                }
            }
        }
        best
    }

    /// The best split by centres.
    pub(super) fn best_object_split(&self, binner: &Binner) -> Split {
        self.best_split(|axis| binner.scale[axis] > 0.0, binner.bins)
    }
}
