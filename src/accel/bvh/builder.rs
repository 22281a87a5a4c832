//! From shapes to nodes and leaves: binned splits, opened 8 wide, in parallel.
//!
//! References are moved in place: a node owns a range of them, and a split hands on its two parts. Nothing is decided by
//! which thread came first, so any number of threads builds the same structure.

use super::binning::{BINS, Binner, Bins, ObjectSplit, Split, blocks};
use super::boxes::{Bounds, Ref, extent_of};
use super::data::{BLOCK, Child, Hierarchy, WIDTH};
use super::emit::{Piece, Primitives, Tree};
use super::huge;
use super::morton;
use super::partition::{CHUNK, partition};
use super::simd::Available;
use super::splits::{LEAST_OVERLAP, Slabs};
use crate::accel::Quality;
use crate::geometry::Shape;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Most primitives of a leaf that the heuristic may choose to make.
const MAX_LEAF: usize = 2 * BLOCK;

/// References from which a node's children are built in parallel.
pub(super) const PARALLEL: usize = 16 * 1024;

/// Levels (of 8-wide nodes) after which nodes are halved by count: at most 11 levels later all are leaves, and
/// 7 waiting children a level stay within a traversal stack.
const HEURISTIC_LEVELS: usize = 22;

/// Cost of visiting a node over that of testing a block.
const NODE_COST: f32 = 1.0;

/// References of spatially split nodes may grow by this part.
const SPATIAL_GROWTH: f32 = 0.5;

/// What the whole build shares.
pub(super) struct Build<'s> {
    pub(super) primitives: Primitives<'s>,
    quality: Quality,
    isa: Available,
    /// Whether there are triangles and spheres, which no leaf may mix.
    mixed: bool,
    scene_area: f32,
}

/// The hierarchy over all primitives with a box; those of the shapes `apart` are a part of their own, and so are the others.
pub(super) fn build(primitives: Primitives<'_>, quality: Quality, apart: &[bool]) -> Hierarchy {
    let shapes = primitives.shapes;
    let isa = Available::best();
    let mut parts: Vec<_> = [true, false]
        .into_iter()
        .map(|is_apart| references(shapes, |geom_id| apart[geom_id] == is_apart))
        .filter(|refs| !refs.is_empty())
        .map(|refs| (extent_parallel(isa, &refs), refs))
        .collect();
    let mut bounds = Bounds::EMPTY;
    parts.iter().for_each(|((part, _), _)| bounds.join(part));
    let has = |spheres| shapes.iter().any(|s| matches!(s, Shape::Spheres(_)) == spheres);
    let mixed = has(true) && has(false);
    let build = Build { primitives, quality, isa, mixed, scene_area: bounds.half_area() };
    let extent = (bounds.hi() - bounds.lo()).truncate().max_element();
    let extent = if extent.is_finite() { extent } else { f32::MAX };
    match parts.len() {
        0 => Tree::Piece(Piece::default(), Child::EMPTY).assemble(extent),
        1 => build.part(parts.remove(0), 0).assemble(extent),
        _ => {
            let boxes = parts.iter().map(|((part, _), _)| *part).collect();
            let trees = parts.into_iter().map(|part| build.part(part, 1)).collect();
            let mut hierarchy = Tree::Inner(boxes, trees).assemble(extent);
            hierarchy.rest = Some(hierarchy.nodes[hierarchy.root.index()].children[1]);
            hierarchy
        }
    }
}

/// One reference per primitive of the shapes that `wanted` tells by their numbers, but for those whose box is not a number and
/// for triangles without area, which no ray hits.
pub(super) fn references(shapes: &[Shape], wanted: impl Fn(usize) -> bool) -> Vec<Ref> {
    let those = || (0u32..).zip(shapes).filter(|(geom_id, _)| wanted(*geom_id as usize));
    let mut refs = huge::vec_with_capacity(those().map(|(_, shape)| shape.primitive_count()).sum());
    for (geom_id, shape) in those() {
        let prim_ids = (0..shape.primitive_count()).into_par_iter().with_min_len(CHUNK);
        match shape {
            Shape::Mesh(mesh) => refs.par_extend(prim_ids.map(|prim_id| {
                let [a, b, c] = mesh.triangle(prim_id as u32);
                let lo = if is_flat([a, b, c]) { Vec3::NAN } else { a.min(b).min(c) };
                Ref::new(lo, a.max(b).max(c), geom_id, prim_id as u32)
            })),
            Shape::Spheres(spheres) => refs.par_extend(prim_ids.map(|prim_id| {
                let b = spheres[prim_id].bounds();
                Ref::new(b.min, b.max, geom_id, prim_id as u32)
            })),
        }
    }
    refs.retain(|r| r.bounds().is_valid());
    refs
}

