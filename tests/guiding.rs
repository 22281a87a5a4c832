//! Guided rays: the light that a mirror or a bright wall throws on a floor has a closed form, guided or not, with less noise.

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
fn glossy_floors_show_the_same_guided_or_not_but_for_the_noise() {
    let floor = "type = \"diffuse\"\n    cd = [0.6, 0.6, 0.6]";
    // From where the lamp's image in the mirror is near the floor's mirror direction.
    let text = MIRROR_AND_LAMP.replace("[0, 3, 0.2]", "[3, 1.2, 0.2]");
    let power = |exponent: f32, horizon: &str| {
        format!("type = \"cosine-power\"\n kr = 0.8\n exponent = {exponent}\n horizon = \"{horizon}\"")
    };
    for glossy in [
        "type = \"conductor\"\n metal = \"copper\"\n alpha = 0.3".to_owned(),
        "type = \"plastic\"\n cd = [0.6, 0.5, 0.4]\n alpha = 0.2".to_owned(),
        power(5.0, "fold"),
        power(20.0, "fold-weighted"),
        power(20.0, "clip"),
        power(20.0, "modified-phong"),
        power(5.0, "fold") + "\n kd = 0.4\n cd = [0.5, 0.6, 0.7]",
    ] {
        assert!(text.contains(floor));
        let text = text.replace(floor, &glossy);
        let spp = ("settings.spp", "1024");
        let film = |settings: &[(&str, &str)]| picture(&scene_with(&text, settings)).film;
        let (guided, guided_error) = mean_and_error(&film(&[spp]));
        let (unguided, unguided_error) = mean_and_error(&film(&[spp, UNGUIDED]));
        let error = guided_error.hypot(unguided_error);
        assert!((guided - unguided).abs() < 5.0 * error, "{glossy}: {guided} and {unguided}, error {error}");
        assert!(2.0 * guided_error < unguided_error, "{glossy}: errors {guided_error} and {unguided_error}");
    }
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

/// A floor under a white square that a light from below shines on, but not on the floor.
const BRIGHT_SQUARE: &str = r#"
    [settings]
    max_depth = 1
    at_max_depth = "black"
    glossy_samples = 1
    [camera]
    eye = [0, 1, 3]
    look_at = [0, 0, 0]
    resolution = [8, 8]
    fov_deg = 0.1
    [materials.floor]
    type = "diffuse"
    cd = [0.6, 0.6, 0.6]
    [materials.square]
    type = "diffuse"
    cd = [0.9, 0.9, 0.9]
    [[shapes]]
    type = "rect"
    corner = [-0.1, 0, 0.1]
    u = [0.2, 0, 0]
    v = [0, 0, -0.2]
    material = "floor"
    [[shapes]]
    type = "rect"
    corner = [0.2, 1.5, -0.8]
    u = [0.6, 0, 0]
    v = [0, 0, 0.6]
    material = "square"
    [[lights]]
    type = "directional"
    direction = [0, 1, 0]
    irradiance = [20, 20, 20]
"#;

/// What the floor shows of the square: Lambert's irradiance by a polygon, edge by edge.
fn of_square() -> f64 {
    let corners = [[0.2, -0.8], [0.8, -0.8], [0.8, -0.2], [0.2, -0.2]]
        .map(|[x, z]| glam::DVec3::new(x, 1.5, z).normalize());
    let edge = |i: usize| {
        let (a, b) = (corners[i], corners[(i + 1) % 4]);
        a.angle_between(b) * a.cross(b).normalize().y
    };
    let irradiance = 0.5 * (0..4).map(edge).sum::<f64>().abs() * (0.9 * 20.0 / std::f64::consts::PI);
    0.6 / std::f64::consts::PI * irradiance
}

fn of_floor(guiding: &str, spp: &str) -> Film {
    let settings = [("settings.spp", spp), ("settings.indirect_guiding", guiding)];
    picture(&scene_with(BRIGHT_SQUARE, &settings)).film
}

#[test]
fn light_thrown_by_a_bright_wall_has_its_closed_form_with_a_small_part_of_the_variance() {
    let films = ["never", "always", "auto"].map(|guiding| {
        let film = of_floor(guiding, "1024");
        assert_mean(&film, of_square(), guiding);
        film
    });
    let [never, always, auto] = films.each_ref().map(|film| mean_and_error(film).1);
    assert!(5.0 * always.powi(2) < never.powi(2), "standard errors {always} and {never}");
    assert_eq!(auto, always, "the pilot finds it worth it");
}

#[test]
fn a_pilot_follows_guides_where_they_are_worth_it() {
    let settings = [("settings.spp", "4")];
    assert!(picture(&scene_with(BRIGHT_SQUARE, &settings)).guides_indirect);
    assert!(
        !picture(&scene_with(BRIGHT_SQUARE, &[settings[0], ("settings.indirect_guiding", "never")]))
            .guides_indirect
    );
    assert!(!picture(&scene_with(MIRROR_AND_LAMP, &settings)).guides_indirect, "there are caustics alone");
}

#[test]
fn a_picture_guided_to_a_bright_wall_is_the_same_on_any_number_of_threads() {
    let scene: Scene =
        scene_with(BRIGHT_SQUARE, &[("settings.spp", "8"), ("settings.indirect_guiding", "always")]);
    let on =
        |threads| picture_on(&scene, Backend::Bvh, &RenderOptions { threads, ..Default::default() }).film;
    assert_eq!(on(1).image(), on(3).image());
}
