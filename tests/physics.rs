//! Pictures of scene files against closed forms: the whole way from the text to the pixel.
//!
//! Where a picture has noise, its mean must lie within 5 of its own standard errors.

mod common;

use common::*;
use gloss::accel::Backend;
use gloss::render::RenderOptions;

const SKY: &str = "[environment]\ntype = \"constant\"\nradiance = [1, 1, 1]";

/// Wallis' integral of sin^n over a quarter turn.
fn wallis(n: u32) -> f64 {
    match n {
        0 => std::f64::consts::FRAC_PI_2,
        1 => 1.0,
        n => wallis(n - 2) * f64::from(n - 1) / f64::from(n),
    }
}

/// Mass below the surface of the lobe of integer exponent `e` at incidence `theta`: `J_{e+1}` of the recurrence
/// `J_{n+2} = J_n - cos sin^n W_n / pi`.
fn mass_below(e: u32, theta: f64) -> f64 {
    let n = e + 1;
    let first = if n.is_multiple_of(2) { 0.5 } else { theta / std::f64::consts::PI };
    (n % 2..n)
        .step_by(2)
        .fold(first, |j, k| j - theta.cos() / std::f64::consts::PI * theta.sin().powi(k as i32) * wallis(k))
}

/// `B(e, theta)` of modified Phong's albedo and of the gradient sky: `(e+2)/(2 pi) sin^{e+2} Beta((e+1)/2, 3/2)`.
fn bend(e: u32, theta: f64) -> f64 {
    // Beta((e+1)/2, 3/2) = 2 W_e / (e+2).
    wallis(e) / std::f64::consts::PI * theta.sin().powi(e as i32 + 2)
}

fn modified_phong_albedo(e: u32, theta: f64) -> f64 {
    theta.cos() * (1.0 - mass_below(e + 1, theta)) + bend(e, theta)
}

#[test]
fn the_furnace_value_of_every_horizon_policy_is_its_closed_form() {
    for (e, degrees) in [(0, 40.0), (1, 45.0), (1, 75.0), (10, 60.0), (10, 80.0), (100, 85.0), (1000, 88.0)] {
        let theta = f64::to_radians(degrees);
        let above = 1.0 - mass_below(e, theta);
        for (horizon, expected) in [
            ("fold", 1.0),
            ("reject", 1.0),
            ("fold-weighted", above),
            ("clip", above),
            ("modified-phong", modified_phong_albedo(e, theta)),
        ] {
            let text = glossy_plate(degrees, f64::from(e), horizon, 64, SKY);
            for direct in ["lobe", "mis", "light"] {
                let outcome = picture(&scene_with(&text, &[("settings.direct_light", direct)]));
                let what = format!("{horizon} {direct} e={e} at {degrees} degrees");
                assert_mean(&outcome.film, expected, &what);
            }
        }
    }
}

#[test]
fn the_gradient_sky_tells_the_policies_apart() {
    let sky =
        "[environment]\ntype = \"gradient\"\nzenith = [1, 1, 1]\nhorizon = [0, 0, 0]\nnadir = [0, 0, 0]";
    for (e, degrees) in [(1, 45.0), (10, 70.0), (100, 85.0), (3, 20.0)] {
        let theta = f64::to_radians(degrees);
        let shrink = f64::from(e + 1) / f64::from(e + 2);
        let clip = shrink * modified_phong_albedo(e, theta);
        let fold = shrink * (theta.cos() + 2.0 * bend(e, theta));
        for (horizon, expected) in [
            ("clip", clip),
            ("fold-weighted", clip),
            ("fold", fold),
            ("reject", clip / (1.0 - mass_below(e, theta))),
        ] {
            let text = glossy_plate(degrees, f64::from(e), horizon, 256, sky);
            assert_mean(
                &picture(&scene(&text)).film,
                expected,
                &format!("{horizon} e={e} at {degrees} degrees"),
            );
        }
    }
}

