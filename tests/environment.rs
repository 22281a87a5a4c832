//! Environments: what they show, and their sampling against their density.

use glam::Vec3;
use gloss::core::lanes::Vectors;
use gloss::core::{Rgb, Sampler, SamplerKind, warp};
use gloss::scene::light::environment::{EnvironmentImageError, Gradient, Softbox};
use gloss::scene::{Environment, Light, Lights, Receiver, Receivers, Rivals};
use std::f64::consts::PI;

/// Independent numbers `(choice, u)` in a fixed order.
fn numbers(seed: u32, i: u32) -> (f32, [f32; 2]) {
    let sampler = Sampler::new(SamplerKind::Independent, seed, 0, 0);
    (sampler.single(i, 0), sampler.pair(i, 1))
}

/// Where a lat-long image shows the point `(u, v)`.
fn look_up(u: f64, v: f64) -> Vec3 {
    let ((sin, cos), (sin_phi, cos_phi)) = ((PI * v).sin_cos(), (2.0 * PI * u).sin_cos());
    glam::DVec3::new(sin * sin_phi, cos, -sin * cos_phi).as_vec3()
}

/// A dim random sky with black holes and a sun that outshines all else.
fn sky(width: usize, height: usize, rotation_deg: f32) -> Environment {
    let pixels = (0..width * height).map(|i| {
        let (x, [y, z]) = numbers(77, i as u32);
        if i == width * height / 3 {
            Rgb::new(900.0, 700.0, 500.0)
        } else {
            Rgb::new(x, y, z) * (x - 0.2).max(0.0)
        }
    });
    Environment::image(width, height, pixels.collect(), rotation_deg, 1.0).unwrap()
}

fn all() -> Vec<(&'static str, Environment)> {
    let dusk = Gradient { up: Vec3::Y, zenith: Rgb::grey(0.3), horizon: Rgb::grey(0.1), nadir: Rgb::BLACK };
    let softbox =
        |toward, half_size, softness| Softbox { toward, half_size, radiance: Rgb::grey(5.0), softness };
    let studio = vec![
        softbox(Vec3::new(1.0, 1.0, 0.5), [0.4, 0.3], 0.2),
        // They overlap, and one is overhead.
        softbox(Vec3::new(1.0, 1.0, 0.3), [0.1, 0.9], 0.0),
        softbox(Vec3::Y, [0.5, 0.5], 0.5),
    ];
    vec![
        ("constant", Environment::constant(Rgb::new(0.8, 0.9, 1.0))),
        ("gradient", Environment::gradient(Vec3::ONE, Rgb::WHITE, Rgb::BLACK, Rgb::BLACK)),
        ("studio", Environment::studio(dusk, studio)),
        ("product shot", Environment::product_shot(1.0, 30.0)),
        ("image", sky(24, 12, 70.0)),
        ("a column of pixels", sky(1, 7, 0.0)),
        ("a row of pixels", sky(9, 1, 0.0)),
    ]
}

fn only(environment: Environment) -> Lights {
    Lights::new(vec![], Some(environment))
}

const RECEIVER: Receiver = Receiver { p: Vec3::ZERO, n: Vec3::new(0.6, 0.48, -0.64), rivals: Rivals::None };

/// The same where rays of its own lobes look for light too.
const LOOKING: Receiver = Receiver { rivals: Rivals::Lobes, ..RECEIVER };

/// The same where portals are looked through as well.
const BESIDE_PORTALS: Receiver = Receiver { rivals: Rivals::Portals, ..RECEIVER };

/// Means of `le` and of the density over the sphere by the midpoint rule in (u, v), each times 4 pi.
fn integrals(lights: &Lights, to: &Receiver) -> [f64; 2] {
    let environment = lights.environment.as_ref().unwrap();
    let (columns, rows) = (1440, 720);
    let mut sums = [0.0; 2];
    for row in 0..rows {
        let v = (f64::from(row) + 0.5) / f64::from(rows);
        let weight = 2.0 * PI * PI * (PI * v).sin() / f64::from(rows * columns);
        for column in 0..columns {
            let wi = look_up((f64::from(column) + 0.5) / f64::from(columns), v);
            sums[0] += weight * f64::from(environment.le(wi).g);
            sums[1] += weight * f64::from(lights.pdf_environment(to, wi));
        }
    }
    sums
}

