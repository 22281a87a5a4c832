//! One ray at a time: depth first, nearest child first, hit children prefetched while they are being sorted.

use super::data::{Child, Hierarchy, Node, TriangleBlock};
use super::ray::{Best, CULL_INFLATION, EXIT_INFLATION, Prepared};
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
    rcp: [F; 3],
    near: [F; 3],
    far: [F; 3],
    t_min: F,
    inflation: F,
}

impl<F: Lanes<8>> Slabs<F> {
    #[inline(always)]
    pub(super) fn new<S: Simd<F8 = F>>(simd: S, ray: &Prepared) -> Self {
        let splat3 = |v: [f32; 3]| [simd.splat8(v[0]), simd.splat8(v[1]), simd.splat8(v[2])];
        Self {
            rcp: splat3(ray.rcp),
            near: splat3(ray.near_offset),
            far: splat3(ray.far_offset),
            t_min: simd.splat8(ray.t_min),
            inflation: simd.splat8(EXIT_INFLATION),
        }
    }

    /// Entry distances of the eight boxes, and which of them the ray enters before `t_max`.
    ///
    /// A NaN (an infinite plane of a ray that is parallel to it) is on the left of each `min` and `max`, which
    /// then return the right operand: the box is kept.
    #[inline(always)]
    pub(super) fn enter<S: Simd<F8 = F>>(
        &self,
        simd: S,
        ray: &Prepared,
        node: &Node,
        t_max: f32,
    ) -> (F, u32) {
        let [x, y, z] = &node.planes;
        let [sx, sy, sz] = ray.sign;
        let near_x = simd.load8(&x[sx & 1]).mul_sub(self.rcp[0], self.near[0]);
        let near_y = simd.load8(&y[sy & 1]).mul_sub(self.rcp[1], self.near[1]);
        let near_z = simd.load8(&z[sz & 1]).mul_sub(self.rcp[2], self.near[2]);
        let far_x = simd.load8(&x[sx & 1 ^ 1]).mul_sub(self.rcp[0], self.far[0]);
        let far_y = simd.load8(&y[sy & 1 ^ 1]).mul_sub(self.rcp[1], self.far[1]);
        let far_z = simd.load8(&z[sz & 1 ^ 1]).mul_sub(self.rcp[2], self.far[2]);
        let near = near_x.max(near_y).max(near_z.max(self.t_min));
        let far = (far_x.min(far_y).min(far_z) * self.inflation).min(simd.splat8(t_max));
        (near, near.le(far).bits())
    }
}

/// Closest hit (or any, for `ANY`) from `start` down, improving on `best`. Whether it improved.
#[inline(always)]
pub(super) fn traverse<S: Simd, const ANY: bool>(
    simd: S,
    data: &Hierarchy,
    ray: &Prepared,
    stack: &mut Stack,
    start: Child,
    best: &mut Best,
) -> bool {
    let slabs = Slabs::new(simd, ray);
    let leaf = Leaf { shear: triangle::Shear::of_ray(simd, ray), t_min: simd.splat4(ray.t_min) };
    let mut limit = best.t * CULL_INFLATION;
    let mut improved = false;
    let mut top = 0;
    let mut current = start;
    loop {
        'descend: while !current.is_leaf() {
            let node = &data.nodes[current.index()];
            let (near, mut mask) = slabs.enter(simd, ray, node, limit);
            if mask == 0 {
                match pop::<ANY>(stack, &mut top, limit) {
                    Some(child) => current = child,
                    None => return improved,
                }
                continue 'descend;
            }
            let lane = mask.trailing_zeros() as usize;
            mask &= mask - 1;
            current = node.children[lane & 7];
            if mask == 0 {
                continue 'descend;
            }
            if ANY {
                prefetch(simd, data, current);
                while mask != 0 {
                    let child = node.children[mask.trailing_zeros() as usize & 7];
                    mask &= mask - 1;
                    prefetch(simd, data, child);
                    stack.put(top, entry(0.0, child));
                    top += 1;
                }
                continue 'descend;
            }

            // The nearest goes on in a register; the others are sorted into the stack, the farthest deepest.
            let distances = near.to_array();
            prefetch(simd, data, current);
            let first = entry(distances[lane & 7], current);
            let second = next(simd, data, node, &distances, &mut mask);
            let mut nearest = first.min(second);
            let bottom = top;
            stack.put(top, first.max(second));
            top += 1;
            while mask != 0 {
                let other = next(simd, data, node, &distances, &mut mask);
                let waiting = nearest.max(other);
                nearest = nearest.min(other);
                let mut slot = top;
                while slot > bottom && stack.at(slot - 1) < waiting {
                    stack.put(slot, stack.at(slot - 1));
                    slot -= 1;
                }
                stack.put(slot, waiting);
                top += 1;
            }
            current = Child(nearest as u32);
        }

        if leaf.intersect::<S, ANY>(simd, data, ray, current, best) {
            if ANY {
                return true;
            }
            improved = true;
            limit = best.t * CULL_INFLATION;
        }
        match pop::<ANY>(stack, &mut top, limit) {
            Some(child) => current = child,
            None => return improved,
        }
    }
}

