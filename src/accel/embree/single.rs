//! One ray a call.

use super::ffi;
use super::query::Query;
use super::scene::Scene;
use crate::core::{Hit, Ray};

/// The ray in Embree's struct; its end is not after its start where it is inactive.
#[inline]
pub(super) fn rtc_ray(ray: &Ray) -> ffi::RTCRay {
    if !ray.is_active() {
        return ffi::RTCRay {
            tnear: f32::INFINITY,
            tfar: f32::NEG_INFINITY,
            dir_z: 1.0,
            ..Default::default()
        };
    }
    ffi::RTCRay {
        org_x: ray.origin.x,
        org_y: ray.origin.y,
        org_z: ray.origin.z,
        tnear: ray.t_min,
        dir_x: ray.dir.x,
        dir_y: ray.dir.y,
        dir_z: ray.dir.z,
        time: 0.0,
        tfar: ray.t_max,
        mask: u32::MAX,
        id: 0,
        flags: 0,
    }
}

/// The ray in Embree's struct, with nothing hit.
#[inline]
pub(super) fn rtc_ray_hit(ray: &Ray) -> ffi::RTCRayHit {
    let ids = ffi::INVALID_ID;
    ffi::RTCRayHit {
        ray: rtc_ray(ray),
        hit: ffi::RTCHit {
            geomID: ids,
            primID: ids,
            instID: [ids; ffi::INSTANCE_LEVELS],
            ..Default::default()
        },
    }
}

/// What Embree wrote.
#[inline]
pub(super) fn hit(answer: &ffi::RTCRayHit) -> Option<Hit> {
    let ffi::RTCRayHit { ray, hit } = answer;
    (hit.geomID != ffi::INVALID_ID).then_some(Hit {
        t: ray.tfar,
        u: hit.u,
        v: hit.v,
        geom_id: hit.geomID,
        prim_id: hit.primID,
    })
}

/// Closest hits, ray by ray.
pub(super) fn intersect(scene: &Scene, query: &mut Query<'_>, rays: &[Ray], hits: &mut [Option<Hit>]) {
    for (ray, hit) in rays.iter().zip(hits) {
        *hit = intersect_one(scene, query, ray);
    }
}

/// Any hit, ray by ray.
pub(super) fn occluded(scene: &Scene, query: &mut Query<'_>, rays: &[Ray], occluded: &mut [bool]) {
    for (ray, occluded) in rays.iter().zip(occluded) {
        *occluded = occluded_one(scene, query, ray);
    }
}

/// Closest hit of one ray.
#[inline]
pub(super) fn intersect_one(scene: &Scene, query: &mut Query<'_>, ray: &Ray) -> Option<Hit> {
    if !ray.is_active() {
        return None;
    }
    let mut answer = rtc_ray_hit(ray);
    scene.intersect1(query, &mut answer);
    hit(&answer)
}

/// Any hit of one ray.
#[inline]
pub(super) fn occluded_one(scene: &Scene, query: &mut Query<'_>, ray: &Ray) -> bool {
    if !ray.is_active() {
        return false;
    }
    let mut answer = rtc_ray(ray);
    scene.occluded1(query, &mut answer);
    answer.tfar == f32::NEG_INFINITY
}
