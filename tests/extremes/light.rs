//! Dark and bright light, many samples, deep paths.

use super::common::{assert_mean, glossy_plate, picture, scene, scene_with};
use super::extremes;

#[test]
fn light_of_1e_8_and_of_1e8_is_added_without_loss() {
    for radiance in [1e-8, 1.0, 1e8] {
        for e in [0.0, 1.0, 1e3, 1e9] {
            let sky = format!(
                "[environment]\ntype = \"constant\"\nradiance = [{radiance:e}, {radiance:e}, {radiance:e}]"
            );
            let text = glossy_plate(60.0, e, "fold", 16, &sky);
            let half = [("materials.plate.kr", "0.5"), ("settings.direct_light", "lobe")];
            let (least, most) = extremes(&picture(&scene_with(&text, &half)).film);
            let exact = 0.5 * radiance as f32;
            assert!(
                (least / exact - 1.0).abs() < 2e-6 && (most / exact - 1.0).abs() < 2e-6,
                "{least} {most}"
            );
            assert_mean(&picture(&scene_with(&text, &half[..1])).film, 0.5 * radiance, "with light sampling");
        }
    }
}

#[test]
fn a_million_samples_of_one_pixel_have_an_exact_mean() {
    // No f32: a sum in f32 stands still at 2^24 times its terms.
    for radiance in [0.3f32, 1e-8, 3e7] {
        let text = format!(
            "[settings]\nspp = 1000000\n[camera]\nresolution = [1, 1]\n\
             [environment]\ntype = \"constant\"\nradiance = {radiance:e}"
        );
        let film = picture(&scene(&text)).film;
        assert_eq!(film.pixels[0].count, 1_000_000);
        assert_eq!(film.pixels[0].mean().to_array(), [radiance; 3]);
    }
}

#[test]
fn a_thousand_reflections_between_mirrors_that_shine_are_the_geometric_sum() {
    for k in [0.9, 0.999, 1.0] {
        let text = format!(
            r#"
            ambient = 1
            [settings]
            spp = 1
            max_depth = 1000
            at_max_depth = "black"
            roulette_from = 4294967295
            [camera]
            eye = [0, 0.25, 0]
            look_at = [0, 0, 0]
            up = [0, 0, 1]
            resolution = [4, 4]
            fov_deg = 0.001
            [materials.mirror]
            type = "mirror"
            kr = {k}
            ka = 1
            ca = 1
            [[shapes]]
            type = "box"
            min = [-9, 0, -9]
            max = [9, 1, 9]
            material = "mirror"
            "#
        );
        let expected = if k == 1.0 { 1001.0 } else { (1.0 - f64::powi(k, 1001)) / (1.0 - k) };
        let (least, most) = extremes(&picture(&scene(&text)).film);
        // A thousand products of f32.
        for mean in [least, most].map(f64::from) {
            assert!((mean / expected - 1.0).abs() < 6e-5, "k = {k}: {mean} instead of {expected}");
        }
    }
}
