//! The wave loop against closed forms, on scenes made by hand.

use glam::{DVec3, Vec3};
use gloss::accel::{self, Backend, BuildOptions};
use gloss::bxdf::Horizon;
use gloss::core::Rgb;
use gloss::film::Film;
use gloss::geometry::{Shape, Sphere};
use gloss::render::{Outcome, RenderOptions, Silent, State, render};
use gloss::scene::{
    AtMaxDepth, Camera, Geometry, GlossySamples, Lights, Material, Scene, Settings, Specular, Texture, World,
};
use std::sync::atomic::AtomicBool;

/// The inside of a sphere whose wall shines with radiance 1 and reflects the fraction `k` of all light.
fn furnace(specular: Specular, settings: Settings) -> Scene {
    let resolution = [8, 8];
    Scene {
        camera: Camera::look_at(Vec3::new(0.2, 0.1, 0.0), DVec3::Z, DVec3::Y, 0.1, resolution),
        shapes: vec![Shape::Spheres([Sphere { center: Vec3::ZERO, radius: 1.0 }].into())],
        geometries: vec![Geometry { name: "wall".into(), material: 0, light: None }],
        materials: vec![Material {
            name: "wall".into(),
            ambient: None,
            diffuse: None,
            specular,
            emission: Some(Rgb::WHITE),
            emits_both_sides: true,
        }],
        lights: Lights::default(),
        ambient: Rgb::BLACK,
        world: World::IDENTITY,
        settings,
        warnings: vec![],
        hash: String::new(),
        files: vec![],
    }
}

fn glossy(k: f32, exponent: f32) -> Specular {
    Specular::CosinePower { reflectance: Texture::Constant(Rgb::grey(k)), exponent, horizon: Horizon::Fold }
}

fn run(scene: &Scene, options: &RenderOptions<'_>) -> Outcome {
    let accel = accel::build(Backend::Bvh, &scene.shapes, &BuildOptions::default()).unwrap();
    render(scene, &*accel, options, &Silent, &AtomicBool::new(false))
}

fn series(k: f64, depth: i32) -> f64 {
    (1.0 - k.powi(depth + 1)) / (1.0 - k)
}

#[test]
fn a_closed_room_of_mirrors_sums_the_geometric_series() {
    for depth in [0, 1, 5, 19] {
        let settings = Settings {
            spp: 1,
            max_depth: depth,
            at_max_depth: AtMaxDepth::Black,
            roulette_from: Settings::NEVER,
            ..Default::default()
        };
        for specular in [Specular::Mirror(Texture::Constant(Rgb::grey(0.9))), glossy(0.9, 10.0)] {
            let outcome = run(&furnace(specular, settings.clone()), &RenderOptions::default());
            assert!(outcome.film.dropped.is_empty());
            assert!((outcome.tally.lost_throughput() - 0.9f64.powi(depth as i32 + 1)).abs() < 1e-5);
            for pixel in outcome.film.image() {
                assert!((f64::from(pixel.g) - series(0.9, depth as i32)).abs() < 1e-5, "{depth}: {pixel:?}");
            }
        }
    }
}

#[test]
fn every_way_of_splitting_sums_the_same_series() {
    let ways = [
        GlossySamples::First(9),
        GlossySamples::PerDepth(vec![3, 2, 5]),
        GlossySamples::Branch { branch: 4 },
        GlossySamples::First(10_000),
    ];
    for glossy_samples in ways {
        let settings = Settings {
            spp: 2,
            max_depth: 5,
            at_max_depth: AtMaxDepth::Black,
            roulette_from: Settings::NEVER,
            glossy_samples: glossy_samples.clone(),
            ..Default::default()
        };
        let outcome = run(&furnace(glossy(0.5, 3.0), settings), &RenderOptions::default());
        for pixel in outcome.film.image() {
            assert!((f64::from(pixel.r) - 1.96875).abs() < 1e-4, "{glossy_samples:?}: {pixel:?}");
        }
    }
}

