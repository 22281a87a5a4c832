//! One picture of many.

use crate::accel::AccelError;
use crate::image_io::ImageError;
use crate::scene::{Override, SceneError};
use std::collections::HashMap;
use std::path::PathBuf;

/// What is to be made.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// What reports call it.
    pub name: String,
    /// What it is one of: a job's name, or the same for all.
    pub job: String,
    /// The scene file.
    pub scene: PathBuf,
    /// What is changed of it.
    pub overrides: Vec<Override>,
    /// What tells it from its neighbours: a part of the overrides, for labels.
    pub label: String,
    /// Its frame, if it is one of an animation.
    pub frame: Option<u32>,
    /// Files to write.
    pub outputs: Vec<PathBuf>,
}

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// The scene cannot be loaded.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// No structure can be built over it.
    #[error(transparent)]
    Accel(#[from] AccelError),
    /// A file cannot be written; one that was there before is untouched.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// Rendering was interrupted: nothing was written.
    #[error("interrupted")]
    Interrupted,
}

/// Checks that no file would be written twice.
///
/// # Errors
/// Which pictures would write the same file, in a message for people.
pub fn check_names_differ(pictures: &[Picture]) -> Result<(), String> {
    let mut writers: HashMap<&PathBuf, &str> = HashMap::new();
    for picture in pictures {
        for output in &picture.outputs {
            if let Some(other) = writers.insert(output, &picture.name) {
                return Err(format!(
                    "{} would be written both for `{other}` and for `{}`: let the name of the output tell them apart, \
                     as {{index}} does",
                    output.display(),
                    picture.name
                ));
            }
        }
    }
    Ok(())
}

/// The share of a machine that is number `index` of `count`: every `count`th picture, which spreads the long jobs.
pub fn share(pictures: Vec<Picture>, index: u32, count: u32) -> Vec<Picture> {
    pictures.into_iter().skip(index as usize).step_by(count.max(1) as usize).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(name: &str, output: &str) -> Picture {
        Picture {
            name: name.into(),
            job: name.into(),
            scene: "a.toml".into(),
            overrides: vec![],
            label: String::new(),
            frame: None,
            outputs: vec![output.into()],
        }
    }

    #[test]
    fn a_file_has_one_writer() {
        let pictures = [picture("a", "x.png"), picture("b", "y.png"), picture("c", "x.png")];
        assert!(check_names_differ(&pictures[..2]).is_ok());
        let message = check_names_differ(&pictures).unwrap_err();
        assert!(message.contains("x.png") && message.contains("`a`") && message.contains("`c`"), "{message}");
    }

    #[test]
    fn shares_make_up_the_whole() {
        let all: Vec<_> = (0..7).map(|i| picture(&i.to_string(), "x")).collect();
        let mut names: Vec<_> =
            (0..3).flat_map(|i| share(all.clone(), i, 3)).map(|picture| picture.name).collect();
        names.sort();
        assert_eq!(names, ["0", "1", "2", "3", "4", "5", "6"]);
    }
}
