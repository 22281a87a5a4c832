//! Rays side by side, as Embree's packets lay them out, and single rays in its struct.

use super::ffi;
use super::query::{PacketCalls, Query};
use super::scene::Scene;
use crate::core::{Hit, Ray};
use std::mem::offset_of;

/// Rows of a packet's hit beyond the seven that every version has: instance ids, which grew in Embree 4.3.
const INSTANCE_ROWS: usize = size_of::<ffi::RTCHit8>() / size_of::<[u32; 8]>() - 7;

/// `RTCRayHit4`, `8` or `16`.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct Packet<const N: usize> {
    rays: Rays<N>,
    hits: Hits<N>,
}

/// `RTCRay4`, `8` or `16`.
#[derive(Clone, Copy)]
#[repr(C)]
struct Rays<const N: usize> {
    origin: [[f32; N]; 3],
    t_near: [f32; N],
    dir: [[f32; N]; 3],
    time: [f32; N],
    t_far: [f32; N],
    mask: [u32; N],
    id: [u32; N],
    flags: [u32; N],
}

/// `RTCHit4`, `8` or `16`.
#[derive(Clone, Copy)]
#[repr(C)]
struct Hits<const N: usize> {
    normal: [[f32; N]; 3],
    u: [f32; N],
    v: [f32; N],
    prim_id: [u32; N],
    geom_id: [u32; N],
    instance: [[u32; N]; INSTANCE_ROWS],
}

/// Which rays of a packet are to be answered: -1 for yes, 0 for no.
#[repr(C, align(64))]
pub(super) struct Mask<const N: usize>([i32; N]);

impl<const N: usize> Mask<N> {
    pub(super) fn as_ptr(&self) -> *const i32 {
        self.0.as_ptr()
    }
}

impl<const N: usize> Packet<N> {
    /// At most `N` rays, filled up with inactive ones.
    #[inline]
    pub(super) fn load(rays: &[Ray]) -> (Self, Mask<N>) {
        let mut packet = Self::INACTIVE;
        let mut mask = Mask([0; N]);
        for (lane, ray) in rays.iter().take(N).enumerate().filter(|(_, ray)| ray.is_active()) {
            for axis in 0..3 {
                packet.rays.origin[axis][lane] = ray.origin[axis];
                packet.rays.dir[axis][lane] = ray.dir[axis];
            }
            packet.rays.t_near[lane] = ray.t_min;
            packet.rays.t_far[lane] = ray.t_max;
            mask.0[lane] = -1;
        }
        (packet, mask)
    }

    /// Rays that hit nothing, with nothing hit.
    const INACTIVE: Self = Self {
        rays: Rays {
            origin: [[0.0; N]; 3],
            t_near: [f32::INFINITY; N],
            dir: [[0.0; N], [0.0; N], [1.0; N]],
            time: [0.0; N],
            t_far: [f32::NEG_INFINITY; N],
            mask: [u32::MAX; N],
            id: [0; N],
            flags: [0; N],
        },
        hits: Hits {
            normal: [[0.0; N]; 3],
            u: [0.0; N],
            v: [0.0; N],
            prim_id: [ffi::INVALID_ID; N],
            geom_id: [ffi::INVALID_ID; N],
            instance: [[ffi::INVALID_ID; N]; INSTANCE_ROWS],
        },
    };

    /// The closest hits that Embree wrote.
    #[inline]
    pub(super) fn store(&self, hits: &mut [Option<Hit>]) {
        for (lane, hit) in hits.iter_mut().take(N).enumerate() {
            let geom_id = self.hits.geom_id[lane];
            *hit = (geom_id != ffi::INVALID_ID).then(|| Hit {
                t: self.rays.t_far[lane],
                u: self.hits.u[lane],
                v: self.hits.v[lane],
                geom_id,
                prim_id: self.hits.prim_id[lane],
            });
        }
    }

    /// Embree marks an occluded ray by an end at minus infinity, which inactive rays have from the start.
    #[inline]
    fn store_occluded(&self, mask: &Mask<N>, occluded: &mut [bool]) {
        for (lane, occluded) in occluded.iter_mut().take(N).enumerate() {
            *occluded = mask.0[lane] != 0 && self.rays.t_far[lane] == f32::NEG_INFINITY;
        }
    }
}

/// Closest hits by packets of `N`.
pub(super) fn intersect<const N: usize>(
    scene: &Scene,
    query: &mut Query<'_>,
    rays: &[Ray],
    hits: &mut [Option<Hit>],
) where
    Scene: PacketCalls<N>,
{
    for (rays, hits) in rays.chunks(N).zip(hits.chunks_mut(N)) {
        let (mut packet, mask) = Packet::load(rays);
        scene.intersect_packet(query, &mask, &mut packet);
        packet.store(hits);
    }
}

/// Any hit by packets of `N`.
pub(super) fn occluded<const N: usize>(
    scene: &Scene,
    query: &mut Query<'_>,
    rays: &[Ray],
    occluded: &mut [bool],
) where
    Scene: PacketCalls<N>,
{
    for (rays, occluded) in rays.chunks(N).zip(occluded.chunks_mut(N)) {
        let (mut packet, mask) = Packet::load(rays);
        scene.occluded_packet(query, &mask, &mut packet);
        packet.store_occluded(&mask, occluded);
    }
}

/// Holds our generic struct against the header's struct of one width.
macro_rules! assert_layout {
    ($width:literal, $ray:ident, $hit:ident, $ray_hit:ident) => {
        assert!(align_of::<Packet<$width>>() >= align_of::<ffi::$ray_hit>());
        assert!(size_of::<Packet<$width>>() >= size_of::<ffi::$ray_hit>());
        assert!(offset_of!(Packet<$width>, hits) == offset_of!(ffi::$ray_hit, hit));
        assert!(offset_of!(Rays<$width>, t_near) == offset_of!(ffi::$ray, tnear));
        assert!(offset_of!(Rays<$width>, dir) == offset_of!(ffi::$ray, dir_x));
        assert!(offset_of!(Rays<$width>, t_far) == offset_of!(ffi::$ray, tfar));
        assert!(offset_of!(Rays<$width>, flags) == offset_of!(ffi::$ray, flags));
        assert!(offset_of!(Hits<$width>, u) == offset_of!(ffi::$hit, u));
        assert!(offset_of!(Hits<$width>, prim_id) == offset_of!(ffi::$hit, primID));
        assert!(offset_of!(Hits<$width>, geom_id) == offset_of!(ffi::$hit, geomID));
        assert!(offset_of!(Hits<$width>, instance) == offset_of!(ffi::$hit, instID));
        assert!(size_of::<Rays<$width>>() == size_of::<ffi::$ray>());
        assert!(size_of::<Hits<$width>>() == size_of::<ffi::$hit>());
    };
}

const _: () = {
    assert_layout!(4, RTCRay4, RTCHit4, RTCRayHit4);
    assert_layout!(8, RTCRay8, RTCHit8, RTCRayHit8);
    assert_layout!(16, RTCRay16, RTCHit16, RTCRayHit16);
};
