//! Cheap occlusion of glossy reflections: exact where nothing hides anything, and elsewhere as its formulas say.

use assert_cmd::cargo::cargo_bin_cmd;
use gloss::accel::{self, Backend, BuildOptions};
use gloss::core::Rgb;
use gloss::render::{RenderOptions, Silent, render};
use gloss::scene::load::{Format, load_str};
use gloss::scene::{Occlusion, Override};
use std::path::Path;
use std::sync::atomic::AtomicBool;

const MODES: [&str; 6] = ["exact", "none", "ao", "cone", "mirror-visibility", "sh"];

fn pixels(scene: &str, mode: &str, seed: u32) -> Vec<Rgb> {
    let overrides = [Override::new("settings.occlusion", mode), Override::new("settings.seed", seed)];
    let scene = load_str(scene, Format::Toml, Path::new("."), &overrides).expect("the scene is good");
    let accel = accel::build(Backend::Bvh, &scene.shapes, &BuildOptions::default()).expect("it is built");
    let outcome = render(&scene, &*accel, &RenderOptions::default(), &Silent, &AtomicBool::new(false));
    assert!(outcome.film.dropped.is_empty());
    outcome.film.image()
}

fn mean(scene: &str, mode: &str) -> f64 {
    let pixels = pixels(scene, mode, 1);
    pixels.iter().map(|p| f64::from(p.g)).sum::<f64>() / pixels.len() as f64
}

/// A sphere under a sky that is bright on one side.
fn sphere(exponent: &str, depth: &str) -> String {
    format!(
        r#"
[settings]
spp = 64
max_depth = 3
at_max_depth = "{depth}"
[camera]
eye = [0, 1, 5]
look_at = [0, 0, 0]
fov_deg = 20
resolution = [24, 24]
[environment]
type = "gradient"
up = [1, 1, 0]
zenith = [2, 1, 0.5]
horizon = 0.5
nadir = [0, 0, 1]
[materials.shiny]
type = "cosine-power"
kr = 0.8
exponent = {exponent}
[[shapes]]
type = "sphere"
radius = 1
material = "shiny"
"#
    )
}

#[test]
fn on_a_convex_thing_all_modes_are_exact() {
    for (exponent, depth) in [("2", "black"), ("50", "roulette"), ("1e5", "black")] {
        let scene = sphere(exponent, depth);
        let exact = pixels(&scene, "exact", 7);
        for mode in &MODES[1..] {
            let found = pixels(&scene, mode, 8);
            let differences: Vec<f64> =
                found.iter().zip(&exact).map(|(a, b)| f64::from(a.luminance() - b.luminance())).collect();
            let n = differences.len() as f64;
            let mean = differences.iter().sum::<f64>() / n;
            let deviation = (differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / n).sqrt();
            assert!(mean.abs() < 5.0 * deviation / n.sqrt(), "{exponent} {mode}: {mean} of {deviation}");
            assert!(deviation < 0.05, "{exponent} {mode}: {deviation}");
        }
    }
}

/// A point of a shining floor at the foot of a black wall that hides half of a white sky, seen from `eye`.
fn wall(exponent: f64, eye: &str) -> String {
    format!(
        r#"
[settings]
spp = 1024
max_depth = 1
at_max_depth = "black"
highlights = false
[camera]
eye = {eye}
look_at = [0.001, 0, 0]
up = [0, 0, 1]
fov_deg = 0.0001
resolution = [4, 4]
[environment]
type = "constant"
radiance = 1
[materials.floor]
type = "cosine-power"
exponent = {exponent}
[materials.black]
type = "diffuse"
kd = 0
[[shapes]]
type = "rect"
corner = [-10, 0, 10]
u = [20, 0, 0]
v = [0, 0, -20]
material = "floor"
[[shapes]]
type = "rect"
corner = [0, -100, -100]
u = [0, 0, 200]
v = [0, 200, 0]
material = "black"
"#
    )
}

#[test]
fn a_wall_that_hides_half_of_everything_has_its_closed_form_in_each_mode() {
    // From above the lobe stands upright: the wall hides half of it, half of the ambient light, and half of each band's
    // part; the mirror direction runs along it. The cone of visibility is 45 degrees wide and leans by atan(2 / pi) =
    // 32.5 degrees: a narrow lobe lies within it.
    let above = wall(1000.0, "[0.001, 5, 0]");
    let expected =
        [("exact", 0.5), ("none", 1.0), ("ao", 0.5), ("mirror-visibility", 1.0), ("sh", 0.5), ("cone", 1.0)];
    for (mode, value) in expected {
        let found = mean(&above, mode);
        // 16384 samples of a quantity of deviation 1/2 at most.
        assert!((found - value).abs() < 5.0 * 0.5 / 128.0, "{mode}: {found}");
    }
    // Towards the wall nothing is left but by those that do not look there.
    let towards = wall(1e6, "[1, 1, 0]");
    for (mode, value) in [("exact", 0.0), ("none", 1.0), ("ao", 0.5), ("mirror-visibility", 0.0)] {
        let found = mean(&towards, mode);
        assert!((found - value).abs() < 5.0 * 0.5 / 128.0, "{mode}: {found}");
    }
    let [cone, sh] = ["cone", "sh"].map(|mode| mean(&towards, mode));
    assert!(cone < 0.05, "the lobe lies outside of the cone: {cone}");
    assert!(sh < 0.25, "the bands see that most of it is hidden: {sh}");
}

#[test]
fn a_lamp_still_shines_on_what_is_approximated_and_the_environment_does_so_once() {
    let lamp = "[[lights]]\ntype = \"point\"\nposition = [3, 3, 5]\nintensity = 30\n";
    let lit = format!("{}{lamp}", sphere("20", "black"));
    let exact = mean(&lit, "exact");
    assert!(exact > 1.05 * mean(&sphere("20", "black"), "exact"), "the lamp is seen");
    for mode in &MODES[1..] {
        let found = mean(&lit, mode);
        assert!((found / exact - 1.0).abs() < 0.02, "{mode}: {found} {exact}");
    }
}

#[test]
fn approximations_are_labelled_and_the_exact_one_is_not() {
    assert!(Occlusion::default().is_exact());
    let directory = tempfile::tempdir().unwrap();
    let scene = directory.path().join("a.toml");
    std::fs::write(&scene, sphere("10", "black")).unwrap();
    let said = |mode: &str| {
        let picture = directory.path().join(format!("{mode}.exr"));
        let occlusion = format!("settings.occlusion={mode}");
        let mut command = cargo_bin_cmd!("gloss");
        command.arg("render").arg(&scene).arg("-o").arg(&picture).args(["-D", &occlusion, "--spp", "1"]);
        let told = String::from_utf8(command.assert().success().get_output().stderr.clone()).unwrap();
        (told, String::from_utf8_lossy(&std::fs::read(&picture).unwrap()).into_owned())
    };
    let (told, bytes) = said("ao");
    assert!(told.contains("approximation: glossy reflections of the environment by `ao`"), "{told}");
    assert!(bytes.contains("gloss.approximation") && bytes.contains("\"occlusion\":\"ao\""));
    let (told, bytes) = said("exact");
    assert!(!told.contains("approximation") && !bytes.contains("gloss.approximation"));
}