#[test]
fn only_paths_below_a_third_end_by_chance() {
    // The sums of the series tell of each sample: whoever was ended has less, and whoever survived has more.
    let wall = |k: f32, max_depth: u32| {
        let settings = Settings {
            spp: 64,
            max_depth,
            at_max_depth: AtMaxDepth::Black,
            roulette_from: 0,
            ..Default::default()
        };
        run(&furnace(glossy(k, 10.0), settings), &RenderOptions::default())
    };
    // The last ray's throughput is 0.8^4 = 0.41, and 0.8^6 = 0.26.
    let (bright, dim) = (wall(0.8, 4), wall(0.8, 6));
    assert!(bright.film.pixels.iter().all(|pixel| pixel.variance_of_mean() < 1e-12));
    assert!(dim.film.pixels.iter().any(|pixel| pixel.variance_of_mean() > 1e-6));
    for (outcome, depth) in [(bright, 4), (dim, 6)] {
        let image = outcome.film.image();
        let mean = image.iter().map(|pixel| f64::from(pixel.g)).sum::<f64>() / image.len() as f64;
        assert!((mean - series(0.8, depth)).abs() < 0.02, "{depth}: {mean}");
    }
}

/// Variance of `1 + k + k^2 + ...` where the path of throughput `b` goes on with the probability `3 b`, but never above 0.99,
/// and is divided by it.
fn variance_of_endless_series(k: f64) -> f64 {
    let (mut throughput, mut alive, mut sum, mut square) = (1.0, 1.0, 0.0, 0.0);
    for _ in 0..10_000 {
        // The sum so far is the same for all that are alive.
        square += alive * (throughput * throughput + 2.0 * throughput * sum);
        sum += throughput;
        let goes_on = (3.0 * k * throughput).min(0.99);
        alive *= goes_on;
        throughput *= k / goes_on;
    }
    square - (1.0 - k).powi(-2)
}

#[test]
fn roulette_has_the_mean_and_the_variance_of_the_infinite_series() {
    let settings = Settings {
        spp: 4096,
        max_depth: 0,
        at_max_depth: AtMaxDepth::Roulette,
        adaptive: false,
        ..Default::default()
    };
    let outcome = run(&furnace(glossy(0.9, 100.0), settings), &RenderOptions::default());
    let samples = f64::from(outcome.film.pixels.iter().map(|p| p.count).sum::<u32>());
    let mean = outcome.film.image().iter().map(|p| f64::from(p.g)).sum::<f64>() / 64.0;
    assert!((mean - 10.0).abs() < 5.0 * (variance_of_endless_series(0.9) / samples).sqrt(), "{mean}");
    let variance = outcome.film.pixels.iter().map(|p| p.variance_of_mean() * 4096.0).sum::<f64>() / 64.0;
    let expected = variance_of_endless_series(0.9);
    assert!((variance / expected - 1.0).abs() < 0.05, "{variance} instead of {expected}");
    assert_eq!(outcome.tally.lost_throughput(), 0.0);
}

#[test]
fn threads_tiles_and_crops_change_no_bit() {
    let settings = Settings { spp: 8, glossy_samples: GlossySamples::First(700), ..Default::default() };
    let scene = furnace(glossy(0.7, 20.0), settings);
    let whole = run(&scene, &RenderOptions { threads: 1, ..Default::default() });
    for (threads, tile_size) in [(2, 0), (3, 1), (1, 5), (2, 64)] {
        let other = run(&scene, &RenderOptions { threads, tile_size, ..Default::default() });
        assert_eq!(whole.film.pixels, other.film.pixels, "{threads} threads, tiles of {tile_size}");
        assert_eq!(whole.tally.all_rays().rays, other.tally.all_rays().rays);
    }
    let crop = gloss::film::PixelRect { x0: 3, y0: 2, x1: 7, y1: 5 };
    let part = run(&scene, &RenderOptions { crop: Some(crop), ..Default::default() });
    for (i, pixel) in part.film.pixels.iter().enumerate() {
        let (x, y) = (3 + i % 4, 2 + i / 4);
        assert_eq!(*pixel, whole.film.pixels[y * 8 + x]);
    }
}

