//! Every mistake is named with its place and, where there is one, the word that was meant.

use super::{complaint, read};
use gloss::scene::{Format, load, load_str};
use proptest::prelude::*;
use std::path::Path;

/// Each text with what its complaint must begin with and contain.
const MISTAKES: &[(&str, &str, &str)] = &[
    ("camera = 3", "<scene>:1:10", "expected a table, found integer `3`"),
    ("[camera]\neye = [0, 0", "<scene>:2:", ""),
    ("[camera]\n  eyes = [0, 0, 1]", "<scene>:2:3", "unknown key `eyes`; did you mean `eye`?"),
    ("[camera]\neye = [0, 0]", "<scene>:2:7", "expected an array of length 3, found 2 values"),
    ("[camera]\neye = [0, 0, 1, 2]", "<scene>:2:7", "expected an array of length 3, found 4 values"),
    ("[camera]\neye = [0, \"a\", 1]", "<scene>:2:11", "expected f64, found string \"a\""),
    ("[camera]\neye = [0, nan, 1]", "<scene>:2:11", "camera.eye.1: NaN is not a finite number"),
    ("[camera]\neye = [inf, 0, 1]", "<scene>:2:8", "camera.eye.0: inf is not a finite number"),
    ("[camera]\neye = [0, 0, 0]", "<scene>:1:1", "camera.look_at: the same point as `eye`"),
    ("[camera]\neye = [1e300, 0, 0]", "<scene>:2:7", "too far away"),
    ("[camera]\nup = [0, 0, 2]", "<scene>:2:6", "camera.up: parallel to the direction"),
    ("[camera]\nup = [0, 0, 0]", "<scene>:2:6", "a direction must not be zero"),
    ("[camera]\nresolution = [640, 0]", "<scene>:2:20", "from 1 to 65536"),
    ("[camera]\nresolution = [65537, 1]", "<scene>:2:15", "from 1 to 65536"),
    ("[camera]\nfov_deg = 180", "<scene>:2:11", "below 180"),
    ("[camera]\nzoom = 1e-300", "<scene>:2:8", "camera.zoom: pixels become"),
    ("[camera]\nzoom = 1e-36", "<scene>:2:8", "which is too large"),
    ("[camera]\nzoom = 1e300", "<scene>:2:8", "which is too small"),
    ("[camera]\nfov_deg = 1e-300", "<scene>:2:11", "camera.fov_deg: pixels become"),
    ("[camera]\nzoom = 0", "<scene>:2:8", "0 is not above zero"),
    ("[camera]\nfov_deg = 40\npixel_size = 1", "<scene>:2:11", "goes without"),
    ("[camera]\npixel_size = 1", "<scene>:2:14", "`view_plane_distance`, which is missing"),
    ("[settings]\nspp = 0", "<scene>:2:7", "at least 1"),
    ("[settings]\nspp = 1.5", "<scene>:2:7", "expected u32, found floating point `1.5`"),
    ("[settings]\nspp = -1", "<scene>:2:7", "expected u32"),
    ("[settings]\nglossy_samples = [9, 0]", "<scene>:2:18", "each number must be from 1"),
    ("[settings]\nglossy_samples = { brunch = 9 }", "<scene>:2:18", "{ branch = whole number }"),
    ("[settings]\nglossy_samples = { branch = 9, deep = 1 }", "<scene>:2:18", "{ branch = whole number }"),
    ("[settings]\nhorizon = \"folded\"", "<scene>:2:11", "unknown value `folded`; did you mean `fold`?"),
    ("[settings]\npreset = \"lectur\"", "<scene>:2:10", "did you mean `lecture`?"),
    ("[settings]\nself_hit = { a = 1 }", "<scene>:2:12", ""),
    ("[materials.m]\nkd = 1", "<scene>:1:1", "the key `type` is missing (expected `diffuse`"),
    ("[materials.m]\ntype = 3", "<scene>:2:8", "the key `type` is a name"),
    ("[materials.m]\ntype = \"cosinepower\"", "<scene>:2:8", "did you mean `cosine-power`?"),
    ("[materials.m]\ntype = \"cosine-power\"", "<scene>:1:1", "the key `exponent` is missing"),
    ("[materials]\nm = \"mirror\"", "<scene>:2:5", "write a table: { type = \"mirror\", ... }"),
    ("[materials.m]\ntype = \"cosine-power\"\nexponent = -1", "<scene>:3:12", "at least 0, or inf"),
    ("[materials.m]\ntype = \"cosine-power\"\nexponent = nan", "<scene>:3:12", "NaN is no exponent"),
    ("[materials.m]\ntype = \"cosine-power\"\nexponent = \"sharp\"", "<scene>:3:12", "expected an exponent"),
    ("[materials.m]\ntype = \"cosine-power\"\nexponnt = 1", "<scene>:3:1", "did you mean `exponent`?"),
    ("[materials.m]\ntype = \"diffuse\"\nkd = -0.5", "<scene>:3:6", "materials.m.kd: -0.5 is negative"),
    ("[materials.m]\ntype = \"diffuse\"\ncd = [1, -1, 0]", "<scene>:3:6", "-1 is negative"),
    ("[materials.m]\ntype = \"diffuse\"\ncd = { checker = [0, 1], sise = 4 }", "<scene>:3:26", "`size`"),
    ("[materials.m]\ntype = \"diffuse\"\ncd = { checker = [0, 1], size = 0 }", "<scene>:3:33", "above zero"),
    ("[materials.m]\ntype = \"conductor\"\nmetal = \"gold\"\nk = 1", "<scene>:1:1", "`eta` and `k`"),
    ("[materials.m]\ntype = \"conductor\"\nalpha = 2", "<scene>:3:9", "the roughest is 1"),
    ("[materials.m]\ntype = \"plastic\"\ncd = [1.5, 0, 0]", "<scene>:3:6", "no base reflects more"),
    ("[materials.m]\ntype = \"plastic\"\neta = 0.5", "<scene>:3:7", "from 1 (air) to 100"),
    ("[materials.m]\ntype = \"emissive\"\nradiance = [1e13, 0, 0]", "<scene>:3:12", "too bright"),
    (
        "[materials.m]\ntype = \"conductor\"\neta = 1e30\nk = 1",
        "<scene>:3:7",
        "an index of refraction is from 0",
    ),
    (
        "[materials.lemon]\ntype = \"mirror\"\n[[shapes]]\ntype = \"sphere\"\nmaterial = \"lemn\"",
        "<scene>:5:12",
        "there is no material `lemn`; did you mean `lemon`?",
    ),
    ("[[shapes]]\ntype = \"sphere\"\nmaterial = \"m\"", "<scene>:3:12", "there are none"),
    ("[[shapes]]\ntype = \"spere\"", "<scene>:2:8", "did you mean `sphere`?"),
    ("[[shapes]]\ntype = \"sphere\"\nradus = 1", "<scene>:3:1", "did you mean `radius`?"),
    ("[[shapes]]\ntype = \"sphere\"\nradius = 0", "<scene>:3:10", "shapes.0.radius: 0 is not above zero"),
    ("[[shapes]]\ntype = \"sphere\"\nspheres = [[0, 0, 0, -1]]", "<scene>:3:22", "-1 is not above zero"),
    ("[[shapes]]\ntype = \"sphere\"\ntransform = [{ scale = [1, 2, 1] }]", "<scene>:3:13", "\"generated\""),
    (
        "[[shapes]]\ntype = \"sphere\"\nspheres = [[0, 0, 0, 1]]\nradius = 5",
        "<scene>:4:10",
        "goes without `spheres`",
    ),
    (
        "[[shapes]]\ntype = \"sphere\"\nspheres = [[0, 0, 0, 1]]\ncenter = [0, 0, 0]",
        "<scene>:4:10",
        "goes without",
    ),
    ("[[shapes]]\ntype = \"sphere\"\nradius = 1e308", "<scene>:1:1", "sphere 0 is too large"),
    ("[[shapes]]\ntype = \"box\"\nmin = [0, 0, 0]\nmax = [1, 0, 1]", "<scene>:4:7", "a `rect`"),
    (
        "[[shapes]]\ntype = \"cylinder\"\nbase = [0, 0, 0]\ntop = [0, 0, 0]\nradius = 1",
        "<scene>:4:7",
        "a `disk`",
    ),
    (
        "[[shapes]]\ntype = \"rect\"\ncorner = [0, 0, 0]\nu = [1, 0, 0]\nv = [2, 0, 0]",
        "<scene>:5:5",
        "no area",
    ),
    ("[[shapes]]\ntype = \"disk\"\nsegments = 2", "<scene>:3:12", "from 3 to"),
    ("[[shapes]]\ntype = \"plane\"\nnormal = [0, 0, 0]", "<scene>:3:10", "must not be zero"),
    ("[[shapes]]\ntype = \"generated\"\nkind = \"knott\"", "<scene>:3:8", "did you mean `knot`?"),
    ("[[shapes]]\ntype = \"generated\"\nkind = \"knot\"\ntriangles = 0", "<scene>:4:13", "from 1 to"),
    ("[[shapes]]\ntype = \"obj\"\nfile = \"no/such.obj\"", "<scene>:3:8", "cannot read no/such.obj"),
    ("[[shapes]]\ntype = \"ply\"\nfile = \"no/such.ply\"", "<scene>:3:8", "cannot read no/such.ply"),
    ("[[shapes]]\ntype = \"disk\"\ntransform = [{ scale = 0 }]", "<scene>:3:24", "flattens"),
    (
        "[[shapes]]\ntype = \"disk\"\ntransform = [{ scale = 1, translate = [0, 0, 0] }]",
        "<scene>:3:14",
        "exactly one",
    ),
    ("[[shapes]]\ntype = \"disk\"\ntransform = [{ turn = 1 }]", "<scene>:3:16", "unknown key `turn`"),
    (
        "[[shapes]]\ntype = \"disk\"\ntransform = [{ matrix = [1,0,0,0, 0,1,0,0, 0,0,1,0, 5,0,0,1] }]",
        "<scene>:3:25",
        "row by row",
    ),
    ("[[lights]]\ntype = \"point\"\nposition = [0, 0, 0]", "<scene>:1:1", "the key `intensity` is missing"),
    ("[[lights]]\ntype = \"directional\"\ndirection = [0, 0, 0]\nirradiance = 1", "<scene>:3:13", "zero"),
    ("[environment]\ntype = \"image\"\nfile = \"sky.png\"", "<scene>:3:8", ".hdr (Radiance)"),
    ("[environment]\ntype = \"image\"\nfile = \"no/sky.exr\"", "<scene>:3:8", "no/sky.exr"),
    ("[environment]\ntype = \"studio\"\nbackground = 1", "<scene>:3:14", "goes with `softboxes`"),
    ("[environment]\ntype = \"studio\"\nscale = 1e30", "<scene>:3:9", "environment.scale: 1e30 times"),
    (
        "[environment]\ntype = \"studio\"\nscale = 1e8\nsoftboxes = []\nbackground = 1e5",
        "<scene>:3:9",
        "too bright",
    ),
    ("[environment]\ntype = \"constant\"\nradiance = 1e13", "<scene>:3:12", "too bright"),
    ("ambient = [0.5, 0.5]", "<scene>:1:11", "expected an array of length 3"),
    ("ambient = -1", "<scene>:1:11", "ambient: -1 is negative"),
    ("ambient = 1979-05-27", "<scene>:1:11", "no dates"),
    ("ambint = 1", "<scene>:1:1", "unknown key `ambint`; did you mean `ambient`?"),
];

