//! What the rules against self-hits lose, on a knot that sees itself.

mod common;

use common::{picture_on, scene_with};
use gloss::accel::Backend;
use gloss::compare::diff::{Difference, Range, compare};
use gloss::film::Film;
use gloss::image_io::Image;
use gloss::render::RenderOptions;

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
