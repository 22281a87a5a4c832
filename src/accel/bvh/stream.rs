//! Up to 32 rays at a time that share the visits to nodes: a child is visited once for all rays that enter it.
//!
//! Every entry of the stack carries a mask of rays (after Fuetterling et al. 2015, "Efficient Ray Tracing Kernels for
//! Modern CPU Architectures"). All rays go into one octant, so that they agree on the order of the children and on
//! which plane of a slab comes first. In a subtree that only one ray enters, it goes on by itself. In large structures, it
//! pauses before each leaf there, and others go on while the leaf's memory is on its way.

use super::data::{Child, Hierarchy, Node, WIDTH};
use super::mode::Mode;
use super::ray::{Best, CULL_INFLATION, Prepared, Weights};
use super::simd::Simd;
use super::single::{self, STACK, Slabs, Stack};
use crate::core::Ray;

/// Most rays of a stream.
pub(super) const STREAM: usize = 32;

/// Entries of the stack of a stream: twice what depth first needs, for streams that stray from that order.
pub(super) const PENDING: usize = 2 * STACK;

/// The stack of a stream: children and which rays wait for them, one bit each. Never cleared.
pub(super) struct Pending {
    children: [u32; PENDING + WIDTH],
    rays: [u32; PENDING + WIDTH],
}

impl Pending {
    pub(super) fn new() -> Self {
        Self { children: [0; PENDING + WIDTH], rays: [0; PENDING + WIDTH] }
    }

    #[inline(always)]
    pub(super) fn at(&self, index: usize) -> (Child, u32) {
        (Child(self.children[index % PENDING]), self.rays[index % PENDING])
    }

    /// Pushes the children that rays enter, in the order that `order` gives in the 3 bits from `shift`. The new top.
    #[inline(always)]
    pub(super) fn push<S: Simd>(
        &mut self,
        simd: S,
        data: &Hierarchy,
        node: &Node,
        (order, shift): (&[u32; WIDTH], u32),
        entering: S::Marks,
        top: usize,
    ) -> usize {
        let packed = simd.pack_marked(order, shift, &Child::bits(&node.children), entering);
        let top = top % PENDING;
        self.children[top..top + WIDTH].copy_from_slice(&packed.lanes);
        self.rays[top..top + WIDTH].copy_from_slice(&packed.marks);
        for child in &packed.lanes[..packed.count] {
            single::prefetch(simd, data, Child(*child));
        }
        top + packed.count
    }
}

/// Rays that pause at a time in large structures: 8 and 16 are as fast.
pub(super) const PAUSED: usize = 4;

/// Bytes of a structure from which on rays pause: smaller ones stay in the caches, where there is little to wait for.
const LARGE: usize = 8 << 20;

/// Whether rays of streams through a structure had better pause before leaves.
pub(super) fn wants_pauses(data: &Hierarchy) -> bool {
    data.memory_bytes() >= LARGE
}

/// A ray that goes by itself: the leaf to which it has come, and what waits for it after that.
struct Alone {
    ray: usize,
    leaf: Child,
    stack: Stack,
    top: usize,
}

/// The rays of a stream and what each has found; made once for many streams. `AT_ONCE` rays may go by themselves at a time,
/// which take turns at leaves; if it is 1, each goes to its end.
pub(super) struct Stream<M: Mode, const AT_ONCE: usize> {
    count: usize,
    octant: usize,
    pub(super) rays: [Prepared<M>; STREAM],
    pub(super) best: [Best; STREAM],
    pub(super) weights: [Weights; STREAM],
    pending: Pending,
    alone: [Alone; AT_ONCE],
    /// Those of `alone` that are none, one bit each.
    free: u32,
    /// The rays that pause, one bit each, and where.
    pausing: u32,
    place: [u8; STREAM],
    /// Who goes on next.
    turn: usize,
}

impl<M: Mode, const AT_ONCE: usize> Stream<M, AT_ONCE> {
    /// Whether rays pause before leaves.
    const PAUSES: bool = AT_ONCE > 1;

    pub(super) fn new() -> Self {
        Self {
            count: 0,
            octant: 0,
            rays: [Prepared::new(&Ray::inactive()); STREAM],
            best: [Best::none(0.0); STREAM],
            weights: [Weights::NONE; STREAM],
            pending: Pending::new(),
            alone: [(); AT_ONCE].map(|()| Alone { ray: 0, leaf: Child::EMPTY, stack: Stack::new(), top: 0 }),
            free: (1 << AT_ONCE) - 1,
            pausing: 0,
            place: [0; STREAM],
            turn: 0,
        }
    }

    /// No rays, and where those to come go: bit k is set for those that are negative along axis k.
    #[inline(always)]
    pub(super) fn start(&mut self, octant: usize) {
        (self.count, self.octant) = (0, octant);
    }

    /// One more ray, and the best that is known to be on it.
    #[inline(always)]
    pub(super) fn push(&mut self, ray: Prepared<M>, best: Best) {
        let i = self.count % STREAM;
        self.best[i] = best;
        self.rays[i] = ray;
        self.count = i + 1;
    }

