//! The program as its users meet it: exit codes, messages, files.

use assert_cmd::cargo::cargo_bin_cmd;
use gloss::core::Rgb;
use gloss::image_io::{ExrOptions, Image, read_image, write_exr, write_png};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Output, Stdio};
use tempfile::TempDir;

/// A small glossy sphere under a grey sky.
const SCENE: &str = r#"
[settings]
spp = 4
max_depth = 2

[camera]
resolution = [16, 12]

[environment]
type = "constant"
radiance = [0.5, 0.5, 0.5]

[materials.shiny]
type = "cosine-power"
exponent = 100

[[shapes]]
type = "sphere"
material = "shiny"
"#;

struct Place(TempDir);

impl Place {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, text: &str) -> PathBuf {
        fs::write(self.path(name), text).unwrap();
        self.path(name)
    }

    fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(self.0.path()).unwrap();
        let mut names: Vec<_> =
            entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    /// Runs the program in this directory.
    fn gloss(&self, arguments: &str) -> Ran {
        let mut command = cargo_bin_cmd!("gloss");
        let output = command.current_dir(self.0.path()).args(arguments.split_whitespace()).output().unwrap();
        Ran::from(output)
    }
}

struct Ran {
    code: i32,
    out: String,
    err: String,
}

impl From<Output> for Ran {
    fn from(output: Output) -> Self {
        let ran = Self {
            code: output.status.code().expect("the program ends by itself"),
            out: String::from_utf8(output.stdout).unwrap(),
            err: String::from_utf8(output.stderr).unwrap(),
        };
        assert!(!ran.err.contains("panicked"), "{}", ran.err);
        ran
    }
}

impl Ran {
    #[track_caller]
    fn ends(self, code: i32) -> Self {
        assert_eq!(self.code, code, "stdout: {}\nstderr: {}", self.out, self.err);
        self
    }

    /// Fails with one error, which says all of the words.
    #[track_caller]
    fn fails(self, code: i32, words: &[&str]) {
        let ran = self.ends(code);
        assert_eq!(ran.err.matches("error:").count(), 1, "{}", ran.err);
        for word in words {
            assert!(ran.err.contains(word), "`{word}` is not in: {}", ran.err);
        }
        assert_eq!(ran.out, "");
    }
}

#[test]
fn help_documents_the_exit_codes_and_every_subcommand_has_an_example() {
    let place = Place::new();
    let help = place.gloss("--help").ends(0).out;
    for line in ["Exit codes:", "0  done", "1  failed", "2  bad usage", "75  interrupted"] {
        assert!(help.contains(line), "`{line}` is not in: {help}");
    }
    for subcommand in ["render", "info", "gen", "diff", "schema"] {
        let help = place.gloss(&format!("{subcommand} --help")).ends(0).out;
        assert!(help.contains(&format!("gloss {subcommand} ")), "{help}");
    }
    assert!(place.gloss("--version").ends(0).out.starts_with("gloss "));
}

#[test]
fn bad_usage_ends_with_2() {
    let place = Place::new();
    place.write("a.toml", SCENE);
    for bad in [
        "",
        "paint a.toml",
        "render",
        "render a.toml",
        "render a.toml -o a.png --spp 0",
        "render a.toml -o a.png --spp many",
        "render a.toml -o a.png --resolution 0x4",
        "render a.toml -o a.png --crop 4,4,4,8",
        "render a.toml -o a.png --backend magic",
        "render a.toml -o a.png --glossy-samples 0",
        "render a.toml -o a.png --tile-size 7",
        "render a.toml -o a.png --exposure nan",
        "render a.toml -o a.png -D settings.spp",
        "render a.toml -o a.png -q -v",
        "gen cube -o a.obj",
        "gen sphere -o a.obj --triangles 0",
        "diff a.png",
        "diff a.png b.png --threshold -1",
        "diff a.png b.png --exposure 1",
    ] {
        let ran = place.gloss(bad).ends(2);
        assert!(!ran.err.is_empty() && ran.out.is_empty(), "{bad}");
    }
    assert_eq!(place.names(), ["a.toml"]);
}

