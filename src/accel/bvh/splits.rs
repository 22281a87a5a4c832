//! Spatial splits (Stich, Friedrich and Dietrich 2009, "Spatial Splits in Bounding Volume Hierarchies"): a plane
//! through the node cuts the references that it meets in two, where that leaves less overlap.

use super::binning::{BINS, Bins, SpatialSplit, Split};
use super::boxes::{Bounds, Ref};
use super::simd::{Available, Kernel, Lanes, Mask, Simd};
use crate::geometry::Shape;
use glam::{Vec3, Vec4};

/// Overlap of the object split's halves, as a fraction of the scene's surface, from which cutting is tried.
pub(super) const LEAST_OVERLAP: f32 = 1e-5;

/// Equal slabs of a node's box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slabs {
    base: Vec4,
    width: Vec4,
    scale: Vec4,
}

impl Slabs {
    pub(super) fn new(bounds: &Bounds) -> Self {
        let size = bounds.hi() - bounds.lo();
        let scale = (BINS as f32 / size)
            .to_array()
            .map(|s| if s.is_finite() && s > 0.0 && s < 1e30 { s } else { 0.0 });
        Self { base: bounds.lo(), width: size / BINS as f32, scale: Vec4::from_array(scale) }
    }

    /// First and last slab that a reference meets on the three axes.
    #[inline(always)]
    fn spans<S: Simd>(&self, simd: S, r: S::F8) -> [(usize, usize); 3] {
        let (base, scale) = (self.base.to_array(), self.scale.to_array());
        let place = (r - mirrored(simd, &base)) * mirrored(simd, &scale);
        let place = place.max(simd.splat8(0.0)).min(simd.splat8((BINS - 1) as f32)).to_array();
        let mut spans = [(0, 0); 3];
        for axis in 0..3 {
            let (first, last) = (place[axis] as usize, place[axis + 4] as usize);
            spans[axis] = (first % BINS, last.max(first) % BINS);
        }
        spans
    }

    /// The plane before a slab.
    #[inline(always)]
    fn plane(&self, axis: usize, slab: usize) -> f32 {
        self.base[axis] + self.width[axis] * slab as f32
    }

    /// The cheapest plane; its counts include the references on both sides twice.
    pub(super) fn best_split(&self, isa: Available, shapes: &[Shape], refs: &[Ref]) -> Split {
        isa.run(BestSplit { slabs: self, shapes, refs })
    }

    /// The parts of a reference left and right of the split.
    pub(super) fn sides(
        &self,
        isa: Available,
        shapes: &[Shape],
        r: &Ref,
        split: &Split,
    ) -> (Option<Ref>, Option<Ref>) {
        isa.run(Sides { slabs: self, shapes, r, split })
    }
}

struct BestSplit<'a> {
    slabs: &'a Slabs,
    shapes: &'a [Shape],
    refs: &'a [Ref],
}

impl Kernel for BestSplit<'_> {
    type Output = Split;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Split {
        let Self { slabs, shapes, refs } = self;
        let used = [slabs.scale.x > 0.0, slabs.scale.y > 0.0, slabs.scale.z > 0.0];
        let (mut bins, mut ends) = (Bins::EMPTY, Bins::EMPTY.counts);
        for r in refs {
            let whole = r.bounds().load(simd);
            let spans = slabs.spans(simd, whole);
            let is_cut = spans[0].0 < spans[0].1 || spans[1].0 < spans[1].1 || spans[2].0 < spans[2].1;
            let triangle = if is_cut { Triangle::of(simd, shapes, r) } else { None };
            for axis in 0..3 {
                if !used[axis] {
                    continue;
                }
                let (first, last) = spans[axis];
                bins.counts[first][axis] += 1;
                ends[last][axis] += 1;
                let mut rest = whole;
                for slab in first..last {
                    let (below, above) = cut(simd, &triangle, rest, axis, slabs.plane(axis, slab + 1));
                    if is_valid(simd, below) {
                        join(simd, &mut bins.bounds[slab][axis], below);
                    }
                    if !is_valid(simd, above) {
                        break;
                    }
                    rest = above;
                }
                join(simd, &mut bins.bounds[last][axis], rest);
            }
        }
        SpatialSplit { bins: &bins, ends: &ends, used }.run(simd)
    }
}

struct Sides<'a> {
    slabs: &'a Slabs,
    shapes: &'a [Shape],
    r: &'a Ref,
    split: &'a Split,
}

impl Kernel for Sides<'_> {
    type Output = (Option<Ref>, Option<Ref>);

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> (Option<Ref>, Option<Ref>) {
        let Self { slabs, shapes, r, split } = self;
        let whole = r.bounds().load(simd);
        let (first, last) = slabs.spans(simd, whole)[split.axis];
        if last < split.bin {
            return (Some(*r), None);
        }
        if first >= split.bin {
            return (None, Some(*r));
        }
        let triangle = Triangle::of(simd, shapes, r);
        let (below, above) = cut(simd, &triangle, whole, split.axis, slabs.plane(split.axis, split.bin));
        match (is_valid(simd, below), is_valid(simd, above)) {
            (false, false) => (Some(*r), None),
            (is_left, is_right) => (
                if is_left { Some(r.with_bounds(&Bounds::store(below))) } else { None },
                if is_right { Some(r.with_bounds(&Bounds::store(above))) } else { None },
            ),
        }
    }
}

