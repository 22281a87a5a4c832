//! Up to 32 rays at a time that share the visits to nodes: a child is visited once for all rays that enter it.
//!
//! Every entry of the stack carries a mask of rays (after Fuetterling et al. 2015, "Efficient Ray Tracing Kernels for
//! Modern CPU Architectures"). Rays that want their closest hit all go into one octant, so that they agree on the order
//! of the children and on which plane of a slab comes first; those that want any hit may be mixed, since neighbours
//! gain more by their common origin. A subtree that only one ray enters is traversed by the single-ray loop.

use super::data::{Child, Hierarchy, WIDTH};
use super::mode::Mode;
use super::ray::{Best, CULL_INFLATION, Prepared, Weights};
use super::simd::Simd;
use super::single::{self, STACK, Slabs, Stack};
use crate::core::Ray;

/// Most rays of a stream.
pub(super) const STREAM: usize = 32;

/// The rays of a stream and what each has found; made once for many streams.
pub(super) struct Stream<M: Mode> {
    count: usize,
    octant: usize,
    pub(super) rays: [Prepared<M>; STREAM],
    pub(super) best: [Best; STREAM],
    pub(super) weights: [Weights; STREAM],
    children: [u32; STACK + WIDTH],
    waiting: [u32; STACK + WIDTH],
    single: Stack,
}

impl<M: Mode> Stream<M> {
    pub(super) fn new() -> Self {
        Self {
            count: 0,
            octant: 0,
            rays: [Prepared::new(&Ray::inactive()); STREAM],
            best: [Best::none(0.0); STREAM],
            weights: [Weights::NONE; STREAM],
            children: [0; STACK + WIDTH],
            waiting: [0; STACK + WIDTH],
            single: Stack::new(),
        }
    }

    /// No rays, and where those to come go: bit k is set for those that are negative along axis k. Of no meaning for rays
    /// that want any hit.
    #[inline(always)]
    pub(super) fn start(&mut self, octant: usize) {
        (self.count, self.octant) = (0, octant);
    }

    /// One more ray.
    #[inline(always)]
    pub(super) fn push(&mut self, ray: Prepared<M>) {
        let i = self.count % STREAM;
        self.best[i] = Best::none(ray.t_max);
        self.rays[i] = ray;
        self.count = i + 1;
    }

    /// Closest hits, or for `ANY` any, of all rays.
    #[inline(always)]
    pub(super) fn traverse<S: Simd, const ANY: bool>(&mut self, simd: S, data: &Hierarchy) {
        let mut active = ((1u64 << self.count) - 1) as u32;
        let (mut current, mut rays, mut top) = (data.root, active, 0);
        while active != 0 {
            if rays & (rays - 1) == 0 {
                active &= !self.alone::<S, ANY>(simd, data, current, rays);
            } else if current.is_leaf() {
                active &= !self.leaf::<S, ANY>(simd, data, current, rays);
            } else {
                top = self.node::<S, ANY>(simd, data, current, rays, top);
            }

            // The next child that rays still wait for.
            rays = 0;
            while rays == 0 {
                if top == 0 {
                    return;
                }
                top -= 1;
                current = Child(self.children[top % STACK]);
                rays = self.waiting[top % STACK] & active;
            }
        }
    }

    /// Lets the only ray of the mask go on by itself. For `ANY`, the mask if it hit something.
    #[inline(always)]
    fn alone<S: Simd, const ANY: bool>(&mut self, simd: S, data: &Hierarchy, start: Child, ray: u32) -> u32 {
        let i = ray.trailing_zeros() as usize % STREAM;
        let (prepared, weights) = (&self.rays[i], &mut self.weights[i]);
        let best = single::traverse::<S, M, ANY>(
            simd,
            data,
            prepared,
            &mut self.single,
            start,
            self.best[i],
            weights,
        );
        self.best[i] = best;
        if ANY && best.is_hit() { ray } else { 0 }
    }

    /// Pushes the children that some of the rays enter, the farthest first. The new top of the stack.
    #[inline(always)]
    fn node<S: Simd, const ANY: bool>(
        &mut self,
        simd: S,
        data: &Hierarchy,
        node: Child,
        rays: u32,
        top: usize,
    ) -> usize {
        let node = &data.nodes[node.index()];
        let octant = if ANY {
            self.rays[rays.trailing_zeros() as usize % STREAM].octant as usize
        } else {
            self.octant
        };
        let sign = [octant & 1, octant >> 1 & 1, octant >> 2 & 1];
        let mut entering = simd.no_marks();
        let mut rest = rays;
        while rest != 0 {
            let i = rest.trailing_zeros();
            rest &= rest - 1;
            let (ray, best) = (&self.rays[i as usize % STREAM], self.best[i as usize % STREAM]);
            let sign = if ANY { ray.sign() } else { sign };
            let (_, enters) = Slabs::new(simd, ray).enter(simd, sign, node, best.t * CULL_INFLATION);
            entering = simd.mark(entering, enters, 1 << i);
        }

        let packed = simd.pack_marked(&node.order, 3 * octant as u32, &Child::bits(&node.children), entering);
        let top = top % STACK;
        self.children[top..top + WIDTH].copy_from_slice(&packed.lanes);
        self.waiting[top..top + WIDTH].copy_from_slice(&packed.marks);
        for child in &packed.lanes[..packed.count] {
            single::prefetch(simd, data, Child(*child));
        }
        top + packed.count
    }

    /// Tests the rays one after the other. For `ANY`, which of them hit something.
    #[inline(always)]
    fn leaf<S: Simd, const ANY: bool>(&mut self, simd: S, data: &Hierarchy, leaf: Child, rays: u32) -> u32 {
        let mut hit = 0;
        let mut rest = rays;
        while rest != 0 {
            let i = rest.trailing_zeros() as usize % STREAM;
            rest &= rest - 1;
            let ray = &self.rays[i];
            let best = single::intersect_leaf::<S, M, ANY>(
                simd,
                data,
                ray,
                leaf,
                self.best[i],
                &mut self.weights[i],
            );
            self.best[i] = best;
            if ANY {
                hit |= u32::from(best.is_hit()) << i;
            }
        }
        hit
    }
}
