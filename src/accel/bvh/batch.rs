//! How a slice of rays is grouped: the kernels that the instruction set's dispatch runs.
//!
//! Coherent closest hits go in packets where eight neighbours are close enough, and singly otherwise. Incoherent
//! batches go in streams, each of one octant, that keep the rays' order within it.

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
use core::ops::Range;

/// Batches shorter than this go singly.
const LEAST_BATCH: usize = 64;

/// A packet that needs more leaves than this met triangles smaller than the gaps between its rays, and is slower than
/// they are singly.
const MOST_LEAVES: usize = 12;

/// Streams in place of packets after such a packet.
const REST: usize = 8;

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

    /// In streams where the rays are not coherent after all, and for a while after a packet that was too slow.
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let (data, hits) = (self.data, self.hits);
        let mut stack = Stack::new();
        let mut streams = Streaming::<M>::new(data, self.rays);
        let mut rest = 0;
        for start in (0..self.rays.len()).step_by(STREAM) {
            let end = self.rays.len().min(start + STREAM);
            let mut done = start;
            while rest == 0
                && let Some(Ok(rays)) = self.rays[done..end].get(..PACKET).map(<&[Ray; PACKET]>::try_from)
                && let Some(packet) = Packet::<M, _>::new(simd, data, rays)
            {
                let hits = &mut hits[done..done + PACKET];
                let leaves = packet::traverse(simd, data, rays, &packet, &mut stack, hits);
                rest = if leaves > MOST_LEAVES { REST } else { 0 };
                done += PACKET;
            }
            rest = usize::saturating_sub(rest, 1);
            if done < end {
                streams.all::<S, false>(simd, done..end, |i, ray, best, weights| {
                    hits[i] = best.hit(data, ray, weights);
                });
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
        let (hits, data) = (self.hits, self.data);
        let mut streams = Streaming::<M>::new(data, self.rays);
        streams.all::<S, false>(simd, 0..self.rays.len(), |i, ray, best, weights| {
            hits[i] = best.hit(data, ray, weights);
        });
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
        let occluded = self.occluded;
        let mut streams = Streaming::<M>::new(self.data, self.rays);
        streams.all::<S, true>(simd, 0..self.rays.len(), |i, _, best, _| occluded[i] = best.is_hit());
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

/// Rays that wait for enough others of their octant to go with: those that go alike stay in their order.
struct Streaming<'a, M: Mode> {
    data: &'a Hierarchy,
    rays: &'a [Ray],
    waiting: [[u32; STREAM]; 8],
    counts: [usize; 8],
    stream: Stream<M>,
}

impl<'a, M: Mode> Streaming<'a, M> {
    fn new(data: &'a Hierarchy, rays: &'a [Ray]) -> Self {
        Self { data, rays, waiting: [[0; STREAM]; 8], counts: [0; 8], stream: Stream::new() }
    }

    /// Answers all rays of a range.
    #[inline(always)]
    fn all<S: Simd, const ANY: bool>(
        &mut self,
        simd: S,
        range: Range<usize>,
        mut answer: impl FnMut(usize, &Prepared<M>, &Best, &Weights),
    ) {
        // One call of `trace`, so that it is compiled once: the octants that are left over come after the last ray.
        let end = range.end + 8;
        for i in range.start..end {
            let octant = if i < range.end {
                // Rays that want any hit go with their neighbours.
                let octant = if ANY { 0 } else { octant(&self.rays[i]) };
                let count = &mut self.counts[octant];
                self.waiting[octant][*count % STREAM] = i as u32;
                *count += 1;
                if *count < STREAM {
                    continue;
                }
                octant
            } else {
                i - range.end
            };
            self.trace::<S, ANY>(simd, octant, &mut answer);
        }
    }

    /// Answers the waiting rays of an octant.
    #[inline(always)]
    fn trace<S: Simd, const ANY: bool>(
        &mut self,
        simd: S,
        octant: usize,
        mut answer: impl FnMut(usize, &Prepared<M>, &Best, &Weights),
    ) {
        let group = &self.waiting[octant][..self.counts[octant]];
        self.stream.start(octant);
        for &i in group {
            self.stream.push(Prepared::new(&self.rays[i as usize]));
        }
        self.stream.traverse::<S, ANY>(simd, self.data);
        for (lane, &i) in group.iter().enumerate() {
            let stream = &self.stream;
            answer(i as usize, &stream.rays[lane], &stream.best[lane], &stream.weights[lane]);
        }
        self.counts[octant] = 0;
    }
}

/// The octant of a ray's direction; that of an inactive ray means nothing, since it enters no box.
#[inline(always)]
fn octant(ray: &Ray) -> usize {
    let bit = |x: f32| (x.to_bits() >> 31) as usize;
    bit(ray.dir.x) | bit(ray.dir.y) << 1 | bit(ray.dir.z) << 2
}
