//! How a slice of rays is grouped: the kernels that the instruction set's dispatch runs.
//!
//! Coherent closest hits go in packets where eight neighbours are close enough, and singly otherwise. Incoherent
//! batches are swept, if anything is, and where something else may be hit they go in streams, each of one octant, that keep
//! the rays' order within it.

use super::data::{Child, Hierarchy};
use super::mode::Mode;
use super::occlusion::Occlusion;
use super::packet::{self, PACKET, Packet};
use super::ray::{Best, Prepared, Weights};
use super::simd::{Available, Kernel, Simd};
use super::single::{self, Stack};
use super::small::Small;
use super::stream::{PAUSED, STREAM, Stream, wants_pauses};
use super::sweep::Sweeps;
use crate::accel::Coherence;
use crate::core::{Hit, Ray};
use core::marker::PhantomData;
use core::ops::Range;

/// Batches shorter than this go singly.
const LEAST_BATCH: usize = 64;

/// Batches shorter than this are not swept.
const LEAST_SWEEP: usize = 8;

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
        Grouping::Groups(Coherence::Incoherent)
            if isa.wants_batches()
                && rays.len() >= LEAST_SWEEP
                && let Some(small) = &data.small =>
        {
            let beyond = isa.run(Sweeping { mode: PhantomData::<M>, data, small, rays, hits });
            if let Some(rest) = &small.rest {
                let known = Known::Beyond(&beyond);
                in_streams::<M>(isa, (data, rest.root), (rays, known), hits);
            }
        }
        Grouping::Groups(Coherence::Incoherent) if isa.wants_batches() && rays.len() >= LEAST_BATCH => {
            in_streams::<M>(isa, (data, data.root), (rays, Known::Nothing), hits);
        }
        _ => isa.run(Singles { mode: PhantomData::<M>, data, rays, hits }),
    }
}

/// Closest hits of a slice in streams from a child down, with pauses where they pay.
fn in_streams<M: Mode>(
    isa: Available,
    (data, start): (&Hierarchy, Child),
    (rays, known): (&[Ray], Known),
    hits: &mut [Option<Hit>],
) {
    let mode = PhantomData::<M>;
    if wants_pauses(data) {
        isa.run(Streams::<M, PAUSED> { mode, data, start, rays, known, hits });
    } else {
        isa.run(Streams::<M, 1> { mode, data, start, rays, known, hits });
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
    let in_groups = isa.wants_batches() && grouping != Grouping::Single;
    // Few rays that want any hit have it on what is swept, so that it pays only where the hierarchy would have to be asked
    // about walls all around.
    if let Some(small) = &data.small
        && in_groups
        && rays.len() >= LEAST_SWEEP
        && small.rest.as_ref().is_none_or(|rest| rest.is_walled)
    {
        let beyond = isa.run(AnySweeping { mode: PhantomData::<M>, data, small, rays, occluded });
        if let Some(rest) = &small.rest {
            let known = Known::Beyond(&beyond);
            isa.run(AnyStreams { mode: PhantomData::<M>, data, start: rest.root, rays, known, occluded });
        }
    } else if in_groups && rays.len() >= LEAST_BATCH {
        let (start, known) = (data.root, Known::Nothing);
        isa.run(AnyStreams { mode: PhantomData::<M>, data, start, rays, known, occluded });
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
        // Without pauses, which would make all of this a second kernel, for rays that seldom come here.
        let mut streams = Streaming::<M, 1>::new(data, (self.rays, Known::Nothing));
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
                streams.all(simd, data.root, done..end, hits);
            }
        }
    }
}

struct Streams<'a, M, const AT_ONCE: usize> {
    mode: PhantomData<M>,
    data: &'a Hierarchy,
    /// From where down.
    start: Child,
    rays: &'a [Ray],
    known: Known<'a>,
    hits: &'a mut [Option<Hit>],
}

impl<M: Mode, const AT_ONCE: usize> Kernel for Streams<'_, M, AT_ONCE> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { data, start, rays, known, hits, .. } = self;
        Streaming::<M, AT_ONCE>::new(data, (rays, known)).all(simd, start, 0..rays.len(), hits);
    }
}

/// What is known of rays before they are traversed.
#[derive(Clone, Copy)]
enum Known<'a> {
    /// Nothing of any.
    Nothing,
    /// What they have hit in a sweep, where they may hit something else; the others are not asked.
    Beyond(&'a [Option<Best>]),
}

