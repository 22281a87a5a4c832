//! Why a mesh file cannot be read.

use std::path::{Path, PathBuf};

/// Why a mesh file does not make a mesh: which file, where in it, what is wrong and what would mend it.
#[derive(Debug, thiserror::Error)]
pub enum MeshFileError {
    /// The file cannot be opened or read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A line of a text is wrong.
    #[error("{}, line {line}: {what}: {mend}", path.display())]
    Line {
        /// Which file.
        path: PathBuf,
        /// Which line; the first is 1.
        line: usize,
        /// What is wrong.
        what: String,
        /// What would mend it.
        mend: &'static str,
    },
    /// Something is wrong in the binary part of a file, or with the file as a whole.
    #[error("{}, byte {offset}: {what}: {mend}", path.display())]
    Byte {
        /// Which file.
        path: PathBuf,
        /// Bytes before the trouble.
        offset: usize,
        /// What is wrong.
        what: String,
        /// What would mend it.
        mend: &'static str,
    },
}

/// A [`MeshFileError`] of a parser that does not know which file it reads.
#[derive(Debug, PartialEq)]
pub(super) struct Fault {
    pub(super) at: Place,
    pub(super) what: String,
    pub(super) mend: &'static str,
}

/// Where in a file a [`Fault`] is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Place {
    /// A line of a text; the first is 1.
    Line(usize),
    /// A number of bytes from the start.
    Byte(usize),
}

impl Fault {
    pub(super) fn new(at: Place, what: impl Into<String>, mend: &'static str) -> Self {
        Self { at, what: what.into(), mend }
    }

    /// The same, now that the file is known.
    pub(super) fn in_file(self, path: &Path) -> MeshFileError {
        let Self { at, what, mend } = self;
        let path = path.to_path_buf();
        match at {
            Place::Line(line) => MeshFileError::Line { path, line, what, mend },
            Place::Byte(offset) => MeshFileError::Byte { path, offset, what, mend },
        }
    }
}

/// All bytes of a file.
pub(super) fn read_bytes(path: &Path) -> Result<Vec<u8>, MeshFileError> {
    std::fs::read(path).map_err(|source| MeshFileError::Read { path: path.to_path_buf(), source })
}
