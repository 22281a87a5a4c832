//! Boxes as the builder keeps them, and references: primitives of which only the box is looked at.

use super::simd::{Available, Kernel, Lanes, Simd};
use glam::{Vec3, Vec4, Vec4Swizzles};

/// A box in eight numbers: the least corner and the greatest one negated, so that joining is one minimum. The last of
/// each four mean nothing.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(super) struct Bounds([f32; 8]);

impl Bounds {
    pub(super) const EMPTY: Self = Self([f32::INFINITY; 8]);

    pub(super) fn new(lo: Vec4, hi: Vec4) -> Self {
        Self([lo.x, lo.y, lo.z, lo.w, -hi.x, -hi.y, -hi.z, -hi.w])
    }

    /// Least corner.
    #[inline(always)]
    pub(super) fn lo(&self) -> Vec4 {
        Vec4::from_slice(&self.0[..4])
    }

    /// Greatest corner.
    #[inline(always)]
    pub(super) fn hi(&self) -> Vec4 {
        -Vec4::from_slice(&self.0[4..])
    }

    /// The eight numbers in a vector.
    #[inline(always)]
    pub(super) fn load<S: Simd>(&self, simd: S) -> S::F8 {
        simd.load8(&self.0)
    }

    /// A box from such a vector.
    #[inline(always)]
    pub(super) fn store<F: Lanes<8>>(vector: F) -> Self {
        Self(vector.to_array())
    }

    #[inline(always)]
    pub(super) fn join(&mut self, o: &Self) {
        for (a, &b) in self.0.iter_mut().zip(&o.0) {
            *a = if b < *a { b } else { *a };
        }
    }

    /// Half the surface area; zero for an empty box.
    #[inline(always)]
    pub(super) fn half_area(&self) -> f32 {
        let d = (self.hi() - self.lo()).max(Vec4::ZERO);
        let p = d * d.yzxw();
        p.x + p.y + p.z
    }

    /// The part in common with another box.
    pub(super) fn intersection(&self, o: &Self) -> Self {
        Self::new(self.lo().max(o.lo()), self.hi().min(o.hi()))
    }

    /// Whether `lo <= hi` on the three axes.
    pub(super) fn is_valid(&self) -> bool {
        self.lo().xyz().cmple(self.hi().xyz()).all()
    }
}

/// A primitive, or with spatial splits a part of one: its box, whose unused numbers carry the bits of its ids.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ref(Bounds);

impl Ref {
    pub(super) const NONE: Self = Self(Bounds([0.0; 8]));

    #[inline(always)]
    pub(super) fn new(lo: Vec3, hi: Vec3, geom_id: u32, prim_id: u32) -> Self {
        let (prim_id, geom_id) = (f32::from_bits(prim_id), f32::from_bits(geom_id));
        Self(Bounds([lo.x, lo.y, lo.z, prim_id, -hi.x, -hi.y, -hi.z, geom_id]))
    }

    #[inline(always)]
    pub(super) fn geom_id(&self) -> u32 {
        self.0.0[7].to_bits()
    }

    #[inline(always)]
    pub(super) fn prim_id(&self) -> u32 {
        self.0.0[3].to_bits()
    }

    #[inline(always)]
    pub(super) fn bounds(&self) -> &Bounds {
        &self.0
    }

    /// Becomes the reference that was loaded as a vector.
    #[inline(always)]
    pub(super) fn set<F: Lanes<8>>(&mut self, vector: F) {
        self.0 = Bounds::store(vector);
    }

    /// The same primitive with a smaller box.
    #[inline(always)]
    pub(super) fn with_bounds(&self, b: &Bounds) -> Self {
        let [x, y, z, _, far_x, far_y, far_z, _] = b.0;
        let ids = &self.0.0;
        Self(Bounds([x, y, z, ids[3], far_x, far_y, far_z, ids[7]]))
    }

    /// Centre of the box; halves first, so that huge coordinates do not overflow.
    #[inline(always)]
    pub(super) fn center(&self) -> Vec4 {
        0.5 * self.0.lo() + 0.5 * self.0.hi()
    }
}

/// The centre of a reference's box as a box of one point.
#[inline(always)]
pub(super) fn center<S: Simd>(simd: S, bounds: S::F8) -> S::F8 {
    let half = simd.splat8(0.5);
    bounds * half - simd.swap_halves(bounds) * half
}

/// Box around the boxes.
pub(super) fn bounds_of(refs: &[Ref]) -> Bounds {
    let mut bounds = Bounds::EMPTY;
    for r in refs {
        bounds.join(&r.0);
    }
    bounds
}

/// Box around the boxes and box around their centres; centres that are not numbers do not count.
pub(super) fn extent_of(isa: Available, refs: &[Ref]) -> (Bounds, Bounds) {
    isa.run(Extent { refs })
}

struct Extent<'a> {
    refs: &'a [Ref],
}

impl Kernel for Extent<'_> {
    type Output = (Bounds, Bounds);

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> (Bounds, Bounds) {
        let empty = simd.splat8(f32::INFINITY);
        let (mut bounds, mut centers) = (empty, empty);
        for r in self.refs {
            let r = r.0.load(simd);
            bounds = r.min(bounds);
            centers = center(simd, r).min(centers);
        }
        (Bounds::store(bounds), Bounds::store(centers))
    }
}
