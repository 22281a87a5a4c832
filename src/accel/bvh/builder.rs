//! From shapes to nodes and leaves: binned splits, opened 8 wide, in parallel.
//!
//! References live in two buffers of which a node owns the same range: a split reads one and fills the other from
//! both ends. Nothing is decided by which thread came first, so any number of threads builds the same structure.

use super::binning::{BINS, Binner, Bins, Bounds, Ref, Side, Split, bounds_of, centers_of};
use super::data::{BLOCK, Child, Hierarchy, WIDTH};
use super::emit::{Piece, Primitives, Tree};
use super::morton;
use super::splits::{LEAST_OVERLAP, Slabs};
use crate::accel::Quality;
use crate::geometry::Shape;
use core::ops::Range;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Most primitives of a leaf that the heuristic may choose to make.
const MAX_LEAF: usize = 2 * BLOCK;

/// References from which a node's children are built in parallel.
pub(super) const PARALLEL: usize = 16 * 1024;

/// References that one thread bins or distributes at a time.
const CHUNK: usize = 32 * 1024;

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
    /// Whether there are triangles and spheres, which no leaf may mix.
    mixed: bool,
    scene_area: f32,
}

/// The hierarchy over all primitives with a box.
pub(super) fn build(primitives: Primitives<'_>, quality: Quality) -> Hierarchy {
    let shapes = primitives.shapes;
    let mut refs = references(shapes);
    let bounds = bounds_of(&refs);
    let count = refs.len();
    let has = |spheres| shapes.iter().any(|s| matches!(s, Shape::Spheres(_)) == spheres);
    let build = Build { primitives, quality, mixed: has(true) && has(false), scene_area: bounds.half_area() };
    let centers = centers_of(&refs);
    let tree = if quality == Quality::Fast {
        morton::tree(&build, &refs, &centers)
    } else {
        let spare = if quality == Quality::High { (count as f32 * SPATIAL_GROWTH) as usize } else { 0 };
        refs.resize(count + spare, Ref::NONE);
        let mut buffer = vec![Ref::NONE; refs.len()];
        build.tree(Work { refs: &mut refs, other: &mut buffer, items: 0..count, bounds, centers }, 0)
    };
    drop(refs);
    let extent = (bounds.hi - bounds.lo).truncate().max_element();
    tree.assemble(if extent.is_finite() { extent } else { f32::MAX })
}

/// One reference per primitive, but for those whose box is not a number and for triangles without area, which no ray
/// hits.
fn references(shapes: &[Shape]) -> Vec<Ref> {
    let mut refs = vec![Ref::NONE; shapes.iter().map(Shape::primitive_count).sum()];
    let mut rest = &mut refs[..];
    for (geom_id, shape) in (0u32..).zip(shapes) {
        let (own, others) = rest.split_at_mut(shape.primitive_count());
        rest = others;
        own.par_iter_mut().with_min_len(CHUNK).enumerate().for_each(|(prim_id, r)| {
            let (lo, hi) = match shape {
                Shape::Mesh(mesh) => {
                    let [a, b, c] = mesh.triangle(prim_id as u32);
                    if is_flat([a, b, c]) {
                        (Vec3::NAN, Vec3::NAN)
                    } else {
                        (a.min(b).min(c), a.max(b).max(c))
                    }
                }
                Shape::Spheres(spheres) => {
                    let b = spheres[prim_id].bounds();
                    (b.min, b.max)
                }
            };
            *r = Ref::new(lo, hi, geom_id, prim_id as u32);
        });
    }
    refs.retain(|r| r.bounds().is_valid());
    refs
}

/// Whether the corners lie on one line, exactly.
#[inline]
fn is_flat(corners: [Vec3; 3]) -> bool {
    let [a, b, c] = corners.map(|p| p.as_dvec3());
    (b - a).cross(c - a) == DVec3::ZERO
}

/// A node to be: its references are `refs[items]`, and `other` has as much room.
struct Work<'a> {
    refs: &'a mut [Ref],
    other: &'a mut [Ref],
    items: Range<usize>,
    bounds: Bounds,
    centers: Bounds,
}

impl Work<'_> {
    fn items(&self) -> &[Ref] {
        &self.refs[self.items.clone()]
    }

    fn count(&self) -> usize {
        self.items.len()
    }
}