#[test]
fn a_missing_scene_and_a_bad_one_end_with_2_and_say_where() {
    let place = Place::new();
    place.gloss("info none.toml").fails(2, &["none.toml", "No such file"]);
    place.gloss("render none.toml -o a.png").fails(2, &["none.toml"]);
    place.write("bad.toml", "[settings]\nspp = 4\nmax_dept = 2\n");
    place.gloss("info bad.toml").fails(2, &["bad.toml:3", "max_depth"]);
    place.write("torn.toml", "[settings\n");
    place.gloss("render torn.toml -o a.png").fails(2, &["torn.toml:1"]);
    place.write("a.toml", SCENE);
    place.gloss("info a.toml -D settings.spp=none").fails(2, &["settings.spp"]);
    assert_eq!(place.names(), ["a.toml", "bad.toml", "torn.toml"]);
}

#[test]
fn outputs_that_cannot_be_written_are_refused_before_the_scene_is_read() {
    let place = Place::new();
    place.write("file", "");
    // The scene is missing too: the message about the output shows that it was looked at first.
    place.gloss("render none.toml -o a.jpg").fails(2, &["a.jpg", ".exr", ".png"]);
    place.gloss("render none.toml -o a").fails(2, &["a: unknown image format"]);
    place.gloss("render none.toml -o none/a.png").fails(1, &["none/a.png", "No such file"]);
    place.gloss("render none.toml -o file/a.png").fails(1, &["file/a.png"]);
    place.gloss("render none.toml -o a.png -o a.png").fails(2, &["twice"]);
    place.gloss("gen sphere -o a.stl").fails(2, &["a.stl", ".obj", ".ply"]);
    place.gloss("gen sphere -o none/a.obj").fails(1, &["none/a.obj"]);
    assert_eq!(place.names(), ["file"]);
}

#[test]
fn a_render_makes_its_pictures_and_says_who_made_them() {
    let place = Place::new();
    place.write("a.toml", SCENE);
    let ran = place.gloss("render a.toml -o a.png -o a.exr --backend brute --direct-light lobe").ends(0);
    assert_eq!(ran.out, "");
    let last = ran.err.lines().last().unwrap();
    for word in ["a.png", "a.exr", "brute", "4 spp", "rays/s", "load", "build", "render", "peak memory"] {
        assert!(last.contains(word), "`{word}` is not in: {last}");
    }
    assert_eq!(read_image(&place.path("a.png")).unwrap().size(), [16, 12]);
    let picture = read_image(&place.path("a.exr")).unwrap();
    assert_eq!(picture.size(), [16, 12]);
    // The sky shines from everywhere, and the lobe sends all of it on.
    assert!(picture.pixels.iter().all(|p| (p.g - 0.5).abs() < 1e-5));
    assert_eq!(place.names(), ["a.exr", "a.png", "a.toml"]);
}

#[test]
fn an_exr_remembers_how_it_was_made() {
    let place = Place::new();
    place.write("a.toml", SCENE);
    place.gloss("render a.toml -o a.exr --backend brute --spp 3 --seed 7 -q").ends(0);
    let meta = exr::meta::MetaData::read_from_file(place.path("a.exr"), false).unwrap();
    let attributes = &meta.headers[0].own_attributes.other;
    let attribute = |name: &str| match attributes.get(&exr::meta::attribute::Text::from(name)) {
        Some(exr::meta::attribute::AttributeValue::Text(text)) => text.to_string(),
        other => panic!("{name}: {other:?}"),
    };
    assert_eq!(attribute("gloss.spp"), "3");
    assert_eq!(attribute("gloss.seed"), "7");
    assert_eq!(attribute("gloss.scene"), "a.toml");
    assert_eq!(attribute("gloss.version"), env!("CARGO_PKG_VERSION"));
    assert!(attribute("gloss.backend").contains("brute"));
    assert!(attribute("gloss.scene_hash").len() >= 16);
    assert!(attribute("gloss.seconds").parse::<f64>().is_ok());
    let settings: serde_json::Value = serde_json::from_str(&attribute("gloss.settings")).unwrap();
    assert_eq!(settings["max_depth"], 2);
}

