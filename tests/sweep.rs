//! Many pictures by `gloss sweep` and `gloss batch`: the same bits as one by one, geometry kept, failures alone.

use gloss::image_io::read_image;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use tempfile::TempDir;

const SCENE: &str = r#"
settings = { spp = 4, max_depth = 2 }
camera = { resolution = [24, 16], eye = [0, 1, 5], look_at = [0, 0, 0] }
environment = { type = "gradient", nadir = [0.1, 0.2, 0.1], horizon = [0.5, 0.6, 0.9], zenith = [2.0, 1.5, 1.0] }

[materials.lemon]
type = "cosine-power"
exponent = 20

[[shapes]]
type = "ply"
file = "ball.ply"
material = "lemon"
"#;

struct Place(TempDir);

struct Ran {
    code: i32,
    out: String,
    err: String,
}

impl Ran {
    fn records(&self) -> Vec<serde_json::Value> {
        self.out.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
    }
}

impl Place {
    fn new() -> Self {
        let place = Self(tempfile::tempdir().unwrap());
        place.write("lemon.toml", SCENE);
        let ran = place.gloss("gen sphere --triangles 2000 -o ball.ply");
        assert_eq!(ran.code, 0, "{}", ran.err);
        place
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).unwrap();
    }

    fn gloss(&self, arguments: &str) -> Ran {
        let mut command = Command::new(env!("CARGO_BIN_EXE_gloss"));
        command.current_dir(self.0.path()).args(arguments.split_whitespace()).stdin(Stdio::null());
        let output = command.output().unwrap();
        Ran {
            code: output.status.code().unwrap(),
            out: String::from_utf8(output.stdout).unwrap(),
            err: String::from_utf8(output.stderr).unwrap(),
        }
    }

    /// Whether two files hold the same bytes.
    fn same(&self, a: &str, b: &str) -> bool {
        std::fs::read(self.path(a)).unwrap() == std::fs::read(self.path(b)).unwrap()
    }
}

#[test]
fn a_sweep_makes_the_pictures_of_single_renders_with_one_structure() {
    let place = Place::new();
    let ran = place.gloss(
        "sweep lemon.toml --vary materials.lemon.exponent=1,100,10000 --vary settings.seed=0,7 \
         -o out/{exponent}-{seed}.png --sheet sheet.png",
    );
    assert_eq!(ran.code, 0, "{}", ran.err);
    let records = ran.records();
    assert_eq!(records.len(), 6);
    assert_eq!(records[0]["structure_kept"], false);
    assert!(records[1..].iter().all(|r| r["structure_kept"] == true && r["build_seconds"] == 0.0));
    assert_eq!(records[5]["overrides"]["materials.lemon.exponent"], "10000");
    assert!(ran.err.contains("geometry kept"), "{}", ran.err);

    for (exponent, seed) in [(1, 0), (100, 7), (10000, 7)] {
        let flags = format!("--seed {seed} -D materials.lemon.exponent={exponent}");
        assert_eq!(place.gloss(&format!("render lemon.toml -o alone.png -q {flags}")).code, 0);
        assert!(place.same("alone.png", &format!("out/{exponent}-{seed}.png")), "{flags}");
    }
    let sheet = read_image(&place.path("sheet.png")).unwrap();
    assert!(sheet.width > 3 * 24 && sheet.height > 2 * 16);
}

#[test]
fn a_dry_run_says_what_would_be_made_and_makes_nothing() {
    let place = Place::new();
    let ran =
        place.gloss("sweep lemon.toml --vary settings.spp=1,2 --vary settings.seed=3,4 --zip --dry-run");
    assert_eq!(
        ran.out,
        "lemon-1-3.png: lemon.toml settings.spp=1 settings.seed=3\n\
         lemon-2-4.png: lemon.toml settings.spp=2 settings.seed=4\n"
    );
    assert!(ran.code == 0 && !place.path("lemon-1-3.png").exists());
    let ran = place.gloss("sweep lemon.toml --vary settings.spp=1,2 -o same.png");
    assert!(ran.code == 2 && ran.err.contains("would be written both"), "{}", ran.err);
}

#[test]
fn a_job_that_fails_does_not_stop_the_others() {
    let place = Place::new();
    place.write("lost.toml", &SCENE.replace("ball.ply", "gone.ply"));
    let jobs = r#"
        output = "{job}-{frame:2}.png"
        [[job]]
        scene = "lemon.toml"
        name = "turn"
        frames = "1-5x2"
        animate = { "camera.eye" = [[1, [0, 1, 5]], [5, [4, 1, 5]]] }
        [[job]]
        scene = "lost.toml"
        output = "lost.png"
        [[job]]
        scene = "lemon.toml"
        name = "dull"
        output = ["dull.exr", "dull.png"]
        set = { "materials.lemon.exponent" = 2 }
    "#;
    place.write("jobs.toml", jobs);
    let ran = place.gloss("batch jobs.toml --records done.jsonl");
    assert_eq!(ran.code, 3, "{}", ran.err);
    assert!(ran.err.contains("error: lost: ") && ran.err.contains("gone.ply"), "{}", ran.err);
    let all = ran.err.lines().last().unwrap().split_whitespace().take(3).collect::<Vec<_>>().join(" ");
    assert_eq!(all, "all 5 1");
    let lines = std::fs::read_to_string(place.path("done.jsonl")).unwrap();
    let kept: Vec<bool> = lines
        .lines()
        .map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap()["structure_kept"] == true)
        .collect();
    assert_eq!(kept, [false, true, true, false, true]);

    assert_eq!(place.gloss("render lemon.toml -o alone.png -q -D camera.eye=[2,1,5]").code, 0);
    assert!(place.same("alone.png", "turn-03.png"));
    assert!(!place.same("turn-01.png", "turn-03.png"));
    assert_eq!(read_image(&place.path("dull.exr")).unwrap().size(), [24, 16]);
}

