//! The surface area heuristic over bins (Wald 2007, "On fast Construction of SAH-based Bounding Volume
//! Hierarchies"): bins, and the best plane among them.

use super::boxes::{Bounds, Ref, center};
use super::data::BLOCK;
use super::simd::{Available, Kernel, Lanes, Simd};

/// Bins an axis.
pub(super) const BINS: usize = 16;

/// Blocks that `count` primitives fill: what the heuristic counts, since a block is tested at once.
#[inline(always)]
pub(super) fn blocks(count: u32) -> f32 {
    count.div_ceil(BLOCK as u32) as f32
}

/// The map from centres to bins.
#[derive(Clone, Copy, Debug)]
pub(super) struct Binner {
    centers: Bounds,
    /// Zero for an axis without extent (or with one that f32 cannot divide by).
    scale: [f32; 3],
    pub(super) bins: usize,
}

impl Binner {
    #[inline(always)]
    pub(super) fn new(centers: &Bounds, bins: usize) -> Self {
        let scale = (0.999 * bins as f32) / (centers.hi() - centers.lo());
        let scale = [scale.x, scale.y, scale.z].map(|s| if s.is_finite() && s > 0.0 { s } else { 0.0 });
        Self { centers: *centers, scale, bins }
    }

    /// Whether the centres differ on an axis.
    pub(super) fn has(&self, axis: usize) -> bool {
        self.scale[axis] > 0.0
    }

    #[inline(always)]
    pub(super) fn places<S: Simd>(&self, simd: S) -> Places<S> {
        let [x, y, z] = self.scale;
        let half = simd.splat8(0.5001);
        Places {
            base: self.centers.load(simd),
            scale: simd.load8(&[x, y, z, 0.0, 0.0, 0.0, 0.0, 0.0]),
            half,
            integer: simd.splat8(8_388_608.0),
        }
    }
}

/// The same in the registers of an instruction set.
#[derive(Clone, Copy)]
pub(super) struct Places<S: Simd> {
    base: S::F8,
    scale: S::F8,
    half: S::F8,
    integer: S::F8,
}

impl<S: Simd> Places<S> {
    /// Bins of a centre on the three axes.
    #[inline(always)]
    pub(super) fn bins_of(&self, center: S::F8) -> [usize; 3] {
        let place = self.place(center);
        [bin(place[0]), bin(place[1]), bin(place[2])]
    }

    /// The bin of a centre on one axis.
    #[inline(always)]
    pub(super) fn bin_of(&self, center: S::F8, axis: usize) -> usize {
        bin(self.place(center)[axis % 8])
    }

    /// Rounding to the nearest integer by adding 2^23 leaves that integer in the low bits.
    #[inline(always)]
    fn place(&self, center: S::F8) -> [f32; 8] {
        ((center - self.base) * self.scale + self.half + self.integer).to_array()
    }
}

#[inline(always)]
fn bin(place: f32) -> usize {
    (place.to_bits().wrapping_sub(0x4b00_0001) as usize) % BINS
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
    const EMPTY: Self = Self { bounds: Bounds::EMPTY, count: 0 };
}

impl Split {
    pub(super) const NONE: Self =
        Self { axis: 0, bin: 0, cost: f32::INFINITY, left: Side::EMPTY, right: Side::EMPTY };
}

/// Numbers of references by bin and axis.
pub(super) type Counts = [[u32; 3]; BINS];

/// References counted into the bins of each axis, and boxes around what lies in them.
#[derive(Clone)]
pub(super) struct Bins {
    pub(super) bounds: [[Bounds; 3]; BINS],
    pub(super) counts: Counts,
}

impl Bins {
    pub(super) const EMPTY: Self = Self { bounds: [[Bounds::EMPTY; 3]; BINS], counts: [[0; 3]; BINS] };

    /// Counts references by their centres.
    pub(super) fn count(isa: Available, refs: &[Ref], binner: &Binner) -> Self {
        isa.run(Count { refs, binner })
    }

    #[inline(always)]
    fn add<S: Simd>(&mut self, simd: S, refs: &[Ref], binner: &Binner) {
        let places = binner.places(simd);
        // Neighbours fall into the same bin, and each would wait for the one before: so the halves take turns.
        let (front, back) = refs.split_at(refs.len() / 2);
        for (a, b) in front.iter().zip(back) {
            self.add_one(simd, a, &places);
            self.add_one(simd, b, &places);
        }
        if let [.., last] = refs
            && refs.len() % 2 == 1
        {
            self.add_one(simd, last, &places);
        }
    }

