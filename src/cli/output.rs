//! The pictures that a render leaves behind.

use super::exit::{Failure, OrExit};
use crate::film::{Film, PixelRect};
use crate::image_io::{ExrOptions, Format, Image, ImageError, atomic, write_exr, write_png};
use crate::render::aov_channels;
use crate::scene::Aov;
use std::path::{Path, PathBuf};

/// A file to write.
pub(super) struct Output {
    path: PathBuf,
    format: Format,
}

impl Output {
    /// Checks that every file can be written, before any work is done for it.
    pub(super) fn check(paths: &[PathBuf]) -> Result<Vec<Self>, Failure> {
        let mut outputs: Vec<Self> = Vec::with_capacity(paths.len());
        for path in paths {
            let format = Format::of(path).or_bad()?;
            atomic::check_writable(path).or_failed()?;
            if outputs.iter().any(|o| &o.path == path) {
                return Err(Failure::bad(format!("{}: given twice as an output", path.display())));
            }
            outputs.push(Self { path: path.clone(), format });
        }
        Ok(outputs)
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