/// Whether the corners lie on one line, exactly.
#[inline]
fn is_flat([a, b, c]: [Vec3; 3]) -> bool {
    // Almost all triangles are so far from flat that f32 can tell: its cross product is off by some 4 roundings of the
    // edges' product.
    let (e1, e2) = (b - a, c - a);
    let room = 1e-6 * e1.abs().max_element() * e2.abs().max_element();
    if e1.cross(e2).abs().max_element() > room && room > f32::MIN_POSITIVE {
        return false;
    }
    let [a, b, c] = [a, b, c].map(|p| p.as_dvec3());
    (b - a).cross(c - a) == DVec3::ZERO
}

/// A node to be.
struct Work<'a> {
    /// Its references, and room for more.
    refs: &'a mut [Ref],
    count: usize,
    bounds: Bounds,
    /// Around the centres.
    centers: Bounds,
    half_area: f32,
    /// Whether it stays a leaf.
    is_leaf: bool,
}

impl<'a> Work<'a> {
    fn new(refs: &'a mut [Ref], count: usize, bounds: Bounds, centers: Bounds) -> Self {
        Self { refs, count, half_area: bounds.half_area(), bounds, centers, is_leaf: false }
    }

    fn none() -> Self {
        Self {
            refs: &mut [],
            count: 0,
            bounds: Bounds::EMPTY,
            centers: Bounds::EMPTY,
            half_area: 0.0,
            is_leaf: true,
        }
    }

    /// A node alone among the places of its children.
    fn children(work: Self) -> [Self; WIDTH] {
        let none = Self::none;
        [work, none(), none(), none(), none(), none(), none(), none()]
    }

    /// The node, of which nothing is left here.
    fn take(&mut self) -> Self {
        let Self { count, bounds, centers, half_area, is_leaf, .. } = *self;
        Self { refs: core::mem::take(&mut self.refs), count, bounds, centers, half_area, is_leaf }
    }

    fn items(&self) -> &[Ref] {
        &self.refs[..self.count]
    }

    /// The first `left` references and the rest; the room is shared out by their numbers.
    fn cut_at(self, left: usize, bounds: [Bounds; 2], centers: [Bounds; 2]) -> [Self; 2] {
        let room = self.refs.len() - self.count;
        let cut = left + (room as u64 * left as u64 / self.count.max(1) as u64) as usize;
        if cut > left {
            self.refs.copy_within(left..self.count, cut);
        }
        let (lefts, rights) = self.refs.split_at_mut(cut);
        [
            Self::new(lefts, left, bounds[0], centers[0]),
            Self::new(rights, self.count - left, bounds[1], centers[1]),
        ]
    }
}

