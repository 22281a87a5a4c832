//! Reads lat-long photographs into linear light.

use crate::core::Rgb;
use std::path::{Path, PathBuf};

/// A picture in linear light, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearImage {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width * height` pixels.
    pub pixels: Vec<Rgb>,
}

/// Why a file gives no picture.
#[derive(Debug, thiserror::Error)]
pub enum ReadImageError {
    /// The ending names no format that is read.
    #[error("{}: pictures of light are read from .exr (OpenEXR) and .hdr (Radiance) files", path.display())]
    Format {
        /// Which file.
        path: PathBuf,
    },
    /// OpenEXR cannot be decoded.
    #[error("cannot read {} (OpenEXR{}): {source}", path.display(), compression.as_deref().unwrap_or(""))]
    Exr {
        /// Which file.
        path: PathBuf,
        /// How the file's first layer is compressed, if so much can be read.
        compression: Option<String>,
        /// Why.
        source: exr::error::Error,
    },
    /// Radiance HDR cannot be decoded.
    #[error("cannot read {} (Radiance HDR): {source}", path.display())]
    Hdr {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: image::ImageError,
    },
}

/// Reads an OpenEXR or Radiance HDR file, by its ending. Numbers are taken as they are: linear Rec. 709.
///
/// # Errors
/// If the ending is another, or the file is missing, damaged, or compressed in a way that is not known.
pub fn read_linear(path: &Path) -> Result<LinearImage, ReadImageError> {
    let ending = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    match ending.as_deref() {
        Some("exr") => read_exr(path),
        Some("hdr") => read_hdr(path),
        _ => Err(ReadImageError::Format { path: path.to_owned() }),
    }
}

/// The first layer with channels R, G and B.
fn read_exr(path: &Path) -> Result<LinearImage, ReadImageError> {
    let make = |size: exr::math::Vec2<usize>, _: &_| LinearImage {
        width: size.width(),
        height: size.height(),
        pixels: vec![Rgb::BLACK; size.area()],
    };
    let put = |image: &mut LinearImage, at: exr::math::Vec2<usize>, (r, g, b, _): (f32, f32, f32, f32)| {
        image.pixels[at.y() * image.width + at.x()] = Rgb::new(r, g, b);
    };
    exr::image::read::read_first_rgba_layer_from_file(path, make, put)
        .map(|image| image.layer_data.channel_data.pixels)
        .map_err(|source| ReadImageError::Exr {
            path: path.to_owned(),
            compression: compression(path),
            source,
        })
}

/// `, COMPRESSION compression` of the first layer.
fn compression(path: &Path) -> Option<String> {
    let meta = exr::meta::MetaData::read_from_file(path, false).ok()?;
    Some(format!(", {} compression", meta.headers.first()?.compression))
}

/// All of the file.
fn read_hdr(path: &Path) -> Result<LinearImage, ReadImageError> {
    let image = image::ImageReader::open(path)
        .map_err(image::ImageError::IoError)
        .and_then(|mut reader| {
            reader.set_format(image::ImageFormat::Hdr);
            reader.decode()
        })
        .map_err(|source| ReadImageError::Hdr { path: path.to_owned(), source })?
        .into_rgb32f();
    let pixels = image.pixels().map(|p| Rgb::from(p.0)).collect();
    Ok(LinearImage { width: image.width() as usize, height: image.height() as usize, pixels })
}
