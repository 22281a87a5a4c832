//! Nothing to hit, and rays that hit nothing.

use crate::scenes::{camera_rays, mesh, right_triangle, spheres, triangle};
use crate::subject::{HINTS, Subject, any, closest};
use gloss::core::{Ray, Vec3};

pub(crate) fn a_scene_of_nothing_is_never_hit(subject: &Subject) {
    let empties = [mesh(vec![], vec![]), spheres(&[]), mesh(vec![Vec3::ZERO], vec![])];
    for shapes in [&empties[..0], &empties[..1], &empties[1..2], &empties[..]] {
        let accel = subject.build(shapes);
        let rays = camera_rays(50);
        for hint in HINTS {
            assert_eq!(closest(&*accel, &rays, hint), vec![None; 50]);
            assert_eq!(any(&*accel, &rays, hint), vec![false; 50]);
        }
    }
}

pub(crate) fn shapes_without_primitives_keep_their_ids(subject: &Subject) {
    let shapes = [
        mesh(vec![], vec![]),
        triangle(right_triangle(0.0)),
        spheres(&[]),
        spheres(&[(Vec3::new(0.25, 0.25, -3.0), 1.0)]),
    ];
    let accel = subject.build(&shapes);
    let rays = [(5.0, -1.0), (-9.0, 1.0)].map(|(z, dir)| Ray::new(Vec3::new(0.2, 0.3, z), dir * Vec3::Z));
    for hint in HINTS {
        let ids: Vec<_> = closest(&*accel, &rays, hint).iter().map(|hit| hit.unwrap().geom_id).collect();
        assert_eq!(ids, [1, 3]);
    }
}

/// Towards the right triangle at height 0.
fn active() -> Ray {
    Ray::new(Vec3::new(0.25, 0.25, 1.0), -Vec3::Z)
}

/// One ray for each way to be inactive.
fn inactive() -> Vec<Ray> {
    let mut rays = vec![
        Ray::inactive(),
        Ray { dir: Vec3::ZERO, ..active() },
        Ray { t_min: 2.0, t_max: 1.0, ..active() },
        Ray { t_max: -1.0, ..active() },
        Ray { t_max: f32::NEG_INFINITY, ..active() },
        Ray { t_min: f32::NAN, ..active() },
        Ray { t_max: f32::NAN, ..active() },
    ];
    for axis in 0..3 {
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let spoilt = |mut p: Vec3| {
                p[axis] = bad;
                p
            };
            rays.push(Ray { origin: spoilt(active().origin), ..active() });
            rays.push(Ray { dir: spoilt(active().dir), ..active() });
        }
    }
    assert!(rays.iter().all(|ray| !ray.is_active()));
    rays
}

pub(crate) fn inactive_rays_hit_nothing(subject: &Subject) {
    let around = spheres(&[(Vec3::ZERO, 10.0)]);
    let accel = subject.build(&[triangle(right_triangle(0.0)), around]);
    let rays = inactive();
    for hint in HINTS {
        assert!(closest(&*accel, &rays, hint).iter().all(Option::is_none));
        assert!(any(&*accel, &rays, hint).iter().all(|occluded| !occluded));
        assert!(rays.chunks(1).all(|ray| closest(&*accel, ray, hint)[0].is_none()));
        assert!(rays.chunks(1).all(|ray| !any(&*accel, ray, hint)[0]));
    }
}

pub(crate) fn inactive_rays_do_not_disturb_their_neighbours(subject: &Subject) {
    let accel = subject.build(&[triangle(right_triangle(0.0))]);
    for period in [2, 3, 5] {
        let dead = inactive();
        let rays: Vec<_> =
            (0..100).map(|i| if i % period == 0 { dead[i % dead.len()] } else { active() }).collect();
        for hint in HINTS {
            let hits = closest(&*accel, &rays, hint);
            let occluded = any(&*accel, &rays, hint);
            for (i, ray) in rays.iter().enumerate() {
                assert_eq!(hits[i].map(|hit| hit.prim_id), ray.is_active().then_some(0), "ray {i}");
                assert_eq!(occluded[i], ray.is_active(), "ray {i}");
            }
        }
    }
}
