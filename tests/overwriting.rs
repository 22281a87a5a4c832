//! What is there stays: no output takes the place of what is read, nor of another output.

mod common;

use common::place::{Place, Ran};
use std::fs;
use std::path::Path;

impl Place {
    /// Runs the program, which refuses with all of the words and leaves all files as they are.
    #[track_caller]
    fn refuses(&self, arguments: &str, words: &[&str]) {
        let before = self.contents();
        let ran = self.gloss(arguments);
        assert_eq!(ran.code, 2, "{arguments}: {}", ran.err);
        assert_eq!(ran.err.matches("error:").count(), 1, "{arguments}: {}", ran.err);
        for word in words {
            assert!(ran.err.contains(word), "{arguments}: `{word}` is not in: {}", ran.err);
        }
        assert!(self.contents() == before, "{arguments}: files have changed, now {:?}", self.names());
    }

    /// Names of all files, and what the files hold.
    fn contents(&self) -> Vec<(String, Option<Vec<u8>>)> {
        self.names().into_iter().map(|name| (name.clone(), fs::read(self.path(&name)).ok())).collect()
    }

    #[track_caller]
    fn makes(&self, arguments: &str) {
        let ran = self.gloss(arguments);
        assert_eq!(ran.code, 0, "{arguments}: {}", ran.err);
    }

    /// Two shards of three.
    fn with_shards() -> Self {
        let place = Self::new();
        for index in 0..2 {
            place.makes(&format!("render scene.toml -o {index}.exr --shard {index}/3 --spp 3 -q"));
        }
        place
    }
}

#[test]
fn the_scene_stays_whatever_the_flag() {
    let place = Place::new();
    for (command, flag) in [
        ("render scene.toml -o z.png", "--dump-rays"),
        ("render scene.toml -o z.png --resume", "--checkpoint"),
        ("compare scene.toml", "--html"),
        ("compare scene.toml", "--dump-rays"),
        ("sweep scene.toml --vary settings.seed=1,2", "--records"),
        ("trade scene.toml", "--output"),
        ("trade scene.toml", "--json"),
        ("trade scene.toml", "--csv"),
        ("trade scene.toml", "--state"),
    ] {
        let told = &*format!("scene.toml is the scene: give {flag} another name");
        place.refuses(&format!("{command} {flag} scene.toml"), &[told]);
    }
    place.refuses("render ./scene.toml -o z.png --dump-rays scene.toml", &["scene.toml is the scene"]);
}

#[test]
fn what_the_scene_names_stays() {
    let place = Place::new();
    place.makes("render scene.toml -o sky.exr --spp 1 -q");
    fs::write(place.path("m.mtl"), "newmtl m\nKd 1 1 1\n").unwrap();
    fs::write(place.path("m.obj"), "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n").unwrap();
    let text = "environment = { type = \"image\", file = \"sky.exr\" }\nshapes = [{ type = \"obj\", file = \"m.obj\" }]\n";
    fs::write(place.path("s.toml"), text).unwrap();
    let told = |file: &str, name: &str| format!("{file} is a file of the scene: give {name} another name");
    for (arguments, file, name) in [
        ("render s.toml -o ./sky.exr", "./sky.exr", "--output"),
        ("render s.toml -o z.png --dump-rays m.mtl", "m.mtl", "--dump-rays"),
        ("render s.toml -o z.png --checkpoint sky.exr --resume", "sky.exr", "--checkpoint"),
        ("compare s.toml --html m.obj", "m.obj", "--html"),
        ("trade s.toml --json m.obj", "m.obj", "--json"),
        ("sweep s.toml --vary settings.seed=1 -o sky.exr", "sky.exr", "a picture"),
        ("sweep s.toml --vary settings.seed=1 --records m.obj", "m.obj", "--records"),
    ] {
        place.refuses(arguments, &[&told(file, name)]);
    }
    // A picture may be the environment of one that is made after it.
    let jobs = "[[job]]\nname = \"a\"\nscene = \"scene.toml\"\noutput = \"sky.exr\"\n\
                [[job]]\nname = \"b\"\nscene = \"s.toml\"\noutput = \"b.png\"\n";
    fs::write(place.path("jobs.toml"), jobs).unwrap();
    place.makes("batch jobs.toml -q -D settings.spp=1");
    place.refuses("batch jobs.toml --records jobs.toml", &["jobs.toml is the file of jobs"]);
}

