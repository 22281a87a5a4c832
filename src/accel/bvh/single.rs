//! One ray at a time: depth first, nearest child first, hit children prefetched while they are being sorted.

use super::data::{Child, Hierarchy, Node, TriangleBlock};
use super::ray::{Best, CULL_INFLATION, Prepared};
use super::simd::{Lanes, Mask, Simd};
use super::{sphere, triangle};

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

/// The slab test's constants over eight lanes.
pub(super) struct Slabs<F> {
    origin: [F; 3],
    neg_rcp: [F; 3],
    neg_rcp_far: [F; 3],
    t_min: F,
}

impl<F: Lanes<8>> Slabs<F> {
    #[inline(always)]
    pub(super) fn new<S: Simd<F8 = F>>(simd: S, ray: &Prepared) -> Self {
        let [ox, oy, oz] = ray.origin;
        let [rx, ry, rz] = ray.neg_rcp;
        let [fx, fy, fz] = ray.neg_rcp_far;
        Self {
            origin: [simd.splat8(ox), simd.splat8(oy), simd.splat8(oz)],
            neg_rcp: [simd.splat8(rx), simd.splat8(ry), simd.splat8(rz)],
            neg_rcp_far: [simd.splat8(fx), simd.splat8(fy), simd.splat8(fz)],
            t_min: simd.splat8(ray.t_min),
        }
    }

    /// Entry distances of the eight boxes, and which of them the ray enters before `t_max`.
    ///
    /// A NaN (a plane that the ray runs in) never stays: `min` and `max` return the right operand if the left one is
    /// NaN, and the rightmost is a number.
    #[inline(always)]
    pub(super) fn enter<S: Simd<F8 = F>>(
        &self,
        simd: S,
        ray: &Prepared,
        node: &Node,
        t_max: f32,
    ) -> (F, F::Mask) {
        let [x, y, z] = &node.planes;
        let [sx, sy, sz] = ray.sign;
        let near_x = (self.origin[0] - simd.load8(&x[sx & 1])) * self.neg_rcp[0];
        let near_y = (self.origin[1] - simd.load8(&y[sy & 1])) * self.neg_rcp[1];
        let near_z = (self.origin[2] - simd.load8(&z[sz & 1])) * self.neg_rcp[2];
        let far_x = (self.origin[0] - simd.load8(&x[sx & 1 ^ 1])) * self.neg_rcp_far[0];
        let far_y = (self.origin[1] - simd.load8(&y[sy & 1 ^ 1])) * self.neg_rcp_far[1];
        let far_z = (self.origin[2] - simd.load8(&z[sz & 1 ^ 1])) * self.neg_rcp_far[2];
        let near = near_x.max(near_y).max(near_z.max(self.t_min));
        let far = far_x.min(far_y).min(far_z.min(simd.splat8(t_max)));
        (near, near.le(far))
    }
}