#[test]
fn densities_integrate_to_one_and_samples_to_the_light_of_all_directions() {
    for (name, environment) in all() {
        let lights = only(environment);
        let [light, one] = integrals(&lights, &RECEIVER);
        assert!((one - 1.0).abs() < 2e-3, "{name}: {one}");
        // Where others look too, an even environment is theirs and samples of others go to what is bright.
        for to in [LOOKING, BESIDE_PORTALS] {
            let [_, density] = integrals(&lights, &to);
            let expected = if lights.sample(&to, 0.5, [0.5; 2]).is_some() { 1.0 } else { 0.0 };
            assert!((density - expected).abs() < 3e-3, "{name}: {density} beside {:?}", to.rivals);
        }
        let (mut sum, mut squares) = (0.0, 0.0);
        let n = 40_000;
        for i in 0..n {
            let (choice, u) = numbers(1, i);
            let x = lights.sample(&RECEIVER, choice, u).map_or(0.0, |s| f64::from(s.le_over_pdf.g));
            sum += x;
            squares += x * x;
        }
        let mean = sum / f64::from(n);
        let error = ((squares / f64::from(n) - mean * mean).max(0.0) / f64::from(n)).sqrt();
        // The quadrature resolves hard edges to 1e-3.
        assert!(
            (mean - light).abs() < 5.0 * error + 1e-3 * light,
            "{name}: {mean} is not {light} +- {error}"
        );
    }
}

#[test]
fn a_sample_has_the_radiance_and_the_density_of_its_direction() {
    for (name, environment) in all() {
        let lights = only(environment);
        for (i, to) in (0..10_000).zip([RECEIVER, LOOKING, BESIDE_PORTALS].iter().cycle()) {
            let (choice, u) = numbers(2, i);
            let Some(sample) = lights.sample(to, choice, u) else { continue };
            assert!((sample.wi.length() - 1.0).abs() < 1e-6 && sample.t_max == f32::INFINITY, "{name}");
            let pdf = lights.pdf_environment(to, sample.wi);
            // The place in an image is found again from a direction that was rounded.
            assert!((pdf / sample.pdf - 1.0).abs() < 1e-4, "{name}: {pdf} {}", sample.pdf);
            let le = lights.environment.as_ref().unwrap().le(sample.wi);
            let product = sample.le_over_pdf.r * sample.pdf;
            assert!((product - le.r).abs() <= 1e-4 * le.r, "{name}: {product} {le:?}");
        }
    }
}

#[test]
fn image_samples_follow_luminance_so_that_weights_hardly_vary() {
    let lights = only(sky(64, 32, 0.0));
    let range = |y_max: f32| {
        let weights = (0..10_000).filter_map(|i| {
            let (choice, u) = numbers(3, i);
            let sample = lights.sample(&RECEIVER, choice, u).filter(|s| s.wi.y.abs() <= y_max);
            sample.map(|s| s.le_over_pdf.luminance())
        });
        weights.fold((f32::INFINITY, 0.0f32), |(a, b), w| (a.min(w), b.max(w)))
    };
    // Between neighbouring rows the sine varies by a factor of 1.2 up to |y| = 0.9 and of 3 next to the poles; where
    // one of the two rows is black the weight is off by that, upwards or downwards.
    for (y_max, factor) in [(0.9, 1.2 * 1.2), (1.0, 3.0 * 3.0)] {
        let (least, greatest) = range(y_max);
        assert!(least > 0.0 && greatest < factor * least, "{least} {greatest} up to {y_max}");
    }
}

