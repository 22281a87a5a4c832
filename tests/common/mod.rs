//! Scenes as text, rendered: what the tests of whole pictures share.

#![allow(dead_code, reason = "each test program uses its own part")]

pub(crate) mod place;

use gloss::accel::{self, Backend, BuildOptions};
use gloss::film::Film;
use gloss::render::{Outcome, RenderOptions, Silent, render};
use gloss::scene::load::{Format, load_str};
use gloss::scene::{Override, Scene};
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// The scene that a TOML text describes.
pub(crate) fn scene(toml: &str) -> Scene {
    scene_with(toml, &[])
}

/// The same with overrides.
pub(crate) fn scene_with(toml: &str, overrides: &[(&str, &str)]) -> Scene {
    let overrides: Vec<Override> = overrides
        .iter()
        .map(|(path, value)| Override { path: (*path).into(), value: (*value).into() })
        .collect();
    load_str(toml, Format::Toml, Path::new(env!("CARGO_MANIFEST_DIR")), &overrides)
        .unwrap_or_else(|error| panic!("{error}\nin\n{toml}"))
}

/// The scene's picture, on the pure-Rust BVH.
pub(crate) fn picture(scene: &Scene) -> Outcome {
    picture_on(scene, Backend::Bvh, &RenderOptions::default())
}

/// The scene's picture.
pub(crate) fn picture_on(scene: &Scene, backend: Backend, options: &RenderOptions<'_>) -> Outcome {
    let accel = accel::build(backend, &scene.shapes, &BuildOptions::default()).expect("the shapes are built");
    let outcome = render(scene, &*accel, options, &Silent, &AtomicBool::new(false));
    assert!(outcome.film.dropped.is_empty(), "{:?}", outcome.film.dropped);
    outcome
}

/// Mean of the green channel over all pixels, and its standard error from the samples' own spread.
pub(crate) fn mean_and_error(film: &Film) -> (f64, f64) {
    let n = film.pixels.len() as f64;
    let mean = film.pixels.iter().map(|p| p.sum[1].to_f64() / f64::from(p.count)).sum::<f64>() / n;
    let variance = film.pixels.iter().map(|p| p.variance_of_mean()).sum::<f64>() / (n * n);
    (mean, variance.sqrt())
}

/// Fails unless the picture's mean is `expected` within 5 standard errors (and the rounding of f32).
pub(crate) fn assert_mean(film: &Film, expected: f64, what: &str) {
    let (mean, error) = mean_and_error(film);
    assert!(
        (mean - expected).abs() < 5.0 * error + 2e-6 * expected.abs(),
        "{what}: {mean} instead of {expected}, standard error {error}"
    );
}

/// A unit square at y = 0 about the origin, facing +y, seen under `theta_deg` from far away through a narrow angle,
/// with the glossy lobe of the policy; nothing else but what `rest` adds.
pub(crate) fn glossy_plate(theta_deg: f64, exponent: f64, horizon: &str, spp: u32, rest: &str) -> String {
    let (sin, cos) = theta_deg.to_radians().sin_cos();
    let (x, y) = (100.0 * sin, 100.0 * cos);
    format!(
        r#"
        [settings]
        spp = {spp}
        max_depth = 1
        at_max_depth = "black"
        horizon = "{horizon}"
        sampler = "independent"
        [camera]
        eye = [{x}, {y}, 0.0]
        look_at = [0, 0, 0]
        up = [0, 0, 1]
        resolution = [16, 16]
        fov_deg = 0.0001
        [materials.plate]
        type = "cosine-power"
        kr = 1.0
        exponent = {exponent}
        [[shapes]]
        type = "rect"
        corner = [-0.5, 0, 0.5]
        u = [1, 0, 0]
        v = [0, 0, -1]
        material = "plate"
        {rest}
        "#
    )
}
