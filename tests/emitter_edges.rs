//! Edges of emitters that the camera sees: they cover what they should, with a fraction of the noise, wherever they are.

mod common;

use common::{assert_mean, picture, picture_on, scene_with};
use gloss::accel::Backend;
use gloss::film::{Film, PixelRect};
use gloss::render::RenderOptions;

/// Rays that look for emitters, per sample.
const RAYS: f64 = 16.0;

/// A square of area 1 that faces the camera at distance 10, and a black bar before its middle, of width 0.1 as seen there. The
/// picture is 3.2 wide at the square.
const SQUARE: &str = r#"
    [settings]
    spp = 16
    max_depth = 1
    at_max_depth = "black"
    sampler = "independent"
    [camera]
    eye = [0.013, 0.017, 10]
    look_at = [0.013, 0.017, 0]
    resolution = [32, 32]
    view_plane_distance = 10
    pixel_size = 0.1
    [materials.lamp]
    type = "emissive"
    radiance = [3, 3, 3]
    [materials.black]
    type = "diffuse"
    cd = [0, 0, 0]
    [[shapes]]
    type = "rect"
    corner = [-0.5, -0.5, 0]
    u = [1, 0, 0]
    v = [0, 1, 0]
    material = "lamp"
    [[shapes]]
    type = "rect"
    corner = [-0.025, -5, 5]
    u = [0.05, 0, 0]
    v = [0, 10, 0]
    material = "black"
"#;

fn film(scene: &str, overrides: &[(&str, &str)]) -> Film {
    picture(&scene_with(scene, overrides)).film
}

const PLAIN: (&str, &str) = ("settings.emitter_edges", "false");
const MANY: (&str, &str) = ("settings.spp", "256");

/// Sum of the variances of all pixels.
fn noise(film: &Film) -> f64 {
    film.pixels.iter().map(|pixel| pixel.variance_of_mean()).sum()
}

#[test]
fn a_lamp_shows_as_much_light_as_its_area_with_a_fraction_of_the_noise() {
    // Of 10.24 units of area; the bar covers a tenth of the square.
    let expected = 3.0 * 0.9 / 10.24;
    let [clean, plain] = [&[][..], &[PLAIN]].map(|settings| film(SQUARE, settings));
    assert_mean(&plain, expected, "by the samples alone");
    assert_mean(&clean, expected, "by rays of its own");
    let left = noise(&clean) / noise(&plain) * RAYS;
    assert!((0.9..1.1).contains(&left), "{left} times what the number of rays should leave of the noise");
}

#[test]
fn a_lamp_that_no_corner_of_a_pixel_sees_is_found_by_its_place() {
    // Two fifths of a pixel wide, in the middle of one.
    let ball = SQUARE.replace(
        r#"    [[shapes]]
    type = "rect"
    corner = [-0.5, -0.5, 0]
    u = [1, 0, 0]
    v = [0, 1, 0]"#,
        r#"    [[shapes]]
    type = "sphere"
    center = [0.363, 0.363, 0]
    radius = 0.02"#,
    );
    assert_ne!(ball, SQUARE);
    // A pinhole sees a small ball as a disk.
    let expected = 3.0 * std::f64::consts::PI * 0.0004 / 10.24;
    let [clean, plain] = [&[][..], &[PLAIN]].map(|settings| film(&ball, &[settings, &[MANY]].concat()));
    assert_mean(&plain, expected, "by the samples alone");
    assert_mean(&clean, expected, "by rays of its own");
    let ratio = noise(&clean) / noise(&plain);
    assert!(ratio < 1.5 / RAYS, "{ratio} of the noise is left");
}

#[test]
fn the_dark_side_of_a_lamp_and_one_behind_the_camera_show_nothing() {
    let turned = SQUARE.replace("u = [1, 0, 0]\n    v = [0, 1, 0]", "u = [0, 1, 0]\n    v = [1, 0, 0]");
    let behind = SQUARE.replace("corner = [-0.5, -0.5, 0]", "corner = [-0.5, -0.5, 20]");
    for scene in [turned, behind] {
        assert_ne!(scene, SQUARE);
        let black = film(&scene, &[]);
        assert!(black.pixels.iter().all(|pixel| pixel.mean().is_black()));
    }
}

#[test]
fn any_part_of_the_picture_is_that_part_of_the_whole() {
    for sampler in ["sobol", "blue-noise", "regular"] {
        let scene = scene_with(SQUARE, &[("settings.sampler", sampler), ("settings.adaptive", "false")]);
        let whole = picture(&scene).film;
        let rect = PixelRect { x0: 9, y0: 11, x1: 20, y1: 27 };
        for tile_size in [0, 5] {
            let options =
                RenderOptions { crop: Some(rect), tile_size, threads: 2, ..RenderOptions::default() };
            let part = picture_on(&scene, Backend::Bvh, &options).film;
            for (x, y) in (11..27).flat_map(|y| (9..20).map(move |x| (x, y))) {
                assert_eq!(part.pixel(x, y), whole.pixel(x, y), "{sampler}, pixel {x}, {y}");
            }
        }
    }
}