#[test]
fn a_mesh_that_vanishes_leaves_the_pictures_made_before() {
    let place = Place::new();
    place.write("jobs.toml", "[[job]]\nscene = \"lemon.toml\"\noutput = \"a.png\"");
    assert_eq!(place.gloss("batch jobs.toml -q").code, 0);
    let before = std::fs::read(place.path("a.png")).unwrap();
    std::fs::remove_file(place.path("ball.ply")).unwrap();
    let ran = place.gloss("batch jobs.toml -q");
    assert!(ran.code == 3 && ran.err.contains("ball.ply"), "{}", ran.err);
    assert!(std::fs::read(place.path("a.png")).unwrap() == before);
}

#[test]
fn a_batch_goes_on_with_what_is_not_made_yet() {
    let place = Place::new();
    place.write(
        "jobs.toml",
        "[[job]]\nscene = \"lemon.toml\"\noutput = \"{frame}-{spp}.png\"\nframes = \"1-3\"",
    );
    let batch = "batch jobs.toml --records done.jsonl --resume";
    let made = || {
        let ran = place.gloss(batch);
        assert_eq!(ran.code, 0, "{}", ran.err);
        ran.err.lines().filter(|line| line.contains(", render ")).count()
    };
    assert_eq!((made(), made()), (3, 0));
    std::fs::remove_file(place.path("2-4.png")).unwrap();
    assert_eq!(made(), 1);
    place.write("lemon.toml", &SCENE.replace("exponent = 20", "exponent = 21"));
    assert_eq!((made(), made()), (3, 0));
}

#[test]
fn the_shipped_jobs_are_in_order() {
    let jobs = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/jobs/turntable.toml");
    let ran = Place::new().gloss(&format!("batch {jobs} --dry-run"));
    assert_eq!((ran.code, ran.out.lines().count()), (0, 25), "{}{}", ran.out, ran.err);
}

#[test]
fn shares_of_a_batch_make_up_the_whole() {
    let place = Place::new();
    place.write("jobs.toml", "[[job]]\nscene = \"lemon.toml\"\noutput = \"{frame}.png\"\nframes = \"1-5\"");
    let first = place.gloss("batch jobs.toml --shard 0/2 --dry-run").out;
    let second = place.gloss("batch jobs.toml --shard 1/2 --dry-run").out;
    assert_eq!((first.lines().count(), second.lines().count()), (3, 2));
    assert_eq!(place.gloss("batch jobs.toml --shard 2/2 --dry-run").code, 2);
}

#[test]
fn a_submission_is_printed_for_each_engine() {
    let place = Place::new();
    let submit = "submit lemon.toml -o lemon.png --tasks 3 --cpus 2 --time 30m --dry-run";
    let slurm = place.gloss(&format!("{submit} --engine slurm -- --spp 9")).out;
    assert!(slurm.contains("#SBATCH --array=0-2") && slurm.contains("--spp 9 &\n"), "{slurm}");
    assert!(slurm.contains("gloss merge -o "), "{slurm}");
    assert!(Command::new("sh").args(["-n", "-c", &slurm]).status().unwrap().success());
    let parallel = place.gloss(&format!("{submit} --engine parallel")).out;
    let checked = Command::new("sh").args(["-n", "-c", &parallel]).status().unwrap();
    assert!(checked.success() && parallel.contains("seq 0 2 | parallel"), "{parallel}");
    let openjd = place.gloss(&format!("{submit} --engine openjd")).out;
    let template: serde_json::Value = serde_json::from_str(&openjd).unwrap();
    assert_eq!(template["steps"].as_array().unwrap().len(), 2);
    let ran = place.gloss("submit lemon.toml --tasks 3 --engine slurm --dry-run");
    assert!(ran.code == 2 && ran.err.contains("--output"), "{}", ran.err);
    for (flags, told) in [("--foo", "--foo"), ("--spp 0", "--spp"), ("--threads 4", "--threads")] {
        let ran = place.gloss(&format!("{submit} --engine slurm -- {flags}"));
        assert!(ran.code == 2 && ran.err.contains("after `--`") && ran.err.contains(told), "{}", ran.err);
    }
}