impl Build<'_> {
    /// The tree over references that lie in these boxes.
    fn part(&self, ((bounds, centers), mut refs): ((Bounds, Bounds), Vec<Ref>), level: usize) -> Tree {
        if self.quality == Quality::Fast {
            return morton::tree(self, &refs, &centers);
        }
        let count = refs.len();
        let spare = if self.quality == Quality::High { (count as f32 * SPATIAL_GROWTH) as usize } else { 0 };
        refs.resize(count + spare, Ref::NONE);
        self.tree(Work::new(&mut refs, count, bounds, centers), level)
    }

    /// The tree below a node: large nodes here, in parallel, and small ones as one piece each.
    fn tree(&self, work: Work<'_>, level: usize) -> Tree {
        if work.count <= PARALLEL || rayon::current_num_threads() == 1 {
            let mut piece = Piece::with_room(self.primitives, work.items(), work.count);
            let root = self.small(work, level, &mut piece);
            return Tree::Piece(piece, root);
        }
        let mut children = Work::children(work);
        let count = self.open(&mut children, level);
        let bounds = children[..count].iter().map(|child| child.bounds).collect();
        let children: Vec<Work<'_>> = children.into_iter().take(count).collect();
        let trees = children.into_par_iter().map(|work| self.tree(work, level + 1)).collect();
        Tree::Inner(bounds, trees)
    }

    /// The same on one thread, straight into nodes.
    fn small(&self, work: Work<'_>, level: usize, piece: &mut Piece) -> Child {
        if work.count <= BLOCK && self.is_uniform(work.items()) {
            return piece.leaf(self.primitives, work.items());
        }
        let mut children = Work::children(work);
        let count = self.open(&mut children, level);
        let children = &mut children[..count];
        if let [only] = children {
            return piece.leaf(self.primitives, only.items());
        }
        let mut bounds = [Bounds::EMPTY; WIDTH];
        let mut slots = [Child::EMPTY; WIDTH];
        let node = piece.reserve_node();
        for (i, work) in children.iter_mut().enumerate() {
            bounds[i] = work.bounds;
            slots[i] = if work.is_leaf {
                piece.leaf(self.primitives, work.items())
            } else {
                self.small(work.take(), level + 1, piece)
            };
        }
        piece.set_node(node, &bounds[..count], &slots[..count]);
        Child::node(node)
    }

    /// Opens the first of the children into up to eight, those of most references in front, and gives their number: the one
    /// with the largest box is split first.
    fn open(&self, children: &mut [Work<'_>; WIDTH], level: usize) -> usize {
        let by_count = level >= HEURISTIC_LEVELS;
        let mut count = 1;
        while count < WIDTH {
            let size = |work: &Work<'_>| if by_count { work.count as f32 } else { work.half_area };
            let mut largest: Option<(usize, f32)> = None;
            for (i, work) in children[..count].iter().enumerate() {
                if !work.is_leaf && largest.is_none_or(|(_, s)| size(work) > s) {
                    largest = Some((i, size(work)));
                }
            }
            let Some((i, _)) = largest else { break };
            match self.split(children[i].take(), by_count) {
                Ok(parts) => {
                    for (part, slot) in parts.into_iter().zip([i, count]) {
                        children[slot] = part;
                        let part = &mut children[slot];
                        part.is_leaf = part.count <= BLOCK && self.is_uniform(part.items());
                    }
                    count += 1;
                }
                Err(leaf) => children[i] = Work { is_leaf: true, ..leaf },
            }
        }
        // Rays that want any hit go into the first child first: the one that has the most to hit.
        children[..count].sort_by_key(|child| core::cmp::Reverse(child.count));
        count
    }

    /// Whether there are triangles and spheres.
    pub(super) fn is_mixed(&self) -> bool {
        self.mixed
    }

    /// Whether all may lie in one leaf.
    pub(super) fn is_uniform(&self, refs: &[Ref]) -> bool {
        let is_sphere = |r: &Ref| matches!(self.primitives.shapes[r.geom_id() as usize], Shape::Spheres(_));
        !self.mixed || refs.windows(2).all(|pair| is_sphere(&pair[0]) == is_sphere(&pair[1]))
    }

    /// Two parts of a node, or the node if it had better be a leaf.
    fn split<'a>(&self, work: Work<'a>, by_count: bool) -> Result<[Work<'a>; 2], Work<'a>> {
        let may_be_leaf = work.count <= MAX_LEAF && self.is_uniform(work.items());
        if may_be_leaf && work.count <= BLOCK {
            return Err(work);
        }
        if by_count {
            return Ok(self.halve(work));
        }
        // Few references need few bins.
        let binner = Binner::new(&work.centers, (4 + work.count / 8).min(BINS));
        let object = self.object_split(work.items(), &binner);
        let spatial = self.spatial_split(&work, &object);

        let leaf_cost = work.half_area * blocks(work.count as u32);
        let cost = spatial.as_ref().map_or(object.cost, |s| s.1.cost);
        let worth_it = cost + NODE_COST * work.half_area < leaf_cost;
        if may_be_leaf && !worth_it {
            return Err(work);
        }
        Ok(match spatial {
            Some((slabs, split)) => self.cut(work, &slabs, &split),
            None if object.cost.is_finite() => {
                let (left, centers) = partition(self.isa, &mut work.refs[..work.count], &binner, &object);
                work.cut_at(left, [object.left.bounds, object.right.bounds], centers)
            }
            None => self.halve(work),
        })
    }

    /// The best split by centres, on many threads if there are many references.
    fn object_split(&self, refs: &[Ref], binner: &Binner) -> Split {
        let bins = (refs.len() > 2 * CHUNK).then(|| {
            let chunks = refs.par_chunks(CHUNK).map(|chunk| Bins::count(self.isa, chunk, binner));
            chunks.reduce(|| Bins::EMPTY, |a, b| a.merge(&b))
        });
        self.isa.run(ObjectSplit { refs, binner, bins })
    }

    /// A spatial split that is cheaper than the object split, if there is one and room for its copies.
    fn spatial_split(&self, work: &Work<'_>, object: &Split) -> Option<(Slabs, Split)> {
        if self.quality != Quality::High || work.refs.len() == work.count {
            return None;
        }
        let overlap = object.left.bounds.intersection(&object.right.bounds);
        let overlaps = !object.cost.is_finite()
            || overlap.is_valid() && overlap.half_area() > LEAST_OVERLAP * self.scene_area;
        if !overlaps {
            return None;
        }
        let slabs = Slabs::new(&work.bounds);
        let split = slabs.best_split(self.isa, self.primitives.shapes, work.items());
        let (left, right) = (split.left.count, split.right.count);
        let fits = left + right <= work.refs.len() && left.max(right) < work.count;
        (fits && split.cost < 0.99 * object.cost).then_some((slabs, split))
    }

    /// Parts by a plane; references that it cuts go to both sides.
    fn cut<'a>(&self, work: Work<'a>, slabs: &Slabs, split: &Split) -> [Work<'a>; 2] {
        let mut rights = Vec::with_capacity(split.right.count);
        let mut left = 0;
        for i in 0..work.count {
            let sides = slabs.sides(self.isa, self.primitives.shapes, &work.refs[i], split);
            if let Some(part) = sides.0 {
                work.refs[left] = part;
                left += 1;
            }
            rights.extend(sides.1);
        }
        let count = left + rights.len();
        work.refs[left..count].copy_from_slice(&rights);
        self.measured_parts(Work { count, ..work }, left)
    }

    /// Parts of equal number, as the references lie.
    fn halve<'a>(&self, work: Work<'a>) -> [Work<'a>; 2] {
        let middle = work.count / 2;
        self.measured_parts(work, middle)
    }

    /// The first `left` references and the rest, whose boxes are not known.
    fn measured_parts<'a>(&self, work: Work<'a>, left: usize) -> [Work<'a>; 2] {
        let (lefts, rights) = work.items().split_at(left);
        let ((left_box, left_centers), (right_box, right_centers)) =
            (extent_parallel(self.isa, lefts), extent_parallel(self.isa, rights));
        work.cut_at(left, [left_box, right_box], [left_centers, right_centers])
    }
}

