//! Samples shared out by noise: no pixel becomes darker for it, and the picture is the same on any number of threads.

mod common;

use common::{picture, picture_on, scene};
use gloss::accel::Backend;
use gloss::film::Film;
use gloss::render::{RenderOptions, State};
use gloss::scene::Scene;
use gloss::scene::settings::EVEN_SAMPLES;

/// A glossy floor under a small lamp, mostly in the dark, beside a wide and clean white wall: noise here and there.
const UNEVEN: &str = r#"
    [settings]
    spp = 64
    max_depth = 3
    at_max_depth = "black"
    [camera]
    eye = [0, 1.5, 6]
    look_at = [0, 1, 0]
    resolution = [48, 32]
    fov_deg = 40
    [environment]
    type = "constant"
    radiance = [0.2, 0.2, 0.2]
    [materials.floor]
    type = "cosine-power"
    kr = 0.4
    exponent = 30
    kd = 0.3
    [materials.bright]
    type = "emissive"
    radiance = [1, 1, 1]
    [[shapes]]
    type = "rect"
    corner = [-4, 0, 4]
    u = [8, 0, 0]
    v = [0, 0, -8]
    material = "floor"
    [[shapes]]
    type = "rect"
    corner = [-4, 1.5, -4]
    u = [8, 0, 0]
    v = [0, 8, 0]
    material = "bright"
    [[lights]]
    type = "sphere"
    center = [0.5, 0.8, 0]
    radius = 0.05
    radiance = [400, 400, 400]
"#;

fn with(settings: &[(&str, &str)], seed: u32) -> Scene {
    let mut scene = common::scene_with(UNEVEN, settings);
    scene.settings.seed = seed;
    scene
}

fn luminance(film: &Film) -> Vec<f64> {
    film.image().iter().map(|p| f64::from(p.luminance())).collect()
}

const ADAPTIVE: (&str, &str) = ("settings.adaptive", "true");

#[test]
fn the_mean_over_many_seeds_is_that_of_even_samples() {
    // Independent numbers, few samples and lights that only rare rays hit: what would bias the picture shows most.
    let rare = [
        ("settings.sampler", "independent"),
        ("settings.direct_light", "lobe"),
        ("settings.spp", "32"),
        ("lights.0.radius", "0.2"),
    ];
    let seeds = 96u32;
    let pictures = |adaptive: &'static str, offset: u32| -> Vec<Vec<f64>> {
        let settings: Vec<_> = rare.into_iter().chain([("settings.adaptive", adaptive)]).collect();
        (0..seeds).map(|seed| luminance(&picture(&with(&settings, offset + seed)).film)).collect()
    };
    let even = pictures("false", 1000);
    let uneven = pictures("true", 0);
    let n = f64::from(seeds);
    let pixels = even[0].len();

    // Bias, in blocks of 8 x 8 pixels.
    let block = |p: &[f64], b: usize| -> f64 {
        let (x, y) = (b % 6 * 8, b / 6 * 8);
        (0..64).map(|i| p[(y + i / 8) * 48 + x + i % 8]).sum::<f64>() / 64.0
    };
    for b in 0..pixels / 64 {
        let statistics = |all: &[Vec<f64>]| {
            let mean = all.iter().map(|p| block(p, b)).sum::<f64>() / n;
            let variance = all.iter().map(|p| (block(p, b) - mean).powi(2)).sum::<f64>() / (n - 1.0);
            (mean, variance / n)
        };
        let ((a, va), (b_mean, vb)) = (statistics(&even), statistics(&uneven));
        let error = (va + vb).sqrt();
        assert!((a - b_mean).abs() < 5.0 * error + 1e-6, "block {b}: {a} even, {b_mean} shared out, {error}");
    }
}