#[test]
fn a_sphere_without_folding_has_the_dark_rim_of_its_closed_form() {
    let text = |horizon| {
        format!(
            r#"
            [settings]
            spp = 256
            max_depth = 1
            at_max_depth = "black"
            direct_light = "lobe"
            horizon = "{horizon}"
            [camera]
            eye = [0, 0, 2000]
            look_at = [0, 0, 0]
            resolution = [41, 41]
            fov_deg = 0.06
            [environment]
            type = "constant"
            radiance = [0.8, 0.9, 1.0]
            [materials.m]
            type = "cosine-power"
            kr = 0.8
            exponent = 1
            [[shapes]]
            type = "sphere"
            material = "m"
            "#
        )
    };
    let image = |horizon| picture(&scene(&text(horizon))).film;
    let (folded, dark) = (image("fold"), image("clip"));
    let half = 2000.0 * f64::to_radians(0.03).tan();
    for (i, (bright, rim)) in folded.pixels.iter().zip(&dark.pixels).enumerate() {
        let at = |k: usize| (k as f64 + 0.5 - 20.5) / 20.5 * half;
        let sin = at(i % 41).hypot(at(i / 41));
        if sin > 0.93 {
            continue;
        }
        for (channel, expected) in [0.64, 0.72, 0.8].into_iter().enumerate() {
            let mean = bright.sum[channel].to_f64() / f64::from(bright.count);
            assert!((mean - expected).abs() < 1e-5, "pixel {i}: {mean}");
        }
        let above = (1.0 + (1.0 - sin * sin).sqrt()) / 2.0;
        let expected = 0.8 * above;
        let mean = rim.sum[2].to_f64() / f64::from(rim.count);
        // A pixel is 0.05 wide: the profile bends by its second derivative over that.
        let curvature = 0.4 / (1.0 - sin * sin).powf(1.5) * (2.0 * half / 41.0f64).powi(2) / 12.0;
        let tolerance = 5.0 * 0.8 * (above * (1.0 - above) / 256.0).sqrt() + curvature;
        assert!((mean - expected).abs() < tolerance, "pixel {i}, sin {sin}: {mean} instead of {expected}");
    }
}

#[test]
fn a_bright_sphere_on_the_axis_fills_its_cone_of_the_lobe() {
    for (ratio, e) in [(0.1f64, 10), (0.1, 100), (0.1, 1000), (0.01, 10_000), (0.01, 100_000), (0.3, 3)] {
        let light = format!(
            "[[lights]]\ntype = \"sphere\"\ncenter = [-10, 10, 0]\nradius = {}\nradiance = [1, 1, 1]",
            ratio * 200f64.sqrt()
        );
        let expected = 1.0 - (1.0 - ratio * ratio).sqrt().powi(e + 1);
        for (direct, candidates) in
            [("mis", "1"), ("lobe", "1"), ("light", "1"), ("mis", "4"), ("light", "4")]
        {
            let text = glossy_plate(45.0, f64::from(e), "fold", 256, &light);
            // The whole cone is above the surface, but a wide lobe folds some of its mass into it.
            let overrides = [
                ("settings.direct_light", direct),
                ("settings.light_candidates", candidates),
                ("settings.horizon", "\"clip\""),
            ];
            let outcome = picture(&scene_with(&text, &overrides));
            let what = format!("R/D={ratio} e={e} {direct}, {candidates} candidates");
            assert_mean(&outcome.film, expected, &what);
        }
    }
}

#[test]
fn a_bright_disk_on_the_axis_fills_its_cone_of_the_lobe() {
    for (ratio, e) in [(0.1f64, 100), (0.5, 10)] {
        let light = format!(
            "[[lights]]\ntype = \"disk\"\ncenter = [-10, 10, 0]\nnormal = [1, -1, 0]\nradius = {}\nradiance = [1, 1, 1]",
            ratio * 200f64.sqrt()
        );
        let expected = 1.0 - (1.0 + ratio * ratio).sqrt().recip().powi(e + 1);
        let text = glossy_plate(45.0, f64::from(e), "clip", 1024, &light);
        let (mean, error) = mean_and_error(&picture(&scene(&text)).film);
        // The disk is a polygon of 128 corners: smaller than the circle by 4e-4 of its area.
        assert!((mean - expected).abs() < 5.0 * error + 4.1e-4 * expected, "{mean} {expected} {error}");
    }
}

