//! Rays guided to caustics: the light that a mirror throws on a wall has a closed form, guided or not, with less noise.

mod common;

use common::{assert_mean, mean_and_error, picture, picture_on, scene_with};
use gloss::accel::Backend;
use gloss::film::Film;
use gloss::render::RenderOptions;
use gloss::scene::Scene;

/// A point of a floor beside a lamp, before a tall mirror at x = -1, which shows the lamp at x = -3. A ray from the floor
/// rises on its way over the mirror, so that the floor never sees itself.
const MIRROR_AND_LAMP: &str = r#"
    [settings]
    max_depth = 2
    at_max_depth = "black"
    [camera]
    eye = [0, 3, 0.2]
    look_at = [0, 0, 0]
    resolution = [8, 8]
    fov_deg = 0.1
    [materials.floor]
    type = "diffuse"
    cd = [0.6, 0.6, 0.6]
    [materials.wall]
    type = "mirror"
    kr = 0.9
    [[shapes]]
    type = "rect"
    corner = [-0.6, 0, 0.6]
    u = [1.2, 0, 0]
    v = [0, 0, -1.2]
    material = "floor"
    [[shapes]]
    type = "rect"
    corner = [-1, 0, 2]
    u = [0, 2, 0]
    v = [0, 0, -4]
    material = "wall"
    [[lights]]
    type = "sphere"
    center = [1, 1, 0]
    radius = 0.1
    radiance = [50, 50, 50]
"#;

/// What the floor shows of the lamp and of its image: a sphere of radius r at distance d puts `pi L (r / d)^2 cos` on a
/// surface.
fn expected() -> f64 {
    let lamp = |dx: f64, dy: f64| {
        let squared = dx * dx + dy * dy;
        50.0 * 0.01 / squared * (dy / squared.sqrt())
    };
    0.6 * (lamp(1.0, 1.0) + 0.9 * lamp(3.0, 1.0))
}

fn film(settings: &[(&str, &str)]) -> Film {
    picture(&scene_with(MIRROR_AND_LAMP, settings)).film
}

const UNGUIDED: (&str, &str) = ("settings.guiding", "false");

#[test]
fn light_thrown_by_a_mirror_has_its_closed_form() {
    for way in ["mis", "light", "lobe"] {
        let settings = [("settings.spp", "1024"), ("settings.direct_light", way)];
        assert_mean(&film(&settings), expected(), &format!("guided, {way}"));
        assert_mean(&film(&[&settings[..], &[UNGUIDED]].concat()), expected(), &format!("unguided, {way}"));
    }
}

#[test]
fn what_a_metal_throws_is_the_same_guided_or_not_but_for_the_noise() {
    let text = MIRROR_AND_LAMP.replace("kr = 0.9", "reflectance = 0.9");
    let metal =
        [("settings.spp", "1024"), ("materials.wall.type", "conductor"), ("materials.wall.alpha", "0.05")];
    let film = |settings: &[(&str, &str)]| picture(&scene_with(&text, settings)).film;
    let (guided, guided_error) = mean_and_error(&film(&metal));
    let (unguided, unguided_error) = mean_and_error(&film(&[&metal[..], &[UNGUIDED]].concat()));
    let error = guided_error.hypot(unguided_error);
    assert!((guided - unguided).abs() < 5.0 * error, "{guided} and {unguided}, standard error {error}");
    assert!(4.0 * guided_error < unguided_error, "errors {guided_error} and {unguided_error}");
}

#[test]
fn guided_rays_have_a_small_part_of_the_variance() {
    let spp = ("settings.spp", "256");
    let (_, guided) = mean_and_error(&film(&[spp]));
    let (_, unguided) = mean_and_error(&film(&[spp, UNGUIDED]));
    assert!(20.0 * guided.powi(2) < unguided.powi(2), "standard errors {guided} and {unguided}");
}

#[test]
fn a_guided_picture_is_the_same_on_any_number_of_threads() {
    let scene: Scene = scene_with(MIRROR_AND_LAMP, &[("settings.spp", "8")]);
    let on =
        |threads| picture_on(&scene, Backend::Bvh, &RenderOptions { threads, ..Default::default() }).film;
    assert_eq!(on(1).image(), on(3).image());
}
