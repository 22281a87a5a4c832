//! One ray at a time: depth first, nearest child first, hit children prefetched while they are being sorted.

use super::data::{BLOCK, Child, Hierarchy, Node, Place};
use super::mode::Mode;
use super::ray::{Best, CULL_INFLATION, Prepared, Weights};
use super::rows::{Row, Rows};
use super::simd::{Lanes, Mask, Simd};
use super::sphere;
use glam::Vec3A;

/// Entries of a traversal stack: the builder bounds the depth so that 7 waiting children a level fit.
pub(super) const STACK: usize = 256;

/// Children to visit: distance bits above, child below. Made once for many rays; never cleared.
pub(super) struct Stack([u64; STACK]);

impl Stack {
    pub(super) fn new() -> Self {
        Self([0; STACK])
    }

    // The mask stands in for a bounds check: the builder's depth limit keeps indices below the length.
    #[inline(always)]
    fn at(&self, index: usize) -> u64 {
        self.0[index % STACK]
    }

    #[inline(always)]
    fn put(&mut self, index: usize, entry: u64) {
        debug_assert!(index < STACK);
        self.0[index % STACK] = entry;
    }
}

#[inline(always)]
fn entry(distance: f32, child: Child) -> u64 {
    u64::from(distance.to_bits()) << 32 | u64::from(child.0)
}

/// The slab test's constants over eight lanes: see [`super::ray::Slabs`].
pub(super) struct Slabs<F> {
    pub(super) rcp: [F; 3],
    pub(super) near: [F; 3],
    pub(super) far: [F; 3],
    pub(super) t_min: F,
}

impl<F: Lanes<8>> Slabs<F> {
    #[inline(always)]
    pub(super) fn new<S: Simd<F8 = F>, M: Mode>(simd: S, ray: &Prepared<M>) -> Self {
        let splat3 = |v: Vec3A| [simd.splat8(v.x), simd.splat8(v.y), simd.splat8(v.z)];
        Self {
            rcp: splat3(ray.slabs.rcp),
            near: splat3(ray.slabs.near),
            far: splat3(if M::WATERTIGHT { ray.slabs.far } else { ray.slabs.near }),
            t_min: simd.splat8(ray.t_min),
        }
    }

    /// The same for one of the rays in rows.
    #[inline(always)]
    pub(super) fn of_row<S: Simd<F8 = F>, M: Mode>(simd: S, rows: &Rows, ray: usize) -> Self {
        let splat3 = |rows: &[Row; 3]| rows.each_ref().map(|row| simd.splat8(row[ray]));
        Self {
            rcp: splat3(&rows.rcp),
            near: splat3(&rows.near),
            far: splat3(if M::WATERTIGHT { &rows.far } else { &rows.near }),
            t_min: simd.splat8(rows.t_min[ray]),
        }
    }

    /// Entry distances of the eight boxes, and which of them the ray enters before `t_max`.
    ///
    /// A NaN (infinity less infinity) never stays: `min` and `max` return the right operand if the left one is NaN,
    /// and the rightmost is a number.
    #[inline(always)]
    pub(super) fn enter<S: Simd<F8 = F>>(
        &self,
        simd: S,
        sign: [usize; 3],
        node: &Node,
        t_max: f32,
    ) -> (F, F::Mask) {
        let near = |k: usize| simd.load8(&node.planes[k][sign[k] & 1]).mul_sub(self.rcp[k], self.near[k]);
        let far = |k: usize| simd.load8(&node.planes[k][sign[k] & 1 ^ 1]).mul_sub(self.rcp[k], self.far[k]);
        let entry = near(0).max(near(1)).max(near(2).max(self.t_min));
        let exit = far(0).min(far(1)).min(far(2).min(simd.splat8(t_max)));
        (entry, entry.le(exit))
    }
}

/// The best of `best` and what the ray hits from `start` down; for `ANY`, the first hit that is better.
#[inline(always)]
pub(super) fn traverse<S: Simd, M: Mode, const ANY: bool>(
    simd: S,
    data: &Hierarchy,
    ray: &Prepared<M>,
    stack: &mut Stack,
    start: Child,
    mut best: Best,
    weights: &mut Weights,
) -> Best {
    let (slabs, sign) = (Slabs::new(simd, ray), ray.sign());
    let mut limit = best.t * CULL_INFLATION;
    let mut top = 0;
    let mut current = start;
    loop {
        'descend: while !current.is_leaf() {
            let node = &data.nodes[current.index()];
            let (near, enters) = slabs.enter(simd, sign, node, limit);
            let mask = enters.bits();
            if mask == 0 {
                match pop::<ANY>(stack, &mut top, limit) {
                    Some(child) => current = child,
                    None => return best,
                }
                continue 'descend;
            }
            if mask & (mask - 1) == 0 {
                current = node.children[mask.trailing_zeros() as usize & 7];
            } else if ANY {
                current = push_unsorted(simd, data, node, mask, stack, &mut top);
            } else {
                current = push_sorted(simd, data, node, near, mask, stack, &mut top);
            }
        }

        best = intersect_leaf::<S, M, ANY>(simd, data, ray, current, best, weights);
        if ANY && best.is_hit() {
            return best;
        }
        limit = best.t * CULL_INFLATION;
        match pop::<ANY>(stack, &mut top, limit) {
            Some(child) => current = child,
            None => return best,
        }
    }
}

