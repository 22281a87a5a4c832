//! Pictures in files: EXR (linear `f32`, with attributes) and PNG (sRGB, 8 bits).
//!
//! Knows nothing of scenes and renders. Read [`Image`] first, then [`read_image`], [`exr_file`] and [`png_file`]; a
//! file is only ever replaced whole, by [`atomic`].

pub mod atomic;
pub mod exr_file;
pub mod label;
mod load;
pub mod png_file;
pub mod read;
pub mod srgb;

pub use atomic::write_atomically;
pub use exr_file::{ExrOptions, write_exr};
pub use load::read_image;
pub use png_file::{write_png, write_rgb8};

use crate::core::Rgb;
use std::path::{Path, PathBuf};

/// Linear Rec. 709 pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Row by row from the top; `width * height` of them.
    pub pixels: Vec<Rgb>,
}

impl Image {
    /// An image of the given pixels.
    ///
    /// # Panics
    /// If there are not `width * height` pixels.
    pub fn new(width: u32, height: u32, pixels: Vec<Rgb>) -> Self {
        assert_eq!(pixels.len(), width as usize * height as usize, "an image has one colour per pixel");
        Self { width, height, pixels }
    }

    /// An image whose pixel in column `x` and row `y` is `colour(x, y)`.
    pub fn from_fn(width: u32, height: u32, colour: impl Fn(u32, u32) -> Rgb) -> Self {
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        Self::new(width, height, pixels.map(|(x, y)| colour(x, y)).collect())
    }

    /// Columns and rows.
    pub fn size(&self) -> [u32; 2] {
        [self.width, self.height]
    }
}

/// What is written to a picture's file, by the ending of its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// OpenEXR: linear, any range.
    Exr,
    /// PNG: sRGB, 8 bits, `[0, 1]`.
    Png,
}

impl Format {
    /// The format that a path's ending names.
    ///
    /// # Errors
    /// [`ImageError::UnknownEnding`] if it names none.
    pub fn of(path: &Path) -> Result<Self, ImageError> {
        let ending = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        match ending.as_deref() {
            Some("exr") => Ok(Self::Exr),
            Some("png") => Ok(Self::Png),
            _ => Err(ImageError::UnknownEnding { path: path.to_owned() }),
        }
    }
}

/// Why a picture cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The ending names no supported format.
    #[error("{}: unknown image format; the name must end in .exr (linear, float) or .png (sRGB, 8 bits)", path.display())]
    UnknownEnding {
        /// Whose ending.
        path: PathBuf,
    },
    /// A file of linear light cannot be read.
    #[error(transparent)]
    Linear(#[from] read::ReadImageError),
    /// The file is missing, or is not what its ending says.
    #[error("cannot read {}: {reason}", path.display())]
    Read {
        /// Which file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// The file cannot be written; what was there before is still there.
    #[error("cannot write {}: {reason}", path.display())]
    Write {
        /// Which file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ending_names_the_format_in_either_case() {
        assert_eq!(Format::of(Path::new("a/b.EXR")).unwrap(), Format::Exr);
        assert_eq!(Format::of(Path::new("b.c.png")).unwrap(), Format::Png);
        for bad in ["a.jpg", "png", "a.", ""] {
            let message = Format::of(Path::new(bad)).unwrap_err().to_string();
            assert!(message.contains(".exr") && message.contains(".png"), "{message}");
        }
    }
}
