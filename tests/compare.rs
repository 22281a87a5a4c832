//! Backends held against each other: right ones agree, and a wrong one is found out.

use assert_cmd::cargo::cargo_bin_cmd;
use gloss::accel::{self, AccelInfo, Accelerator, Backend, BuildOptions, Coherence};
use gloss::compare::{self, Comparison, Contender, Options, Verdict, page, text};
use gloss::core::{Hit, Ray};
use gloss::integrator::RayClass;
use gloss::scene::load::{Format, load_str};
use gloss::scene::{Override, Scene};
use serde_json::Value;
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// A knot of glossy triangles and a sphere on a diffuse floor, under a lamp: rays of all four classes.
const SCENE: &str = r#"
[settings]
spp = 8
max_depth = 2

[camera]
eye = [0, 2, 5]
look_at = [0, 0.3, 0]
fov_deg = 35
resolution = [48, 32]

[environment]
type = "constant"
radiance = [0.4, 0.5, 0.6]

[materials.shiny]
type = "cosine-power"
exponent = 200

[materials.chalk]
type = "diffuse"
kd = 0.7

[[shapes]]
type = "sphere"
center = [-0.9, 0.5, 0]
radius = 0.5
material = "shiny"

[[shapes]]
type = "cylinder"
base = [0.9, 0, 0]
top = [0.9, 1, 0]
radius = 0.4
material = "shiny"

[[shapes]]
type = "rect"
corner = [-3, 0, 3]
u = [6, 0, 0]
v = [0, 0, -6]
material = "chalk"

[[lights]]
type = "point"
position = [2, 5, 2]
intensity = 20
"#;

const OPTIONS: Options =
    Options { rays: 4000, rounds: 1, tolerance: 1e-5, max_wrong: 1e-4, independent: false, threads: 2 };

fn scene() -> Scene {
    let none: [Override; 0] = [];
    load_str(SCENE, Format::Toml, Path::new("."), &none).expect("the scene is good")
}

fn compare(a: &dyn Accelerator, b: &dyn Accelerator, options: &Options) -> Comparison {
    let backends = [("a", a), ("b", b)].map(|(name, accel)| Contender { name: name.into(), accel });
    compare::run(scene(), &backends, options, &|_| {}, &AtomicBool::new(false)).expect("nobody interrupts")
}

fn bvh() -> Box<dyn Accelerator> {
    accel::build(Backend::Bvh, &scene().shapes, &BuildOptions::default()).expect("the shapes are built")
}

/// A backend that spoils what another answers.
struct Wrong<F: Fn(&Ray, Option<Hit>) -> Option<Hit> + Send + Sync> {
    right: Box<dyn Accelerator>,
    spoil: F,
}

impl<F: Fn(&Ray, Option<Hit>) -> Option<Hit> + Send + Sync> Accelerator for Wrong<F> {
    fn intersect(&self, rays: &[Ray], coherence: Coherence, hits: &mut [Option<Hit>]) {
        self.right.intersect(rays, coherence, hits);
        for (hit, ray) in hits.iter_mut().zip(rays) {
            *hit = (self.spoil)(ray, *hit);
        }
    }

    fn occluded(&self, rays: &[Ray], coherence: Coherence, occluded: &mut [bool]) {
        self.right.occluded(rays, coherence, occluded);
    }

    fn info(&self) -> AccelInfo {
        self.right.info()
    }
}

#[test]
fn a_backend_is_identical_to_itself() {
    let found = compare(&*bvh(), &*bvh(), &OPTIONS);
    assert_eq!(found.verdict, Verdict::Identical, "{:?}", found.pairs[0].reasons);
    assert_eq!(found.rays.len(), RayClass::ALL.len(), "the scene asks rays of all classes: {:?}", found.rays);
    assert_eq!(found.pairs[0].explained.all, 0);
    assert_eq!(found.subjects[1].rates.len(), found.rays.len());
}

