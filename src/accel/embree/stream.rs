//! Embree 3's streams: many rays a call.

use super::CHUNK;
use super::ffi;
use super::packet::Packet;
use super::query::Query;
use super::scene::Scene;
use super::single::{hit, rtc_ray, rtc_ray_hit};
use crate::core::{Hit, Ray};
use std::mem::MaybeUninit;

/// At most [`CHUNK`] closest hits, by a stream of packets of 8: the fastest call for coherent rays.
pub(super) fn intersect_coherent(
    scene: &Scene,
    query: &mut Query<'_>,
    rays: &[Ray],
    hits: &mut [Option<Hit>],
) {
    let mut buffer = [const { MaybeUninit::uninit() }; CHUNK / 8];
    let packets = fill(&mut buffer, rays.chunks(8).map(|rays| Packet::load(rays).0));
    scene.intersect_packet_stream(query, packets);
    for (packet, hits) in packets.iter().zip(hits.chunks_mut(8)) {
        packet.store(hits);
    }
}

/// At most [`CHUNK`] closest hits, by a stream of single rays.
pub(super) fn intersect(scene: &Scene, query: &mut Query<'_>, rays: &[Ray], hits: &mut [Option<Hit>]) {
    let mut buffer = [const { MaybeUninit::uninit() }; CHUNK];
    let answers = fill(&mut buffer, rays.iter().map(rtc_ray_hit));
    scene.intersect_stream(query, answers);
    for (answer, hit_of_ray) in answers.iter().zip(hits) {
        *hit_of_ray = hit(answer);
    }
}

/// Any hit of at most [`CHUNK`] rays, by a stream of single rays, which Embree bins by octant.
pub(super) fn occluded(scene: &Scene, query: &mut Query<'_>, rays: &[Ray], occluded: &mut [bool]) {
    let mut buffer = [const { MaybeUninit::<ffi::RTCRay>::uninit() }; CHUNK];
    let answers = fill(&mut buffer, rays.iter().map(rtc_ray));
    scene.occluded_stream(query, answers);
    for ((answer, occluded), ray) in answers.iter().zip(occluded).zip(rays) {
        *occluded = answer.tfar == f32::NEG_INFINITY && ray.is_active();
    }
}

/// Writes the values, as many as fit, and gives the part of the buffer that holds them.
fn fill<T: Copy>(buffer: &mut [MaybeUninit<T>], values: impl Iterator<Item = T>) -> &mut [T] {
    let mut count = 0;
    for (slot, value) in buffer.iter_mut().zip(values) {
        slot.write(value);
        count += 1;
    }
    // SAFETY: the first `count` values are written, and `MaybeUninit` has the layout of its value.
    unsafe { std::slice::from_raw_parts_mut(buffer.as_mut_ptr().cast(), count) }
}
