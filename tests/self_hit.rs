//! What the rules against self-hits lose, on a knot that sees itself.

mod common;

use common::{picture_on, scene_with};
use glam::Vec3;
use gloss::accel::{self, Backend, BuildOptions, Coherence};
use gloss::compare::diff::{Difference, Range, compare};
use gloss::core::{Frame, Hit, Ray, Sampler, SamplerKind, Skip, warp};
use gloss::film::Film;
use gloss::geometry::{Shape, TriangleMesh};
use gloss::image_io::Image;
use gloss::render::RenderOptions;
use gloss::scene::SelfHit;
use std::sync::Arc;

/// A knot that shines with radiance 1 of its own and reflects nine tenths of what comes, in the dark.
const KNOT: &str = r#"
    ambient = 1
    [settings]
    spp = 16
    max_depth = 20
    at_max_depth = "black"
    [camera]
    eye = [0, 2.2, 2.6]
    look_at = [0, 0, 0]
    fov_deg = 36
    resolution = [48, 48]
    [materials.m]
    type = "cosine-power"
    kr = 0.9
    exponent = 1000
    ka = 1
    ca = 1
    [[shapes]]
    type = "generated"
    kind = "knot"
    triangles = 20000
    material = "m"
"#;

fn film(text: &str, self_hit: &str, backend: Backend) -> Film {
    let scene = scene_with(text, &[("settings.self_hit", self_hit)]);
    picture_on(&scene, backend, &RenderOptions::default()).film
}

fn difference(test: &Film, reference: &Film) -> Difference {
    let image = |film: &Film| Image::new(film.rect.width(), film.rect.height(), film.image());
    compare(&image(test), &image(reference), Range::Hdr, 67.02).expect("pictures of one size")
}

fn mean(film: &Film) -> f64 {
    film.pixels.iter().map(|p| f64::from(p.mean().g)).sum::<f64>() / film.pixels.len() as f64
}

fn backends() -> Vec<Backend> {
    if cfg!(feature = "embree") { vec![Backend::Bvh, Backend::Embree] } else { vec![Backend::Bvh] }
}

#[test]
fn skipping_the_geometry_loses_every_reflection_of_a_knot_in_itself() {
    for backend in backends() {
        let [geometry, primitive, offset] =
            ["geometry", "primitive", "offset"].map(|p| film(KNOT, p, backend));
        // By the lecture's rule it shows its own light and nothing else, wherever it is hit.
        let coverage = mean(&geometry);
        assert!(geometry.pixels.iter().all(|p| (0.0..=1.0).contains(&p.mean().g)));
        let lost = 1.0 - coverage / mean(&primitive);
        let relmse = difference(&geometry, &primitive).relmse;
        println!("{backend:?}: mean radiance lost {:.2} %, relMSE {relmse:.4}", 100.0 * lost);
        assert!(lost > 0.1, "{lost}");
        assert!(relmse > 0.01, "{relmse}");

        // The other two rules agree.
        let apart = difference(&offset, &primitive);
        println!("{backend:?}: offset and primitive: max {:.2e}", apart.max);
        assert!(apart.rmse < 1e-3, "{apart:?}");
    }
}

#[test]
fn the_figures_pair_differs_by_what_is_reported() {
    let studio = include_str!("../scenes/self-hit.toml")
        .replace("resolution = [400, 400]", "resolution = [64, 64]")
        .replace("triangles = 100000", "triangles = 20000")
        .replace("spp = 64", "spp = 16");
    let [geometry, primitive] = ["geometry", "primitive"].map(|p| film(&studio, p, Backend::Bvh));
    let apart = difference(&geometry, &primitive);
    let absolute =
        geometry.pixels.iter().zip(&primitive.pixels).map(|(a, b)| (a.mean() - b.mean()).map(f32::abs).g);
    let share = absolute.map(f64::from).sum::<f64>() / primitive.pixels.len() as f64 / mean(&primitive);
    println!(
        "in the studio: {:.1} % of the light is in the wrong place, relMSE {:.3}",
        100.0 * share,
        apart.relmse
    );
    assert!(share > 0.05 && apart.relmse > 0.1, "{share} {}", apart.relmse);
}