#[test]
fn all_backends_agree_with_brute_force() {
    let brute = accel::build(Backend::Brute, &scene().shapes, &BuildOptions::default()).unwrap();
    let mut backends = vec![Backend::Bvh];
    if cfg!(feature = "embree") {
        backends.push(Backend::Embree);
    }
    for backend in backends {
        let accel = accel::build(backend, &scene().shapes, &BuildOptions::default()).unwrap();
        let found = compare(&*brute, &*accel, &OPTIONS);
        assert!(found.verdict < Verdict::Differs, "{backend:?}: {:?}", found.pairs[0].reasons);
        assert_eq!(found.pairs[0].explained.wrong()[0], 0.0, "brute force is right: {:?}", found.pairs[0]);
    }
}

#[test]
fn independent_renders_are_statistically_equal() {
    let found = compare(&*bvh(), &*bvh(), &Options { independent: true, ..OPTIONS });
    assert_eq!(found.verdict, Verdict::StatisticallyEqual, "{:?}", found.pairs[0].reasons);
    assert!(found.pairs[0].picture.equal_pixels < found.pairs[0].picture.pixels);
}

#[test]
fn a_backend_that_moves_hits_differs() {
    let spoil = |_: &Ray, hit: Option<Hit>| hit.map(|hit| Hit { t: hit.t * 1.001, ..hit });
    let wrong = Wrong { right: bvh(), spoil };
    let found = compare(&*bvh(), &wrong, &OPTIONS);
    assert_eq!(found.verdict, Verdict::Differs);
    let pair = &found.pairs[0];
    assert!(pair.answers.iter().any(|class| class.distance > 0), "{:?}", pair.answers);
    assert_eq!(pair.explained.first, pair.explained.judged, "the first is right: {:?}", pair.explained);
    assert!(pair.reasons.iter().any(|r| r.starts_with("b answers")), "{:?}", pair.reasons);
}

#[test]
fn a_backend_that_loses_a_tenth_of_the_hits_differs() {
    let spoil = |ray: &Ray, hit: Option<Hit>| hit.filter(|_| !ray.dir.x.to_bits().is_multiple_of(10));
    let wrong = Wrong { right: bvh(), spoil };
    let found = compare(&wrong, &*bvh(), &OPTIONS);
    let pair = &found.pairs[0];
    assert_eq!(found.verdict, Verdict::Differs);
    assert!(pair.answers.iter().map(|class| class.missed_by_first).sum::<u64>() > 100, "{:?}", pair.answers);
    assert_eq!(pair.explained.second, pair.explained.judged, "the second is right: {:?}", pair.explained);
    assert_eq!(pair.disagreements.len() as u64, pair.explained.all);
}

#[test]
fn noise_does_not_hide_a_shape_that_is_missing() {
    // The last shape is the floor: most of the picture.
    let floor = scene().shapes.len() as u32 - 1;
    let spoil = move |_: &Ray, hit: Option<Hit>| hit.filter(|hit| hit.geom_id != floor);
    let wrong = Wrong { right: bvh(), spoil };
    let found = compare(&wrong, &*bvh(), &Options { independent: true, ..OPTIONS });
    assert_eq!(found.pairs[0].picture.verdict, Verdict::Differs, "{:?}", found.pairs[0]);
}

#[test]
fn reports_tell_what_was_found() {
    let found = compare(&*bvh(), &*bvh(), &OPTIONS);
    let html = page::to_html(&found, "<scene>", "gloss compare 'a&b'", 0.0);
    assert!(html.contains("&lt;scene&gt;") && html.contains("a&amp;b") && !html.contains("<scene>"));
    assert_eq!(html.matches("data:image/png;base64,").count(), 4, "two pictures and two maps");
    for outside in ["http:", "https:", "@import", "url("] {
        assert!(!html.contains(outside), "{outside}");
    }
    let text = text::to_text(&found, "a.toml");
    assert!(text.ends_with("verdict   identical\n"), "{text}");
    for class in RayClass::ALL {
        assert!(text.contains(class.name()) && html.contains(class.name()));
    }
}

