//! What denoisers are told, against closed forms: the plane's normal, the way's length, the colours of mirrors.

mod common;

use common::{picture, picture_on, scene, scene_with};
use gloss::accel::Backend;
use gloss::core::Rgb;
use gloss::film::{Film, PixelRect};
use gloss::render::{RenderOptions, aov_channels};
use gloss::scene::Aov;

/// A camera that looks along -z at a wall of `material` 3 units away, with a red wall 5 units behind the camera.
fn room(material: &str) -> String {
    format!(
        r#"
        [settings]
        spp = 64
        max_depth = 4
        at_max_depth = "black"
        aovs = ["albedo", "normal", "depth", "variance"]
        [camera]
        eye = [7, 1, 0]
        look_at = [7, 1, -1]
        resolution = [8, 8]
        fov_deg = 0.01
        [environment]
        type = "constant"
        radiance = [0.5, 0.6, 0.7]
        [materials.wall]
        {material}
        [materials.red]
        type = "diffuse"
        kd = 1.0
        cd = [0.8, 0.3, 0.1]
        [[shapes]]
        type = "rect"
        corner = [-20, -20, -3]
        u = [50, 0, 0]
        v = [0, 50, 0]
        material = "wall"
        [[shapes]]
        type = "rect"
        corner = [-20, -20, 5]
        u = [0, 50, 0]
        v = [50, 0, 0]
        material = "red"
        "#
    )
}

fn film(material: &str) -> Film {
    picture(&scene(&room(material))).film
}

fn mean(values: &[Rgb]) -> [f64; 3] {
    let n = values.len() as f64;
    [0, 1, 2].map(|c| values.iter().map(|v| f64::from(v.to_array()[c])).sum::<f64>() / n)
}

fn near(found: [f64; 3], expected: [f64; 3], tolerance: f64) -> bool {
    found.iter().zip(expected).all(|(f, e)| (f - e).abs() <= tolerance)
}

/// Of the wall itself.
fn assert_wall(film: &Film, albedo: [f64; 3], what: &str) {
    assert!(near(mean(&film.albedo()), albedo, 1e-5), "{what}: {:?}", mean(&film.albedo()));
    assert!(near(mean(&film.normal()), [0.0, 0.0, 1.0], 1e-6), "{what}: {:?}", mean(&film.normal()));
    assert!(film.depth().iter().all(|d| (d - 3.0).abs() < 1e-4), "{what}: {:?}", film.depth()[0]);
}

/// Of the red wall in the mirror: 3 units there and 8 back.
fn assert_red_wall(film: &Film, tint: f64, what: &str) {
    let albedo = [0.8, 0.3, 0.1].map(|c| c * tint);
    assert!(near(mean(&film.albedo()), albedo, 1e-3), "{what}: {:?}", mean(&film.albedo()));
    assert!(near(mean(&film.normal()), [0.0, 0.0, -1.0], 1e-6), "{what}: {:?}", mean(&film.normal()));
    assert!(film.depth().iter().all(|d| (d - 11.0).abs() < 0.05), "{what}: {:?}", film.depth()[0]);
}

#[test]
fn a_matte_wall_is_described_as_it_stands() {
    let film = film("type = \"diffuse\"\nkd = 0.5\ncd = [1.0, 0.6, 0.2]");
    assert_wall(&film, [0.5, 0.3, 0.1], "matte");
}

#[test]
fn a_mirror_or_a_sharp_lobe_is_looked_through_and_a_wide_one_is_not() {
    assert_red_wall(&film("type = \"mirror\"\nkr = 0.5"), 0.5, "mirror");
    assert_red_wall(&film("type = \"cosine-power\"\nkr = 0.5\nexponent = 1e6"), 0.5, "sharp lobe");
    assert_red_wall(&film("type = \"conductor\"\nalpha = 0.002"), 1.0, "sharp metal");
    assert_wall(&film("type = \"cosine-power\"\nkr = 0.5\nexponent = 100"), [0.5; 3], "wide lobe");
    // A ray each of nine shows the same.
    let split = scene_with(
        &room("type = \"cosine-power\"\nkr = 0.5\nexponent = 1e6"),
        &[("settings.glossy_samples", "9")],
    );
    assert_red_wall(&picture(&split).film, 0.5, "split lobe");
}

#[test]
fn a_mirror_over_paint_shows_both_in_their_shares() {
    let mostly_mirror = film("type = \"mirror\"\nkr = 0.6\nkd = 0.2\ncd = [0.0, 1.0, 0.5]");
    let [r, g, b] = mean(&mostly_mirror.albedo());
    // 0.6 of the red wall, and the paint's own.
    let expected = [0.48, 0.18 + 0.2, 0.06 + 0.1];
    assert!(near([r, g, b], expected, 0.02), "{r} {g} {b} instead of {expected:?}");
    let mostly_paint = film("type = \"mirror\"\nkr = 0.2\nkd = 0.6");
    assert_wall(&mostly_paint, [0.8; 3], "paint");
}

