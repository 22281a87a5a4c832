//! The transfer function of sRGB (IEC 61966-2-1).

use crate::core::Rgb;

/// Linear light of an sRGB value; both in `[0, 1]`.
#[inline]
pub fn decode(srgb: f32) -> f32 {
    if srgb <= 0.04045 { srgb / 12.92 } else { ((srgb + 0.055) / 1.055).powf(2.4) }
}

/// sRGB value of linear light; both in `[0, 1]`.
#[inline]
pub fn encode(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// The nearest 8-bit sRGB colour; light outside `[0, 1]` is clipped, and NaN is black.
#[inline]
pub fn encode_8_bit(linear: Rgb) -> [u8; 3] {
    // A float-to-integer cast saturates, and turns NaN into zero.
    linear.to_array().map(|c| (255.0 * encode(c.clamp(0.0, 1.0)) + 0.5) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_8_bit_value_survives_the_way_to_linear_light_and_back() {
        for byte in 0..=255u8 {
            let linear = decode(f32::from(byte) / 255.0);
            assert_eq!(encode_8_bit(Rgb::grey(linear)), [byte; 3]);
        }
    }

    #[test]
    fn values_that_no_display_shows_are_clipped() {
        assert_eq!(encode_8_bit(Rgb::new(-1.0, 7.0, f32::NAN)), [0, 255, 0]);
        assert_eq!(encode_8_bit(Rgb::new(f32::INFINITY, f32::NEG_INFINITY, 1.0)), [255, 0, 255]);
    }

    #[test]
    fn middle_grey_is_188() {
        assert_eq!(encode_8_bit(Rgb::grey(0.5)), [188; 3]);
    }
}
