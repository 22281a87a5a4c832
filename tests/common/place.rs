//! The program itself, run on a scene: what the tests of parts of pictures share.

use gloss::farm::Checkpoint;
use std::path::PathBuf;
use std::process::{Child, Command, Output, Stdio};
use tempfile::TempDir;

/// Three glossy spheres under an uneven sky: noise everywhere.
pub(crate) const SCENE: &str = r#"
settings = { spp = 64, max_depth = 3 }
camera = { resolution = [48, 32], eye = [0, 1, 5], look_at = [0, 0, 0] }
environment = { type = "gradient", nadir = [0.1, 0.2, 0.1], horizon = [0.5, 0.6, 0.9], zenith = [2.0, 1.5, 1.0] }

[materials.shiny]
type = "cosine-power"
exponent = 20

[[shapes]]
type = "sphere"
material = "shiny"
spheres = [[0, 0, 0, 1], [-1.8, 0, 0, 0.7], [1.8, 0.3, 0, 0.8]]
"#;

/// A directory with a scene, in which the program runs.
pub(crate) struct Place(TempDir);

impl Place {
    pub(crate) fn new() -> Self {
        let place = Self(tempfile::tempdir().unwrap());
        std::fs::write(place.path("scene.toml"), SCENE).unwrap();
        place
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub(crate) fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.0.path()).unwrap();
        let mut names: Vec<_> =
            entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    pub(crate) fn command(&self, arguments: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_gloss"));
        command.current_dir(self.0.path()).args(arguments.split_whitespace()).stdin(Stdio::null());
        command
    }

    pub(crate) fn gloss(&self, arguments: &str) -> Ran {
        Ran::from(self.command(arguments).output().unwrap())
    }

    pub(crate) fn start(&self, arguments: &str) -> Child {
        self.command(arguments).stderr(Stdio::piped()).spawn().unwrap()
    }

    /// Renders the whole without a break.
    pub(crate) fn whole(&self, flags: &str) -> Checkpoint {
        let ran = self.gloss(&format!("render scene.toml -o whole.png --checkpoint whole.exr -q {flags}"));
        assert_eq!(ran.code, 0, "{}", ran.err);
        Checkpoint::read(&self.path("whole.exr")).unwrap()
    }
}

/// How the program ended.
pub(crate) struct Ran {
    pub(crate) code: i32,
    /// What it said on stderr.
    pub(crate) err: String,
}

impl From<Output> for Ran {
    fn from(output: Output) -> Self {
        let code = output.status.code().expect("the program ends by itself");
        Self { code, err: String::from_utf8(output.stderr).unwrap() }
    }
}