/// The entry of the next child in the mask, whose memory it asks for.
#[inline(always)]
fn next<S: Simd>(simd: S, data: &Hierarchy, node: &Node, distances: &[f32; 8], mask: &mut u32) -> u64 {
    let lane = mask.trailing_zeros() as usize & 7;
    *mask &= *mask - 1;
    let child = node.children[lane];
    prefetch(simd, data, child);
    entry(distances[lane], child)
}

/// The next waiting child that begins before `limit`.
#[inline(always)]
fn pop<const ANY: bool>(stack: &Stack, top: &mut usize, limit: f32) -> Option<Child> {
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

/// One ray, ready for the blocks of a leaf.
pub(super) struct Leaf<F> {
    pub(super) shear: triangle::Shear<F>,
    pub(super) t_min: F,
}

impl<F: Lanes<4>> Leaf<F> {
    /// Whether the leaf has something better than `best`, which then becomes it.
    #[inline(always)]
    pub(super) fn intersect<S: Simd<F4 = F>, const ANY: bool>(
        &self,
        simd: S,
        data: &Hierarchy,
        ray: &Prepared,
        leaf: Child,
        best: &mut Best,
    ) -> bool {
        if leaf.is_spheres() {
            return sphere::intersect_leaf(ray, &data.spheres[leaf.blocks()], best);
        }
        let mut improved = false;
        for index in leaf.blocks() {
            let block = &data.triangles[index];
            let corners = triangle::load_block(simd, ray.axes, block);
            let crossing = triangle::cross(&self.shear, &corners);
            if crossing.inside.bits() == 0 {
                continue;
            }
            let (t, valid, edge_on) =
                triangle::hits(&self.shear, &corners, &crossing, self.t_min, simd.splat4(best.t));
            if take_best(ray, block, &t.to_array(), valid, best) {
                if ANY {
                    return true;
                }
                improved = true;
                best.weights = [crossing.v.to_array(), crossing.w.to_array(), crossing.det.to_array()];
            }
            if edge_on != 0 && take_edge_on(ray, block, edge_on, best) {
                improved = true;
            }
        }
        improved
    }
}

/// Puts the best of the valid lanes into `best`. Whether there was one.
#[inline(always)]
fn take_best(ray: &Prepared, block: &TriangleBlock, t: &[f32; 4], mut lanes: u32, best: &mut Best) -> bool {
    let mut improved = false;
    while lanes != 0 {
        let lane = lanes.trailing_zeros() as usize & 3;
        lanes &= lanes - 1;
        let (geom_id, prim_id) = (block.geom_ids[lane], block.prim_ids[lane]);
        if best.loses_to(t[lane], geom_id, prim_id) && !ray.skip.rejects(geom_id, prim_id) {
            (best.t, best.geom_id, best.prim_id, best.lane) = (t[lane], geom_id, prim_id, lane);
            improved = true;
        }
    }
    improved
}

/// The lanes whose edge functions vanish in f32: seldom, and by way of f64.
#[cold]
#[inline(never)]
pub(super) fn take_edge_on(ray: &Prepared, block: &TriangleBlock, lanes: u32, best: &mut Best) -> bool {
    let mut improved = false;
    for lane in (0..4).filter(|lane| lanes >> lane & 1 == 1) {
        if let Some((t, v, w)) = triangle::solve_edge_on(ray, block, lane)
            && t >= ray.t_min
            && t <= best.t
            && take_best(ray, block, &[t; 4], 1 << lane, best)
        {
            best.weights = [[v; 4], [w; 4], [1.0; 4]];
            improved = true;
        }
    }
    improved
}
