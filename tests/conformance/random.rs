//! Equality with brute force on scenes without a plan.

use crate::oracle::assert_agrees;
use crate::scenes::{Rng, camera_rays, dented_ball, mesh, random_rays, random_spheres, soup};
use crate::subject::Subject;
use gloss::core::Ray;
use gloss::geometry::Shape;

/// Camera rays, random rays and random segments.
fn assert_agrees_on_many(subject: &Subject, shapes: &[Shape], seed: u64) {
    let mut rng = Rng::new(seed);
    let mut rays = camera_rays(900);
    rays.extend(random_rays(&mut rng, 900));
    let segments = random_rays(&mut rng, 600);
    rays.extend(segments.into_iter().map(|ray| Ray { t_min: rng.unit(), t_max: 1.0 + rng.unit(), ..ray }));
    assert_agrees(&*subject.build(shapes), shapes, &rays);
}

pub(crate) fn random_triangles_agree_with_brute_force(subject: &Subject) {
    assert_agrees_on_many(subject, &[soup(&mut Rng::new(61), 500)], 62);
}

pub(crate) fn random_spheres_agree_with_brute_force(subject: &Subject) {
    assert_agrees_on_many(subject, &[random_spheres(&mut Rng::new(63), 200)], 64);
}

pub(crate) fn mixed_shapes_agree_with_brute_force(subject: &Subject) {
    let mut rng = Rng::new(65);
    let shapes: Vec<_> = (0..10)
        .map(|i| if i % 3 == 0 { random_spheres(&mut rng, 1 + i) } else { soup(&mut rng, 40) })
        .collect();
    assert_agrees_on_many(subject, &shapes, 66);
}

pub(crate) fn a_smooth_mesh_agrees_with_brute_force(subject: &Subject) {
    let (points, triangles) = dented_ball(2);
    assert_agrees_on_many(subject, &[mesh(points, triangles)], 67);
}
