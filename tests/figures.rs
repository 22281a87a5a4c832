//! The figures come out as the lecture and the book have them.

mod common;

use assert_cmd::Command;
use common::{picture, scene_with};
use gloss::accel::{self, Backend, BuildOptions};
use gloss::core::Rgb;
use gloss::figures::{FAMILIES, Size, draw, most_demanding};
use gloss::geometry::Shape;
use gloss::image_io::Image;
use gloss::render::RayClass;
use std::collections::HashSet;
use std::sync::atomic::AtomicBool;

/// A figure, small.
fn figure(name: &str, scale: f32, spp: u32) -> Image {
    let family =
        FAMILIES.iter().find(|f| f.figures.iter().any(|f| f.name == name)).expect("the figure is there");
    let scenes = family.load(Size { scale, spp: Some(spp) }).expect("the scenes load");
    let at = family.figures.iter().position(|f| f.name == name).expect("the figure is there");
    let accel =
        accel::build(Backend::Bvh, &scenes[at].shapes, &BuildOptions::default()).expect("it is built");
    let drawn = draw(&scenes[at], &*accel, 1, &AtomicBool::new(false)).expect("nobody interrupts");
    assert!(drawn.outcome.film.dropped.is_empty(), "{name}: {:?}", drawn.outcome.film.dropped);
    drawn.image
}

fn at(image: &Image, x: f32, y: f32) -> Rgb {
    let [column, row] = [(x * image.width as f32) as usize, (y * image.height as f32) as usize];
    image.pixels[row * image.width as usize + column]
}

#[test]
fn the_scenes_of_a_family_have_the_same_shapes_and_every_figure_a_name_of_its_own() {
    let mut names = HashSet::new();
    for family in &FAMILIES {
        let scenes = family.load(Size { scale: 0.1, spp: Some(1) }).expect("the scenes load");
        let size = |shape: &Shape| (shape.primitive_count(), shape.memory_bytes());
        for scene in &scenes {
            assert!(scene.shapes.iter().map(size).eq(scenes[0].shapes.iter().map(size)));
            // The book's blue sphere of figure 25.10 reflects more than it gets.
            let odd = scene.warnings.iter().filter(|w| !w.contains("`sphere` reflects up to 1.250"));
            assert_eq!(odd.count(), 0, "{:?}", scene.warnings);
        }
        most_demanding(&scenes);
        let mut all = family.figures.iter().map(|f| f.name).chain(family.difference.map(|d| d.0));
        assert!(all.all(|name| names.insert(name)));
    }
}

#[test]
fn figure_7_has_one_even_colour_with_folding_and_a_dark_rim_without() {
    let (fold, clip) = (figure("25-07-fold", 0.15, 25), figure("25-07-clip", 0.15, 25));
    for (x, y) in [(0.5, 0.5), (0.3, 0.5), (0.5, 0.15), (0.75, 0.75)] {
        let colour = at(&fold, x, y);
        for (channel, expected) in colour.to_array().into_iter().zip([0.64, 0.72, 0.8]) {
            assert!((channel - expected).abs() < 0.15, "{colour:?} at {x}, {y}");
        }
    }
    let (middle, rim) = (at(&clip, 0.5, 0.5).b, at(&clip, 0.5, 0.09).b);
    assert!(middle > 0.75 && rim < 0.65, "{middle} {rim}");
}

#[test]
fn figure_8_blurs_less_from_a_to_f() {
    // How uneven the sphere is: the reflected window has edges where the lobe is narrow.
    let unevenness = |name| {
        let image = figure(name, 0.1, 64);
        let within: Vec<f32> = (0..60 * 60)
            .filter(|i| ((i % 60) as f32 - 30.0).hypot((i / 60) as f32 - 27.0) < 16.0)
            .map(|i| image.pixels[i].g)
            .collect();
        let mean = within.iter().sum::<f32>() / within.len() as f32;
        within.iter().map(|g| (g - mean).powi(2)).sum::<f32>() / within.len() as f32
    };
    let [a, c, f] = ["25-08-a", "25-08-c", "25-08-f"].map(unevenness);
    assert!(a < c && c < f, "{a} {c} {f}");
}

#[test]
fn figure_13_is_noise_at_random_and_clean_from_patterns_of_one_point() {
    // The difference of neighbours on the sphere, above the stand.
    let noise = |name| {
        let image = figure(name, 0.2, 1);
        let pairs = (20..60).flat_map(|y| (40..80).map(move |x| y * 120 + x));
        let count = 40.0 * 40.0;
        pairs.map(|i| (image.pixels[i].g - image.pixels[i + 1].g).abs()).sum::<f32>() / count
    };
    let [random, regular, hammersley] = ["25-13-a", "25-13-b", "25-13-c"].map(noise);
    assert!(random > 3.0 * regular && random > 3.0 * hammersley, "{random} {regular} {hammersley}");
}

#[test]
fn the_presets_are_the_lectures_and_the_books() {
    let rays = |preset: &str| {
        let text = include_str!("../scenes/rim.toml").replace("spp = 100\nmax_depth = 1\n", "");
        let overrides =
            [("settings.preset", preset), ("camera.resolution", "[8, 8]"), ("camera.pixel_size", "10")];
        let text = text.replace("preset = \"suffern\"", "");
        let outcome = picture(&scene_with(&text, &overrides));
        (outcome.tally.class(RayClass::Primary).rays / 64, outcome.tally.class(RayClass::Glossy).rays / 64)
    };
    // Every camera ray hits the sphere, and from its outside no reflected ray hits it again.
    assert_eq!(rays("lecture"), (9, 81));
    assert_eq!(rays("suffern"), (100, 100));
}

fn gloss() -> Command {
    Command::cargo_bin("gloss").expect("the program is built")
}

#[test]
fn info_prints_what_a_preset_stands_for() {
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/mesh.toml");
    for (preset, words) in [
        (
            "lecture",
            ["\"branch\":9", "self_hit geometry", "at_max_depth black", "max_depth 5", "horizon fold"],
        ),
        ("suffern", ["glossy_samples 1", "spp 100", "at_max_depth black", "max_depth 5", "horizon fold"]),
        (
            "accurate",
            ["glossy_samples auto", "self_hit primitive", "at_max_depth roulette", "spp 64", "max_depth 8"],
        ),
    ] {
        let out = gloss().args(["info", scene, "--preset", preset]).assert().success();
        let text = String::from_utf8_lossy(&out.get_output().stdout).into_owned();
        for word in words {
            assert!(text.contains(word), "{preset}: no `{word}` in\n{text}");
        }
    }
}

#[test]
fn the_command_writes_labelled_pictures_a_sheet_and_a_table() {
    let folder = tempfile::tempdir().expect("a folder");
    let args = ["figures", "--scale", "0.05", "--spp", "1", "--only", "25-0", "-o"];
    let out = gloss().args(args).arg(folder.path()).args(["--backend", "bvh"]).assert().success();
    let table = String::from_utf8_lossy(&out.get_output().stdout).into_owned();
    let files = ["25-07-fold", "25-07-clip", "25-08-a", "25-08-f", "25-09", "contact-sheet"];
    for file in files.map(|name| format!("{name}.png")) {
        assert!(folder.path().join(&file).is_file(), "{file}");
        assert!(table.contains(&file), "{file} in\n{table}");
    }
    assert!(!table.contains("25-10") && !table.contains("7-random"), "{table}");
    gloss().args(["figures", "--only", "26", "-o"]).arg(folder.path()).assert().code(2);
    gloss().args(["figures", "--scale", "0", "-o", "x"]).assert().code(2);
}
