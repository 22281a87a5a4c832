//! Whether anything is in the way of up to 32 rays at a time: a stream for rays that want any hit.
//!
//! As in [`stream`](super::stream) every entry of the stack carries a mask of rays. Nothing is sorted by distance and
//! nothing is kept of a hit, so that rays are no more than rows of numbers, prepared eight at a time; and two rays are
//! tested at once against the four triangles of a block. Since any order will do, a child is not visited as soon as it is
//! pushed, but when its memory has had time to come.

use super::data::{BLOCK, Child, Hierarchy, TriangleBlock, WIDTH};
use super::mode::Mode;
use super::ray::{Best, Prepared, Weights};
use super::rows::{EIGHT, Row, Rows};
use super::simd::{Mask, Simd};
use super::single::{STACK, Slabs};
use super::sphere;
use super::stream::{PENDING, Pending, STREAM};
use crate::core::{Ray, Skip};
use core::marker::PhantomData;
use glam::Vec3;

/// Visits between taking a child from the stack and visiting it: enough work to hide the way from memory.
const AHEAD: usize = 8;

/// Height of the stack from which it is emptied strictly from the top, so that it cannot overflow: then it grows by no more
/// than a traversal depth first, and what the upcoming visits push.
const DEEP: usize = PENDING - STACK - AHEAD * WIDTH;

/// Children in the order of pushing. The builder puts those of most primitives in front: they are likeliest to be hit.
const LAST_TO_FIRST: [u32; WIDTH] = [7, 6, 5, 4, 3, 2, 1, 0];

/// Children to visit next, and the rays that wait for them, first come, first served.
struct Upcoming {
    visits: [(Child, u32); AHEAD],
    first: usize,
    count: usize,
}

impl Upcoming {
    #[inline(always)]
    fn new() -> Self {
        Self { visits: [(Child::EMPTY, 0); AHEAD], first: 0, count: 0 }
    }

    /// Adds one; there must be room.
    #[inline(always)]
    fn push(&mut self, child: Child, rays: u32) {
        self.visits[(self.first + self.count) % AHEAD] = (child, rays);
        self.count += 1;
    }

    /// The one that came first.
    #[inline(always)]
    fn take(&mut self) -> Option<(Child, u32)> {
        if self.count == 0 {
            return None;
        }
        let visit = self.visits[self.first % AHEAD];
        (self.first, self.count) = (self.first + 1, self.count - 1);
        Some(visit)
    }
}

/// The rays of a stream; made once for many streams.
pub(super) struct Occlusion<'a, M> {
    mode: PhantomData<M>,
    data: &'a Hierarchy,
    /// All rays, of which a stream has some.
    rays: &'a [Ray],
    /// Which those are.
    group: [u32; STREAM],
    rows: Rows,
    /// The rays that have a skip rule, one bit each.
    ruled: u32,
    pending: Pending,
}

impl<'a, M: Mode> Occlusion<'a, M> {
    pub(super) fn new(data: &'a Hierarchy, rays: &'a [Ray]) -> Self {
        Self {
            mode: PhantomData,
            data,
            rays,
            group: [0; STREAM],
            rows: Rows::EMPTY,
            ruled: 0,
            pending: Pending::new(),
        }
    }

    /// Which of the rays with these indices, all of one octant and at most [`STREAM`], hit something from `start` down: one bit
    /// each.
    #[inline(always)]
    pub(super) fn find<S: Simd>(&mut self, simd: S, start: Child, octant: usize, group: &[u32]) -> u32 {
        self.prepare(simd, group);
        let all = ((1u64 << group.len()) - 1) as u32;
        let (mut active, mut top) = (all, 0);
        let mut upcoming = Upcoming::new();
        upcoming.push(start, all);
        loop {
            top = self.look_ahead(&mut upcoming, active, top);
            let Some((current, rays)) = upcoming.take() else { return all & !active };
            let rays = rays & active;
            if current.is_leaf() {
                active &= !self.leaf(simd, current, rays);
            } else if rays != 0 {
                top = self.node(simd, octant, current, rays, top);
            }
        }
    }

    /// Fills the upcoming visits with children that rays still wait for. The new top of the stack.
    #[inline(always)]
    fn look_ahead(&self, upcoming: &mut Upcoming, active: u32, mut top: usize) -> usize {
        while upcoming.count < AHEAD && top > 0 && (upcoming.count == 0 || top < DEEP) {
            top -= 1;
            let (child, rays) = self.pending.at(top);
            if rays & active != 0 {
                upcoming.push(child, rays);
            }
        }
        top
    }

    /// Writes the rows; the last ray fills the last eight.
    #[inline(always)]
    fn prepare<S: Simd>(&mut self, simd: S, group: &[u32]) {
        self.ruled = 0;
        self.group[..group.len()].copy_from_slice(group);
        for (k, eight) in group.chunks(EIGHT).enumerate() {
            let rays = core::array::from_fn(|i| &self.rays[eight[i.min(eight.len() - 1)] as usize]);
            self.rows.set::<S, M>(simd, k * EIGHT, rays);
            for (i, ray) in rays.iter().enumerate() {
                self.ruled |= u32::from(ray.skip != Skip::None) << (k * EIGHT + i);
            }
        }
    }

