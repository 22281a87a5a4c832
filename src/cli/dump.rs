//! Rays written to a file for `gloss trace`.

use super::exit::{Failure, OrExit};
use super::files::Files;
use super::output::check_writable;
use crate::image_io::atomic;
use crate::trace::RayFile;
use std::path::{Path, PathBuf};
use tempfile::TempPath;

/// A file of rays in work: it gets its name once it is whole.
pub(super) struct Dump {
    path: PathBuf,
    temporary: TempPath,
    rays: RayFile,
}

impl Dump {
    /// Begins the file, under a temporary name beside its own.
    pub(super) fn create(path: &Path, files: &mut Files) -> Result<Self, Failure> {
        check_writable(path, "--dump-rays", files)?;
        let temporary = atomic::temporary_beside(path).or_failed()?.into_temp_path();
        let rays = RayFile::create(&temporary).or_failed()?;
        Ok(Self { path: path.into(), temporary, rays })
    }

    /// What rays are told to.
    pub(super) fn rays(&self) -> &RayFile {
        &self.rays
    }

    /// Gives the file its name.
    pub(super) fn finish(self) -> Result<(), Failure> {
        self.rays.finish().or_failed()?;
        self.temporary.persist(&self.path).or_failed()
    }
}
