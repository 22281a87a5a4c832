//! The border between Rust and Embree's C: who owns what, for how long, and what may be read. Small enough to run
//! under valgrind (`tests/valgrind.sh`).
#![cfg(feature = "embree")]

use gloss::accel::{Accelerator, BuildOptions, Coherence, EmbreeMode, embree::Embree};
use gloss::core::{Ray, Skip, Vec3};
use gloss::geometry::{Shape, Sphere, TriangleMesh};
use std::sync::Arc;

const MODES: [EmbreeMode; 6] = [
    EmbreeMode::Auto,
    EmbreeMode::Single,
    EmbreeMode::Packet4,
    EmbreeMode::Packet8,
    EmbreeMode::Packet16,
    EmbreeMode::Stream,
];

/// A strip of triangles in exactly fitting buffers, and a sphere behind each.
fn shapes() -> [Shape; 2] {
    let corner = |i: u32| Vec3::new(i.div_euclid(2) as f32, (i % 2) as f32, 0.0);
    let positions: Vec<_> = (0..12).map(corner).collect();
    let indices = (0..10).map(|i| [i, i + 1, i + 2]).collect();
    let spheres = (0..5).map(|i| Sphere { center: Vec3::new(i as f32 + 0.5, 0.5, -2.0), radius: 0.5 });
    let mesh = TriangleMesh::new(positions, indices, vec![], vec![]).unwrap();
    [Shape::Mesh(Arc::new(mesh)), Shape::Spheres(spheres.collect())]
}

/// Straight down at the triangle `i`, with every rule in turn.
fn ray(i: usize) -> Ray {
    let geom = 0;
    let prim = i as u32 % 10;
    let skip = [Skip::None, Skip::Primitive { geom, prim }, Skip::Geometry(geom)][i % 3];
    let x = (prim as f32).midpoint(1.0) - 0.1;
    Ray { skip, ..Ray::new(Vec3::new(x, 0.5, 1.0), -Vec3::Z) }
}

/// Asks for batches of awkward lengths and checks that each answer obeys its rule.
fn assert_answers(accel: &dyn Accelerator) {
    for length in [0, 1, 3, 8, 17, 300] {
        let rays: Vec<_> = (0..length).map(ray).collect();
        for hint in [Coherence::Coherent, Coherence::Incoherent] {
            let (mut hits, mut occluded) = (vec![None; length], vec![false; length]);
            accel.intersect(&rays, hint, &mut hits);
            accel.occluded(&rays, hint, &mut occluded);
            for ((ray, hit), occluded) in rays.iter().zip(&hits).zip(&occluded) {
                assert_eq!(hit.is_some(), *occluded);
                let Some(hit) = hit else { continue };
                assert!(!ray.skip.rejects(hit.geom_id, hit.prim_id));
            }
            let first = hits.first().copied().flatten();
            assert!(length == 0 || first.is_some_and(|hit| (hit.t - 1.0).abs() < 1e-6));
        }
    }
}

#[test]
fn every_call_stays_in_its_buffers() {
    for embree_mode in MODES {
        for (robust, compact) in [(true, false), (false, true)] {
            let options =
                BuildOptions { embree_mode, robust, compact, threads: 1, ..BuildOptions::default() };
            assert_answers(&Embree::new(&shapes(), &options).unwrap());
        }
    }
}

#[test]
fn the_scene_keeps_its_shapes() {
    let shapes = shapes();
    let Shape::Mesh(mesh) = &shapes[0] else { unreachable!("the first shape is the mesh") };
    let watch = Arc::downgrade(mesh);
    let accel = Embree::new(&shapes, &BuildOptions { threads: 1, ..BuildOptions::default() }).unwrap();
    drop(shapes);
    assert!(watch.upgrade().is_some());
    assert_answers(&accel);
    drop(accel);
    assert!(watch.upgrade().is_none());
}

#[test]
fn a_scene_may_be_used_and_dropped_elsewhere() {
    let accel = Embree::new(&shapes(), &BuildOptions { threads: 2, ..BuildOptions::default() }).unwrap();
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| assert_answers(&accel));
        }
    });
    std::thread::spawn(move || drop(accel)).join().unwrap();
}

#[test]
fn scenes_come_and_go() {
    for _ in 0..10 {
        let options = BuildOptions { threads: 1, ..BuildOptions::default() };
        let scenes = [0, 1, 2].map(|count| Embree::new(&shapes()[..count], &options).unwrap());
        let [nothing, mesh, both] = scenes.each_ref().map(|scene| scene.info().memory_bytes);
        assert!(nothing < mesh && mesh < both, "{nothing} {mesh} {both}");
    }
}

#[test]
fn the_library_names_itself() {
    let accel =
        Embree::new(&[], &BuildOptions { embree_mode: EmbreeMode::Packet8, ..Default::default() }).unwrap();
    let name = accel.info().name;
    assert!(name.starts_with("embree 3.") || name.starts_with("embree 4."), "{name}");
    assert!(name.ends_with(" packet8"), "{name}");
}
