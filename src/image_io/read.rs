//! Reads pictures of linear light, such as lat-long photographs.

use crate::core::{Rgb, memory};
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
    /// It is a picture of something else than colours.
    #[error("cannot read {}: colours are in channels R, G and B of one layer, and it has {found}", path.display())]
    Channels {
        /// Which file.
        path: PathBuf,
        /// The channels that there are.
        found: String,
    },
    /// It claims more pixels than can be.
    #[error("cannot read {}: it claims to have {width} x {height} pixels, and {why}", path.display())]
    Size {
        /// Which file.
        path: PathBuf,
        /// Pixels in a row.
        width: usize,
        /// Rows.
        height: usize,
        /// Why that cannot be, and what would mend it.
        why: &'static str,
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
/// If the ending is another, or the file is missing, damaged, too large for memory, or compressed in a way that is not
/// known.
pub fn read_linear(path: &Path) -> Result<LinearImage, ReadImageError> {
    let ending = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    match ending.as_deref() {
        Some("exr") => read_exr(path),
        Some("hdr" | "pic" | "rgbe") => read_hdr(path),
        _ => Err(ReadImageError::Format { path: path.to_owned() }),
    }
}

/// The first layer with channels R, G and B.
fn read_exr(path: &Path) -> Result<LinearImage, ReadImageError> {
    let mut compression = None;
    let fail = |compression: Option<String>, source| ReadImageError::Exr {
        path: path.to_owned(),
        compression,
        source,
    };
    let meta = exr::meta::MetaData::read_from_file(path, false).map_err(|e| fail(None, e))?;
    if let Some(header) = meta.headers.first() {
        compression = Some(format!(", {} compression", header.compression));
    }
    let names = |header: &exr::meta::header::Header| {
        header.channels.list.iter().map(|channel| channel.name.to_string()).collect::<Vec<_>>()
    };
    let all: Vec<_> = meta.headers.iter().map(names).collect();
    if !all.iter().any(|names| ["R", "G", "B"].iter().all(|c| names.iter().any(|n| n == c))) {
        return Err(ReadImageError::Channels { path: path.to_owned(), found: all.concat().join(", ") });
    }
    for size in meta.headers.iter().map(|header| header.layer_size) {
        check_size(path, size.width(), size.height())?;
    }

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
        .map_err(|e| fail(compression, e))
}

/// All of the file.
fn read_hdr(path: &Path) -> Result<LinearImage, ReadImageError> {
    use image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader};
    let fail = |source| ReadImageError::Hdr { path: path.to_owned(), source };
    let mut reader = ImageReader::open(path).map_err(|e| fail(ImageError::IoError(e)))?;
    reader.set_format(ImageFormat::Hdr);
    reader.no_limits();
    let decoder = reader.into_decoder().map_err(fail)?;
    let [width, height] = <[u32; 2]>::from(decoder.dimensions()).map(|n| n as usize);
    check_size(path, width, height)?;
    let image = DynamicImage::from_decoder(decoder).map_err(fail)?.into_rgb32f();
    let pixels = image.pixels().map(|p| Rgb::from(p.0)).collect();
    Ok(LinearImage { width, height, pixels })
}

/// Refuses a picture that its file cannot hold, or memory cannot, before there is room made for it: a header may claim
/// anything.
fn check_size(path: &Path, width: usize, height: usize) -> Result<(), ReadImageError> {
    /// In the densest compression, DWA, a byte that deflate makes of 1032 stands for half the mean of 64 values, of
    /// which a pixel has three: 11008 pixels.
    const MOST_PIXELS_PER_BYTE: u64 = 1 << 14;
    let bytes = std::fs::metadata(path).map_or(u64::MAX, |m| m.len());
    let claims = |why| Err(ReadImageError::Size { path: path.to_owned(), width, height, why });
    let Some(pixels) = width.checked_mul(height) else { return claims("no file holds so many") };
    if pixels as u64 > bytes.saturating_mul(MOST_PIXELS_PER_BYTE) {
        return claims("its length cannot hold them, so that it is damaged: make it anew");
    }
    if !memory::gives((pixels * size_of::<Rgb>()) as u64) {
        return claims("memory cannot hold them: make it smaller");
    }
    Ok(())
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

    /// The EXR file of a small picture, which claims to have 60000 x 60000 pixels.
    fn claim(path: &Path) {
        write_exr(path, Compression::ZIP16);
        let mut bytes = std::fs::read(path).unwrap();
        for name in [&b"dataWindow\0"[..], b"displayWindow\0"] {
            let name_at = bytes.windows(name.len()).position(|w| w == name).unwrap();
            let corner = name_at + name.len() + b"box2i\0".len() + 4 + 8;
            bytes[corner..corner + 8].copy_from_slice(&[59_999i32.to_le_bytes(); 2].concat());
        }
        std::fs::write(path, bytes).unwrap();
    }

    #[test]
    fn a_picture_that_claims_more_pixels_than_its_file_holds_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let (exr, hdr) = (folder.path().join("a.exr"), folder.path().join("a.hdr"));
        claim(&exr);
        std::fs::write(&hdr, "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 60000 +X 60000\n").unwrap();
        for path in [exr, hdr] {
            let message = read_linear(&path).unwrap_err().to_string();
            for word in [&*path.display().to_string(), "60000 x 60000 pixels", "make it anew"] {
                assert!(message.contains(word), "`{word}` is not in: {message}");
            }
        }
    }

    #[test]
    fn a_picture_without_colours_says_which_channels_it_wants_and_which_it_has() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("grey.exr");
        let channels = SpecificChannels::build().with_channel("Y").with_pixel_fn(|_| (0.5f32,));
        let image = exr::prelude::Image::from_channels((4, 4), channels);
        image.write().to_file(&path).unwrap();
        let message = read_linear(&path).unwrap_err().to_string();
        assert!(message.contains("channels R, G and B") && message.ends_with("it has Y"), "{message}");
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
