//! `t_min` and `t_max`.

use crate::scenes::{Rng, random_rays, right_triangle, soup, spheres, triangle};
use crate::subject::{HINTS, Subject, any, closest};
use gloss::core::{Ray, Vec3};

/// A surface at t = 2, one of each kind.
fn surfaces() -> [gloss::geometry::Shape; 2] {
    [triangle(right_triangle(1.0)), spheres(&[(Vec3::new(0.25, 0.25, 0.0), 1.0)])]
}

fn towards_surface() -> Ray {
    Ray::new(Vec3::new(0.25, 0.25, 3.0), -Vec3::Z)
}

pub(crate) fn hits_lie_in_the_interval(subject: &Subject) {
    let mut rng = Rng::new(11);
    let shapes = [soup(&mut rng, 300)];
    let accel = subject.build(&shapes);
    let free = random_rays(&mut rng, 500);
    let exact = closest(&*accel, &free, HINTS[1]);
    // Ends at the hit itself and a unit in the last place to each side, where f32 is at its least certain.
    let ends = |t: f32| [t.next_down(), t, t.next_up()];
    let rays: Vec<_> = free
        .iter()
        .zip(&exact)
        .filter_map(|(ray, hit)| hit.map(|hit| (ray, hit.t)))
        .flat_map(|(ray, t)| {
            ends(t).into_iter().flat_map(move |end| [Ray { t_max: end, ..*ray }, Ray { t_min: end, ..*ray }])
        })
        .collect();
    assert!(rays.len() > 1000);
    for hint in HINTS {
        for (ray, hit) in rays.iter().zip(closest(&*accel, &rays, hint)) {
            if let Some(hit) = hit {
                assert!(hit.t >= ray.t_min && hit.t <= ray.t_max, "{ray:?} {hit:?}");
            }
        }
    }
}

pub(crate) fn the_ends_cut_where_they_should(subject: &Subject) {
    // Embree divides by an approximate reciprocal, so that the surface is at 2 give or take some roundings.
    let (before, after) = (2.0 - 8.0 * f32::EPSILON, 2.0 + 8.0 * f32::EPSILON);
    let ray = towards_surface();
    let cases = [
        (Ray { t_max: after, ..ray }, true),
        (Ray { t_max: before, ..ray }, false),
        (Ray { t_min: before, t_max: 2.5, ..ray }, true),
        (Ray { t_min: after, t_max: 2.5, ..ray }, false),
        (Ray { t_min: before, t_max: after, ..ray }, true),
        (Ray { t_min: 0.0, t_max: 0.0, ..ray }, false),
        (Ray { t_min: f32::INFINITY, ..ray }, false),
        (Ray { t_max: f32::MAX, ..ray }, true),
    ];
    for surface in surfaces() {
        let accel = subject.build(&[surface]);
        for hint in HINTS {
            let rays = cases.map(|(ray, _)| ray);
            let expected = cases.map(|(_, hit)| hit);
            let hit: Vec<_> = closest(&*accel, &rays, hint).iter().map(Option::is_some).collect();
            assert_eq!(hit, expected, "{hint:?}");
            assert_eq!(any(&*accel, &rays, hint), expected, "{hint:?}");
        }
    }
}

pub(crate) fn an_end_beyond_the_first_surface_finds_the_second(subject: &Subject) {
    let shapes = [right_triangle(1.0), right_triangle(0.0), right_triangle(-1.0)].map(triangle);
    let accel = subject.build(&shapes);
    let ray = towards_surface();
    let rays = [0.0, 2.5, 3.5, 4.5].map(|t_min| Ray { t_min, ..ray });
    for hint in HINTS {
        let ids: Vec<_> = closest(&*accel, &rays, hint).iter().map(|hit| hit.map(|h| h.geom_id)).collect();
        assert_eq!(ids, [Some(0), Some(1), Some(2), None]);
        assert_eq!(any(&*accel, &rays, hint), [true, true, true, false]);
    }
}