#[test]
fn flags_go_before_the_file_and_definitions_before_flags() {
    let place = Place::new();
    place.write("a.toml", SCENE);
    let spp = |flags: &str| {
        let ran = place.gloss(&format!("info a.toml --json {flags}")).ends(0);
        let info: serde_json::Value = serde_json::from_str(&ran.out).unwrap();
        info["settings"]["spp"].as_u64().unwrap()
    };
    assert_eq!(spp(""), 4);
    assert_eq!(spp("--spp 9"), 9);
    assert_eq!(spp("-D settings.spp=16 --spp 9"), 16);
    let ran =
        place.gloss("info a.toml --json --resolution 64x48 --glossy-samples 8,2 --horizon clip").ends(0);
    let info: serde_json::Value = serde_json::from_str(&ran.out).unwrap();
    assert_eq!(info["resolution"], serde_json::json!([64, 48]));
    assert_eq!(info["settings"]["glossy_samples"], serde_json::json!([8, 2]));
    assert_eq!(info["settings"]["horizon"], "clip");
}

#[test]
fn a_crop_is_that_part_of_the_whole_picture() {
    let place = Place::new();
    place.write("a.toml", SCENE);
    place.gloss("render a.toml -o whole.exr --backend brute -q").ends(0);
    place.gloss("render a.toml -o part.exr -o part.png --backend brute -q --crop 3,2,11,9").ends(0);
    let (whole, part) =
        (read_image(&place.path("whole.exr")).unwrap(), read_image(&place.path("part.exr")).unwrap());
    assert_eq!(part.size(), [8, 7]);
    assert_eq!(read_image(&place.path("part.png")).unwrap().size(), [8, 7]);
    let same = Image::from_fn(8, 7, |x, y| whole.pixels[((y + 2) * 16 + x + 3) as usize]);
    assert_eq!(part, same);
    place.gloss("render a.toml -o no.png --crop 3,2,17,9").fails(2, &["--crop", "16 x 12"]);
}

#[test]
fn quiet_is_silent_and_json_is_json() {
    let place = Place::new();
    place.write("a.toml", SCENE);
    let ran = place.gloss("render a.toml -o a.png --backend brute -q").ends(0);
    assert_eq!((ran.out.as_str(), ran.err.as_str()), ("", ""));
    let ran = place.gloss("render a.toml -o a.png --backend brute --progress json").ends(0);
    let events: Vec<serde_json::Value> = ran.err.lines().map(|l| serde_json::from_str(l).unwrap()).collect();
    let last = events.last().unwrap();
    assert_eq!(last["event"], "done");
    assert_eq!(last["rays"]["primary"], 4 * 16 * 12);
    assert!(last["backend"].as_str().unwrap().contains("brute"));
}

#[test]
fn the_old_picture_stays_if_the_new_one_fails() {
    let place = Place::new();
    place.write("a.png", "old");
    place.write("bad.toml", "shapes = 3");
    place.gloss("render bad.toml -o a.png").ends(2);
    assert_eq!(fs::read_to_string(place.path("a.png")).unwrap(), "old");
    assert_eq!(place.names(), ["a.png", "bad.toml"]);
}

