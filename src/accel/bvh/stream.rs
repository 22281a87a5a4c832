//! Up to 32 rays at a time that share the visits to nodes: a child is visited once for all rays that enter it.
//!
//! Every entry of the stack carries a mask of rays (after Fuetterling et al. 2015, "Efficient Ray Tracing Kernels for
//! Modern CPU Architectures"). Children are ordered along the octant of the first ray, so a stream wants rays of one
//! octant. A subtree that only one ray enters is traversed by the single-ray loop.

use super::data::{Child, Hierarchy, WIDTH};
use super::ray::{Best, CULL_INFLATION, Prepared, Weights};
use super::simd::Simd;
use super::single::{self, STACK, Slabs, Stack};

/// Most rays of a stream.
pub(super) const STREAM: usize = 32;

/// The rays of a stream and what each has found; made once for many streams.
pub(super) struct Stream {
    pub(super) rays: Vec<Prepared>,
    pub(super) best: Vec<Best>,
    pub(super) weights: [Weights; STREAM],
    stack: [(Child, u32); STACK + WIDTH],
    single: Stack,
}

impl Stream {
    pub(super) fn new() -> Self {
        Self {
            rays: Vec::with_capacity(STREAM),
            best: Vec::with_capacity(STREAM),
            weights: [Weights::NONE; STREAM],
            stack: [(Child::EMPTY, 0); STACK + WIDTH],
            single: Stack::new(),
        }
    }

    /// No rays.
    pub(super) fn clear(&mut self) {
        self.rays.clear();
        self.best.clear();
    }

    /// One more ray.
    #[inline(always)]
    pub(super) fn push(&mut self, ray: Prepared) {
        self.best.push(Best::none(ray.t_max));
        self.rays.push(ray);
    }

    /// Closest hits, or for `ANY` any, of all rays.
    #[inline(always)]
    pub(super) fn traverse<S: Simd, const ANY: bool>(&mut self, simd: S, data: &Hierarchy) {
        let mut active = ((1u64 << self.rays.len()) - 1) as u32;
        let (mut current, mut rays, mut top) = (data.root, active, 0);
        while active != 0 {
            if rays & (rays - 1) == 0 {
                let i = rays.trailing_zeros() as usize;
                let (ray, best, weights) = (&self.rays[i], self.best[i], &mut self.weights[i]);
                let best =
                    single::traverse::<S, ANY>(simd, data, ray, &mut self.single, current, best, weights);
                self.best[i] = best;
                if ANY && best.is_hit() {
                    active &= !rays;
                }
            } else if current.is_leaf() {
                active &= !self.leaf::<S, ANY>(simd, data, current, rays);
            } else {
                top = self.node(simd, data, current, rays, top);
            }

            // The next child that rays still wait for.
            rays = 0;
            while rays == 0 {
                if top == 0 {
                    return;
                }
                top -= 1;
                let (child, waiting) = self.stack[top % STACK];
                (current, rays) = (child, waiting & active);
            }
        }
    }

    /// Pushes the children that some of the rays enter, the farthest first. The new top of the stack.
    #[inline(always)]
    fn node<S: Simd>(&mut self, simd: S, data: &Hierarchy, node: Child, rays: u32, top: usize) -> usize {
        let node = &data.nodes[node.index()];
        let mut entering = simd.no_marks();
        let mut rest = rays;
        while rest != 0 {
            let i = rest.trailing_zeros() as usize;
            rest &= rest - 1;
            let ray = &self.rays[i];
            let (_, enters) =
                Slabs::new(simd, ray).enter(simd, ray.sign(), node, self.best[i].t * CULL_INFLATION);
            entering = simd.mark(entering, enters, 1 << i);
        }

        // Every child is written and those that no ray enters are overwritten: no branch to mispredict.
        let entering = simd.marks(entering);
        let octant = self.rays[rays.trailing_zeros() as usize].octant;
        let mut top = top;
        for place in node.order {
            let child = (place >> (3 * octant)) as usize % WIDTH;
            self.stack[top % STACK] = (node.children[child], entering[child]);
            top += usize::from(entering[child] != 0);
        }
        top
    }

    /// Tests the rays one after the other. For `ANY`, which of them hit something.
    #[inline(always)]
    fn leaf<S: Simd, const ANY: bool>(&mut self, simd: S, data: &Hierarchy, leaf: Child, rays: u32) -> u32 {
        let mut hit = 0;
        let mut rest = rays;
        while rest != 0 {
            let i = rest.trailing_zeros() as usize;
            rest &= rest - 1;
            let ray = &self.rays[i];
            let best =
                single::intersect_leaf::<S, ANY>(simd, data, ray, leaf, self.best[i], &mut self.weights[i]);
            self.best[i] = best;
            if ANY {
                hit |= u32::from(best.is_hit()) << i;
            }
        }
        hit
    }
}
