//! What a ray must not hit.

use crate::oracle::assert_agrees;
use crate::scenes::{
    Rng, dented_ball, mesh, random_rays, random_spheres, right_triangle, soup, spheres, triangle,
};
use crate::subject::{HINTS, Subject, any, closest};
use gloss::core::{Ray, Skip, Vec3};
use gloss::geometry::Shape;

/// Two triangles of one mesh over one of another, in the way of one ray.
fn stack() -> [Shape; 2] {
    let positions = [right_triangle(2.0), right_triangle(1.0)].concat();
    [mesh(positions, vec![[0, 1, 2], [3, 4, 5]]), triangle(right_triangle(0.0))]
}

fn ray(skip: Skip) -> Ray {
    Ray { skip, ..Ray::new(Vec3::new(0.25, 0.25, 3.0), -Vec3::Z) }
}

/// The id that each rule leaves as the closest, asked alone and together.
fn assert_leaves(subject: &Subject, shapes: &[Shape], cases: &[(Skip, Option<(u32, u32)>)]) {
    let accel = subject.build(shapes);
    let rays: Vec<_> = cases.iter().map(|&(skip, _)| ray(skip)).collect();
    let expected: Vec<_> = cases.iter().map(|&(_, ids)| ids).collect();
    let is_hit: Vec<_> = expected.iter().map(Option::is_some).collect();
    for hint in HINTS {
        for batch in [1, cases.len()] {
            let hits = rays.chunks(batch).flat_map(|rays| closest(&*accel, rays, hint));
            let ids: Vec<_> = hits.map(|hit| hit.map(|h| (h.geom_id, h.prim_id))).collect();
            assert_eq!(ids, expected, "{hint:?}");
            let occluded: Vec<_> = rays.chunks(batch).flat_map(|rays| any(&*accel, rays, hint)).collect();
            assert_eq!(occluded, is_hit, "{hint:?}");
        }
    }
}

pub(crate) fn a_primitive_is_skipped(subject: &Subject) {
    let primitive = |geom, prim| Skip::Primitive { geom, prim };
    let cases = [
        (Skip::None, Some((0, 0))),
        (primitive(0, 0), Some((0, 1))),
        (primitive(0, 1), Some((0, 0))),
        (primitive(1, 0), Some((0, 0))),
        (primitive(7, 0), Some((0, 0))),
        (primitive(0, 7), Some((0, 0))),
    ];
    assert_leaves(subject, &stack(), &cases);
    let lone = [triangle(right_triangle(0.0))];
    assert_leaves(subject, &lone, &[(primitive(0, 0), None), (primitive(0, 1), Some((0, 0)))]);
}

pub(crate) fn a_geometry_is_skipped(subject: &Subject) {
    let cases = [
        (Skip::None, Some((0, 0))),
        (Skip::Geometry(0), Some((1, 0))),
        (Skip::Geometry(1), Some((0, 0))),
        (Skip::Geometry(9), Some((0, 0))),
    ];
    assert_leaves(subject, &stack(), &cases);
    assert_leaves(subject, &stack()[..1], &[(Skip::Geometry(0), None), (Skip::Geometry(1), Some((0, 0)))]);
}

/// Rays that start on primitives and skip them, rays that skip others or whole geometries, and rays without a rule.
fn rays_with_rules(rng: &mut Rng, shapes: &[Shape], count: usize) -> Vec<Ray> {
    let mut rays = random_rays(rng, count);
    for ray in &mut rays {
        let geom = rng.below(shapes.len()) as u32;
        let shape = &shapes[geom as usize];
        let prim = rng.below(shape.primitive_count()) as u32;
        match (rng.below(4), shape) {
            (0, Shape::Mesh(mesh)) => {
                let [a, b, c] = mesh.triangle(prim);
                let (u, v) = (0.5 * rng.unit(), 0.5 * rng.unit());
                ray.origin = a + u * (b - a) + v * (c - a);
                ray.skip = Skip::Primitive { geom, prim };
            }
            (1, _) => ray.skip = Skip::Primitive { geom, prim },
            (2, _) => ray.skip = Skip::Geometry(geom),
            _ => {}
        }
    }
    rays
}

pub(crate) fn rules_of_neighbours_do_not_mix(subject: &Subject) {
    let mut rng = Rng::new(41);
    let (points, triangles) = dented_ball(1);
    let shapes =
        [soup(&mut rng, 60), random_spheres(&mut rng, 20), mesh(points, triangles), soup(&mut rng, 60)];
    let rays = rays_with_rules(&mut rng, &shapes, 1000);
    assert_agrees(&*subject.build(&shapes), &shapes, &rays);
}

pub(crate) fn a_skipped_sphere_is_not_hit_from_inside(subject: &Subject) {
    let shapes = [spheres(&[(Vec3::new(0.25, 0.25, 3.0), 1.0), (Vec3::new(0.25, 0.25, 0.0), 1.0)])];
    let skip = Skip::Primitive { geom: 0, prim: 0 };
    let cases = [(Skip::None, Some((0, 0))), (skip, Some((0, 1))), (Skip::Geometry(0), None)];
    assert_leaves(subject, &shapes, &cases);
}

pub(crate) fn without_rules_nothing_changes(subject: &Subject) {
    let mut rng = Rng::new(42);
    let shapes = [soup(&mut rng, 200), random_spheres(&mut rng, 20)];
    let rays = random_rays(&mut rng, 500);
    let (ready, without) = (subject.build(&shapes), subject.build_without_skip(&shapes));
    for hint in HINTS {
        assert_eq!(closest(&*ready, &rays, hint), closest(&*without, &rays, hint));
        assert_eq!(any(&*ready, &rays, hint), any(&*without, &rays, hint));
    }
}