/// Boxes around references and around their centres, on many threads if there are many.
fn extent_parallel(isa: Available, refs: &[Ref]) -> (Bounds, Bounds) {
    if refs.len() <= 2 * CHUNK {
        return extent_of(isa, refs);
    }
    let join = |mut a: (Bounds, Bounds), b: (Bounds, Bounds)| {
        a.0.join(&b.0);
        a.1.join(&b.1);
        a
    };
    refs.par_chunks(CHUNK).map(|chunk| extent_of(isa, chunk)).reduce(|| (Bounds::EMPTY, Bounds::EMPTY), join)
}

#[cfg(test)]
mod tests {
    use super::super::mode::Mode;
    use super::super::moeller::Fast;
    use super::*;
    use crate::geometry::TriangleMesh;
    use std::sync::Arc;

    /// Triangles here and there: more than one thread moves at a time.
    fn soup() -> Shape {
        let mut state = 1u32;
        let mut unit = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        let count = 3 * CHUNK as u32 + 100;
        let mut positions = vec![];
        for _ in 0..count {
            let corner = Vec3::new(unit(), unit() * unit(), 0.1 * unit());
            positions.extend([
                corner,
                corner + 0.01 * Vec3::new(unit(), unit(), 0.0),
                corner + 0.01 * Vec3::Z,
            ]);
        }
        let indices = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        Shape::Mesh(Arc::new(TriangleMesh::new(positions, indices, vec![], vec![]).expect("a valid mesh")))
    }

    #[test]
    fn one_thread_and_three_build_the_same_bits() {
        let shapes = [soup(), soup()];
        for (quality, apart) in [
            (Quality::Fast, [false; 2]),
            (Quality::Medium, [false; 2]),
            (Quality::High, [false; 2]),
            (Quality::Medium, [false, true]),
        ] {
            let build_by = |threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
                pool.install(|| build(Primitives { shapes: &shapes, kept: Fast::kept }, quality, &apart))
            };
            let (one, three) = (build_by(1), build_by(3));
            assert_eq!((one.root, one.rest), (three.root, three.rest));
            assert_eq!(one.rest.is_some(), apart[1]);
            assert_eq!((one.nodes.len(), one.triangles.len()), (three.nodes.len(), three.triangles.len()));
            for (a, b) in one.nodes.iter().zip(&three.nodes) {
                assert_eq!((a.planes, a.children, a.order), (b.planes, b.children, b.order));
            }
            for (a, b) in one.triangles.iter().zip(&three.triangles) {
                assert_eq!(a.prim_ids, b.prim_ids);
            }
        }
    }
}