#[cfg(unix)]
#[test]
fn an_interrupted_render_writes_nothing_and_ends_with_75() {
    let place = Place::new();
    place.write("a.toml", SCENE);
    place.write("a.png", "old");
    let arguments = "render a.toml -o a.png --backend brute --spp 256 --resolution 1000x1000 --tile-size 8";
    for signal in ["INT", "TERM"] {
        let child = std::process::Command::new(env!("CARGO_BIN_EXE_gloss"))
            .current_dir(place.0.path())
            .args(arguments.split_whitespace())
            .args(["--progress", "json"])
            .stderr(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut child = child;
        // The first event shows that the render runs and that signals are listened to.
        let mut reader = std::io::BufReader::new(child.stderr.take().unwrap());
        let mut first = String::new();
        std::io::BufRead::read_line(&mut reader, &mut first).unwrap();
        assert!(first.contains("progress"), "{first}");
        let killed =
            std::process::Command::new("kill").args(["-s", signal, &child.id().to_string()]).status();
        assert!(killed.unwrap().success());
        let mut rest = String::new();
        std::io::Read::read_to_string(&mut reader, &mut rest).unwrap();
        assert_eq!(child.wait().unwrap().code(), Some(75), "{rest}");
        assert!(rest.contains("interrupted") && rest.contains("nothing is written"), "{rest}");
    }
    assert_eq!(fs::read_to_string(place.path("a.png")).unwrap(), "old");
    assert_eq!(place.names(), ["a.png", "a.toml"]);
}

#[test]
fn info_tells_what_is_in_a_scene() {
    let place = Place::new();
    place.write("a.toml", SCENE);
    let text = place.gloss("info a.toml").ends(0).out;
    for words in [
        "16 x 12 pixels",
        "0 triangles, 1 spheres",
        "plan        reflected rays are traced",
        "(-1, -1, -1) to (1, 1, 1)",
        "shiny: glossy, exponent 100",
    ] {
        assert!(text.contains(words), "`{words}` is not in: {text}");
    }
    let info: serde_json::Value =
        serde_json::from_str(&place.gloss("info a.toml --json").ends(0).out).unwrap();
    assert_eq!(info["plan"]["spheres"], 1);
    assert_eq!(info["environment"], "constant");
}

#[test]
fn info_tells_what_memory_a_picture_takes() {
    let place = Place::new();
    place.write("a.toml", SCENE);
    let told = place.gloss("info a.toml --resolution 65536x65536").ends(0).out;
    assert!(told.contains("GB of the picture"), "{told}");
}

#[test]
fn the_schema_is_json_and_nobody_minds_if_only_its_head_is_read() {
    let place = Place::new();
    let schema: serde_json::Value = serde_json::from_str(&place.gloss("schema").ends(0).out).unwrap();
    assert!(schema["properties"]["camera"].is_object(), "{schema}");

    let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_gloss"))
        .arg("schema")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let ran = Ran::from(child.wait_with_output().unwrap()).ends(0);
    assert_eq!(ran.err, "");
}

#[test]
fn generated_meshes_have_about_the_asked_size_and_render() {
    let place = Place::new();
    for (kind, name) in [("sphere", "a.obj"), ("terrain", "b.ply"), ("knot", "c.ply"), ("blob", "d.obj")] {
        let ran = place.gloss(&format!("gen {kind} --triangles 500 -o {name}")).ends(0);
        let told: f64 = ran.err.split_whitespace().nth(1).unwrap().parse().unwrap();
        assert!((250.0..=1000.0).contains(&told), "{}", ran.err);
        let shape = &name[name.len() - 3..];
        place.write("a.toml", &format!("[[shapes]]\ntype = \"{shape}\"\nfile = \"{name}\"\n"));
        let info: serde_json::Value =
            serde_json::from_str(&place.gloss("info a.toml --json").ends(0).out).unwrap();
        assert_eq!(info["plan"]["triangles"].as_f64(), Some(told), "{kind}");
    }
}

/// Two pictures, one a little brighter in one pixel, in both formats.
fn pictures(place: &Place) {
    let a = Image::from_fn(20, 10, |x, y| Rgb::new(x as f32 / 20.0, y as f32 / 10.0, 0.5));
    let mut b = a.clone();
    b.pixels[47].g += 0.25;
    for (name, image) in [("a", &a), ("b", &b)] {
        write_png(&place.path(&format!("{name}.png")), image, 0.0).unwrap();
        write_exr(&place.path(&format!("{name}.exr")), image, &ExrOptions::default()).unwrap();
    }
    let small = Image::from_fn(4, 4, |_, _| Rgb::BLACK);
    write_png(&place.path("small.png"), &small, 0.0).unwrap();
}

fn json_of(ran: Ran) -> serde_json::Value {
    serde_json::from_str(&ran.out).unwrap()
}

#[test]
fn diff_of_the_same_is_nothing() {
    let place = Place::new();
    pictures(&place);
    for name in ["a.png", "a.exr"] {
        let ran = place.gloss(&format!("diff {name} {name} --json --threshold 0")).ends(0);
        let difference = json_of(ran);
        for metric in ["rmse", "relmse", "max", "mean", "flip"] {
            assert_eq!(difference[metric], 0.0, "{name} {metric}");
        }
    }
}

#[test]
fn diff_measures_and_judges() {
    let place = Place::new();
    pictures(&place);
    let difference = json_of(place.gloss("diff b.exr a.exr --json").ends(0));
    let value = |name: &str| difference[name].as_f64().unwrap();
    assert!((value("max") - 0.25).abs() < 1e-6);
    assert!((value("mean") - 0.25 / 600.0).abs() < 1e-7);
    assert!((value("rmse") - 0.25 / 600f64.sqrt()).abs() < 1e-7);
    assert_eq!(difference["max_at"], serde_json::json!([7, 2]));
    assert_eq!(difference["range"], "hdr");
    assert_eq!(json_of(place.gloss("diff b.exr a.exr --json --ldr").ends(0))["range"], "ldr");
    assert_eq!(json_of(place.gloss("diff b.png a.exr --json").ends(0))["range"], "ldr");

    place.gloss("diff b.exr a.exr --metric max --threshold 0.3").ends(0);
    let ran = place.gloss("diff b.exr a.exr --metric max --threshold 0.2").ends(1);
    assert!(ran.err.contains("max") && ran.out.contains("rmse"), "{}", ran.err);
    place.gloss("diff b.png a.png --threshold 1e-6").ends(1);
}

#[test]
fn diff_draws_a_map_and_refuses_what_it_cannot_compare() {
    let place = Place::new();
    pictures(&place);
    place.gloss("diff b.exr a.exr --map map.png -q").ends(0);
    let map = read_image(&place.path("map.png")).unwrap();
    assert_eq!(map.size(), [20, 10]);
    let brightest = (0..200).max_by(|&a, &b| map.pixels[a].luminance().total_cmp(&map.pixels[b].luminance()));
    assert_eq!(brightest, Some(47));

    place.gloss("diff a.png small.png").fails(2, &["20 x 10", "4 x 4"]);
    place.gloss("diff a.png none.png").fails(2, &["none.png"]);
    place.gloss("diff a.png a.jpg").fails(2, &["a.jpg", ".png"]);
    place.gloss("diff a.png b.png --map map.exr").fails(2, &["map.exr"]);
    place.gloss("diff a.png b.png --map none/map.png").fails(1, &["none/map.png"]);
    place.write("torn.png", "no picture");
    place.gloss("diff torn.png a.png").fails(2, &["torn.png", "not a PNG"]);
}

#[cfg(unix)]
#[test]
fn names_that_are_no_text_are_no_trouble() {
    use std::os::unix::ffi::OsStrExt;
    let place = Place::new();
    let odd = Path::new(std::ffi::OsStr::from_bytes(b"\xff\xfe.png"));
    let output = cargo_bin_cmd!("gloss")
        .current_dir(place.0.path())
        .args(["diff".as_ref(), odd.as_os_str(), odd.as_os_str()])
        .output()
        .unwrap();
    Ran::from(output).fails(2, &[".png"]);
}