/// Runs the program in a directory: exit code, standard output and error.
fn gloss(directory: &Path, arguments: &str) -> (i32, String, String) {
    let mut command = cargo_bin_cmd!("gloss");
    let output = command.current_dir(directory).args(arguments.split_whitespace()).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

#[test]
fn the_program_compares_and_traces() {
    let place = tempfile::tempdir().unwrap();
    std::fs::write(place.path().join("a.toml"), SCENE).unwrap();
    let run = |arguments: &str| gloss(place.path(), arguments);

    let small = "--rays 3000 --rounds 1 --spp 2";
    let (code, out, err) = run(&format!("compare a.toml --between brute,bvh --json {small} --html a.html"));
    assert_eq!(code, 0, "{err}");
    let found: Value = serde_json::from_str(&out).unwrap();
    assert_ne!(found["verdict"], "differs", "{out}");
    assert_eq!(found["subjects"][0]["name"], "brute");
    assert!(found["pairs"][0]["picture"]["outliers_allowed"].is_number(), "{out}");
    assert!(std::fs::read_to_string(place.path().join("a.html")).unwrap().starts_with("<!doctype html>"));
    assert_eq!(run(&format!("compare a.toml -q {small}")), (0, String::new(), String::new()));

    let (code, out, err) = run("render a.toml -o a.png --spp 2 -q --dump-rays a.rays");
    assert_eq!((code, &*out), (0, ""), "{err}");
    let (code, out, err) = run("trace a.rays --scene a.toml --backend bvh --rounds 2 --json");
    assert_eq!(code, 0, "{err}");
    let traced: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(traced["classes"][0]["class"], "primary");
    assert_eq!(traced["classes"][0]["rays"], 48 * 32 * 2);
    let (_, out, _) = run("trace a.rays --scene a.toml --backend brute --rounds 1 --json");
    let brute: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(traced["classes"][0]["hits"], brute["classes"][0]["hits"]);

    let mut names: Vec<_> = std::fs::read_dir(place.path())
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    assert_eq!(names, ["a.html", "a.png", "a.rays", "a.toml"]);
}

#[test]
fn the_program_tells_where_the_time_went() {
    let place = tempfile::tempdir().unwrap();
    std::fs::write(place.path().join("a.toml"), SCENE).unwrap();
    let (code, out, err) = gloss(place.path(), "render a.toml -o a.png -q --backend bvh --stats json");
    assert_eq!(code, 0, "{err}");
    let stats: Value = serde_json::from_str(&out).unwrap();
    let number = |key: &str| stats[key].as_f64().unwrap_or_else(|| panic!("{key}: {out}"));
    let quotient = number("rays_alone_seconds") / number("render_cpu_seconds");
    assert!((number("efficiency") - quotient).abs() < 1e-9);
    let classes = stats["classes"].as_array().unwrap();
    assert_eq!(classes.len(), 4);
    let shares: f64 = classes.iter().map(|class| class["share"].as_f64().unwrap()).sum();
    assert!(0.0 < shares && shares < 1.0, "{out}");
    let (_, out, _) = gloss(place.path(), "render a.toml -o a.png -q --backend bvh --stats");
    assert!(out.contains("efficiency ") && out.contains("shadow"), "{out}");
}

#[test]
fn bad_usage_is_refused() {
    let place = tempfile::tempdir().unwrap();
    std::fs::write(place.path().join("a.toml"), SCENE).unwrap();
    std::fs::write(place.path().join("torn.rays"), "glossry1abc").unwrap();
    for bad in [
        "compare a.toml --between bvh",
        "compare a.toml --between bvh,gpu",
        "compare a.toml --all --between bvh,brute",
        "compare a.toml --rounds 0",
        "compare a.toml --max-wrong 2",
        "compare missing.toml",
        "trace torn.rays --scene a.toml",
        "trace a.toml --scene a.toml",
        "trace missing.rays --scene a.toml",
        "render a.toml -o a.png --stats --dump-rays a.rays",
    ] {
        let (code, out, err) = gloss(place.path(), bad);
        assert_eq!((code, &*out), (2, ""), "{bad}: {err}");
        assert_eq!(err.matches("error:").count(), 1, "{bad}: {err}");
    }
}