#[test]
fn the_error_is_lower_where_noise_is_uneven() {
    // By what pictures of different seeds differ. The lamp itself is out of view: it fills less than a pixel, whose
    // neighbours, which decide for it, know nothing of its noise. Half of the picture is floor: where only edges are
    // noisy, whose error falls faster than the rule reckons with, even samples do better.
    let squared_error = |adaptive: &'static str, spp: &'static str| -> f64 {
        let settings = [
            ("settings.adaptive", adaptive),
            ("settings.spp", spp),
            ("lights.0.center", "[0.5, 4.0, 2.0]"),
            ("camera.look_at", "[0, 1.5, 0]"),
        ];
        let pictures: Vec<_> = (0..8).map(|seed| luminance(&picture(&with(&settings, seed)).film)).collect();
        let pixels = pictures[0].len();
        let variance = |i: usize| {
            let mean = pictures.iter().map(|p| p[i]).sum::<f64>() / 8.0;
            pictures.iter().map(|p| (p[i] - mean).powi(2)).sum::<f64>() / 7.0
        };
        (0..pixels).map(variance).sum::<f64>() / pixels as f64
    };
    for (spp, gain) in [("32", 1.2), ("64", 1.4)] {
        let [even, uneven] = ["false", "true"].map(|adaptive| squared_error(adaptive, spp));
        assert!(uneven * gain < even, "{spp} samples: {even} even, {uneven} shared out");
    }
}

#[test]
fn there_are_as_many_samples_as_were_asked_for_and_none_is_without() {
    let even = f64::from(EVEN_SAMPLES);
    for spp in ["2", "4", "5", "32", "100"] {
        let film = picture(&with(&[ADAPTIVE, ("settings.spp", spp)], 3)).film;
        let spp: f64 = spp.parse().unwrap();
        let mean = film.pixels.iter().map(|p| f64::from(p.count)).sum::<f64>() / film.pixels.len() as f64;
        assert!((0.97..=1.0).contains(&(mean / spp)), "{mean} samples, {spp} wanted");
        let [least, most] =
            [film.pixels.iter().map(|p| p.count).min(), film.pixels.iter().map(|p| p.count).max()];
        assert!(f64::from(least.unwrap()) >= (spp / 4.0).max(spp.min(even)));
        assert_eq!(spp <= even, least == most, "{least:?} to {most:?} of {spp}");
    }
}

#[test]
fn a_picture_that_grows_is_that_of_more_samples() {
    let of = |spp| with(&[ADAPTIVE, ("settings.spp", spp)], 7);
    let shot = |scene: &Scene, resume| {
        picture_on(scene, Backend::Bvh, &RenderOptions { resume, ..Default::default() })
    };
    let mut state = None;
    for spp in ["2", "4", "8", "16", "50", "128"] {
        let outcome = shot(&of(spp), state);
        assert_eq!(outcome.film, shot(&of(spp), None).film, "{spp}");
        state = Some(State { film: outcome.film, tally: outcome.tally, decisions: outcome.decisions });
    }
}

#[test]
fn threads_and_tiles_change_no_bit() {
    let scene = with(&[ADAPTIVE], 5);
    let one = picture_on(&scene, Backend::Bvh, &RenderOptions { threads: 1, ..Default::default() });
    let two =
        picture_on(&scene, Backend::Bvh, &RenderOptions { threads: 2, tile_size: 8, ..Default::default() });
    assert_eq!(one.film, two.film);
}

#[test]
fn a_threshold_takes_the_place_of_sharing_out() {
    let options = RenderOptions { noise: Some(0.05), ..Default::default() };
    let [shared, even] = ["true", "false"].map(|adaptive| {
        let settings = [("settings.adaptive", adaptive), ("settings.spp", "16000")];
        picture_on(&with(&settings, 1), Backend::Bvh, &options)
    });
    assert_eq!(shared.stopped_by, gloss::render::StopReason::Noise);
    assert_eq!(shared.film, even.film);
}

#[test]
fn a_picture_without_noise_has_even_samples() {
    let dark = UNEVEN.replace("[400, 400, 400]", "[0, 0, 0]").replace("0.2, 0.2, 0.2", "0, 0, 0");
    let dark = scene(&dark.replace("radiance = [1, 1, 1]", "radiance = [0, 0, 0]"));
    assert!(dark.settings.adaptive);
    assert!(picture(&dark).film.pixels.iter().all(|p| p.count == 64));
}