impl Build<'_> {
    /// The tree below a node: large nodes here, in parallel, and small ones as one piece each.
    fn tree(&self, work: Work<'_>, level: usize) -> Tree {
        if work.count() <= PARALLEL {
            let mut piece = Piece::default();
            let root = self.small(work, level, &mut piece);
            return Tree::Piece(piece, root);
        }
        let children = self.open(work, level);
        let bounds = children.iter().map(|child| child.0.bounds).collect();
        let trees = children.into_par_iter().map(|(work, _)| self.tree(work, level + 1)).collect();
        Tree::Inner(bounds, trees)
    }

    /// The same on one thread, straight into nodes.
    fn small(&self, work: Work<'_>, level: usize, piece: &mut Piece) -> Child {
        if work.count() <= BLOCK && self.is_uniform(work.items()) {
            return piece.leaf(self.primitives, work.items());
        }
        let mut children = self.open(work, level);
        if let [(only, _)] = &children[..] {
            return piece.leaf(self.primitives, only.items());
        }
        let mut bounds = [Bounds::EMPTY; WIDTH];
        for (bounds, (work, _)) in bounds.iter_mut().zip(&children) {
            *bounds = work.bounds;
        }
        let count = children.len();
        let node = piece.reserve_node();
        let mut slots = [Child::EMPTY; WIDTH];
        for (slot, (work, is_leaf)) in slots.iter_mut().zip(children.drain(..)) {
            *slot = if is_leaf {
                piece.leaf(self.primitives, work.items())
            } else {
                self.small(work, level + 1, piece)
            };
        }
        piece.set_node(node, &bounds[..count], &slots[..count]);
        Child::node(node)
    }

    /// Up to eight parts of a node: the one with the largest box is split first. The flag tells final leaves.
    fn open<'a>(&self, work: Work<'a>, level: usize) -> Vec<(Work<'a>, bool)> {
        let by_count = level >= HEURISTIC_LEVELS;
        let mut children = Vec::with_capacity(WIDTH);
        children.push((work, false));
        while children.len() < WIDTH {
            let size = |work: &Work<'_>| if by_count { work.count() as f32 } else { work.bounds.half_area() };
            let mut largest: Option<(usize, f32)> = None;
            for (i, (work, is_leaf)) in children.iter().enumerate() {
                if !is_leaf && largest.is_none_or(|(_, s)| size(work) > s) {
                    largest = Some((i, size(work)));
                }
            }
            let Some((i, _)) = largest else { break };
            let (work, _) = children.swap_remove(i);
            match self.split(work, by_count) {
                Ok((left, right)) => {
                    for part in [left, right] {
                        let is_leaf = part.count() <= BLOCK && self.is_uniform(part.items());
                        children.push((part, is_leaf));
                    }
                }
                Err(leaf) => children.push((leaf, true)),
            }
        }
        children
    }

    /// Whether all may lie in one leaf.
    pub(super) fn is_uniform(&self, refs: &[Ref]) -> bool {
        let is_sphere = |r: &Ref| matches!(self.primitives.shapes[r.geom_id() as usize], Shape::Spheres(_));
        !self.mixed || refs.windows(2).all(|pair| is_sphere(&pair[0]) == is_sphere(&pair[1]))
    }

    /// Two parts of a node, or the node if it had better be a leaf.
    fn split<'a>(&self, work: Work<'a>, by_count: bool) -> Result<(Work<'a>, Work<'a>), Work<'a>> {
        let count = work.count();
        let may_be_leaf = count <= MAX_LEAF && self.is_uniform(work.items());
        if may_be_leaf && count <= BLOCK {
            return Err(work);
        }
        if by_count {
            return Ok(self.halve(work));
        }
        let binner = self.binner(&work);
        let object = count_parallel(work.items(), &binner).best_object_split(&binner);
        let slabs = Slabs::new(&work.bounds);
        let spatial = self.spatial_split(&work, &slabs, &object);

        let area = work.bounds.half_area();
        let leaf_cost = Side { bounds: work.bounds, count }.cost();
        let cost = spatial.map_or(object.cost, |s| s.cost);
        let worth_it = cost + NODE_COST * area < leaf_cost;
        if may_be_leaf && !worth_it {
            return Err(work);
        }
        Ok(match spatial {
            Some(split) => self.cut(work, &slabs, &split),
            None if object.cost.is_finite() => distribute(work, &binner, &object),
            None => self.halve(work),
        })
    }

    /// Few references need few bins.
    fn binner(&self, work: &Work<'_>) -> Binner {
        Binner::new(&work.centers, (4 + work.count() / 8).min(BINS))
    }

    /// A spatial split that is cheaper than the object split, if there is one and room for its copies.
    fn spatial_split(&self, work: &Work<'_>, slabs: &Slabs, object: &Split) -> Option<Split> {
        if self.quality != Quality::High || work.refs.len() == work.count() {
            return None;
        }
        let overlap = object.left.bounds.intersection(&object.right.bounds);
        let overlaps = !object.cost.is_finite()
            || overlap.is_valid() && overlap.half_area() > LEAST_OVERLAP * self.scene_area;
        if !overlaps {
            return None;
        }
        let split = slabs.best_split(self.primitives.shapes, work.items());
        let (left, right) = (split.left.count, split.right.count);
        let fits = left + right <= work.refs.len() && left.max(right) < work.count();
        (fits && split.cost < 0.99 * object.cost).then_some(split)
    }

    /// Parts by a plane; references that it cuts go to both sides.
    fn cut<'a>(&self, work: Work<'a>, slabs: &Slabs, split: &Split) -> (Work<'a>, Work<'a>) {
        let Work { refs, other, items, .. } = work;
        let (mut left, mut right) = (0, other.len());
        for r in &refs[items] {
            let sides = slabs.sides(self.primitives.shapes, r, split);
            if let Some(part) = sides.0 {
                other[left] = part;
                left += 1;
            }
            if let Some(part) = sides.1 {
                right -= 1;
                other[right] = part;
            }
        }
        let bounds = (bounds_of(&other[..left]), bounds_of(&other[right..]));
        parts(other, refs, left, right, bounds)
    }

    /// Parts of equal number, as the references lie.
    fn halve<'a>(&self, work: Work<'a>) -> (Work<'a>, Work<'a>) {
        let Work { refs, other, items, .. } = work;
        let middle = items.start + items.len() / 2;
        let left = middle - items.start;
        let right = other.len() - (items.end - middle);
        other[..left].copy_from_slice(&refs[items.start..middle]);
        other[right..].copy_from_slice(&refs[middle..items.end]);
        let bounds = (bounds_of(&other[..left]), bounds_of(&other[right..]));
        parts(other, refs, left, right, bounds)
    }
}

