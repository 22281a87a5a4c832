//! Pictures as a page holds them: PNG in base64.

use crate::core::Rgb;
use crate::image_io::srgb;
use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};

/// Bytes of sRGB and opacity, row by row from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Raster {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    rgba: Vec<u8>,
}

impl Raster {
    /// A picture of four bytes per pixel.
    ///
    /// # Panics
    /// If there are not so many.
    pub fn new(width: u32, height: u32, rgba: Vec<u8>) -> Self {
        assert_eq!(rgba.len(), 4 * width as usize * height as usize, "four bytes per pixel");
        Self { width, height, rgba }
    }

    /// Linear light, made brighter by `exposure` stops and clipped.
    pub fn of_light(width: u32, height: u32, light: &[Rgb], exposure: f32) -> Self {
        let factor = exposure.exp2();
        let opaque = |p: &Rgb| {
            let [r, g, b] = srgb::encode_8_bit(*p * factor);
            [r, g, b, 255]
        };
        Self::new(width, height, light.iter().flat_map(opaque).collect())
    }

    /// Numbers as blue (negative), nothing (zero) and red (positive), in full at `reach`: where the picture shows
    /// nothing, the page shows through.
    pub fn of_signed(width: u32, height: u32, values: &[f32], reach: f32) -> Self {
        let colour = |value: &f32| {
            let opacity = (value / reach).abs().min(1.0).sqrt();
            let [r, g, b] = if *value < 0.0 { NEGATIVE } else { POSITIVE };
            [r, g, b, (255.0 * opacity + 0.5) as u8]
        };
        Self::new(width, height, values.iter().flat_map(colour).collect())
    }

    /// The picture in an address.
    pub fn data_uri(&self) -> String {
        let mut png = Vec::new();
        let encoder = PngEncoder::new(&mut png);
        let written = encoder.write_image(&self.rgba, self.width, self.height, ExtendedColorType::Rgba8);
        written.expect("memory takes the bytes of a picture whose size is right");
        format!("data:image/png;base64,{}", base64(&png))
    }
}

const NEGATIVE: [u8; 3] = [0x2a, 0x78, 0xd6];
const POSITIVE: [u8; 3] = [0xe3, 0x49, 0x48];

/// RFC 4648, section 4.
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let word = (0..3).fold(0u32, |word, i| word << 8 | u32::from(chunk.get(i).copied().unwrap_or(0)));
        for digit in 0..4 {
            let six = (word >> (18 - 6 * digit)) as usize & 63;
            text.push(if digit <= chunk.len() { char::from(DIGITS[six]) } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_that_of_the_rfc() {
        let vectors = [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")];
        for (bytes, text) in vectors {
            assert_eq!(base64(bytes.as_bytes()), text);
        }
        assert_eq!(base64(&[0xfb, 0xff, 0xbf]), "+/+/");
    }

    #[test]
    fn signs_have_colours_and_zero_has_none() {
        let raster = Raster::of_signed(3, 1, &[-2.0, 0.0, 1.0], 1.0);
        assert_eq!(raster.rgba[..4], [0x2a, 0x78, 0xd6, 255]);
        assert_eq!(raster.rgba[7], 0);
        assert_eq!(raster.rgba[8..], [0xe3, 0x49, 0x48, 255]);
    }
}