/// Chi-square of the samples of an image against its density, in bins of (u, v).
#[test]
fn image_samples_are_distributed_as_their_density_says() {
    chi_square_of_image_samples(&RECEIVER, 300);
    // Only what is brighter than the mean: the sun and the sky about it.
    chi_square_of_image_samples(&LOOKING, 20);
    // The sun, at a height that is as likely as the way along it.
    chi_square_of_image_samples(&BESIDE_PORTALS, 12);
}

#[test]
fn what_is_even_is_seen_with_the_density_zero_where_others_find_it() {
    let grey = Rgb::grey(0.7);
    let bare = Gradient { up: Vec3::Y, zenith: grey, horizon: grey, nadir: grey };
    let image = Environment::image(4, 2, vec![grey; 8], 0.0, 1.0).unwrap();
    let even = [only(image), only(Environment::studio(bare, vec![]))];
    for (even, to) in even.iter().flat_map(|even| [(even, LOOKING), (even, BESIDE_PORTALS)]) {
        let (mut receivers, mut directions) = (Receivers::default(), Vectors::default());
        receivers.set(3, &to);
        directions.set(3, Vec3::Y);
        let environment = even.environment.as_ref().unwrap();
        let (le, pdf) = even.environment_and_pdf_eight(environment, &receivers, &directions);
        assert_eq!((le[0][3], pdf[3]), (0.7, 0.0), "{:?}", to.rivals);
        assert_eq!(even.sample(&to, 0.5, [0.5; 2]), None);
    }
}

fn chi_square_of_image_samples(to: &Receiver, least_bins: i32) {
    const BINS: [usize; 2] = [32, 24];
    const FINE: usize = 24;
    let lights = only(sky(16, 8, 0.0));
    let n = 200_000u32;
    let mut expected = vec![0.0; BINS[0] * BINS[1]];
    for (bin, expected) in expected.iter_mut().enumerate() {
        for fine in 0..FINE * FINE {
            let u = ((bin % BINS[0] * FINE + fine % FINE) as f64 + 0.5) / (BINS[0] * FINE) as f64;
            let v = ((bin / BINS[0] * FINE + fine / FINE) as f64 + 0.5) / (BINS[1] * FINE) as f64;
            let pdf = f64::from(lights.pdf_environment(to, look_up(u, v)));
            let area = 2.0 * PI * PI * (PI * v).sin() / (BINS[0] * BINS[1] * FINE * FINE) as f64;
            *expected += f64::from(n) * pdf * area;
        }
    }
    let mut found = vec![0.0; BINS[0] * BINS[1]];
    for i in 0..n {
        let (choice, u) = numbers(4, i);
        let wi = lights.sample(to, choice, u).expect("the sky shines").wi.as_dvec3();
        let u = (wi.x.atan2(-wi.z) / (2.0 * PI)).rem_euclid(1.0);
        let v = wi.y.clamp(-1.0, 1.0).acos() / PI;
        let [x, y] = [u * BINS[0] as f64, v * BINS[1] as f64].map(|b| b as usize);
        found[y.min(BINS[1] - 1) * BINS[0] + x.min(BINS[0] - 1)] += 1.0;
    }
    // Bins that expect fewer than 5 are one.
    let (mut pooled, mut chi_square, mut bins) = ([0.0; 2], 0.0, 0);
    for (expected, found) in expected.into_iter().zip(found) {
        if expected < 5.0 {
            pooled = [pooled[0] + expected, pooled[1] + found];
        } else {
            chi_square += (found - expected) * (found - expected) / expected;
            bins += 1;
        }
    }
    assert!((pooled[1] - pooled[0]).abs() < 5.0 * f64::max(pooled[0], 1.0).sqrt(), "{pooled:?}");
    let freedom = f64::from(bins - 1);
    assert!(
        bins > least_bins && chi_square < freedom + 5.0 * (2.0 * freedom).sqrt(),
        "{chi_square} of {bins} bins"
    );
}

