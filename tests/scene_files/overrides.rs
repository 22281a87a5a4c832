//! `path=value` on top of a file.

use super::{scene, with};
use gloss::bxdf::Horizon;
use gloss::core::Rgb;
use gloss::scene::{AtMaxDepth, GlossySamples, Override, Preset, SelfHit, Settings, Specular};

const TEXT: &str = r#"
[settings]
preset = "suffern"
spp = 7
max_depth = 2

[materials.lemon]
type = "cosine-power"
exponent = 10

[[shapes]]
type = "sphere"
material = "lemon"

[[lights]]
type = "point"
position = [0, 5, 0]
intensity = 1
"#;

fn complaint(overrides: &[&str]) -> String {
    with(TEXT, overrides).unwrap_err().to_string()
}

#[test]
fn values_are_replaced_and_added_and_the_last_one_wins() {
    let scene = with(
        TEXT,
        &[
            "materials.lemon.exponent=100",
            "settings.spp=16",
            "settings.spp=32",
            "camera.resolution=[64, 48]",
            "settings.horizon=clip",
            "settings.at_max_depth = \"background\"",
            "ambient=0.5",
            "lights.0.intensity=[1, 2, 3]",
            "materials.lemon.cr={ checker = [0, 1], size = 2 }",
        ],
    )
    .unwrap();
    assert_eq!(scene.settings.spp, 32);
    assert_eq!(scene.settings.at_max_depth, AtMaxDepth::Background);
    assert_eq!(scene.camera.resolution, [64, 48]);
    assert_eq!(scene.ambient, Rgb::grey(0.5));
    let Specular::CosinePower { exponent, horizon, .. } = scene.materials[0].specular else {
        panic!("{:?}", scene.materials[0])
    };
    assert_eq!((exponent, horizon), (100.0, Horizon::Clip));
}

#[test]
fn another_resolution_shows_as_much_as_before_with_either_camera() {
    let camera = |lens: &str, overrides: &[&str]| {
        with(&format!("[camera]\nresolution = [600, 200]\n{lens}"), overrides).unwrap().camera
    };
    for lens in ["fov_deg = 30", "view_plane_distance = 900\npixel_size = 2"] {
        let top = |camera: gloss::scene::Camera| {
            let [width, _] = camera.resolution.map(|n| 0.5 * n as f32);
            camera.direction(width, 0.0)
        };
        let whole = top(camera(lens, &[]));
        for change in ["camera.resolution=[64, 64]", "camera.resolution.1=1000"] {
            let off = (top(camera(lens, &[change])) - whole).length();
            assert!(off < 1e-6, "{lens} {change}: {off}");
        }
    }
    // Unless the size of a pixel is asked for too.
    let lens = "view_plane_distance = 900\npixel_size = 2";
    let pixel = camera(lens, &["camera.resolution=[60, 20]", "camera.pixel_size=2"]).right.length();
    assert!((pixel - 2.0 / 900.0).abs() < 1e-9, "{pixel}");
}

#[test]
fn mistakes_in_overrides_are_named_with_the_override() {
    for (overrides, place, part) in [
        (["settings.sp=16"], "-D settings.sp=16: ", "unknown key `sp`; did you mean `spp`?"),
        (["setings.spp=16"], "-D setings.spp=16: ", "did you mean `settings`?"),
        (["materials.lemn.exponent=1"], "-D materials.lemn.exponent=1: ", "did you mean `lemon`?"),
        (["materials.lemon.exponent.x=1"], "-D materials.lemon.exponent.x=1: ", "plain value"),
        (["lights.1.intensity=1"], "-D lights.1.intensity=1: ", "1 items, counted from 0"),
        (["shapes.one.radius=1"], "-D shapes.one.radius=1: ", "`one` is none of them"),
        (["shapes.0.radius=-1"], "-D shapes.0.radius=-1: ", "shapes.0.radius: -1 is not above zero"),
        (["settings.spp=many"], "-D settings.spp=many: ", "expected u32, found string \"many\""),
        (["camera.eye=[0, 0, 1"], "-D camera.eye=[0, 0, 1: ", "no TOML: unclosed array"),
    ] {
        let message = complaint(&overrides);
        assert!(message.starts_with(place) && message.contains(part), "{overrides:?}: {message}");
    }
    assert!("settings.spp".parse::<Override>().is_err());
    assert!("=3".parse::<Override>().is_err());
}

#[test]
fn what_the_file_says_goes_before_its_preset_and_a_preset_from_outside_goes_before_the_file() {
    let own = scene(TEXT).settings;
    assert_eq!(own, Settings { spp: 7, max_depth: 2, ..Preset::Suffern.settings() });
    // In whatever order: the preset comes first.
    for overrides in
        [["settings.preset=lecture", "settings.seed=3"], ["settings.seed=3", "settings.preset=lecture"]]
    {
        let settings = with(TEXT, &overrides).unwrap().settings;
        assert_eq!(settings, Settings { seed: 3, ..Preset::Lecture.settings() });
    }
    assert_eq!(scene("").settings, Settings::default());
}

#[test]
fn the_lectures_preset_is_the_lectures() {
    let lecture = Preset::Lecture.settings();
    assert_eq!((lecture.spp, lecture.max_depth), (9, 5));
    assert_eq!(lecture.glossy_samples, GlossySamples::Branch { branch: 9 });
    assert_eq!((lecture.horizon, lecture.self_hit), (Horizon::Fold, SelfHit::Geometry));
    assert_eq!(lecture.at_max_depth, AtMaxDepth::Black);
    assert!(!lecture.diffuse_bounces && !lecture.highlights);
    assert_eq!(Preset::Accurate.settings(), Settings::default());
}

#[test]
fn displayed_settings_are_a_scene_files_settings() {
    for preset in Preset::ALL {
        let settings = preset.settings();
        assert_eq!(scene(&format!("[settings]\n{settings}")).settings, settings);
    }
    for samples in ["9", "[9, 3]", "\"auto\"", "{ branch = 4 }"] {
        let settings = scene(&format!("[settings]\nglossy_samples = {samples}")).settings;
        assert_eq!(scene(&format!("[settings]\n{settings}")).settings, settings);
    }
}

#[test]
fn a_list_a_table_or_a_quoted_text_that_is_no_toml_is_refused_and_other_text_is_taken_as_it_is() {
    for value in ["[64, 48", "{ checker = [0, 1] size = 2 }", "\"clip", "'clip"] {
        let message = complaint(&[&format!("materials.lemon.cr={value}")]);
        assert!(message.starts_with("-D materials.lemon.cr="), "{message}");
        assert!(message.contains("no TOML"), "{message}");
    }
    assert!(
        complaint(&["environment={ type = \"image\", file = \"x\" }", "environment.file=3d.exr"])
            .contains("3d.exr")
    );
}