#[test]
fn of_a_convex_thing_every_rule_gives_the_same_picture() {
    let sphere = KNOT.replace("kind = \"knot\"", "kind = \"sphere\"");
    for backend in backends() {
        let [geometry, primitive, offset] =
            ["geometry", "primitive", "offset"].map(|p| film(&sphere, p, backend));
        assert_eq!(geometry.pixels, primitive.pixels);
        assert_eq!(offset.pixels, primitive.pixels);
    }
}

/// Triangles of all sizes from 1e-4 to 1 and of all shapes, anywhere in the unit box.
fn soup(count: u32) -> TriangleMesh {
    let sampler = Sampler::new(SamplerKind::Independent, 11, 0, 0);
    let positions = (0..count).flat_map(|i| {
        let vector = |k| {
            let ([x, y], z) = (sampler.pair(i, k), sampler.single(i, k + 1));
            2.0 * Vec3::new(x, y, z) - 1.0
        };
        let [size, stretch] = sampler.pair(i, 8).map(|u| 10f32.powf(-4.0 * u));
        let (a, b, c) = (vector(0), vector(2), vector(4));
        [a, a + size * b, a + size * (stretch * c + (1.0 - stretch) * b)]
    });
    let indices = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    TriangleMesh::new(positions.collect(), indices, vec![], vec![]).expect("finite numbers")
}

#[test]
fn no_shadow_ray_meets_the_triangle_that_it_leaves() {
    let count = 10_000;
    let mut scene = scene_with(KNOT, &[]);
    let mesh = soup(count);
    scene.shapes = vec![Shape::Mesh(Arc::new(mesh.clone()))];
    let sampler = Sampler::new(SamplerKind::Independent, 12, 0, 0);
    let mut rays = vec![];
    for prim_id in 0..count {
        let [a, b, c] = mesh.triangle(prim_id);
        for i in 16 * prim_id..16 * prim_id + 16 {
            // Inside, on edges and at corners; from overhead to grazing.
            let [u, v] = match i % 4 {
                0 => [0.0, sampler.single(i, 0)],
                1 => [0.0, 1.0],
                _ => warp::uniform_triangle(sampler.pair(i, 0)),
            };
            let to_point = Ray::new(a + 2.0 * (b - a).cross(c - a).normalize_or(Vec3::Z), Vec3::Z);
            let hit = Hit { t: 1.0, u, v, geom_id: 0, prim_id };
            let point = scene.interaction(&to_point, &hit);
            let [height, turns] = sampler.pair(i, 1);
            let (cos, tangent) = (10f32.powf(-4.0 * height), Frame::new(point.at.ng));
            let across = (1.0 - cos * cos).max(0.0).sqrt() * warp::unit_vector(turns);
            let wi = tangent.to_world(across.extend(if i & 8 == 0 { cos } else { -cos }));
            rays.push((prim_id, point.spawn_shadow(wi, f32::INFINITY, SelfHit::Primitive)));
        }
    }
    let without_rule = rays.iter().filter(|(_, ray)| ray.skip == Skip::None).count();
    assert!(without_rule > rays.len() / 4, "{without_rule} of {}", rays.len());

    for (backend, robust) in backends().into_iter().flat_map(|backend| [(backend, true), (backend, false)]) {
        let options = BuildOptions { robust, ..BuildOptions::default() };
        let accel = accel::build(backend, &scene.shapes, &options).expect("the soup is built");
        let asked: Vec<Ray> = rays.iter().map(|&(_, ray)| ray).collect();
        let mut hits = vec![None; asked.len()];
        accel.intersect(&asked, Coherence::Incoherent, &mut hits);
        for ((own, ray), hit) in rays.iter().zip(hits) {
            assert!(hit.is_none_or(|hit| hit.prim_id != *own), "{backend:?}, {ray:?} meets {hit:?}");
        }
    }
}