/// The first leaf that a ray enters before `limit`, from `child` down or in what waits on the stack; what else it enters on the
/// way is put there. A loop of its own: [`traverse`] made of this takes 3 % longer.
#[inline(always)]
pub(super) fn descend<S: Simd>(
    simd: S,
    data: &Hierarchy,
    (slabs, sign): (&Slabs<S::F8>, [usize; 3]),
    (stack, top): (&mut Stack, &mut usize),
    mut child: Child,
    limit: f32,
) -> Option<Child> {
    while !child.is_leaf() {
        let node = &data.nodes[child.index()];
        let (near, enters) = slabs.enter(simd, sign, node, limit);
        let mask = enters.bits();
        child = if mask == 0 {
            pop::<false>(stack, top, limit)?
        } else if mask & (mask - 1) == 0 {
            node.children[mask.trailing_zeros() as usize & 7]
        } else {
            push_sorted(simd, data, node, near, mask, stack, top)
        };
    }
    Some(child)
}

/// The nearest of two or more children; the others go on the stack, the farthest deepest. All are prefetched while
/// they are being sorted.
#[inline(always)]
pub(super) fn push_sorted<S: Simd>(
    simd: S,
    data: &Hierarchy,
    node: &Node,
    near: S::F8,
    mut mask: u32,
    stack: &mut Stack,
    top: &mut usize,
) -> Child {
    let distances = near.to_array();
    let (lane, first) = next(simd, data, node, &mut mask);
    let first = entry(distances[lane], first);
    let (lane, second) = next(simd, data, node, &mut mask);
    let second = entry(distances[lane], second);
    let mut nearest = first.min(second);
    let bottom = *top;
    stack.put(*top, first.max(second));
    *top += 1;
    while mask != 0 {
        let (lane, other) = next(simd, data, node, &mut mask);
        let other = entry(distances[lane], other);
        let waiting = nearest.max(other);
        nearest = nearest.min(other);
        let mut slot = *top;
        while slot > bottom && stack.at(slot - 1) < waiting {
            stack.put(slot, stack.at(slot - 1));
            slot -= 1;
        }
        stack.put(slot, waiting);
        *top += 1;
    }
    Child(nearest as u32)
}

/// The first child; the others go on the stack as they come.
#[inline(always)]
fn push_unsorted<S: Simd>(
    simd: S,
    data: &Hierarchy,
    node: &Node,
    mut mask: u32,
    stack: &mut Stack,
    top: &mut usize,
) -> Child {
    let (_, first) = next(simd, data, node, &mut mask);
    while mask != 0 {
        let (_, child) = next(simd, data, node, &mut mask);
        stack.put(*top, entry(0.0, child));
        *top += 1;
    }
    first
}

/// Lane of the next child in the mask, and the child, whose memory is asked for.
#[inline(always)]
fn next<S: Simd>(simd: S, data: &Hierarchy, node: &Node, mask: &mut u32) -> (usize, Child) {
    let lane = mask.trailing_zeros() as usize & 7;
    *mask &= *mask - 1;
    let child = node.children[lane];
    prefetch(simd, data, child);
    (lane, child)
}

/// The next waiting child that begins before `limit`.
#[inline(always)]
pub(super) fn pop<const ANY: bool>(stack: &Stack, top: &mut usize, limit: f32) -> Option<Child> {
    while *top > 0 {
        *top -= 1;
        let entry = stack.at(*top);
        if ANY || f32::from_bits((entry >> 32) as u32) <= limit {
            return Some(Child(entry as u32));
        }
    }
    None
}

/// Fetches what a child points to; for sphere leaves, rare as they are, something useless. Both addresses are
/// computed and one is kept: a branch would be mispredicted half the time.
#[inline(always)]
pub(super) fn prefetch<S: Simd>(simd: S, data: &Hierarchy, child: Child) {
    let node = data.nodes.as_ptr().wrapping_add(child.index()).cast::<u8>();
    let leaf = data.triangles.as_ptr().wrapping_add(child.first()).cast::<u8>();
    simd.prefetch(if child.is_leaf() { leaf } else { node });
}

/// The best of `best` and the primitives of a leaf; for `ANY`, the first that is better.
#[inline(always)]
pub(super) fn intersect_leaf<S: Simd, M: Mode, const ANY: bool>(
    simd: S,
    data: &Hierarchy,
    ray: &Prepared<M>,
    leaf: Child,
    mut best: Best,
    weights: &mut Weights,
) -> Best {
    if leaf.is_spheres() {
        return sphere::intersect_leaf(simd, data, ray, leaf, best, weights);
    }
    let lanes = M::lanes(simd, ray);
    for (i, block) in data.triangles[leaf.blocks()].iter().enumerate() {
        let Some(crossing) = M::test_block(simd, ray, &lanes, block, best.t) else { continue };
        let mut hits = crossing.hits.bits();
        if hits != 0 {
            let (t, before) = (crossing.t.to_array(), best.place);
            while hits != 0 {
                let lane = hits.trailing_zeros() as usize % BLOCK;
                hits &= hits - 1;
                let place = Place::triangle(leaf.first() + i, lane);
                if t[lane] <= best.t && best.loses_to(data, ray.skip, t[lane], place) {
                    best = Best { t: t[lane], place };
                }
            }
            if !ANY && best.place != before {
                *weights = Weights(crossing.weights.map(Lanes::to_array));
            }
        }
        if crossing.edge_on != 0 {
            best = M::edge_on_lanes(data, ray, leaf.first() + i, crossing.edge_on, best, weights);
        }
        if ANY && best.is_hit() {
            break;
        }
    }
    best
}