#[test]
fn a_square_light_has_arvos_moments() {
    // Half size 1 at height 1 on the axis, and a tilted one: see reference values in oracles.json.
    let on_axis = "[[lights]]\ntype = \"rect\"\ncorner = [-1, 1, -1]\nu = [2, 0, 0]\nv = [0, 0, 2]\nradiance = [1, 1, 1]";
    for (e, expected) in
        [(1, 0.554_126_423_98), (2, 0.700_885_930_28), (5, 0.908_183_295_96), (10, 0.986_572_902_76)]
    {
        for (direct, candidates) in
            [("mis", "1"), ("lobe", "1"), ("light", "1"), ("mis", "5"), ("light", "5")]
        {
            // Seen from below the light: between the plate and the light, straight down.
            let text = glossy_plate(0.0, f64::from(e), "clip", 256, on_axis)
                .replace("eye = [0, 100, 0.0]", "eye = [0, 0.9, 0.0]");
            let overrides = [("settings.direct_light", direct), ("settings.light_candidates", candidates)];
            let outcome = picture(&scene_with(&text, &overrides));
            assert_mean(&outcome.film, expected, &format!("e={e} {direct}, {candidates} candidates"));
        }
    }
    let tilted = "[[lights]]\ntype = \"rect\"\ncorner = [-1.5, 1, -0.5]\nu = [1, 0, 0]\nv = [0, 0, 1]\nradiance = [1, 1, 1]";
    for (e, clipped, phong) in [
        (1, 0.110_872_492_19, 0.122_512_130_99),
        (10, 0.465_038_530_08, 0.374_803_247_65),
        (100, 0.988_494_491_54, 0.756_412_322_10),
    ] {
        for (horizon, expected) in [("clip", clipped), ("modified-phong", phong)] {
            let text = glossy_plate(40.0, f64::from(e), horizon, 256, tilted);
            assert_mean(&picture(&scene(&text)).film, expected, &format!("tilted, {horizon} e={e}"));
        }
    }
}

#[test]
fn splitting_divides_the_lobes_variance_and_nothing_else() {
    // Half of the lobe is lit: the edge of a sky of two halves goes through the mirror direction.
    let sky = "[environment]\ntype = \"studio\"\nbackground = [0, 0, 0]\nsoftboxes = [{ direction = [0, 0, 1], \
               width_deg = 179.9, height_deg = 179.9, radiance = [1, 1, 1] }]";
    let variance_of_a_sample = |m: u32| {
        let text = glossy_plate(0.0, 30.0, "fold", 1024, sky);
        let m = m.to_string();
        let overrides = [("settings.glossy_samples", m.as_str()), ("settings.direct_light", "lobe")];
        let film = picture(&scene_with(&text, &overrides)).film;
        film.pixels.iter().map(|p| p.variance_of_mean() * f64::from(p.count)).sum::<f64>()
            / film.pixels.len() as f64
    };
    let f = {
        let film = picture(&scene_with(&glossy_plate(0.0, 30.0, "fold", 256, sky), &[])).film;
        mean_and_error(&film).0
    };
    assert!((f - 0.5).abs() < 0.01, "{f}");
    for m in [1, 4, 9] {
        let expected = f * (1.0 - f) / f64::from(m);
        let variance = variance_of_a_sample(m);
        assert!((variance / expected - 1.0).abs() < 0.03, "m={m}: {variance} instead of {expected}");
    }
}

