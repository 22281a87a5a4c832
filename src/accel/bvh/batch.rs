//! How a slice of rays is grouped: the kernels that the instruction set's dispatch runs.
//!
//! Coherent closest hits go in packets where eight neighbours are close enough, and singly otherwise. Incoherent
//! batches go in streams, after a stable binning by octant that keeps the order within each.

use super::data::Hierarchy;
use super::mode::Mode;
use super::packet::{self, PACKET, Packet};
use super::ray::{Best, Prepared, Weights};
use super::simd::{Available, Kernel, Simd};
use super::single::{self, Stack};
use super::stream::{STREAM, Stream};
use crate::accel::Coherence;
use crate::core::{Hit, Ray};
use core::marker::PhantomData;

/// Rays that are binned together: enough to fill streams, few enough to stay in the cache.
const BATCH: usize = 4096;

/// Batches shorter than this are not binned.
const LEAST_BATCH: usize = 64;

/// A packet that needs more leaves than this met triangles smaller than the gaps between its rays, and is slower than
/// they are singly.
const MOST_LEAVES: usize = 12;

/// Groups of eight that go singly after such a packet.
const REST: usize = 15;

/// How rays may be grouped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Grouping {
    /// One by one.
    Single,
    /// In packets or streams where they win.
    Groups(Coherence),
}

/// Closest hits of a slice.
pub(super) fn closest_hits<M: Mode>(
    isa: Available,
    data: &Hierarchy,
    grouping: Grouping,
    rays: &[Ray],
    hits: &mut [Option<Hit>],
) {
    match grouping {
        Grouping::Groups(Coherence::Coherent) if isa.wants_batches() => {
            isa.run(Packets { mode: PhantomData::<M>, data, rays, hits });
        }
        Grouping::Groups(Coherence::Incoherent) if isa.wants_batches() && rays.len() >= LEAST_BATCH => {
            isa.run(Streams { mode: PhantomData::<M>, data, rays, hits });
        }
        _ => isa.run(Singles { mode: PhantomData::<M>, data, rays, hits }),
    }
}

/// Any hits of a slice.
pub(super) fn any_hits<M: Mode>(
    isa: Available,
    data: &Hierarchy,
    grouping: Grouping,
    rays: &[Ray],
    occluded: &mut [bool],
) {
    if isa.wants_batches() && grouping != Grouping::Single && rays.len() >= LEAST_BATCH {
        isa.run(AnyStreams { mode: PhantomData::<M>, data, rays, occluded });
    } else {
        isa.run(AnySingles { mode: PhantomData::<M>, data, rays, occluded });
    }
}

// A kernel for each way, since a function that held them all would have registers for none.

struct Singles<'a, M> {
    mode: PhantomData<M>,
    data: &'a Hierarchy,
    rays: &'a [Ray],
    hits: &'a mut [Option<Hit>],
}

impl<M: Mode> Kernel for Singles<'_, M> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let (mut stack, mut weights) = (Stack::new(), Weights::NONE);
        for (ray, hit) in self.rays.iter().zip(self.hits) {
            *hit = closest::<S, M>(simd, self.data, ray, &mut stack, &mut weights);
        }
    }
}

struct Packets<'a, M> {
    mode: PhantomData<M>,
    data: &'a Hierarchy,
    rays: &'a [Ray],
    hits: &'a mut [Option<Hit>],
}

impl<M: Mode> Kernel for Packets<'_, M> {
    type Output = ();

    /// Singly where the rays are not coherent after all.
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let (mut stack, mut weights) = (Stack::new(), Weights::NONE);
        let mut singly = 0;
        for (rays, hits) in self.rays.chunks(PACKET).zip(self.hits.chunks_mut(PACKET)) {
            if singly > 0 {
                singly -= 1;
            } else if let Ok(rays) = <&[Ray; PACKET]>::try_from(rays)
                && let Some(packet) = Packet::<M, _>::new(simd, self.data, rays)
            {
                let leaves = packet::traverse(simd, self.data, rays, &packet, &mut stack, hits);
                singly = if leaves > MOST_LEAVES { REST } else { 0 };
                continue;
            }
            for (ray, hit) in rays.iter().zip(hits) {
                *hit = closest::<S, M>(simd, self.data, ray, &mut stack, &mut weights);
            }
        }
    }
}

