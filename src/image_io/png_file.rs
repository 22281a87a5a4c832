//! PNG: what a display shows.

use super::{Image, ImageError, srgb, write_atomically};
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

/// Writes an 8-bit sRGB picture of an image that is first made brighter by `exposure` stops (factors of two).
///
/// Light outside `[0, 1]` is clipped; there is no other tone mapping and no dithering.
///
/// # Errors
/// If the file cannot be written; an older one of that name is then untouched.
pub fn write_png(path: &Path, image: &Image, exposure: f32) -> Result<(), ImageError> {
    let factor = exposure.exp2();
    let bytes: Vec<u8> = image.pixels.iter().flat_map(|&p| srgb::encode_8_bit(p * factor)).collect();
    write_rgb8(path, image.width, image.height, &bytes)
}

/// Writes bytes that are sRGB already: three per pixel, row by row from the top.
///
/// # Errors
/// If the file cannot be written; an older one of that name is then untouched.
///
/// # Panics
/// If there are not three bytes per pixel.
pub fn write_rgb8(path: &Path, width: u32, height: u32, bytes: &[u8]) -> Result<(), ImageError> {
    assert_eq!(bytes.len(), 3 * width as usize * height as usize, "three bytes per pixel");
    write_atomically(path, |file: &mut File| {
        use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};
        let encoder = PngEncoder::new(BufWriter::new(file));
        encoder.write_image(bytes, width, height, ExtendedColorType::Rgb8).map_err(|e| e.to_string())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::Rgb;
    use crate::image_io::read_image;

    #[test]
    fn a_png_comes_back_to_within_half_a_step() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.png");
        let image = Image::from_fn(7, 3, |x, y| Rgb::new(x as f32 / 7.0, y as f32 / 3.0, 0.25));
        write_png(&path, &image, 0.0).unwrap();
        let back = read_image(&path).unwrap();
        assert_eq!(back.size(), [7, 3]);
        for (a, b) in image.pixels.iter().zip(&back.pixels) {
            for (a, b) in a.to_array().into_iter().zip(b.to_array()) {
                assert!((srgb::encode(a) - srgb::encode(b)).abs() <= 0.501 / 255.0);
            }
        }
    }

    #[test]
    fn exposure_is_in_stops() {
        let directory = tempfile::tempdir().unwrap();
        let (bright, dark) = (directory.path().join("bright.png"), directory.path().join("dark.png"));
        write_png(&bright, &Image::from_fn(1, 1, |_, _| Rgb::grey(0.4)), 0.0).unwrap();
        write_png(&dark, &Image::from_fn(1, 1, |_, _| Rgb::grey(0.1)), 2.0).unwrap();
        assert_eq!(read_image(&bright).unwrap(), read_image(&dark).unwrap());
    }
}
