//! Spatial splits (Stich, Friedrich and Dietrich 2009, "Spatial Splits in Bounding Volume Hierarchies"): a plane
//! through the node cuts the references that it meets in two, where that leaves less overlap.

use super::binning::{BINS, Bins, SpatialSplit, Split};
use super::boxes::{Bounds, Ref};
use super::simd::Available;
use crate::geometry::Shape;
use glam::Vec4;

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

    /// First and last slab that the reference meets.
    fn span(&self, r: &Ref, axis: usize) -> (usize, usize) {
        let b = r.bounds();
        let slab = |x: f32| (((x - self.base[axis]) * self.scale[axis]) as usize).min(BINS - 1);
        let first = slab(b.lo()[axis]);
        (first, slab(b.hi()[axis]).max(first))
    }

    /// The plane before a slab.
    fn plane(&self, axis: usize, slab: usize) -> f32 {
        self.base[axis] + self.width[axis] * slab as f32
    }

    /// The cheapest plane; its counts include the references on both sides twice.
    pub(super) fn best_split(&self, isa: Available, shapes: &[Shape], refs: &[Ref]) -> Split {
        let (mut bins, mut ends) = (Bins::EMPTY, Bins::EMPTY.counts);
        for axis in (0..3).filter(|&axis| self.scale[axis] > 0.0) {
            for r in refs {
                let (first, last) = self.span(r, axis);
                bins.counts[first][axis] += 1;
                ends[last][axis] += 1;
                let mut rest = *r;
                for slab in first..last {
                    let (below, above) = cut(shapes, &rest, axis, self.plane(axis, slab + 1));
                    if let Some(part) = below {
                        bins.bounds[slab][axis].join(part.bounds());
                    }
                    let Some(above) = above else { break };
                    rest = above;
                }
                bins.bounds[last][axis].join(rest.bounds());
            }
        }
        let used = [0, 1, 2].map(|axis| self.scale[axis] > 0.0);
        isa.run(SpatialSplit { bins: &bins, ends: &ends, used })
    }

    /// The parts of a reference left and right of the split.
    pub(super) fn sides(&self, shapes: &[Shape], r: &Ref, split: &Split) -> (Option<Ref>, Option<Ref>) {
        let (first, last) = self.span(r, split.axis);
        if last < split.bin {
            (Some(*r), None)
        } else if first >= split.bin {
            (None, Some(*r))
        } else {
            match cut(shapes, r, split.axis, self.plane(split.axis, split.bin)) {
                (None, None) => (Some(*r), None),
                sides => sides,
            }
        }
    }
}

/// The parts of a reference below and above a plane: boxes around the clipped triangle, rounded outwards.
fn cut(shapes: &[Shape], r: &Ref, axis: usize, plane: f32) -> (Option<Ref>, Option<Ref>) {
    let whole = r.bounds();
    let (below, above) = match &shapes[r.geom_id() as usize] {
        Shape::Mesh(mesh) => {
            clip_triangle(mesh.triangle(r.prim_id()).map(|corner| corner.extend(0.0)), axis, plane)
        }
        Shape::Spheres(_) => (*whole, *whole),
    };
    let (mut top, mut bottom) = (below.hi(), above.lo());
    top[axis] = top[axis].min(plane);
    bottom[axis] = bottom[axis].max(plane);
    let part = |b: Bounds| {
        let b = b.intersection(whole);
        b.is_valid().then(|| r.with_bounds(&b))
    };
    (part(Bounds::new(below.lo(), top)), part(Bounds::new(bottom, above.hi())))
}

/// Boxes around a triangle's parts on either side of a plane.
fn clip_triangle(corners: [Vec4; 3], axis: usize, plane: f32) -> (Bounds, Bounds) {
    let (mut below, mut above) = (Bounds::EMPTY, Bounds::EMPTY);
    for i in 0..3 {
        let (a, b) = (corners[i], corners[(i + 1) % 3]);
        if a[axis] <= plane {
            below.join(&Bounds::new(a, a));
        }
        if a[axis] >= plane {
            above.join(&Bounds::new(a, a));
        }
        if (a[axis] < plane) != (b[axis] < plane) {
            let point = a + (b - a) * ((plane - a[axis]) / (b[axis] - a[axis]));
            let rounding = 4.0 * f32::EPSILON * a.abs().max(b.abs());
            let around = Bounds::new(point - rounding, point + rounding);
            below.join(&around);
            above.join(&around);
        }
    }
    (below, above)
}
