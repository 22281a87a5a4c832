//! Different ways to the same light: they must agree on every scene that ships.

mod common;

use common::picture;
use gloss::film::Film;
use gloss::scene::{Override, load};
use std::path::Path;

const SCENES: [&str; 9] =
    ["boxes", "checker-sphere", "cornell-glossy", "daylight", "glass", "lemon", "mesh", "mirror-room", "rim"];

/// A shipped scene, small and with overrides.
fn small(name: &str, overrides: &[(&str, &str)]) -> Film {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}.toml"));
    let mut all = vec![("camera.resolution", "[32, 24]"), ("settings.sampler", "independent")];
    all.extend(overrides);
    let overrides: Vec<Override> =
        all.iter().map(|(path, value)| Override { path: (*path).into(), value: (*value).into() }).collect();
    picture(&load(&path, &overrides).unwrap_or_else(|error| panic!("{error}"))).film
}

/// Fails if two pictures of one scene differ in a block of 8 x 8 pixels by more than 5 standard errors of both.
///
/// A block whose samples have not met its rare bright paths knows nothing of its own error, so the errors of a block
/// and of the whole picture are added.
fn assert_equal_within_noise(a: &Film, b: &Film, what: &str) {
    let whole = |film: &Film| {
        film.pixels.iter().map(|p| p.variance_of_mean()).sum::<f64>() / film.pixels.len() as f64
    };
    let background = whole(a) + whole(b);
    for block in 0..12 {
        let (bx, by) = (block % 4 * 8, block / 4 * 8);
        let (mut difference, mut variance) = (0.0, 0.0);
        for (x, y) in (0..64).map(|i| (bx + i % 8, by + i / 8)) {
            let (p, q) = (a.pixel(x, y), b.pixel(x, y));
            difference += f64::from(p.mean().luminance()) - f64::from(q.mean().luminance());
            variance += p.variance_of_mean() + q.variance_of_mean() + background;
        }
        let error = variance.sqrt();
        assert!(
            difference.abs() < 5.0 * error + 1e-4 * 64.0,
            "{what}, block {block}: they differ by {} +- {}",
            difference / 64.0,
            error / 64.0
        );
    }
}

#[test]
fn sampling_lights_lobes_or_both_makes_the_same_picture_of_every_scene() {
    for name in SCENES {
        let [mis, light, lobe] = ["mis", "light", "lobe"].map(|way| {
            let overrides = [
                ("settings.direct_light", way),
                ("settings.preset", "accurate"),
                ("settings.self_hit", "primitive"),
                ("settings.max_depth", "3"),
                ("settings.at_max_depth", "black"),
                ("settings.spp", "128"),
            ];
            small(name, &overrides)
        });
        assert_equal_within_noise(&mis, &light, &format!("{name}: mis, light"));
        assert_equal_within_noise(&mis, &lobe, &format!("{name}: mis, lobe"));
    }
}

#[test]
fn splitting_candidates_guiding_and_roulette_change_the_noise_and_not_the_picture() {
    for name in ["cornell-glossy", "mesh", "boxes"] {
        let common = [("settings.preset", "accurate"), ("settings.spp", "96"), ("settings.max_depth", "4")];
        let with = |overrides: &[(&str, &str)]| small(name, &[&common[..], overrides].concat());
        let plain = with(&[]);
        for (what, value) in [("settings.glossy_samples", "5"), ("settings.glossy_samples", "auto")] {
            assert_equal_within_noise(&plain, &with(&[(what, value)]), &format!("{name}: {what} {value}"));
        }
        let lights = with(&[("settings.glossy_samples", "{ any = 3 }"), ("settings.light_samples", "split")]);
        assert_equal_within_noise(&plain, &lights, &format!("{name}: three samples of lights"));
        let chosen = with(&[("settings.light_candidates", "4")]);
        assert_equal_within_noise(&plain, &chosen, &format!("{name}: four candidates"));
        let all = [
            ("settings.glossy_samples", "{ any = 3 }"),
            ("settings.light_samples", "split"),
            ("settings.light_candidates", "2"),
        ];
        assert_equal_within_noise(
            &plain,
            &with(&all),
            &format!("{name}: three samples of two candidates each"),
        );
        let unguided = with(&[("settings.guiding", "false")]);
        assert_equal_within_noise(&plain, &unguided, &format!("{name}: guided or not"));
        for guiding in ["always", "never"] {
            let guided = with(&[("settings.indirect_guiding", guiding)]);
            assert_equal_within_noise(
                &plain,
                &guided,
                &format!("{name}: guided to reflected light {guiding}"),
            );
        }
        let long = with(&[("settings.max_depth", "12"), ("settings.at_max_depth", "roulette")]);
        assert_equal_within_noise(&plain, &long, &format!("{name}: roulette from 4 and from 12"));
    }
}

#[test]
fn paths_that_go_both_ways_at_glass_and_photons_change_the_noise_and_not_the_picture() {
    let common = [("settings.spp", "192"), ("settings.max_depth", "6"), ("settings.at_max_depth", "black")];
    let with = |overrides: &[(&str, &str)]| small("glass", &[&common[..], overrides].concat());
    let both = with(&[]);
    let one = with(&[("settings.split_glass", "false")]);
    assert_equal_within_noise(&both, &one, "both ways or one");
    let unguided = with(&[("settings.guiding", "false")]);
    assert_equal_within_noise(&both, &unguided, "guided or not");
    let noise = |film: &Film| film.pixels.iter().map(|p| p.variance_of_mean()).sum::<f64>();
    assert!(noise(&both) < 0.8 * noise(&one), "{} and {}", noise(&both), noise(&one));
}