#[test]
fn the_image_lies_as_documented() {
    // Red sky, green ground; blue at the left edge, which is -z.
    let (width, height) = (64, 32);
    let pixels = (0..width * height).map(|i| {
        let edge = i % width == 0 || i % width == width - 1;
        Rgb::new(
            if i < width * height / 2 { 1.0 } else { 0.0 },
            (i / width) as f32,
            if edge { 1.0 } else { 0.0 },
        )
    });
    let at = |rotation, wi| {
        Environment::image(width, height, pixels.clone().collect(), rotation, 2.0).unwrap().le(wi)
    };
    assert_eq!(at(0.0, Vec3::Y).r, 2.0);
    assert_eq!(at(0.0, Vec3::NEG_Y).r, 0.0);
    let off_level = |x: f32, z: f32| Vec3::new(x, 0.3, z).normalize();
    assert!((at(0.0, off_level(0.0, -1.0)).b - 2.0).abs() < 1e-3);
    assert_eq!(at(0.0, off_level(0.0, 1.0)).b, 0.0);
    // A quarter turn, counter-clockwise from above, takes -z to -x.
    assert!((at(90.0, off_level(-1.0, 0.0)).b - 2.0).abs() < 1e-3);
    assert_eq!(at(90.0, off_level(0.0, -1.0)).b, 0.0);
    // Row j has green j: bilinear between the middles of the rows.
    let v = 10.25 / height as f64;
    assert!((at(0.0, look_up(0.4, v)).g - 2.0 * 9.75).abs() < 1e-3);
    // +x is the left quarter.
    let quarters = [1.0, 2.0, 3.0, 4.0].map(Rgb::grey).to_vec();
    let quarters = Environment::image(4, 1, quarters, 0.0, 1.0).unwrap();
    assert_eq!((quarters.le(look_up(0.125, 0.5)).g * 1e3).round(), 1e3);
    assert!((quarters.le(Vec3::X).g - 1.5).abs() < 1e-5 && (quarters.le(Vec3::NEG_X).g - 3.5).abs() < 1e-5);
}

#[test]
fn gradients_and_softboxes_show_what_they_are_told() {
    let up = Vec3::new(0.0, 0.6, 0.8);
    let lemon = Rgb::new(1.0, 1.0, 0.3);
    let sky = Environment::gradient(2.0 * up, lemon, Rgb::BLACK, Rgb::BLACK);
    for i in 0..100 {
        let wi = warp::uniform_sphere(numbers(5, i).1);
        let expected = lemon * up.dot(wi).max(0.0);
        assert!((sky.le(wi).r - expected.r).abs() < 1e-6 && (sky.le(wi).b - expected.b).abs() < 1e-6);
    }
    let dark = Gradient { up: Vec3::Y, zenith: Rgb::BLACK, horizon: Rgb::BLACK, nadir: Rgb::BLACK };
    let softbox = Softbox { toward: Vec3::X, half_size: [0.5, 0.25], radiance: Rgb::WHITE, softness: 0.1 };
    let studio = Environment::studio(dark, vec![softbox]);
    let at = |level: f32, upright: f32| studio.le(Vec3::new(1.0, upright, level).normalize()).g;
    assert_eq!([at(0.0, 0.0), at(0.44, 0.0), at(0.0, -0.22)], [1.0; 3]);
    assert_eq!([at(0.51, 0.0), at(0.0, 0.26), studio.le(Vec3::NEG_X).g], [0.0; 3]);
    assert!(at(0.475, 0.0) > 0.4 && at(0.475, 0.0) < 0.6);
}

