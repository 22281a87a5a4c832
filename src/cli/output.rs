//! The pictures that a render leaves behind.

use super::exit::{Failure, OrExit};
use super::files::Files;
use crate::film::{Film, PixelRect};
use crate::image_io::{ExrOptions, Format, Image, ImageError, atomic, write_exr, write_png};
use crate::render::aov_channels;
use crate::scene::Aov;
use std::path::{Path, PathBuf};

/// Checks that the file which `flag` names can be written, and is no other of the command's.
pub(super) fn check_writable(path: &Path, flag: &'static str, files: &mut Files) -> Result<(), Failure> {
    atomic::check_writable(path).or_failed()?;
    files.writes(flag, path)
}

/// The same of a picture that is a PNG in any case, such as `the map`.
pub(super) fn check_png(
    path: &Path,
    what: &str,
    flag: &'static str,
    files: &mut Files,
) -> Result<(), Failure> {
    if Format::of(path).or_bad()? != Format::Png {
        return Err(Failure::bad(format!("{}: {what} is a .png", path.display())));
    }
    check_writable(path, flag, files)
}

/// A file to write.
pub(super) struct Output {
    path: PathBuf,
    format: Format,
}

impl Output {
    /// Checks that every file can be written and is none of the others, before any work is done for it.
    pub(super) fn check(paths: &[PathBuf], files: &mut Files) -> Result<Vec<Self>, Failure> {
        let check = |path: &PathBuf| {
            let format = Format::of(path).or_bad()?;
            check_writable(path, "--output", files)?;
            Ok(Self { path: path.clone(), format })
        };
        paths.iter().map(check).collect()
    }

    /// What kind of file it is.
    pub(super) fn format(&self) -> Format {
        self.format
    }

    /// Where it goes.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Writes the film; `exposure`, in stops, is for PNG; the attributes and the pictures
    /// beside the picture are for EXR.
    pub(super) fn write(
        &self,
        film: &Film,
        exposure: f32,
        attributes: &[(String, String)],
        aovs: &[Aov],
    ) -> Result<(), ImageError> {
        let PixelRect { x0, y0, .. } = film.rect;
        let image = Image::new(film.rect.width(), film.rect.height(), film.image());
        match self.format {
            Format::Png => write_png(&self.path, &image, exposure),
            Format::Exr => {
                let crop = Some(([x0, y0], film.resolution));
                let channels = aov_channels(aovs, film);
                write_exr(&self.path, &image, &ExrOptions { attributes: attributes.to_vec(), channels, crop })
            }
        }
    }
}
