//! Samples of lights that are chosen among candidates: the same picture with less noise, and a pilot that knows where.

mod common;

use common::{mean_and_error, picture, scene_with};
use gloss::film::Film;
use gloss::render::Outcome;
use gloss::scene::load::{Format, load_str};
use std::path::Path;

const SETTINGS: &str = r#"
    [settings]
    spp = 16
    adaptive = false
    max_depth = 2
    at_max_depth = "black"
"#;

/// A rough ball on a floor, under a studio's softboxes, seen small.
fn ball(environment: &str, material: &str) -> String {
    format!(
        r#"
        camera = {{ eye = [0, 1.2, 4], look_at = [0, 0, 0], resolution = [40, 30], fov_deg = 40 }}
        environment = {{ {environment} }}
        materials.floor = {{ type = "diffuse", cd = [0.2, 0.2, 0.2] }}
        materials.ball = {{ {material} }}
        {SETTINGS}
        [[shapes]]
        type = "plane"
        point = [0, -1, 0]
        normal = [0, 1, 0]
        material = "floor"
        [[shapes]]
        type = "sphere"
        material = "ball"
        "#
    )
}

const STUDIO: &str = r#"type = "studio""#;
const METAL: &str = r#"type = "conductor", metal = "gold", alpha = 0.25"#;

fn rendered(text: &str, overrides: &[(&str, &str)], seed: u32) -> Outcome {
    let seed = seed.to_string();
    picture(&scene_with(text, &[overrides, &[("settings.seed", &*seed)]].concat()))
}

#[test]
fn candidates_leave_the_picture_and_take_noise_from_metals_in_a_studio() {
    const SEEDS: u32 = 8;
    let plastic = r#"type = "plastic", cd = [0.3, 0.05, 0.05], alpha = 0.2"#;
    let power = r#"type = "cosine-power", exponent = 40"#;
    let coated = r#"type = "cosine-power", exponent = 40, kr = 0.5, kd = 0.4, cd = [0.5, 0.4, 0.3]"#;
    for material in [METAL, plastic, power, coated] {
        let text = ball(STUDIO, material);
        let [plain, chosen] = ["1", "4"].map(|count| {
            let overrides = [("settings.glossy_samples", "1"), ("settings.light_candidates", count)];
            (0..SEEDS).map(|seed| rendered(&text, &overrides, seed).film).collect::<Vec<Film>>()
        });
        let sums = |films: &[Film]| {
            let of = films.iter().map(mean_and_error).fold((0.0, 0.0), |(m, v), (a, e)| (m + a, v + e * e));
            (of.0 / f64::from(SEEDS), of.1.sqrt() / f64::from(SEEDS))
        };
        let ((a, error), (b, error_chosen)) = (sums(&plain), sums(&chosen));
        assert!((a - b).abs() < 5.0 * error.hypot(error_chosen), "{material}: {a} +- {error} and {b}");

        // Between seeds, since samples of one pixel are spread better than their own variance tells.
        let variance = |films: &[Film]| {
            let of_pixel = |pixel: usize| {
                let values: Vec<f64> =
                    films.iter().map(|film| f64::from(film.pixels[pixel].mean().luminance())).collect();
                let mean = values.iter().sum::<f64>() / f64::from(SEEDS);
                values.iter().map(|value| (value - mean).powi(2)).sum::<f64>()
            };
            (0..films[0].pixels.len()).map(of_pixel).sum::<f64>()
        };
        let ratio = variance(&chosen) / variance(&plain);
        println!("{material}: {ratio:.2} times the variance");
        assert!(material != METAL || ratio < 0.8, "{material}: {ratio} times the variance");
    }
}

/// A floor of brushed metal under small lamps at many heights, of which it shows each in a few pixels.
fn lamps() -> String {
    let lamp = |i: u32| {
        let at = |k: u32| (f64::from(i * 3 + k) * 0.618_033_988_749_895).fract();
        let [x, y, z] = [8.0 * at(0) - 4.0, 1.5 + 1.5 * at(1), 7.0 * at(2) - 5.0];
        format!(
            r#"
            [[lights]]
            type = "rect"
            corner = [{x}, {y}, {z}]
            u = [0.12, 0, 0]
            v = [0, 0, 0.12]
            radiance = [30, 25, 20]
            "#
        )
    };
    let floor = format!(
        r#"
        camera = {{ eye = [0, 1.6, 3.6], look_at = [0, 0.3, -0.5], resolution = [40, 30], fov_deg = 45 }}
        materials.metal = {{ type = "conductor", metal = "aluminium", alpha = 0.1 }}
        {SETTINGS}
        [[shapes]]
        type = "plane"
        point = [0, 0, 0]
        normal = [0, 1, 0]
        material = "metal"
        "#
    );
    (0..100).map(lamp).fold(floor, |text, lamp| text + &lamp)
}

#[test]
fn a_pilot_takes_candidates_where_they_are_worth_it() {
    let even = r#"type = "constant", radiance = [1, 1, 1]"#;
    let dull = r#"type = "diffuse", cd = [0.5, 0.5, 0.5]"#;
    for (text, expected) in [
        (ball(STUDIO, METAL), 4),
        (ball(even, METAL), 1),
        (ball(STUDIO, dull), 1),
        (ball(STUDIO, r#"type = "mirror""#), 1),
        (lamps(), 4),
    ] {
        let size = ("camera.resolution", "[160, 120]");
        let auto = rendered(&text, &[size], 1);
        assert_eq!(auto.light_candidates, expected, "{text}");
        // As if it had been asked for: nothing of the pilot is in the picture.
        let count = expected.to_string();
        let asked = rendered(&text, &[size, ("settings.light_candidates", &count)], 1);
        assert_eq!(auto.split, asked.split);
        assert!(auto.film == asked.film, "{text}");
    }
    let fixed = rendered(&ball(STUDIO, METAL), &[("settings.glossy_samples", "1")], 1);
    assert_eq!(fixed.light_candidates, 1, "no pilot, no candidates");
}

#[test]
fn no_candidate_and_too_many_are_refused() {
    for count in ["0", "65"] {
        let text = ball(STUDIO, METAL).replace("spp = 16", &format!("spp = 16\nlight_candidates = {count}"));
        let error = load_str(&text, Format::Toml, Path::new(""), &[]).expect_err("a bad number").to_string();
        assert!(error.contains(&format!("{count} candidates")) && error.contains("1 to 64"), "{error}");
    }
}
