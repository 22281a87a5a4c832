//! No ray slips through an edge that two triangles share, or a vertex.

use crate::scenes::{Rng, dented_ball, mesh};
use crate::subject::{HINTS, Subject, any, closest};
use gloss::core::{Ray, Vec3};

/// Rays whose miss is a leak.
fn assert_no_leak(subject: &Subject, levels: u32, rays: &[Ray]) {
    let (points, triangles) = dented_ball(levels);
    let accel = subject.build(&[mesh(points, triangles)]);
    for hint in HINTS {
        for batch in rays.chunks(4096) {
            let missed = closest(&*accel, batch, hint).iter().filter(|hit| hit.is_none()).count();
            let unoccluded = any(&*accel, batch, hint).iter().filter(|occluded| !*occluded).count();
            assert_eq!((missed, unoccluded), (0, 0), "{hint:?}");
        }
    }
}

pub(crate) fn no_ray_leaves_a_closed_mesh(subject: &Subject) {
    let mut rng = Rng::new(3);
    let rays: Vec<_> = (0..subject.rays / 2).map(|_| Ray::new(0.3 * rng.point(), rng.direction())).collect();
    assert_no_leak(subject, if rays.len() > 10_000 { 4 } else { 1 }, &rays);
}

pub(crate) fn rays_at_vertices_and_edges_hit(subject: &Subject) {
    let levels = 2;
    let (points, triangles) = dented_ball(levels);
    let mut rng = Rng::new(4);
    let corner = |v: u32| points[v as usize];
    let targets = triangles.iter().flat_map(|&[a, b, c]| {
        let s = rng.unit();
        [corner(a), corner(a).midpoint(corner(b)), corner(b).lerp(corner(c), s)]
    });
    let targets: Vec<Vec3> = targets.collect();
    let origins = [Vec3::ZERO, Vec3::new(0.1, -0.2, 0.15)];
    let rays: Vec<_> =
        origins.iter().flat_map(|&o| targets.iter().map(move |&p| Ray::new(o, p - o))).collect();
    assert_no_leak(subject, levels, &rays);
}