#[test]
fn bad_images_are_refused_and_black_environments_cost_nothing() {
    let size = Environment::image(2, 2, vec![Rgb::WHITE; 3], 0.0, 1.0).unwrap_err();
    assert_eq!(size, EnvironmentImageError::Size { width: 2, height: 2, found: 3 });
    assert!(Environment::image(0, 0, vec![], 0.0, 1.0).is_err());
    let pixels = vec![Rgb::WHITE, Rgb::WHITE, Rgb::grey(f32::NAN), Rgb::WHITE];
    let nan = Environment::image(2, 2, pixels, 0.0, 1.0).unwrap_err();
    assert_eq!(nan, EnvironmentImageError::NotFinite { x: 0, y: 1 });
    for black in [
        Environment::constant(Rgb::BLACK),
        Environment::image(2, 2, vec![Rgb::grey(-1.0); 4], 0.0, 1.0).unwrap(),
        Environment::product_shot(0.0, 0.0),
    ] {
        let lights = only(black);
        assert!(lights.is_empty());
        assert_eq!(lights.sample(&RECEIVER, 0.5, [0.5; 2]), None);
        assert_eq!(lights.pdf_environment(&RECEIVER, Vec3::Y), 0.0);
    }
}

#[test]
fn a_product_shot_lights_a_white_sphere_to_about_one() {
    let lights = only(Environment::product_shot(1.0, 0.0));
    let front = |to: &Receiver| -> f32 {
        let samples = (0..20_000).filter_map(|i| {
            let (choice, u) = numbers(6, i);
            lights.sample(to, choice, u).map(|s| s.le_over_pdf.g * s.wi.dot(to.n).max(0.0))
        });
        samples.sum::<f32>() / 20_000.0 / PI as f32
    };
    let n = Vec3::new(-0.3, 0.5, 0.8).normalize();
    let radiance = front(&Receiver { p: Vec3::ZERO, n, rivals: Rivals::None });
    assert!((0.7..1.3).contains(&radiance), "{radiance}");
}

#[test]
fn near_far_and_surrounding_light_add_up() {
    let to = Receiver { p: Vec3::ZERO, n: Vec3::Y, rivals: Rivals::None };
    let lights = || {
        vec![
            Light::rectangle(Vec3::new(1.0, 2.0, 0.0), Vec3::X, Vec3::Z, Rgb::WHITE, false),
            Light::rectangle(Vec3::new(0.0, 2.0, 0.0), Vec3::X, Vec3::Z, Rgb::WHITE, false),
            Light::point(Vec3::new(0.0, 3.0, 0.0), Rgb::WHITE, true, true),
            Light::point(Vec3::new(0.0, 4.0, 3.0), Rgb::WHITE, false, true),
            Light::directional(Vec3::new(0.0, -1.0, 2.0), Rgb::WHITE, true),
            Light::directional(Vec3::new(0.0, 1.0, 0.5), Rgb::WHITE, true),
        ]
    };
    let irradiance = |lights: Lights, n: u32| {
        let (mut sum, mut squares) = (0.0, 0.0);
        for i in 0..n {
            let (choice, u) = numbers(7, i);
            let sample = lights.sample(&to, choice, u);
            let x = sample.map_or(0.0, |s| f64::from(s.le_over_pdf.g * s.wi.dot(to.n).max(0.0)));
            sum += x;
            squares += x * x;
        }
        let mean = sum / f64::from(n);
        (mean, ((squares / f64::from(n) - mean * mean).max(0.0) / f64::from(n)).sqrt())
    };
    for copies in [1, 3] {
        let environment = Environment::constant(Rgb::grey(0.2));
        let many = (0..copies).flat_map(|_| lights()).collect();
        let (all, error) = irradiance(Lights::new(many, Some(environment)), 100_000);
        let single = lights().into_iter().map(|light| irradiance(Lights::new(vec![light], None), 20_000));
        let (sum, variance) = single.fold((0.0, 0.0), |(s, v), (x, e)| (s + x, v + e * e));
        let exact = 0.2 * PI + f64::from(copies) * sum;
        let bound = 5.0 * (error * error + f64::from(copies * copies) * variance).sqrt() + 1e-5 * exact;
        assert!((all - exact).abs() < bound, "{copies} of each: {all} is not {exact} +- {bound}");
    }
}