/// Two facing walls that shine with radiance 1 and reflect the fraction k; the camera between them.
fn parallel_mirrors(k: f64, depth: u32) -> String {
    format!(
        r#"
        [settings]
        spp = 1
        max_depth = {depth}
        at_max_depth = "black"
        roulette_from = 4294967295
        [camera]
        eye = [0, 0.25, 0]
        look_at = [0, 0, 0]
        up = [0, 0, 1]
        resolution = [8, 8]
        fov_deg = 0.001
        [materials.mirror]
        type = "mirror"
        kr = {k}
        [[shapes]]
        type = "rect"
        corner = [-9, 0, 9]
        u = [18, 0, 0]
        v = [0, 0, -18]
        material = "mirror"
        [[shapes]]
        type = "rect"
        corner = [-9, 1, -9]
        u = [18, 0, 0]
        v = [0, 0, 18]
        material = "mirror"
        "#
    )
}

#[test]
fn between_parallel_mirrors_the_lost_throughput_is_the_power_of_the_reflectance() {
    for (k, depth) in [(0.9, 0), (0.9, 5), (0.9, 19), (0.5, 5), (0.99, 50), (1.0, 1000)] {
        let outcome = picture(&scene(&parallel_mirrors(k, depth)));
        let expected = k.powi(depth as i32 + 1);
        let lost = outcome.tally.lost_throughput();
        assert!((lost - expected).abs() < 2e-6 * f64::from(depth + 1), "k={k} D={depth}: {lost}");
        assert_eq!(outcome.tally.all_rays().rays, 64 * u64::from(depth + 1));
    }
}

const KNOT: &str = r#"
    [settings]
    spp = 4
    [camera]
    eye = [0, 0, 4]
    resolution = [64, 64]
    [environment]
    type = "studio"
    [materials.m]
    type = "cosine-power"
    cr = [0.9, 0.8, 0.7]
    exponent = "inf"
    [[shapes]]
    type = "generated"
    kind = "knot"
    triangles = 20000
    material = "m"
"#;

#[test]
fn an_infinite_exponent_is_the_mirror_bit_for_bit_and_a_huge_one_nearly() {
    let infinite = picture(&scene(KNOT)).film;
    let mirror = KNOT.replace("cosine-power", "mirror").replace("exponent = \"inf\"", "");
    assert_eq!(infinite.pixels, picture(&scene(&mirror)).film.pixels);

    let huge = picture(&scene_with(KNOT, &[("materials.m.exponent", "1e9")])).film;
    let difference = |(a, b): (&gloss::film::Pixel, &gloss::film::Pixel)| {
        let (a, b) = (a.mean(), b.mean());
        f64::from((a.r - b.r).abs().max((a.g - b.g).abs()).max((a.b - b.b).abs()))
    };
    let differences: Vec<f64> = infinite.pixels.iter().zip(&huge.pixels).map(difference).collect();
    let mean = differences.iter().sum::<f64>() / differences.len() as f64;
    assert!(mean < 1e-3, "mean difference {mean}");
}

#[test]
fn at_normal_incidence_folding_and_clipping_are_the_same() {
    let sky = "[environment]\ntype = \"studio\"";
    for e in [0.0, 1.0, 30.0] {
        let [fold, clip] =
            ["fold", "clip"].map(|horizon| picture(&scene(&glossy_plate(0.0, e, horizon, 16, sky))).film);
        let worst = fold
            .pixels
            .iter()
            .zip(&clip.pixels)
            .map(|(a, b)| (a.mean() - b.mean()).map(f32::abs).max_channel())
            .fold(0.0, f32::max);
        assert!(worst < 1e-3, "e={e}: {worst}");
    }
}

#[test]
fn brightness_is_linear_in_the_reflectance() {
    let sky = "[environment]\ntype = \"studio\"";
    let text = glossy_plate(50.0, 20.0, "fold", 16, sky);
    let at = |kr: &str| mean_and_error(&picture(&scene_with(&text, &[("materials.plate.kr", kr)])).film).0;
    assert!((at("0.25") * 4.0 - at("1.0")).abs() < 1e-5);
}

