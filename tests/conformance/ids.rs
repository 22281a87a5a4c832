//! Which primitive, and where on it.

use crate::oracle::assert_agrees;
use crate::scenes::{mesh, right_triangle, spheres, triangle};
use crate::subject::{HINTS, Subject, closest};
use gloss::core::{Ray, Vec3};

pub(crate) fn hits_name_the_triangle_and_its_point(subject: &Subject) {
    // A strip of triangles in a row, in three meshes and a sphere, each hit at known barycentrics.
    let strip = |z: f32| {
        let at = |i: u32| Vec3::new(2.0 * i as f32, 0.0, z);
        let positions = (0..9).flat_map(|i| right_triangle(0.0).map(|p| p + at(i))).collect();
        mesh(positions, (0..9).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
    };
    let ball = spheres(&[(Vec3::new(50.0, 0.0, 0.0), 1.0), (Vec3::new(60.0, 0.0, 0.0), 1.0)]);
    let shapes = [strip(0.0), ball, strip(-100.0), strip(100.0)];
    let accel = subject.build(&shapes);
    for (geom_id, z) in [(0, 0.0), (2, -100.0), (3, 100.0)] {
        let (u, v) = (0.25, 0.5);
        let rays: Vec<_> =
            (0..9).map(|i| Ray::new(Vec3::new(2.0 * i as f32 + u, v, z + 1.0), -Vec3::Z)).collect();
        for hint in HINTS {
            for (prim_id, hit) in (0..).zip(closest(&*accel, &rays, hint)) {
                let hit = hit.unwrap();
                assert_eq!((hit.geom_id, hit.prim_id), (geom_id, prim_id));
                assert!((hit.t - 1.0).abs() < 1e-6 && (hit.u - u).abs() < 1e-5 && (hit.v - v).abs() < 1e-5);
            }
        }
    }
    let rays = [50.0, 60.0].map(|x| Ray::new(Vec3::new(x, 0.1, 5.0), -Vec3::Z));
    for hint in HINTS {
        let ids: Vec<_> = closest(&*accel, &rays, hint).iter().map(|hit| hit.unwrap().prim_id).collect();
        assert_eq!(ids, [0, 1]);
    }
}

pub(crate) fn long_and_short_directions_scale_t(subject: &Subject) {
    let shapes = [triangle(right_triangle(0.0)), spheres(&[(Vec3::new(5.0, 0.0, 0.0), 1.0)])];
    let accel = subject.build(&shapes);
    for length in [1e-6f32, 1e-3, 1.0, 1e3, 1e6] {
        let rays = [0.2, 5.2].map(|x| Ray::new(Vec3::new(x, 0.2, 3.0), -length * Vec3::Z));
        assert_agrees(&*accel, &shapes, &rays);
        let t = closest(&*accel, &rays, HINTS[1])[0].unwrap().t;
        assert!((t * length - 3.0).abs() < 1e-5, "{t} for {length}");
    }
}
