//! Analytic spheres.

use crate::oracle::assert_agrees;
use crate::scenes::{Rng, spheres};
use crate::subject::{HINTS, Subject, any, closest};
use gloss::core::{Ray, Vec3};

pub(crate) fn spheres_are_hit_from_outside_and_inside(subject: &Subject) {
    let center = Vec3::new(0.5, -0.25, 0.125);
    let shapes = [spheres(&[(center, 0.75)])];
    let accel = subject.build(&shapes);
    let mut rng = Rng::new(31);
    let outside = (0..200).map(|_| {
        let origin = center + 3.0 * rng.direction();
        Ray::new(origin, (center + 0.5 * rng.point() - origin).normalize())
    });
    let outside: Vec<_> = outside.collect();
    let inside: Vec<_> = (0..200).map(|_| Ray::new(center + 0.4 * rng.point(), rng.direction())).collect();
    assert_agrees(&*accel, &shapes, &outside);
    assert_agrees(&*accel, &shapes, &inside);
    // Past the near surface, the far one; past both, nothing.
    let straight = Ray::new(center + 2.0 * Vec3::X, -Vec3::X);
    let rays = [0.0, 1.5, 3.0].map(|t_min| Ray { t_min, ..straight });
    for hint in HINTS {
        let t: Vec<_> = closest(&*accel, &rays, hint).iter().map(|hit| hit.map(|h| h.t)).collect();
        assert!((t[0].unwrap() - 1.25).abs() < 1e-5 && (t[1].unwrap() - 2.75).abs() < 1e-5, "{t:?}");
        assert_eq!(t[2], None);
    }
}

pub(crate) fn tangents_are_the_border_of_hits(subject: &Subject) {
    let radius = 0.5;
    let shapes = [spheres(&[(Vec3::ZERO, radius)])];
    let accel = subject.build(&shapes);
    let mut rng = Rng::new(32);
    for (factor, hit) in [(1.0 - 1e-4, true), (1.0 + 1e-4, false)] {
        let rays: Vec<_> = (0..100)
            .map(|_| {
                let (dir, other) = (rng.direction(), rng.direction());
                let aside = dir.cross(other).normalize();
                Ray::new(factor * radius * aside - 2.0 * dir, dir)
            })
            .collect();
        for hint in HINTS {
            assert!(closest(&*accel, &rays, hint).iter().all(|h| h.is_some() == hit), "{factor}");
            assert!(any(&*accel, &rays, hint).iter().all(|&o| o == hit), "{factor}");
        }
        assert_agrees(&*accel, &shapes, &rays);
    }
}