#[test]
fn the_backends_make_the_same_picture() {
    let scene = scene(KNOT);
    let of = |backend| picture_on(&scene, backend, &RenderOptions::default()).film;
    let bvh = of(Backend::Bvh);
    let others = if cfg!(feature = "embree") { vec![Backend::Embree] } else { vec![] };
    for backend in others {
        let film = of(backend);
        let pairs = || bvh.pixels.iter().zip(&film.pixels);
        let differ =
            pairs().filter(|(a, b)| (a.mean() - b.mean()).map(f32::abs).max_channel() > 1e-3).count();
        // An edge of the knot may fall on the other side of a ray by one rounding.
        assert!(differ * 500 < bvh.pixels.len(), "{backend:?}: {differ} pixels differ");
    }
}

#[test]
fn without_highlights_a_glossy_surface_shows_the_mean_of_its_rays() {
    // Under an even sky every ray sees the same, and so there is no noise at all.
    for direct in ["mis", "light", "lobe"] {
        let overrides = [("settings.highlights", "false"), ("settings.direct_light", direct)];
        let film = picture(&scene_with(&glossy_plate(70.0, 3.0, "fold", 4, SKY), &overrides)).film;
        for pixel in &film.pixels {
            assert!((pixel.mean().g - 1.0).abs() < 1e-6, "{direct}: {:?}", pixel.mean());
        }
    }
}

#[test]
fn a_pane_of_tinted_glass_lets_through_its_closed_form_whether_paths_go_both_ways_or_one() {
    // Seen head on under an even sky: the first face reflects F; what enters is tinted by t, as is what leaves, and at each
    // face within, F of it is reflected: F + (1 - F)^2 t^2 (1 + F + F^2 + ...).
    let (f, t) = (1.0 / 9.0, 0.5);
    let expected = f + (1.0 - f) * t * t;
    let text = format!(
        r#"
        [settings]
        spp = 64
        max_depth = 24
        at_max_depth = "black"
        sampler = "independent"
        adaptive = false
        [camera]
        eye = [0, 0, 5]
        look_at = [0, 0, 0]
        resolution = [16, 16]
        fov_deg = 0.001
        {SKY}
        [materials.glass]
        type = "dielectric"
        eta = 2
        transmittance = {t}
        [[shapes]]
        type = "rect"
        corner = [-1, -1, 0]
        u = [2, 0, 0]
        v = [0, 2, 0]
        material = "glass"
        [[shapes]]
        type = "rect"
        corner = [-1, -1, -0.5]
        u = [0, 2, 0]
        v = [2, 0, 0]
        material = "glass"
        "#
    );
    let [both, one] = ["true", "false"].map(|both| {
        let film = picture(&scene_with(&text, &[("settings.split_glass", both)])).film;
        assert_mean(&film, expected, &format!("both ways: {both}"));
        mean_and_error(&film).1
    });
    // Chance is left where the light has met three faces.
    assert!(both < 0.3 * one, "standard errors {both} and {one}");
}

#[test]
fn paths_end_where_glass_gives_back_more_light_than_arrives() {
    // A ball of such glass in a mirrored one: no ray gets out, and each way from the glass carries all that arrived.
    let text = r#"
        [settings]
        spp = 1
        max_depth = 200
        at_max_depth = "black"
        roulette_from = 4294967295
        [camera]
        eye = [0, 0, 0.7]
        look_at = [0, 0, 0]
        resolution = [2, 2]
        fov_deg = 20
        [materials.glass]
        type = "dielectric"
        eta = 1.5
        reflectance = 25
        transmittance = 1.05
        [materials.mirror]
        type = "mirror"
        kr = 1
        [[shapes]]
        type = "sphere"
        radius = 0.5
        material = "glass"
        [[shapes]]
        type = "sphere"
        radius = 1
        material = "mirror"
        "#;
    assert!(picture(&scene(text)).film.pixels.iter().all(|pixel| pixel.mean().is_black()));
}