#[test]
fn each_mistake_is_named_with_its_place_and_what_would_mend_it() {
    let wrong: Vec<String> = (MISTAKES.iter())
        .map(|&(text, place, part)| (text, place, part, complaint(text)))
        .filter(|(_, place, part, message)| !(message.starts_with(place) && message.contains(part)))
        .map(|(text, place, part, message)| format!("{text}\n  says: {message}\n  not: {place} ... {part}\n"))
        .collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn json_mistakes_have_their_places_too() {
    let complaint = |text: &str| load_str(text, Format::Json, Path::new(""), &[]).unwrap_err().to_string();
    let unknown = complaint("{\n  \"camera\": {\n    \"eyes\": [0, 0, 1]\n  }\n}");
    assert!(unknown.starts_with("<scene>:3:13: unknown key `eyes`; did you mean `eye`?"), "{unknown}");
    let negative = complaint("{ \"ambient\": [0, 0, -1] }");
    assert!(negative.starts_with("<scene>:1:14: ambient: -1 is negative"), "{negative}");
    let cut = complaint("{\n \"camera\": {");
    assert!(cut.starts_with("<scene>:2:"), "{cut}");
    let deep = complaint(&"[".repeat(100_000));
    assert!(deep.starts_with("<scene>:1:"), "{deep}");
    let closed = complaint(&format!("{}{}", "[".repeat(100_000), "]".repeat(100_000)));
    assert!(closed.contains("nested more than 64 deep"), "{closed}");
    let twice = complaint("{ \"ambient\": 1, \"ambient\": 2 }");
    assert!(twice.contains("duplicate key `ambient`"), "{twice}");
}

#[test]
fn a_missing_scene_file_is_named() {
    let error = load(Path::new("no/such/scene.toml"), &[]).unwrap_err().to_string();
    assert!(error.starts_with("cannot read no/such/scene.toml: "), "{error}");
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(512) })]

    #[test]
    fn no_text_makes_the_loader_panic(text in "[\\[\\]{}=\"a-z0-9., \n]{0,80}") {
        let _ = read(&text);
        let _ = load_str(&text, Format::Json, Path::new(""), &[]);
    }

    #[test]
    fn no_change_of_a_scene_makes_the_loader_panic(at in 0usize..2000, with in "[-a-z0-9\\[\\]{}=\". \n]{0,3}") {
        let text = include_str!("../../scenes/lemon.toml");
        let at = at % text.len();
        let end = (at + with.len()).min(text.len());
        if let (Some(before), Some(after)) = (text.get(..at), text.get(end..)) {
            let _ = read(&format!("{before}{with}{after}"));
        }
    }
}