/// Bins of all references, by chunks of a fixed length.
fn count_parallel(refs: &[Ref], binner: &Binner) -> Bins {
    if refs.len() <= 2 * CHUNK {
        return Bins::count(refs, binner);
    }
    let chunks = refs.par_chunks(CHUNK).map(|chunk| Bins::count(chunk, binner));
    chunks.reduce(|| Bins::EMPTY, |a, b| a.merge(&b))
}

/// Parts by an object split: left ones from the front, right ones from the back.
fn distribute<'a>(work: Work<'a>, binner: &Binner, split: &Split) -> (Work<'a>, Work<'a>) {
    let Work { refs, other, items, .. } = work;
    let (left, right) = (split.left.count, other.len() - split.right.count);
    if items.len() <= 2 * CHUNK {
        // Both places are written and one of them is kept: no branch to mispredict.
        let (mut front, mut back) = (0, other.len());
        for r in &refs[items] {
            let is_left = binner.is_left(r, split);
            let to = if is_left { front } else { back - 1 };
            other[to] = *r;
            front += usize::from(is_left);
            back -= usize::from(!is_left);
        }
    } else {
        distribute_parallel(&refs[items], other, binner, split);
    }
    parts(other, refs, left, right, (split.left.bounds, split.right.bounds))
}

/// The same on many threads: each chunk of references knows its places from the counts of those before it.
fn distribute_parallel(refs: &[Ref], other: &mut [Ref], binner: &Binner, split: &Split) {
    let lefts: Vec<usize> = refs
        .par_chunks(CHUNK)
        .map(|chunk| chunk.iter().filter(|r| binner.is_left(r, split)).count())
        .collect();
    let (mut front, mut back) = other.split_at_mut(split.left.count);
    let mut targets = Vec::with_capacity(lefts.len());
    for (chunk, &left) in refs.chunks(CHUNK).zip(&lefts) {
        let (own_front, rest_front) = front.split_at_mut(left);
        let (rest_back, own_back) = back.split_at_mut(back.len() - (chunk.len() - left));
        (front, back) = (rest_front, rest_back);
        targets.push((chunk, own_front, own_back));
    }
    targets.into_par_iter().for_each(|(chunk, own_front, own_back)| {
        let (mut front, mut back) = (0, own_back.len());
        for r in chunk {
            if binner.is_left(r, split) {
                own_front[front] = *r;
                front += 1;
            } else {
                back -= 1;
                own_back[back] = *r;
            }
        }
    });
}

/// Two nodes of buffers that hold left references up to `left` and right ones from `right`; the room between them
/// is shared out by their numbers.
fn parts<'a>(
    refs: &'a mut [Ref],
    other: &'a mut [Ref],
    left: usize,
    right: usize,
    bounds: (Bounds, Bounds),
) -> (Work<'a>, Work<'a>) {
    let rights = refs.len() - right;
    let room = right - left;
    let cut = left + (room as u64 * left as u64 / (left + rights).max(1) as u64) as usize;
    let (left_refs, right_refs) = refs.split_at_mut(cut);
    let (left_other, right_other) = other.split_at_mut(cut);
    let right_items = right - cut..right_refs.len();
    let centers = (center_bounds(&left_refs[..left]), center_bounds(&right_refs[right_items.clone()]));
    (
        Work { refs: left_refs, other: left_other, items: 0..left, bounds: bounds.0, centers: centers.0 },
        Work {
            refs: right_refs,
            other: right_other,
            items: right_items,
            bounds: bounds.1,
            centers: centers.1,
        },
    )
}

/// Box around the centres, on many threads if there are many.
fn center_bounds(refs: &[Ref]) -> Bounds {
    if refs.len() <= 2 * CHUNK {
        return centers_of(refs);
    }
    let join = |mut a: Bounds, b: Bounds| {
        a.join(b.lo, b.hi);
        a
    };
    refs.par_chunks(CHUNK).map(centers_of).reduce(|| Bounds::EMPTY, join)
}