/// Four numbers and the same negated, as a box has its corners.
#[inline(always)]
fn mirrored<S: Simd>(simd: S, v: &[f32; 4]) -> S::F8 {
    mirror(simd, simd.join8(v, v))
}

/// The upper half negated.
#[inline(always)]
fn mirror<S: Simd>(simd: S, v: S::F8) -> S::F8 {
    v.flip_sign(simd.load8(&[1.0, 1.0, 1.0, 1.0, -1.0, -1.0, -1.0, -1.0]))
}

#[inline(always)]
fn join<S: Simd>(simd: S, bounds: &mut Bounds, b: S::F8) {
    *bounds = Bounds::store(b.min(bounds.load(simd)));
}

/// Whether the least corner of a box is not beyond the greatest one.
#[inline(always)]
fn is_valid<S: Simd>(simd: S, bounds: S::F8) -> bool {
    let opposite = simd.swap_halves(bounds).flip_sign(simd.splat8(-1.0));
    bounds.le(opposite).bits() & 0b111 == 0b111
}

/// The boxes of a reference's parts below and above a plane: around the clipped triangle, rounded outwards. Those of
/// other shapes are only cut.
#[inline(always)]
fn cut<S: Simd>(
    simd: S,
    triangle: &Option<Triangle<S>>,
    whole: S::F8,
    axis: usize,
    plane: f32,
) -> (S::F8, S::F8) {
    let nothing = simd.splat8(f32::NEG_INFINITY);
    let (below, above) = match triangle {
        Some(triangle) => triangle.clip(simd, axis, plane),
        None => (nothing, nothing),
    };
    let half_below = simd.splat8(-plane).select(simd.mask8(0x10 << axis), nothing);
    let half_above = simd.splat8(plane).select(simd.mask8(1 << axis), nothing);
    (below.max(half_below).max(whole), above.max(half_above).max(whole))
}

/// A triangle to be clipped. Its points are boxes: themselves, and themselves negated.
struct Triangle<S: Simd> {
    corners: [S::F8; 3],
    /// From each corner to the next.
    edges: [S::F8; 3],
    /// How far a point of an edge may be off.
    rounding: [S::F8; 3],
    /// The corners by axis, and then the ones that follow them.
    along: [[f32; 4]; 3],
    along_next: [[f32; 4]; 3],
}

impl<S: Simd> Triangle<S> {
    /// A reference's triangle, if it is one.
    #[inline(always)]
    fn of(simd: S, shapes: &[Shape], r: &Ref) -> Option<Self> {
        match &shapes[r.geom_id() as usize] {
            Shape::Mesh(mesh) => Some(Self::new(simd, mesh.triangle(r.prim_id()))),
            Shape::Spheres(_) => None,
        }
    }

    #[inline(always)]
    fn new(simd: S, [a, b, c]: [Vec3; 3]) -> Self {
        let (p, q, r) = (twice(simd, a), twice(simd, b), twice(simd, c));
        let (size_p, size_q, size_r) = (p.flip_sign(p), q.flip_sign(q), r.flip_sign(r));
        let unit = simd.splat8(4.0 * f32::EPSILON);
        Self {
            corners: [mirror(simd, p), mirror(simd, q), mirror(simd, r)],
            edges: [mirror(simd, q - p), mirror(simd, r - q), mirror(simd, p - r)],
            rounding: [unit * size_p.max(size_q), unit * size_q.max(size_r), unit * size_r.max(size_p)],
            along: [[a.x, b.x, c.x, 0.0], [a.y, b.y, c.y, 0.0], [a.z, b.z, c.z, 0.0]],
            along_next: [[b.x, c.x, a.x, 0.0], [b.y, c.y, a.y, 0.0], [b.z, c.z, a.z, 0.0]],
        }
    }

    /// Boxes around the triangle's parts on either side of a plane.
    ///
    /// Which corners lie where is anyone's guess, so nothing branches: what is not part of a side is put at infinity.
    #[inline(always)]
    fn clip(&self, simd: S, axis: usize, plane: f32) -> (S::F8, S::F8) {
        let (a, b) = (simd.load4(&self.along[axis]), simd.load4(&self.along_next[axis]));
        let (plane, here, away) =
            (simd.splat4(plane), simd.splat4(f32::NEG_INFINITY), simd.splat4(f32::INFINITY));
        let in_below = here.select(a.le(plane), away).to_array();
        let in_above = here.select(plane.le(a), away);
        // An edge crosses where its ends differ.
        let crosses = in_above.flip_sign(away.select(plane.le(b), here)).flip_sign(here).to_array();
        let in_above = in_above.to_array();
        let t = ((plane - a) / (b - a)).to_array();

        let mut below = simd.splat8(f32::INFINITY);
        let mut above = below;
        for i in 0..3 {
            below = self.corners[i].max(simd.splat8(in_below[i])).min(below);
            above = self.corners[i].max(simd.splat8(in_above[i])).min(above);
            let point = self.corners[i] + self.edges[i] * simd.splat8(t[i]);
            let around = (point - self.rounding[i]).max(simd.splat8(crosses[i]));
            below = around.min(below);
            above = around.min(above);
        }
        (below, above)
    }
}

/// A point in both halves.
#[inline(always)]
fn twice<S: Simd>(simd: S, point: Vec3) -> S::F8 {
    let point = [point.x, point.y, point.z, 0.0];
    simd.join8(&point, &point)
}