#[test]
fn outputs_are_apart_however_they_are_spelled() {
    let place = Place::new();
    fs::create_dir(place.path("o")).unwrap();
    let render = "render scene.toml --spp 1";
    for (arguments, told) in [
        ("-o z.png --dump-rays z.png", "z.png is --output already: give --dump-rays another name"),
        ("-o z.png --dump-rays x --checkpoint x", "x is --checkpoint already"),
        (
            "-o o/a.exr --checkpoint ./o/a.exr",
            "./o/a.exr is --output already: give --checkpoint another name",
        ),
        ("-o o/d.png -o ./o/d.png", "./o/d.png is given twice as --output"),
        ("-o o/../d.png -o d.png", "twice"),
        ("-o a.exr --shard 0/2 --dump-rays a.exr.part", "a.exr.part is --checkpoint already"),
    ] {
        place.refuses(&format!("{render} {arguments}"), &[told]);
    }
    place.refuses("trade scene.toml -o x --json x --csv x", &["x is --output already"]);
    place.refuses("trade scene.toml --json x --csv x.state", &["x.state is --csv already", "--state"]);
    let sweep = "sweep scene.toml --vary settings.seed=1,2";
    place.refuses(
        &format!("{sweep} -o sw-{{seed}}.png --sheet sw-1.png"),
        &["sw-1.png is a picture already: give --sheet another name"],
    );
    place.refuses(&format!("{sweep} --sheet x.png --records x.png"), &["x.png is --sheet already"]);
}

#[cfg(unix)]
#[test]
fn links_do_not_hide_what_stays() {
    let place = Place::new();
    std::os::unix::fs::symlink("scene.toml", place.path("soft")).unwrap();
    fs::hard_link(place.path("scene.toml"), place.path("hard")).unwrap();
    for link in ["soft", "hard"] {
        let told = format!("{link} is the scene");
        place.refuses(&format!("sweep scene.toml --vary settings.seed=1 --records {link}"), &[&told]);
    }
}

#[test]
fn a_map_takes_the_place_of_neither_picture() {
    let place = Place::new();
    for name in ["a.png", "b.png"] {
        place.makes(&format!("render scene.toml -o {name} --spp 1 -q"));
    }
    place.refuses("diff a.png b.png --map a.png", &["a.png is the picture to test: give --map another name"]);
    place.refuses("diff a.png b.png --map ./b.png", &["./b.png is the reference"]);
}

#[test]
fn a_merge_keeps_its_shards_and_the_sums_of_others() {
    let place = Place::with_shards();
    place.refuses("merge -o 0.exr 0.exr 1.exr --partial", &["0.exr is one of the shards: give --output"]);
    place.refuses("merge -o m.exr --checkpoint ./m.exr 0.exr 1.exr --partial", &["--output already"]);
    place.makes("merge --checkpoint half.exr --partial 0.exr 1.exr -q");
    place.makes("render scene.toml -o 2.exr --shard 2/3 --spp 3 -q");
    place.refuses("merge --checkpoint half.exr --partial 2.exr", &["half.exr is there", "among the shards"]);
    place.refuses(
        "merge -o m.png --partial half.exr 1.exr",
        &["1.exr has samples (shard 1/3, samples 1 to 2) that are in half.exr already"],
    );
    // Its own sums may go on in the same file.
    place.makes("merge --checkpoint half.exr ./half.exr 2.exr -q");
    place.makes("merge -o m.png half.exr -q");
}

#[test]
fn a_sheet_is_a_png() {
    let place = Place::new();
    place.refuses("sweep scene.toml --vary settings.seed=1 --sheet x.exr", &["x.exr: the sheet is a .png"]);
}

#[test]
fn flags_that_would_do_nothing_are_refused() {
    let place = Place::new();
    place.refuses("render scene.toml -o a.png --checkpoint-every 5s", &["--checkpoint"]);
    place.makes("render scene.toml -o a.exr --shard 0/2 --checkpoint-every 5s --spp 2 -q");
    place.refuses("trade scene.toml --rounds 1", &["--rounds", "2.."]);
}

#[cfg(target_os = "linux")]
#[test]
fn names_that_are_no_text_are_kept_or_refused() {
    use std::os::unix::ffi::OsStrExt;
    let place = Place::new();
    let odd = |bytes: &'static [u8]| Path::new(std::ffi::OsStr::from_bytes(bytes));
    let (shard, scene) = (odd(b"\xff.exr"), odd(b"\xff.toml"));
    fs::copy(place.path("scene.toml"), place.path("").join(scene)).unwrap();

    // What another render has left beside a shard is looked for under the shard's own name.
    fs::write(place.path("").join(odd(b"\xff.exr.part")), "no checkpoint").unwrap();
    let mut render = place.command("render scene.toml --shard 0/2 --spp 2 -q");
    let ran = Ran::from(render.arg("-o").arg(shard).output().unwrap());
    assert!(ran.code == 2 && ran.err.contains("no checkpoint of gloss"), "{}", ran.err);

    let submit = "submit --engine slurm --tasks 2 --dry-run";
    let of_scene = place.command(submit).arg(scene).args(["-o", "a.png"]).output().unwrap();
    let of_output = place.command(submit).args(["scene.toml", "-o"]).arg(odd(b"\xff.png")).output().unwrap();
    for ran in [of_scene, of_output].map(Ran::from) {
        assert!(ran.code == 2 && ran.err.contains("no UTF-8"), "{}: {}", ran.code, ran.err);
    }
}