#[test]
fn a_pane_of_glass_is_looked_through_whichever_way_its_paths_go() {
    let pane = |z: f64, [u, v]: [&str; 2]| {
        format!(
            "[[shapes]]\ntype = \"rect\"\ncorner = [-20, -20, {z}]\nu = {u}\nv = {v}\nmaterial = \"glass\"\n"
        )
    };
    let [x, y] = ["[50, 0, 0]", "[0, 50, 0]"];
    let text = format!(
        "{}\n{}{}[materials.glass]\ntype = \"dielectric\"",
        room("type = \"diffuse\"\nkd = 0.5\ncd = [1.0, 0.6, 0.2]"),
        pane(-1.0, [x, y]),
        pane(-1.5, [y, x]),
    );
    // Both ways are followed, and what is told is what the brighter one shows, as if it were all.
    let film = picture(&scene(&text)).film;
    assert_wall(&film, [0.5, 0.3, 0.1], "behind glass");
    // By chance one is: the red wall is seen in the pane now and then.
    let film = picture(&scene_with(&text, &[("settings.split_glass", "false")])).film;
    // Of F at each face, with all that is reflected within.
    let share = 2.0 * 0.04 / 1.04;
    let expected = [(0.5, 0.8), (0.3, 0.3), (0.1, 0.1)].map(|(wall, red)| wall + share * (red - wall));
    assert!(near(mean(&film.albedo()), expected, 0.01), "{:?}", mean(&film.albedo()));
}

#[test]
fn where_nothing_is_met_nothing_is_said() {
    let empty = scene_with(
        &room("type = \"diffuse\""),
        &[("camera.look_at", "[7, 100, 0]"), ("camera.up", "[0, 0, 1]")],
    );
    let film = picture(&empty).film;
    assert!(film.albedo().iter().chain(&film.normal()).all(|v| v.is_black()));
    assert!(film.depth().iter().all(|d| *d == f32::INFINITY));
}

#[test]
fn the_variance_of_grey_light_is_that_of_the_luminance() {
    let grey = [("environment.radiance", "[0.6, 0.6, 0.6]"), ("settings.sampler", "independent")];
    let text = room("type = \"cosine-power\"\nkr = 0.5\nexponent = 5").replace("cd = [0.8, 0.3, 0.1]", "");
    let film = picture(&scene_with(&text, &grey)).film;
    let mut some = false;
    for (pixel, variance) in film.pixels.iter().zip(film.variance()) {
        let expected = pixel.variance_of_mean();
        some |= expected > 0.0;
        for channel in variance.to_array() {
            assert!((f64::from(channel) - expected).abs() < 1e-5 * expected + 1e-12, "{channel} {expected}");
        }
    }
    assert!(some);
}

#[test]
fn asking_changes_no_bit_of_the_picture_nor_do_tiles_of_the_answer() {
    let text = room("type = \"mirror\"\nkr = 0.6\nkd = 0.2");
    let mut asked = scene_with(&text, &[("camera.fov_deg", "60.0"), ("camera.resolution", "[40, 24]")]);
    // Noise elsewhere is no business of a part's.
    asked.settings.adaptive = false;
    let mut plain = asked.clone();
    plain.settings.aovs = vec![];
    let whole = picture(&asked).film;
    assert_eq!(whole.pixels, picture(&plain).film.pixels);
    let tiled = RenderOptions { threads: 1, tile_size: 8, ..Default::default() };
    assert_eq!(picture_on(&asked, Backend::Bvh, &tiled).film, whole);
    let rect = PixelRect { x0: 10, y0: 3, x1: 30, y1: 20 };
    let part = picture_on(&asked, Backend::Bvh, &RenderOptions { crop: Some(rect), ..tiled }).film;
    assert_eq!(part.guides[0], whole.guides[3 * 40 + 10]);
}

#[test]
fn channels_have_the_names_that_other_programs_know() {
    let film = film("type = \"diffuse\"");
    let names = |aovs: &[Aov]| aov_channels(aovs, &film).into_iter().map(|c| c.0).collect::<Vec<_>>();
    assert_eq!(names(&[Aov::Normal, Aov::Depth, Aov::Normal]), ["Depth.Z", "N.X", "N.Y", "N.Z"]);
    assert_eq!(names(&[Aov::Albedo]), ["Albedo.B", "Albedo.G", "Albedo.R"]);
    assert_eq!(names(&[Aov::Variance]), ["Variance.B", "Variance.G", "Variance.R"]);
    assert!(aov_channels(&[Aov::Albedo], &film).iter().all(|c| c.1.len() == 64));
}