impl Known<'_> {
    /// Whether a ray is asked.
    #[inline(always)]
    fn asks(self, ray: usize) -> bool {
        match self {
            Self::Nothing => true,
            Self::Beyond(beyond) => beyond[ray].is_some(),
        }
    }

    /// What a ray has hit before, if anything is known.
    #[inline(always)]
    fn best(self, ray: usize) -> Option<Best> {
        match self {
            Self::Nothing => None,
            Self::Beyond(beyond) => beyond[ray],
        }
    }
}

struct Sweeping<'a, M> {
    mode: PhantomData<M>,
    data: &'a Hierarchy,
    small: &'a Small,
    rays: &'a [Ray],
    hits: &'a mut [Option<Hit>],
}

impl<M: Mode> Kernel for Sweeping<'_, M> {
    type Output = Vec<Option<Best>>;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Vec<Option<Best>> {
        let mut sweeps = Sweeps::<M>::new(self.data, self.small, self.rays);
        sweeps.closest(simd, self.hits);
        let (mut stack, mut weights) = (Stack::new(), Weights::NONE);
        for i in sweeps.left {
            self.hits[i] = closest::<S, M>(simd, self.data, &self.rays[i], &mut stack, &mut weights);
        }
        sweeps.beyond
    }
}

struct AnySweeping<'a, M> {
    mode: PhantomData<M>,
    data: &'a Hierarchy,
    small: &'a Small,
    rays: &'a [Ray],
    occluded: &'a mut [bool],
}

impl<M: Mode> Kernel for AnySweeping<'_, M> {
    type Output = Vec<Option<Best>>;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Vec<Option<Best>> {
        let mut sweeps = Sweeps::<M>::new(self.data, self.small, self.rays);
        sweeps.any(simd, self.occluded);
        let (mut stack, mut weights) = (Stack::new(), Weights::NONE);
        for i in sweeps.left {
            self.occluded[i] = any::<S, M>(simd, self.data, &self.rays[i], &mut stack, &mut weights);
        }
        sweeps.beyond
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
            *occluded = any::<S, M>(simd, self.data, ray, &mut stack, &mut weights);
        }
    }
}

struct AnyStreams<'a, M> {
    mode: PhantomData<M>,
    data: &'a Hierarchy,
    /// From where down.
    start: Child,
    rays: &'a [Ray],
    known: Known<'a>,
    occluded: &'a mut [bool],
}

impl<M: Mode> Kernel for AnyStreams<'_, M> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { data, start, rays, known, occluded, .. } = self;
        let (mut streams, mut waiting) = (Occlusion::<M>::new(data, rays), Waiting::new());
        let mut range = 0..rays.len();
        while let Some(octant) = waiting.next((rays, known), &mut range) {
            let group = waiting.groups[octant].take();
            let hits = streams.find(simd, start, octant, group);
            for (lane, &i) in group.iter().enumerate() {
                occluded[i as usize] = hits >> lane & 1 == 1;
            }
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

/// Whether anything is on one ray.
#[inline(always)]
fn any<S: Simd, M: Mode>(
    simd: S,
    data: &Hierarchy,
    ray: &Ray,
    stack: &mut Stack,
    weights: &mut Weights,
) -> bool {
    let ray = Prepared::<M>::new(ray);
    let none = Best::none(ray.t_max);
    single::traverse::<S, M, true>(simd, data, &ray, stack, data.root, none, weights).is_hit()
}

/// Rays that wait for enough others of their octant to go with: those that go alike stay in their order.
struct Waiting {
    groups: [Group; 8],
}

/// Indices of rays of one octant.
#[derive(Clone, Copy)]
struct Group {
    indices: [u32; STREAM],
    count: usize,
}

impl Group {
    const EMPTY: Self = Self { indices: [0; STREAM], count: 0 };

    /// The indices, which are given away.
    #[inline(always)]
    fn take(&mut self) -> &[u32] {
        &self.indices[..core::mem::take(&mut self.count)]
    }
}

impl Waiting {
    fn new() -> Self {
        Self { groups: [Group::EMPTY; 8] }
    }

    /// The octant of the next rays to go. Takes rays from the front of `from`; once that is empty, octants that are left
    /// over.
    #[inline(always)]
    fn next(&mut self, (rays, known): (&[Ray], Known), from: &mut Range<usize>) -> Option<usize> {
        for i in from.by_ref() {
            if !known.asks(i) {
                continue;
            }
            let octant = octant(&rays[i]);
            let group = &mut self.groups[octant];
            group.indices[group.count % STREAM] = i as u32;
            group.count += 1;
            if group.count == STREAM {
                return Some(octant);
            }
        }
        self.groups.iter().position(|group| group.count > 0)
    }
}

/// Closest hits in streams.
struct Streaming<'a, M: Mode, const AT_ONCE: usize> {
    data: &'a Hierarchy,
    rays: &'a [Ray],
    known: Known<'a>,
    waiting: Waiting,
    stream: Stream<M, AT_ONCE>,
}