    #[inline(always)]
    fn add_one<S: Simd>(&mut self, simd: S, r: &Ref, places: &Places<S>) {
        let r = r.bounds().load(simd);
        let bins = places.bins_of(center(simd, r));
        for axis in 0..3 {
            let bounds = &mut self.bounds[bins[axis]][axis];
            *bounds = Bounds::store(r.min(bounds.load(simd)));
            self.counts[bins[axis]][axis] += 1;
        }
    }

    /// Adds the counts of another part of the references.
    pub(super) fn merge(mut self, o: &Self) -> Self {
        for bin in 0..BINS {
            for axis in 0..3 {
                self.bounds[bin][axis].join(&o.bounds[bin][axis]);
                self.counts[bin][axis] += o.counts[bin][axis];
            }
        }
        self
    }

    /// The cheapest place to split an axis into bins before `bin` and the rest. What lies in the bins before a plane
    /// begins in them (`counts`), and what lies in the others ends in them (`ends`).
    #[inline(always)]
    fn split<S: Simd>(&self, simd: S, ends: &Counts, bins: usize, used: [bool; 3]) -> Split {
        let mut rights = [[0.0; 3]; BINS];
        let mut sides = [Growing::new(simd); 3];
        for bin in (1..bins).rev() {
            for axis in 0..3 {
                sides[axis].join(self.bounds[bin][axis].load(simd), ends[bin][axis]);
                rights[bin][axis] = if used[axis] { sides[axis].cost() } else { f32::INFINITY };
            }
        }
        let mut best = (f32::INFINITY, 0, 0);
        let mut sides = [Growing::new(simd); 3];
        for bin in 1..bins {
            for axis in 0..3 {
                sides[axis].join(self.bounds[bin - 1][axis].load(simd), self.counts[bin - 1][axis]);
                let cost = sides[axis].cost() + rights[bin][axis];
                best = if cost < best.0 { (cost, axis, bin) } else { best };
            }
        }
        let (cost, axis, bin) = best;
        if cost == f32::INFINITY {
            return Split::NONE;
        }
        let mut sides = [Growing::new(simd); 2];
        for (i, bounds) in self.bounds[..bins].iter().enumerate() {
            let (side, counts) = if i < bin { (&mut sides[0], &self.counts) } else { (&mut sides[1], ends) };
            side.join(bounds[axis].load(simd), counts[i][axis]);
        }
        let [left, right] =
            sides.map(|side| Side { bounds: Bounds::store(side.bounds), count: side.count as usize });
        Split { axis, bin, cost, left, right }
    }
}

/// A side that gets bin after bin.
#[derive(Clone, Copy)]
struct Growing<F> {
    bounds: F,
    count: u32,
}

impl<F: Lanes<8>> Growing<F> {
    #[inline(always)]
    fn new<S: Simd<F8 = F>>(simd: S) -> Self {
        Self { bounds: simd.splat8(f32::INFINITY), count: 0 }
    }

    #[inline(always)]
    fn join(&mut self, bounds: F, count: u32) {
        self.bounds = bounds.min(self.bounds);
        self.count += count;
    }

    /// Infinite for nothing: no side of a split may be empty.
    #[inline(always)]
    fn cost(&self) -> f32 {
        let [x, y, z, _, far_x, far_y, far_z, _] = self.bounds.to_array();
        let (x, y, z) = (-far_x - x, -far_y - y, -far_z - z);
        if self.count == 0 { f32::INFINITY } else { (x * y + y * z + z * x) * blocks(self.count) }
    }
}

struct Count<'a> {
    refs: &'a [Ref],
    binner: &'a Binner,
}

impl Kernel for Count<'_> {
    type Output = Bins;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Bins {
        let mut bins = Bins::EMPTY;
        bins.add(simd, self.refs, self.binner);
        bins
    }
}

/// The best split of references by their centres, from their bins where these are known.
pub(super) struct ObjectSplit<'a> {
    pub(super) refs: &'a [Ref],
    pub(super) binner: &'a Binner,
    pub(super) bins: Option<Bins>,
}

impl Kernel for ObjectSplit<'_> {
    type Output = Split;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Split {
        let used = [0, 1, 2].map(|axis| self.binner.has(axis));
        if let Some(bins) = self.bins {
            return bins.split(simd, &bins.counts, self.binner.bins, used);
        }
        let mut bins = Bins::EMPTY;
        bins.add(simd, self.refs, self.binner);
        bins.split(simd, &bins.counts, self.binner.bins, used)
    }
}

/// The best split among all bins, where references may begin in one and end in another.
pub(super) struct SpatialSplit<'a> {
    pub(super) bins: &'a Bins,
    pub(super) ends: &'a Counts,
    pub(super) used: [bool; 3],
}

impl Kernel for SpatialSplit<'_> {
    type Output = Split;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Split {
        self.bins.split(simd, self.ends, BINS, self.used)
    }
}
