//! What is left to tell of a picture: a line of JSON.

use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::collections::BTreeMap;

/// How one picture was made, or why it was not.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Always `picture`.
    pub event: Cow<'static, str>,
    /// What it is called.
    pub name: String,
    /// The job that it belongs to.
    pub job: String,
    /// Its frame.
    pub frame: Option<u32>,
    /// The scene file.
    pub scene: String,
    /// What was changed of it, by path.
    pub overrides: BTreeMap<String, String>,
    /// Files that were written.
    pub outputs: Vec<String>,
    /// Why there is none.
    pub error: Option<String>,
    /// Hash of scene and settings.
    pub scene_hash: String,
    /// Samples per pixel.
    pub spp: u32,
    /// Seed of the random numbers.
    pub seed: u32,
    /// Who answered rays.
    pub backend: String,
    /// Rays asked.
    pub rays: u64,
    /// Samples that could not be added.
    pub dropped: u64,
    /// Reading the scene, in seconds.
    pub load_seconds: f64,
    /// Building the structure; 0 where it was kept.
    pub build_seconds: f64,
    /// Rendering.
    pub render_seconds: f64,
    /// Writing the files.
    pub write_seconds: f64,
    /// Whether the structure of the picture before was still good.
    pub structure_kept: bool,
    /// What loading and building took when they were done in full, less what they took now.
    pub saved_seconds: f64,
}

impl Record {
    /// The records in a file of lines; what is not one, such as a line that was cut off, is left out.
    pub fn of_lines(text: &str) -> Vec<Self> {
        text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect()
    }

    /// One line, without its end.
    pub fn to_line(&self) -> String {
        serde_json::to_string(self).expect("a record has plain fields only")
    }
}
