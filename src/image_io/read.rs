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

#[cfg(test)]
mod tests {
    use super::*;
    use exr::prelude::*;

    fn pixels() -> LinearImage {
        let pixels =
            (0..32 * 16).map(|i| Rgb::new(i as f32, 1e-3 * i as f32, if i == 77 { 6e4 } else { 0.25 }));
        LinearImage { width: 32, height: 16, pixels: pixels.collect() }
    }

    /// The picture as an EXR file of half floats, compressed.
    fn write_exr(path: &Path, compression: Compression) {
        let source = pixels();
        let channels = SpecificChannels::rgb(|at: Vec2<usize>| {
            let [r, g, b] = source.pixels[at.y() * 32 + at.x()].to_array().map(f16::from_f32);
            (r, g, b)
        });
        let encoding = Encoding { compression, ..Encoding::FAST_LOSSLESS };
        let layer = Layer::new((32, 16), LayerAttributes::named("light"), encoding, channels);
        Image::from_layer(layer).write().to_file(path).unwrap();
    }

    #[test]
    fn exr_comes_back_in_every_compression_that_scans_and_renderers_use() {
        let folder = tempfile::tempdir().unwrap();
        let source = pixels();
        for compression in [
            Compression::Uncompressed,
            Compression::RLE,
            Compression::ZIP16,
            Compression::PIZ,
            Compression::DWAA(None),
            Compression::DWAB(Some(45.0)),
        ] {
            let path = folder.path().join(format!("{compression}.EXR"));
            write_exr(&path, compression);
            let read = read_linear(&path).unwrap();
            assert_eq!((read.width, read.height), (32, 16));
            // DWA is lossy.
            let lossy = matches!(compression, Compression::DWAA(_) | Compression::DWAB(_));
            for (a, b) in read.pixels.iter().zip(&source.pixels) {
                let error = (a.r - b.r).abs().max((a.g - b.g).abs());
                assert!(
                    error < if lossy { 0.03 * b.r + 0.5 } else { 1e-3 * b.r + 1e-6 },
                    "{compression} {a:?} {b:?}"
                );
            }
        }
    }

    #[test]
    fn radiance_files_come_back_within_their_eight_bits() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("light.hdr");
        let source = pixels();
        let rgb: Vec<_> = source.pixels.iter().map(|p| image::Rgb(p.to_array())).collect();
        let encoder = image::codecs::hdr::HdrEncoder::new(std::fs::File::create(&path).unwrap());
        encoder.encode(&rgb, 32, 16).unwrap();
        let read = read_linear(&path).unwrap();
        assert_eq!((read.width, read.height, read.pixels.len()), (32, 16, 512));
        for (a, b) in read.pixels.iter().zip(&source.pixels) {
            let step = b.max_channel() / 128.0;
            let near = a.to_array().into_iter().zip(b.to_array()).all(|(a, b)| (a - b).abs() <= step);
            assert!(near, "{a:?} {b:?}");
        }
    }

    #[test]
    fn files_that_cannot_be_read_say_which_and_why() {
        let folder = tempfile::tempdir().unwrap();
        let fails = |name: &str, content: Option<&[u8]>| {
            let path = folder.path().join(name);
            if let Some(content) = content {
                std::fs::write(&path, content).unwrap();
            }
            let message = read_linear(&path).unwrap_err().to_string();
            assert!(message.contains(name), "{message}");
            message
        };
        assert!(fails("sky.png", None).contains(".exr (OpenEXR) and .hdr"));
        assert!(fails("gone.exr", None).contains("OpenEXR"));
        assert!(fails("gone.hdr", None).contains("Radiance"));
        assert!(fails("text.exr", Some(b"no picture")).contains("OpenEXR"));
        assert!(fails("text.hdr", Some(b"no picture")).contains("Radiance"));
        let whole = folder.path().join("whole.exr");
        write_exr(&whole, Compression::PIZ);
        let bytes = std::fs::read(whole).unwrap();
        assert!(fails("half.exr", Some(&bytes[..bytes.len() / 2])).contains("piz compression"));
    }
}
