//! The one ray-sphere test of every path, in f64, since far or large spheres cancel badly in f32; which spheres need it is
//! told in f32 with room to spare.

use super::data::{BLOCK, Child, Hierarchy, Place, SphereBlock};
use super::mode::Mode;
use super::ray::{Best, Prepared, Weights};
use super::simd::{Lanes, Mask, Simd};
use crate::geometry::Sphere;
use glam::{DVec3, Vec3};

/// First parameter in `[t_min, t_max]` at which the ray meets the sphere's surface.
#[inline(always)]
pub(super) fn first_root([origin, dir]: [Vec3; 2], [t_min, t_max]: [f32; 2], sphere: Sphere) -> Option<f32> {
    let Sphere { center, radius } = sphere;
    let d = dir.as_dvec3();
    let to_center: DVec3 = center.as_dvec3() - origin.as_dvec3();
    let length_squared = d.length_squared();

    // The discriminant from the point of the line that is closest to the centre (Haines et al. 2019, "Precision
    // Improvements for Ray/Sphere Intersection").
    let t_closest = to_center.dot(d) / length_squared;
    let miss = to_center - t_closest * d;
    let discriminant = f64::from(radius) * f64::from(radius) - miss.length_squared();
    if discriminant < 0.0 {
        return None;
    }
    let half_chord = (discriminant / length_squared).sqrt();
    let near = (t_closest - half_chord) as f32;
    let t = if near >= t_min { near } else { (t_closest + half_chord) as f32 };
    (t >= t_min && t <= t_max).then_some(t)
}

/// The lanes whose rays may meet their spheres, one bit each: all that [`first_root`] accepts, and few others.
///
/// With `u = 2^-24`, `m` the way to the centre and `d` the direction, `m m d d - (m d)^2` is right to `20 u m m d d`,
/// which is allowed for one and a half times over; where it is too small or too large for f32, all may meet.
#[inline(always)]
pub(super) fn may_meet<const N: usize, F: Lanes<N>>(
    origin: [F; 3],
    dir: [F; 3],
    center: [F; 3],
    radius: F,
) -> u32 {
    let m = [center[0] - origin[0], center[1] - origin[1], center[2] - origin[2]];
    let (mm, dd, md) = (dot(m, m), dot(dir, dir), dot(m, dir));
    let beside = mm.mul_sub(dd, md * md);
    let room = mm.splat(2e-6).mul_add(mm, radius * radius * mm.splat(1.0 + 1e-5));
    let passes = room.mul_add(dd, mm.splat(f32::MIN_POSITIVE)).le(beside);
    // Empty lanes have no number for a radius.
    radius.le(radius).bits() & !passes.bits()
}

#[inline(always)]
fn dot<const N: usize, F: Lanes<N>>(a: [F; 3], b: [F; 3]) -> F {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]))
}

/// The spheres of a block that a ray may meet: see [`may_meet`].
#[inline(always)]
pub(super) fn may_meet_block<S: Simd>(
    simd: S,
    origin: [S::F4; 3],
    dir: [S::F4; 3],
    block: &SphereBlock,
) -> u32 {
    let [x, y, z] = &block.center;
    may_meet(origin, dir, [simd.load4(x), simd.load4(y), simd.load4(z)], simd.load4(&block.radius))
}

/// The best of `best` and the spheres of a leaf.
#[inline(always)]
pub(super) fn intersect_leaf<S: Simd, M: Mode>(
    simd: S,
    data: &Hierarchy,
    ray: &Prepared<M>,
    leaf: Child,
    mut best: Best,
    weights: &mut Weights,
) -> Best {
    let origin = [simd.splat4(ray.origin.x), simd.splat4(ray.origin.y), simd.splat4(ray.origin.z)];
    let dir = [simd.splat4(ray.dir.x), simd.splat4(ray.dir.y), simd.splat4(ray.dir.z)];
    for index in leaf.blocks() {
        let met = may_meet_block(simd, origin, dir, &data.spheres[index]);
        if met != 0 {
            best = nearest(data, ray, index, met, best, weights);
        }
    }
    best
}

/// The best of `best` and some spheres of a block. Out of line, so that rays that meet no sphere do not prepare for
/// them.
#[inline(never)]
pub(super) fn nearest<M: Mode>(
    data: &Hierarchy,
    ray: &Prepared<M>,
    index: usize,
    mut lanes: u32,
    mut best: Best,
    weights: &mut Weights,
) -> Best {
    while lanes != 0 {
        let lane = lanes.trailing_zeros() as usize % BLOCK;
        lanes &= lanes - 1;
        let (sphere, place) = (data.spheres[index].sphere(lane), Place::sphere(index, lane));
        if let Some(t) = first_root([ray.origin.into(), ray.dir.into()], [ray.t_min, best.t], sphere)
            && best.loses_to(data, ray.skip, t, place)
        {
            best = Best { t, place };
            *weights = Weights::NONE;
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::bvh::simd::Array;
    use crate::core::sampler::hash;

    #[test]
    fn no_sphere_that_is_hit_is_passed_by() {
        let number = |i: u32| hash(i) as f32 / u32::MAX as f32 - 0.5;
        let vector = |i: u32| Vec3::new(number(i), number(i + 1), number(i + 2));
        let power = |i: u32, most: f32| 10f32.powf(2.0 * most * number(i));
        let (mut hits, mut met) = (0, 0);
        for i in (0..200_000u32).map(|i| i * 16) {
            // Rays that graze spheres of all sizes, from near and far.
            let radius = power(i, 6.0);
            let (center, normal) = (power(i + 1, 3.0) * vector(i + 2), vector(i + 5).normalize());
            let side = normal.any_orthonormal_vector();
            let graze = 1.0 + 1e-6 * number(i + 8);
            let dir = power(i + 9, 5.0) * side;
            let origin = center + graze * radius * normal - power(i + 10, 4.0) * radius * side;
            let sphere = Sphere { center, radius };
            let lanes = |v: Vec3| v.to_array().map(|x| Array([x]));
            let may = may_meet(lanes(origin), lanes(dir), lanes(center), Array([radius]));
            let hit = first_root([origin, dir], [0.0, f32::MAX], sphere).is_some();
            assert!(!hit || may == 1, "from {origin} along {dir}: {sphere:?}");
            (hits, met) = (hits + u32::from(hit), met + may);
        }
        assert!(hits > 50_000, "{hits} of {met}");
        let aside = may_meet(
            [0.0; 3].map(|x| Array([x])),
            [0.0, 0.0, 1.0].map(|x| Array([x])),
            [1.0, 0.0, 9.0].map(|x| Array([x])),
            Array([0.99]),
        );
        assert_eq!(aside, 0);
    }
}