    /// Closest hits of all rays from `start` down.
    #[inline(always)]
    pub(super) fn traverse<S: Simd>(&mut self, simd: S, data: &Hierarchy, start: Child) {
        let (mut current, mut rays, mut top) = (start, ((1u64 << self.count) - 1) as u32, 0);
        if rays == 0 {
            return;
        }
        loop {
            // A ray comes to what is far once it is done with what is near.
            while Self::PAUSES && rays & self.pausing != 0 {
                let ray = (rays & self.pausing).trailing_zeros() as usize % STREAM;
                self.go_on(simd, data, usize::from(self.place[ray]));
            }
            if rays & (rays - 1) == 0 {
                self.alone(simd, data, current, rays.trailing_zeros() as usize % STREAM);
            } else if current.is_leaf() {
                self.leaf(simd, data, current, rays);
            } else {
                top = self.node(simd, data, current, rays, top);
            }
            if top == 0 {
                break;
            }
            top -= 1;
            (current, rays) = self.pending.at(top);
        }
        while Self::PAUSES && self.pausing != 0 {
            self.next_goes_on(simd, data);
        }
    }

    /// Lets a ray go on by itself: with pauses, until it comes to a leaf.
    #[inline(always)]
    fn alone<S: Simd>(&mut self, simd: S, data: &Hierarchy, start: Child, ray: usize) {
        if !Self::PAUSES {
            let (prepared, best, weights) = (&self.rays[ray], self.best[ray], &mut self.weights[ray]);
            self.best[ray] = single::traverse::<S, M, false>(
                simd,
                data,
                prepared,
                &mut self.alone[0].stack,
                start,
                best,
                weights,
            );
            return;
        }
        while self.free == 0 {
            self.next_goes_on(simd, data);
        }
        let place = self.free.trailing_zeros() as usize % AT_ONCE;
        self.alone[place].ray = ray;
        self.alone[place].top = 0;
        if self.pauses(simd, data, place, start) {
            self.free &= !(1 << place);
            self.pausing |= 1 << ray;
            self.place[ray] = place as u8;
        }
    }

    /// Whether the ray at a place comes to a leaf from `start` down, to pause before it.
    #[inline(always)]
    fn pauses<S: Simd>(&mut self, simd: S, data: &Hierarchy, place: usize, start: Child) -> bool {
        let Alone { ray, leaf, stack, top } = &mut self.alone[place];
        let (ray, limit) = (&self.rays[*ray % STREAM], self.best[*ray % STREAM].t * CULL_INFLATION);
        let slabs = Slabs::new(simd, ray);
        let Some(next) = single::descend(simd, data, (&slabs, ray.sign()), (stack, top), start, limit) else {
            return false;
        };
        single::prefetch(simd, data, next);
        *leaf = next;
        true
    }

    /// Lets the next of the rays that pause go on.
    #[inline(always)]
    fn next_goes_on<S: Simd>(&mut self, simd: S, data: &Hierarchy) {
        self.turn = (self.turn + 1) % AT_ONCE;
        if self.free >> self.turn & 1 == 0 {
            self.go_on(simd, data, self.turn);
        }
    }

    /// Lets the ray that pauses at a place meet its leaf, and go on to the next, if there is one.
    #[inline(always)]
    fn go_on<S: Simd>(&mut self, simd: S, data: &Hierarchy, place: usize) {
        let place = place % AT_ONCE;
        let Alone { ray, leaf, stack, top } = &mut self.alone[place];
        let i = *ray % STREAM;
        let weights = &mut self.weights[i];
        let best =
            single::intersect_leaf::<S, M, false>(simd, data, &self.rays[i], *leaf, self.best[i], weights);
        self.best[i] = best;
        let next = single::pop::<false>(stack, top, best.t * CULL_INFLATION);
        if !next.is_some_and(|next| self.pauses(simd, data, place, next)) {
            self.free |= 1 << place;
            self.pausing &= !(1 << i);
        }
    }

    /// Pushes the children that some of the rays enter, the farthest first. The new top of the stack.
    #[inline(always)]
    fn node<S: Simd>(&mut self, simd: S, data: &Hierarchy, node: Child, rays: u32, top: usize) -> usize {
        let node = &data.nodes[node.index()];
        let octant = self.octant;
        let sign = [octant & 1, octant >> 1 & 1, octant >> 2 & 1];
        let mut entering = simd.no_marks();
        let mut rest = rays;
        while rest != 0 {
            let i = rest.trailing_zeros();
            rest &= rest - 1;
            let (ray, best) = (&self.rays[i as usize % STREAM], self.best[i as usize % STREAM]);
            let (_, enters) = Slabs::new(simd, ray).enter(simd, sign, node, best.t * CULL_INFLATION);
            entering = simd.mark(entering, enters, 1 << i);
        }
        self.pending.push(simd, data, node, (&node.order, 3 * octant as u32), entering, top)
    }

    /// Tests the rays one after the other.
    #[inline(always)]
    fn leaf<S: Simd>(&mut self, simd: S, data: &Hierarchy, leaf: Child, rays: u32) {
        let mut rest = rays;
        while rest != 0 {
            let i = rest.trailing_zeros() as usize % STREAM;
            rest &= rest - 1;
            let (ray, best, weights) = (&self.rays[i], self.best[i], &mut self.weights[i]);
            self.best[i] = single::intersect_leaf::<S, M, false>(simd, data, ray, leaf, best, weights);
        }
    }
}