/// The best of `best` and what the ray hits from `start` down; for `ANY`, the first hit that is better.
#[inline(always)]
pub(super) fn traverse<S: Simd, const ANY: bool>(
    simd: S,
    data: &Hierarchy,
    ray: &Prepared,
    stack: &mut Stack,
    start: Child,
    mut best: Best,
) -> Best {
    let slabs = Slabs::new(simd, ray);
    let mut limit = best.t * CULL_INFLATION;
    let shear = triangle::Shear::of_ray(simd, ray);
    let mut top = 0;
    let mut current = start;
    loop {
        'descend: while !current.is_leaf() {
            let node = &data.nodes[current.index()];
            let (near, enters) = slabs.enter(simd, ray, node, limit);
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

        best = intersect_leaf::<S, ANY>(simd, data, ray, &shear, current, best);
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
fn prefetch<S: Simd>(simd: S, data: &Hierarchy, child: Child) {
    let node = data.nodes.as_ptr().wrapping_add(child.index()).cast::<u8>();
    let leaf = data.triangles.as_ptr().wrapping_add(child.first()).cast::<u8>();
    simd.prefetch(if child.is_leaf() { leaf } else { node });
}

/// The best of `best` and the primitives of a leaf; for `ANY`, the first that is better.
///
/// The best so far goes through calls by value: a reference to it would keep it in memory, and the ids that one leaf
/// writes singly and the next reads together would wait for the store buffer.
#[inline(always)]
pub(super) fn intersect_leaf<S: Simd, const ANY: bool>(
    simd: S,
    data: &Hierarchy,
    ray: &Prepared,
    shear: &triangle::Shear<S::F4>,
    leaf: Child,
    mut best: Best,
) -> Best {
    if leaf.is_spheres() {
        return sphere::intersect_leaf(ray, &data.spheres[leaf.blocks()], best);
    }
    for block in &data.triangles[leaf.blocks()] {
        let crossing = triangle::cross(shear, &triangle::load_block(simd, ray.axes, block));
        if crossing.inside.bits() == 0 {
            continue;
        }
        let mut t = crossing.distance(shear);
        if block.any_flat {
            t = with_flat_distances(simd, ray, shear, &crossing, block, t);
        }
        let hits = crossing.hits(t, simd.splat4(ray.t_min), simd.splat4(best.t));
        if let Some((lane, nearest)) = best_lane(ray, block, &t.to_array(), hits, &best) {
            best = nearest;
            if ANY {
                return best;
            }
            best.weights = [crossing.v, crossing.w, crossing.det].map(|lanes| lanes.to_array()[lane]);
        }
        let edge_on = crossing.edge_on();
        if edge_on != 0 {
            best = edge_on_lanes(ray, block, edge_on, best);
        }
    }
    best
}

/// Distances with those of the flat triangles replaced.
#[inline(always)]
fn with_flat_distances<S: Simd>(
    simd: S,
    ray: &Prepared,
    shear: &triangle::Shear<S::F4>,
    crossing: &triangle::Crossing<S::F4, <S::F4 as Lanes<4>>::Mask>,
    block: &TriangleBlock,
    t: S::F4,
) -> S::F4 {
    let (mut origin, mut plane, mut neg_rcp) = ([0.0; 4], [0.0; 4], [0.0; 4]);
    for (lane, &axis) in block.flat_axes.iter().enumerate() {
        let axis = usize::from(axis);
        if axis < 3 {
            (origin[lane], neg_rcp[lane]) = (ray.origin[axis], ray.neg_rcp[axis]);
            plane[lane] = block.corners[0][axis][lane];
        }
    }
    let flat = crossing.flat_distance(shear, simd.load4(&origin), simd.load4(&plane), simd.load4(&neg_rcp));
    let (mut t, flat) = (t.to_array(), flat.to_array());
    for (lane, &axis) in block.flat_axes.iter().enumerate() {
        if usize::from(axis) < 3 {
            t[lane] = flat[lane];
        }
    }
    simd.load4(&t)
}

/// The best of the lanes that hit, if it is better than `best`.
#[inline(always)]
fn best_lane(
    ray: &Prepared,
    block: &TriangleBlock,
    t: &[f32; 4],
    mut hits: u32,
    best: &Best,
) -> Option<(usize, Best)> {
    let mut better = None;
    let (mut best_t, mut best_ids) = (best.t, (best.geom_id, best.prim_id));
    while hits != 0 {
        let lane = hits.trailing_zeros() as usize & 3;
        hits &= hits - 1;
        let (t, ids) = (t[lane], (block.geom_ids[lane], block.prim_ids[lane]));
        if (t < best_t || t == best_t && ids < best_ids) && !ray.skip.rejects(ids.0, ids.1) {
            (best_t, best_ids) = (t, ids);
            better = Some((lane, Best { t, geom_id: ids.0, prim_id: ids.1, ..*best }));
        }
    }
    better
}

/// The lanes whose edge functions vanish in f32: seldom, and by way of f64.
#[cold]
#[inline(never)]
pub(super) fn edge_on_lanes(ray: &Prepared, block: &TriangleBlock, lanes: u32, mut best: Best) -> Best {
    for lane in (0..4).filter(|lane| lanes >> lane & 1 == 1) {
        if let Some((t, v, w)) = triangle::solve_edge_on(ray, block, lane)
            && t >= ray.t_min
            && t <= best.t
            && let Some((_, better)) = best_lane(ray, block, &[t; 4], 1 << lane, &best)
        {
            best = Best { weights: [v, w, 1.0], ..better };
        }
    }
    best
}
