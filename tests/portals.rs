//! Looking for the environment through portals: what a floor shows of the sky in a hole above it has a closed form, looked for or
//! not, with less noise.

mod common;

use common::{assert_mean, mean_and_error, picture, picture_on, scene_with};
use gloss::accel::Backend;
use gloss::core::Rgb;
use gloss::film::Film;
use gloss::render::RenderOptions;
use gloss::scene::{Environment, Lights, Scene};
use std::f64::consts::PI;

/// A point of a floor in a black box, whose ceiling, at height 1, has a square hole of half the width 0.15. The camera looks in
/// through the hole.
const BOX: &str = r#"
    [settings]
    max_depth = 1
    at_max_depth = "black"
    [camera]
    eye = [0, 3, 0.1]
    look_at = [0, 0, 0]
    resolution = [8, 8]
    fov_deg = 0.1
    [environment]
    type = "constant"
    radiance = [2, 2, 2]
    [materials.floor]
    type = "diffuse"
    cd = [0.6, 0.6, 0.6]
    [materials.wall]
    type = "diffuse"
    cd = [0, 0, 0]
    [[shapes]]
    type = "rect"
    corner = [-1, 0, 1]
    u = [2, 0, 0]
    v = [0, 0, -2]
    material = "floor"
    [[shapes]]
    type = "rect"
    corner = [-1, 0, -1]
    u = [2, 0, 0]
    v = [0, 1, 0]
    material = "wall"
    [[shapes]]
    type = "rect"
    corner = [-1, 0, 1]
    u = [2, 0, 0]
    v = [0, 1, 0]
    material = "wall"
    [[shapes]]
    type = "rect"
    corner = [-1, 0, -1]
    u = [0, 0, 2]
    v = [0, 1, 0]
    material = "wall"
    [[shapes]]
    type = "rect"
    corner = [1, 0, -1]
    u = [0, 0, 2]
    v = [0, 1, 0]
    material = "wall"
    [[shapes]]
    type = "rect"
    corner = [-1, 1, -1]
    u = [2, 0, 0]
    v = [0, 0, 0.85]
    material = "wall"
    [[shapes]]
    type = "rect"
    corner = [-1, 1, 0.15]
    u = [2, 0, 0]
    v = [0, 0, 0.85]
    material = "wall"
    [[shapes]]
    type = "rect"
    corner = [-1, 1, -0.15]
    u = [0.85, 0, 0]
    v = [0, 0, 0.3]
    material = "wall"
    [[shapes]]
    type = "rect"
    corner = [0.15, 1, -0.15]
    u = [0.85, 0, 0]
    v = [0, 0, 0.3]
    material = "wall"
"#;

/// What the floor shows: the form factor of four rectangles with a corner above the point (Howell, C-1), half the width `a`.
fn expected() -> f64 {
    let a: f64 = 0.15;
    let slant = (1.0 + a * a).sqrt();
    let form_factor = 4.0 / (2.0 * PI) * 2.0 * (a / slant * (a / slant).atan());
    0.6 * 2.0 * form_factor
}

fn film(settings: &[(&str, &str)]) -> Film {
    picture(&scene_with(BOX, settings)).film
}

const NO_PORTALS: (&str, &str) = ("settings.portals", "false");

#[test]
fn the_sky_in_a_hole_has_its_closed_form() {
    let spp = ("settings.spp", "1024");
    for way in ["mis", "light", "lobe"] {
        let settings = [spp, ("settings.direct_light", way)];
        assert_mean(&film(&settings), expected(), way);
    }
    assert_mean(&film(&[spp, NO_PORTALS]), expected(), "without portals");
    // No rays of the floor look for the sky.
    assert_mean(&film(&[spp, ("settings.diffuse_bounces", "false")]), expected(), "light samples alone");
    assert_mean(&film(&[spp, ("settings.light_samples", "split")]), expected(), "split");
}

#[test]
fn light_through_portals_has_a_small_part_of_the_variance() {
    // Guides would find the hole too.
    let alone = [("settings.spp", "256"), ("settings.indirect_guiding", "never")];
    let (_, through) = mean_and_error(&film(&alone));
    let (_, without) = mean_and_error(&film(&[alone[0], alone[1], NO_PORTALS]));
    assert!(10.0 * through.powi(2) < without.powi(2), "standard errors {through} and {without}");
}

/// The box with white walls, a lamp, and a sky with a sun.
fn sunlit(portals: &str) -> Scene {
    let lamp = "[[lights]]\ntype = \"sphere\"\ncenter = [0.5, 0.8, 0.3]\nradius = 0.05\nradiance = [1, 1, 1]";
    let settings = [
        ("settings.spp", "256"),
        ("settings.max_depth", "4"),
        ("settings.portals", portals),
        ("materials.wall.cd", "[0.7, 0.7, 0.7]"),
        ("camera.fov_deg", "8.0"),
        ("camera.resolution", "[32, 32]"),
    ];
    let mut scene = scene_with(&format!("{BOX}\n{lamp}"), &settings);
    // A sun that is 4 pixels wide, near the zenith.
    let (width, height) = (64, 32);
    let pixels = (0..width * height).map(|i| {
        let is_sun = i / width == 1 && (20..24).contains(&(i % width));
        Rgb::new(0.5, 0.6, 0.8) * if is_sun { 40.0 } else { 1.0 }
    });
    let sky = Environment::image(width, height, pixels.collect(), 0.0, 1.0).expect("a sky");
    scene.lights = Lights::new(std::mem::take(&mut scene.lights.lights), Some(sky));
    scene
}

#[test]
fn a_room_with_a_lamp_and_the_sun_is_the_same_with_less_noise() {
    let (through, error) = mean_and_error(&picture(&sunlit("true")).film);
    let (without, error_without) = mean_and_error(&picture(&sunlit("false")).film);
    let both = error.hypot(error_without);
    assert!((through - without).abs() < 5.0 * both, "{through} and {without}, standard error {both}");
    assert!(2.0 * error.powi(2) < error_without.powi(2), "standard errors {error} and {error_without}");
}

#[test]
fn a_picture_through_portals_is_the_same_on_any_number_of_threads() {
    let scene: Scene = scene_with(BOX, &[("settings.spp", "8")]);
    let on =
        |threads| picture_on(&scene, Backend::Bvh, &RenderOptions { threads, ..Default::default() }).film;
    assert_eq!(on(1).image(), on(3).image());
}