    /// Pushes the children that some of the rays enter, the one with the most primitives last. The new top of the stack.
    #[inline(always)]
    fn node<S: Simd>(&mut self, simd: S, octant: usize, node: Child, rays: u32, top: usize) -> usize {
        let node = &self.data.nodes[node.index()];
        let sign = [octant & 1, octant >> 1 & 1, octant >> 2 & 1];
        let mut entering = simd.no_marks();
        let mut rest = rays;
        while rest != 0 {
            let i = rest.trailing_zeros();
            rest &= rest - 1;
            let lane = i as usize % STREAM;
            let slabs = Slabs::of_row::<S, M>(simd, &self.rows, lane);
            let (_, enters) = slabs.enter(simd, sign, node, self.rows.limit[lane]);
            entering = simd.mark(entering, enters, 1 << i);
        }

        self.pending.push(simd, self.data, node, (&LAST_TO_FIRST, 0), entering, top)
    }

    /// Which of the rays hit something in a leaf, two at a time.
    #[inline(always)]
    fn leaf<S: Simd>(&self, simd: S, leaf: Child, mut rays: u32) -> u32 {
        if leaf.is_spheres() {
            return self.sphere_leaf(simd, leaf, rays);
        }
        let blocks = &self.data.triangles[leaf.blocks()];
        let mut hit = 0;
        while rays != 0 {
            let first = rays.trailing_zeros();
            rays &= rays - 1;
            let second = if rays == 0 { first } else { rays.trailing_zeros() };
            rays &= rays.wrapping_sub(1);
            let both = 1 << first | 1 << second;
            let lanes = [first as usize % STREAM, second as usize % STREAM];
            let pair = M::pair(simd, &self.rows, lanes);
            let ends = |row: &[f32; STREAM]| simd.pair8(row[lanes[0]], row[lanes[1]]);
            let interval = [ends(&self.rows.t_min), ends(&self.rows.t_max)];
            for (i, block) in blocks.iter().enumerate() {
                let Some(crossing) = M::test_pair(simd, &self.rows, lanes, &pair, block, interval) else {
                    continue;
                };
                let mut hits = crossing.hits.bits();
                if hits != 0 {
                    if self.ruled & both != 0 {
                        hits = self.allowed(lanes, block, hits);
                    }
                    hit |= u32::from(hits & 0xf != 0) << first | u32::from(hits >> BLOCK != 0) << second;
                }
                if crossing.edge_on != 0 {
                    hit |= self.edge_on(lanes, leaf.first() + i, crossing.edge_on);
                }
                if hit & both == both {
                    break;
                }
            }
        }
        hit
    }

    /// Those of a pair's hits that no rule rejects.
    #[inline(never)]
    fn allowed(&self, lanes: [usize; 2], block: &TriangleBlock, mut hits: u32) -> u32 {
        let mut allowed = 0;
        while hits != 0 {
            let i = hits.trailing_zeros() as usize;
            hits &= hits - 1;
            let lane = i % BLOCK;
            let rejects =
                self.given(lanes[i / BLOCK % 2]).skip.rejects(block.geom_ids[lane], block.prim_ids[lane]);
            allowed |= u32::from(!rejects) << i;
        }
        allowed
    }

    /// Which rays of a pair hit those triangles of a block that only f64 can tell.
    #[cold]
    #[inline(never)]
    fn edge_on(&self, lanes: [usize; 2], index: usize, edge_on: u32) -> u32 {
        let hits = |k: usize| {
            let ray = Prepared::<M>::new(self.given(lanes[k]));
            let (none, triangles) = (Best::none(ray.t_max), edge_on >> (k * BLOCK) & 0xf);
            M::edge_on_lanes(self.data, &ray, index, triangles, none, &mut { Weights::NONE }).is_hit()
        };
        u32::from(hits(0)) << lanes[0] | u32::from(hits(1)) << lanes[1]
    }

    /// Which of the rays hit a sphere of a leaf.
    #[inline(always)]
    fn sphere_leaf<S: Simd>(&self, simd: S, leaf: Child, mut rays: u32) -> u32 {
        let mut hit = 0;
        while rays != 0 {
            let lane = rays.trailing_zeros() as usize % STREAM;
            rays &= rays - 1;
            let [ox, oy, oz] = &self.rows.origin;
            let [dx, dy, dz] = &self.rows.dir;
            let origin = [simd.splat4(ox[lane]), simd.splat4(oy[lane]), simd.splat4(oz[lane])];
            let dir = [simd.splat4(dx[lane]), simd.splat4(dy[lane]), simd.splat4(dz[lane])];
            for index in leaf.blocks() {
                let met = sphere::may_meet_block(simd, origin, dir, &self.data.spheres[index]);
                hit |= u32::from(met != 0 && self.meets(lane, index, met)) << lane;
            }
        }
        hit
    }

    /// Whether a ray hits one of some spheres of a block.
    #[inline(never)]
    fn meets(&self, lane: usize, index: usize, mut spheres: u32) -> bool {
        let triple = |rows: &[Row; 3]| Vec3::new(rows[0][lane], rows[1][lane], rows[2][lane]);
        let line = [triple(&self.rows.origin), triple(&self.rows.dir)];
        let interval = [self.rows.t_min[lane], self.rows.t_max[lane]];
        let block = &self.data.spheres[index];
        while spheres != 0 {
            let i = spheres.trailing_zeros() as usize % BLOCK;
            spheres &= spheres - 1;
            if sphere::first_root(line, interval, block.sphere(i)).is_some()
                && !self.given(lane).skip.rejects(block.geom_ids[i], block.prim_ids[i])
            {
                return true;
            }
        }
        false
    }

    /// A ray of the stream as it was given.
    #[inline(always)]
    fn given(&self, lane: usize) -> &Ray {
        &self.rays[self.group[lane % STREAM] as usize]
    }
}
