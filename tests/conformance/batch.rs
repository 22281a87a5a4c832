//! How rays are grouped changes nothing.

use crate::scenes::{Rng, camera_rays, random_rays, random_spheres, soup};
use crate::subject::{HINTS, Subject, any, closest};
use gloss::core::{Ray, Skip};
use gloss::geometry::Shape;

fn shapes() -> [Shape; 2] {
    let mut rng = Rng::new(51);
    [soup(&mut rng, 40), random_spheres(&mut rng, 5)]
}

/// Coherent rays, incoherent ones, and some with rules or inactive.
fn rays(count: usize) -> Vec<Ray> {
    let mut rng = Rng::new(52);
    let mut rays = camera_rays(count / 2);
    rays.extend(random_rays(&mut rng, count - count / 2));
    for ray in &mut rays {
        match rng.below(10) {
            0 => *ray = Ray::inactive(),
            1 => ray.skip = Skip::Geometry(0),
            2 => ray.skip = Skip::Primitive { geom: 1, prim: rng.below(5) as u32 },
            _ => {}
        }
    }
    rays
}

pub(crate) fn any_length_answers_alike(subject: &Subject) {
    let accel = subject.build(&shapes());
    let rays = rays(1000);
    for hint in HINTS {
        let one_by_one: Vec<_> = rays.chunks(1).map(|ray| closest(&*accel, ray, hint)[0]).collect();
        let any_one_by_one: Vec<_> = rays.chunks(1).map(|ray| any(&*accel, ray, hint)[0]).collect();
        // Every length up to a few packets, then steps that are no multiple of any packet's width.
        for length in (0..130).chain((130..1000).step_by(29)).chain([1000]) {
            let start = rays.len() - length;
            assert_eq!(closest(&*accel, &rays[start..], hint), one_by_one[start..], "{length} {hint:?}");
            assert_eq!(any(&*accel, &rays[start..], hint), any_one_by_one[start..], "{length} {hint:?}");
        }
    }
}

pub(crate) fn order_changes_nothing(subject: &Subject) {
    let accel = subject.build(&shapes());
    let rays = rays(1000);
    let mut rng = Rng::new(53);
    let mut order: Vec<_> = (0..rays.len()).collect();
    for i in (1..order.len()).rev() {
        order.swap(i, rng.below(i + 1));
    }
    let shuffled: Vec<_> = order.iter().map(|&i| rays[i]).collect();
    for hint in HINTS {
        let (hits, mixed) = (closest(&*accel, &rays, hint), closest(&*accel, &shuffled, hint));
        let (occluded, any_mixed) = (any(&*accel, &rays, hint), any(&*accel, &shuffled, hint));
        for (place, &i) in order.iter().enumerate() {
            assert_eq!((hits[i], occluded[i]), (mixed[place], any_mixed[place]), "ray {i} {hint:?}");
        }
    }
}

pub(crate) fn a_wrong_hint_changes_nothing(subject: &Subject) {
    let accel = subject.build(&shapes());
    let rays = rays(1000);
    assert_eq!(closest(&*accel, &rays, HINTS[0]), closest(&*accel, &rays, HINTS[1]));
    assert_eq!(any(&*accel, &rays, HINTS[0]), any(&*accel, &rays, HINTS[1]));
}

pub(crate) fn occluded_is_whether_anything_is_hit(subject: &Subject) {
    let accel = subject.build(&shapes());
    let rays = rays(1000);
    for hint in HINTS {
        let hit: Vec<_> = closest(&*accel, &rays, hint).iter().map(Option::is_some).collect();
        assert_eq!(any(&*accel, &rays, hint), hit, "{hint:?}");
        assert!(hit.contains(&true) && hit.contains(&false), "the rays tell nothing");
    }
}

pub(crate) fn threads_share_a_scene(subject: &Subject) {
    let accel = subject.build(&shapes());
    let rays = rays(1000);
    let expected = closest(&*accel, &rays, HINTS[0]);
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                for _ in 0..5 {
                    assert_eq!(closest(&*accel, &rays, HINTS[0]), expected);
                }
            });
        }
    });
}