struct Streams<'a, M> {
    mode: PhantomData<M>,
    data: &'a Hierarchy,
    rays: &'a [Ray],
    hits: &'a mut [Option<Hit>],
}

impl<M: Mode> Kernel for Streams<'_, M> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let mut stream = Stream::new();
        for (rays, hits) in self.rays.chunks(BATCH).zip(self.hits.chunks_mut(BATCH)) {
            in_streams::<S, M, false>(simd, self.data, rays, &mut stream, |i, ray, best, weights| {
                hits[i] = best.hit(self.data, ray, weights);
            });
        }
    }
}

struct AnySingles<'a, M> {
    mode: PhantomData<M>,
    data: &'a Hierarchy,
    rays: &'a [Ray],
    occluded: &'a mut [bool],
}

impl<M: Mode> Kernel for AnySingles<'_, M> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let (mut stack, mut weights) = (Stack::new(), Weights::NONE);
        for (ray, occluded) in self.rays.iter().zip(self.occluded) {
            let ray = Prepared::<M>::new(ray);
            let (root, none) = (self.data.root, Best::none(ray.t_max));
            let best =
                single::traverse::<S, M, true>(simd, self.data, &ray, &mut stack, root, none, &mut weights);
            *occluded = best.is_hit();
        }
    }
}

struct AnyStreams<'a, M> {
    mode: PhantomData<M>,
    data: &'a Hierarchy,
    rays: &'a [Ray],
    occluded: &'a mut [bool],
}

impl<M: Mode> Kernel for AnyStreams<'_, M> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let mut stream = Stream::new();
        for (rays, occluded) in self.rays.chunks(BATCH).zip(self.occluded.chunks_mut(BATCH)) {
            in_streams::<S, M, true>(simd, self.data, rays, &mut stream, |i, _, best, _| {
                occluded[i] = best.is_hit();
            });
        }
    }
}

/// Closest hit of one ray.
#[inline(always)]
fn closest<S: Simd, M: Mode>(
    simd: S,
    data: &Hierarchy,
    ray: &Ray,
    stack: &mut Stack,
    weights: &mut Weights,
) -> Option<Hit> {
    let ray = Prepared::<M>::new(ray);
    let none = Best::none(ray.t_max);
    let best = single::traverse::<S, M, false>(simd, data, &ray, stack, data.root, none, weights);
    best.hit(data, &ray, weights)
}

/// Up to [`BATCH`] rays in streams of one octant each.
#[inline(always)]
fn in_streams<S: Simd, M: Mode, const ANY: bool>(
    simd: S,
    data: &Hierarchy,
    rays: &[Ray],
    stream: &mut Stream<M>,
    mut answer: impl FnMut(usize, &Prepared<M>, &Best, &Weights),
) {
    let mut order = [0u16; BATCH];
    let starts = bin_by_octant(rays, &mut order);
    for octant in 0..8 {
        for group in order[starts[octant]..starts[octant + 1]].chunks(STREAM) {
            stream.clear();
            for &i in group {
                stream.push(Prepared::new(&rays[i as usize]));
            }
            stream.traverse::<S, ANY>(simd, data);
            for (lane, &i) in group.iter().enumerate() {
                answer(i as usize, &stream.rays[lane], &stream.best[lane], &stream.weights[lane]);
            }
        }
    }
}

/// Indices of the rays by the octant of their direction, in their own order within each, and where each begins.
fn bin_by_octant(rays: &[Ray], order: &mut [u16; BATCH]) -> [usize; 9] {
    let octant = |ray: &Ray| {
        let bit = |x: f32| (x.to_bits() >> 31) as usize;
        bit(ray.dir.x) | bit(ray.dir.y) << 1 | bit(ray.dir.z) << 2
    };
    let mut starts = [0; 9];
    for ray in rays {
        starts[octant(ray) + 1] += 1;
    }
    for i in 0..8 {
        starts[i + 1] += starts[i];
    }
    let mut next = starts;
    for (i, ray) in rays.iter().enumerate() {
        let octant = octant(ray);
        order[next[octant] % BATCH] = i as u16;
        next[octant] += 1;
    }
    starts
}