impl<'a, M: Mode, const AT_ONCE: usize> Streaming<'a, M, AT_ONCE> {
    fn new(data: &'a Hierarchy, (rays, known): (&'a [Ray], Known<'a>)) -> Self {
        Self { data, rays, known, waiting: Waiting::new(), stream: Stream::new() }
    }

    /// Answers all rays of a range that are asked by what is from `start` down.
    #[inline(always)]
    fn all<S: Simd>(&mut self, simd: S, start: Child, mut range: Range<usize>, hits: &mut [Option<Hit>]) {
        let Self { data, rays, known, waiting, stream } = self;
        while let Some(octant) = waiting.next((rays, *known), &mut range) {
            let group = waiting.groups[octant].take();
            stream.start(octant);
            for &i in group {
                let ray = Prepared::new(&rays[i as usize]);
                stream.push(ray, known.best(i as usize).unwrap_or(Best::none(ray.t_max)));
            }
            stream.traverse(simd, data, start);
            for (lane, &i) in group.iter().enumerate() {
                let (i, best) = (i as usize, &stream.best[lane]);
                if known.best(i).is_none_or(|before| before.place != best.place) {
                    hits[i] = best.hit(data, &stream.rays[lane], &stream.weights[lane]);
                }
            }
        }
    }
}

/// The octant of a ray's direction; that of an inactive ray means nothing, since it enters no box.
#[inline(always)]
fn octant(ray: &Ray) -> usize {
    let bit = |x: f32| (x.to_bits() >> 31) as usize;
    bit(ray.dir.x) | bit(ray.dir.y) << 1 | bit(ray.dir.z) << 2
}

#[cfg(test)]
mod tests {
    use super::super::builder;
    use super::super::emit::Primitives;
    use super::super::simd::Isa;
    use super::super::watertight::Watertight;
    use super::*;
    use crate::accel::Quality;
    use crate::core::Skip;
    use crate::geometry::{Shape, TriangleMesh};
    use glam::Vec3;
    use std::sync::Arc;

    #[test]
    fn rays_that_pause_find_what_single_rays_find() {
        let mut state = 7u32;
        let mut unit = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        let mut point = |size: f32| size * Vec3::new(unit() - 0.5, unit() - 0.5, unit() - 0.5);
        let count = 5000;
        let corners = (0..count).flat_map(|_| {
            let corner = point(2.0);
            [corner, corner + point(0.2), corner + point(0.2)]
        });
        let positions: Vec<Vec3> = corners.collect();
        let indices = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let mesh = TriangleMesh::new(positions, indices, vec![], vec![]).expect("a valid mesh");
        let shapes = [Shape::Mesh(Arc::new(mesh))];
        let primitives = Primitives { shapes: &shapes, kept: Watertight::kept };
        let data = builder::build(primitives, Quality::Medium, &[false]);
        let rays: Vec<Ray> = (0..6000)
            .map(|i| {
                // Some that start at one point, so that they share nodes, and some with an end or a rule.
                let origin = if i % 3 == 0 { Vec3::splat(0.3) } else { point(2.0) };
                let t_max = if i % 5 == 0 { 0.7 } else { f32::INFINITY };
                let skip = if i % 7 == 0 { Skip::Primitive { geom: 0, prim: i % count } } else { Skip::None };
                Ray { t_max, skip, ..Ray::new(origin, point(2.0)) }
            })
            .collect();
        for isa in Isa::ALL.into_iter().filter_map(Available::new) {
            let mut expected = vec![None; rays.len()];
            closest_hits::<Watertight>(isa, &data, Grouping::Single, &rays, &mut expected);
            let found = expected.iter().flatten().count();
            assert!(found > rays.len() / 2 && found < rays.len(), "{found} of {}", rays.len());
            let mut hits = [(); 2].map(|()| vec![None; rays.len()]);
            let [with, without] = &mut hits;
            let (mode, data, rays, known) = (PhantomData::<Watertight>, &data, &rays, Known::Nothing);
            isa.run(Streams::<_, PAUSED> { mode, data, start: data.root, rays, known, hits: with });
            isa.run(Streams::<_, 1> { mode, data, start: data.root, rays, known, hits: without });
            assert_eq!(hits, [expected.clone(), expected], "{isa:?}");
        }
    }
}
