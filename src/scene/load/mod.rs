//! From a scene file to a [`Scene`].

use super::Scene;
use std::path::{Path, PathBuf};

/// `path.to.key = value`, set in the description before it is read: what `-D` and the other flags become.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Override {
    /// Keys joined by dots.
    pub path: String,
    /// A TOML value; text that is none is taken as a string.
    pub value: String,
}

/// Why a scene file does not make a scene.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// A file cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// Which.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

/// Reads, checks and converts a scene file (TOML, or JSON by its ending) with overrides.
///
/// # Errors
/// If a file is missing or malformed, or a value is out of its range; the message says which, where and what would
/// mend it.
pub fn load(_path: &Path, _overrides: &[Override]) -> Result<Scene, SceneError> {
    unimplemented!()
}