/// Paths of random length: a scene with noise.
fn noisy() -> Scene {
    let settings =
        Settings { spp: 24, max_depth: 0, at_max_depth: AtMaxDepth::Roulette, ..Default::default() };
    furnace(glossy(0.6, 30.0), settings)
}

#[test]
fn a_render_that_goes_on_and_shards_that_are_merged_are_the_whole() {
    let mut scene = noisy();
    // A share knows nothing of the noise in others.
    scene.settings.adaptive = false;
    let whole = run(&scene, &RenderOptions::default()).film;
    let part = |samples, resume: Option<Film>| {
        let resume = resume.map(State::from);
        run(&scene, &RenderOptions { samples: Some(samples), resume, ..Default::default() }).film
    };

    let broken_off = part(0..7, None);
    assert_eq!(part(0..24, Some(broken_off)).pixels, whole.pixels);

    let mut merged = part(16..24, None);
    merged.merge(&part(0..9, None));
    merged.merge(&part(9..16, None));
    assert_eq!(merged.pixels, whole.pixels);
}

#[test]
fn a_threshold_stops_where_it_is_met_on_any_number_of_threads() {
    let mut scene = noisy();
    scene.settings.spp = 100_000;
    let options = RenderOptions { noise: Some(0.02), threads: 1, ..Default::default() };
    let one = run(&scene, &options);
    assert_eq!(one.stopped_by, gloss::render::StopReason::Noise);
    // Relative variance of one sample: the mean is 1 / (1 - k).
    let expected = variance_of_endless_series(0.6) * 0.4f64.powi(2) / 0.02f64.powi(2);
    let count = f64::from(one.film.pixels[0].count);
    assert!(count > expected && count < 4.0 * expected, "{count} samples, {expected} expected");
    let two = run(&scene, &RenderOptions { threads: 2, tile_size: 3, ..options });
    assert_eq!(one.film.pixels, two.film.pixels);
}

#[test]
fn time_that_is_up_stops_a_render() {
    let mut scene = noisy();
    scene.settings.spp = u32::MAX;
    let outcome = run(
        &scene,
        &RenderOptions { time: Some(std::time::Duration::from_millis(50)), ..Default::default() },
    );
    assert_eq!(outcome.stopped_by, gloss::render::StopReason::Time);
    assert!(outcome.film.pixels.iter().all(|p| p.count < u32::MAX));
}

#[test]
fn the_pilot_decides_alike_on_any_number_of_threads() {
    let mut scene = noisy();
    scene.settings.glossy_samples = GlossySamples::Auto(gloss::scene::settings::Auto::Auto);
    let one = run(&scene, &RenderOptions { threads: 1, ..Default::default() });
    let two = run(&scene, &RenderOptions { threads: 2, ..Default::default() });
    assert_eq!(one.film.pixels, two.film.pixels);
    let mean = one.film.image().iter().map(|p| f64::from(p.g)).sum::<f64>() / 64.0;
    let error = (0.6 / 0.16 / (64.0 * 24.0f64)).sqrt();
    assert!((mean - 2.5).abs() < 5.0 * error, "{mean} +- {error}");
}

#[test]
fn a_bound_on_indirect_light_cuts_each_term_of_the_series_from_the_second_reflection_on() {
    let settings = |clamp_indirect| Settings {
        spp: 1,
        max_depth: 12,
        at_max_depth: AtMaxDepth::Black,
        roulette_from: Settings::NEVER,
        clamp_indirect,
        ..Default::default()
    };
    for most in [Some(0.5), Some(1e-3), Some(0.9), None] {
        let mirror = Specular::Mirror(Texture::Constant(Rgb::grey(0.9)));
        let film = run(&furnace(mirror, settings(most)), &RenderOptions::default()).film;
        let term = |n: i32| {
            let whole = 0.9f64.powi(n);
            if n > 1 { whole.min(most.map_or(f64::INFINITY, f64::from)) } else { whole }
        };
        let expected: f64 = (0..13).map(term).sum();
        let mean = f64::from(film.pixels[27].mean().g);
        assert!((mean - expected).abs() < 1e-5 * expected, "{most:?}: {mean} instead of {expected}");
    }
}
