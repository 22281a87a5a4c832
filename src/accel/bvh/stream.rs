//! Up to 32 rays at a time that share the visits to nodes: a child is visited once for all rays that enter it.
//!
//! Every entry of the stack carries a mask of rays (after Fuetterling et al. 2015, "Efficient Ray Tracing Kernels for
//! Modern CPU Architectures"). Children are ordered along the octant of the first ray, so a stream wants rays of one
//! octant. A subtree that only one ray enters is traversed by the single-ray loop.

use super::data::{Child, Hierarchy, WIDTH};
use super::mode::Mode;
use super::ray::{Best, CULL_INFLATION, Prepared, Weights};
use super::simd::Simd;
use super::single::{self, STACK, Slabs, Stack};

/// Most rays of a stream.
pub(super) const STREAM: usize = 32;

/// The rays of a stream and what each has found; made once for many streams.
pub(super) struct Stream<M: Mode> {
    pub(super) rays: Vec<Prepared<M>>,
    pub(super) best: Vec<Best>,
    pub(super) weights: [Weights; STREAM],
    lines: [SlabLine; STREAM],
    children: [u32; STACK + WIDTH],
    waiting: [u32; STACK + WIDTH],
    single: Stack,
}

/// What the slab test needs of a ray, in one cache line.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
struct SlabLine {
    rcp: [f32; 3],
    t_min: f32,
    near: [f32; 3],
    /// Where the closest hit so far ends the ray, with room for rounding.
    limit: f32,
    far: [f32; 3],
    octant: u32,
}

impl SlabLine {
    const NONE: Self =
        Self { rcp: [0.0; 3], t_min: 0.0, near: [0.0; 3], limit: 0.0, far: [0.0; 3], octant: 0 };
}

impl<M: Mode> Stream<M> {
    pub(super) fn new() -> Self {
        Self {
            rays: Vec::with_capacity(STREAM),
            best: Vec::with_capacity(STREAM),
            weights: [Weights::NONE; STREAM],
            lines: [SlabLine::NONE; STREAM],
            children: [0; STACK + WIDTH],
            waiting: [0; STACK + WIDTH],
            single: Stack::new(),
        }
    }

    /// No rays.
    #[inline(always)]
    pub(super) fn clear(&mut self) {
        self.rays.clear();
        self.best.clear();
    }

    /// One more ray.
    #[inline(always)]
    pub(super) fn push(&mut self, ray: Prepared<M>) {
        self.lines[self.rays.len() % STREAM] = SlabLine {
            rcp: ray.slabs.rcp.to_array(),
            t_min: ray.t_min,
            near: ray.slabs.near.to_array(),
            limit: ray.t_max * CULL_INFLATION,
            far: ray.slabs.far.to_array(),
            octant: ray.octant,
        };
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
                active &= !self.alone::<S, ANY>(simd, data, current, rays);
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
        self.lines[i].limit = best.t * CULL_INFLATION;
        if ANY && best.is_hit() { ray } else { 0 }
    }

    /// Pushes the children that some of the rays enter, the farthest first. The new top of the stack.
    #[inline(always)]
    fn node<S: Simd>(&mut self, simd: S, data: &Hierarchy, node: Child, rays: u32, top: usize) -> usize {
        let node = &data.nodes[node.index()];
        let mut entering = simd.no_marks();
        let mut rest = rays;
        while rest != 0 {
            let i = rest.trailing_zeros();
            rest &= rest - 1;
            let line = &self.lines[i as usize % STREAM];
            let splat3 = |v: &[f32; 3]| v.map(|x| simd.splat8(x));
            let slabs = Slabs {
                rcp: splat3(&line.rcp),
                near: splat3(&line.near),
                far: splat3(if M::WATERTIGHT { &line.far } else { &line.near }),
                t_min: simd.splat8(line.t_min),
            };
            let octant = line.octant as usize;
            let sign = [octant & 1, octant >> 1 & 1, octant >> 2 & 1];
            let (_, enters) = slabs.enter(simd, sign, node, line.limit);
            entering = simd.mark(entering, enters, 1 << i);
        }

        let octant = self.lines[rays.trailing_zeros() as usize % STREAM].octant;
        let packed = simd.pack_marked(&node.order, 3 * octant, &Child::bits(&node.children), entering);
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
            self.lines[i].limit = best.t * CULL_INFLATION;
            if ANY {
                hit |= u32::from(best.is_hit()) << i;
            }
        }
        hit
    }
}
