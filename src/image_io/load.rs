//! Reading pictures.

use super::{Format, Image, ImageError, srgb};
use crate::core::Rgb;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// Reads an EXR (its first layer with `R`, `G` and `B`, without alpha; of a cropped picture the part that is there) or
/// a PNG (any colour type; from sRGB to linear light).
///
/// # Errors
/// If the ending is unknown, the file cannot be read, or it is no picture of the kind that its ending says.
pub fn read_image(path: &Path) -> Result<Image, ImageError> {
    let format = Format::of(path)?;
    let failed = |reason: String| ImageError::Read { path: path.to_owned(), reason };
    let file = BufReader::new(File::open(path).map_err(|e| failed(e.to_string()))?);
    match format {
        Format::Exr => read_exr(file).map_err(failed),
        Format::Png => read_png(file).map_err(failed),
    }
}

fn read_exr(file: BufReader<File>) -> Result<Image, String> {
    use exr::prelude::{ReadChannels, ReadLayers, Vec2, read};
    let read = read()
        .no_deep_data()
        .largest_resolution_level()
        .rgba_channels(
            |size: Vec2<usize>, _: &_| (size.x(), vec![Rgb::BLACK; size.area()]),
            |(width, pixels): &mut (usize, Vec<Rgb>), at: Vec2<usize>, (r, g, b, _): (f32, f32, f32, f32)| {
                pixels[at.y() * *width + at.x()] = Rgb::new(r, g, b);
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_buffered(file)
        .map_err(|e| format!("not an EXR picture with R, G and B: {e}"))?;
    let size = read.layer_data.size;
    let side = |n: usize| u32::try_from(n).map_err(|_| format!("{n} pixels are too many on a side"));
    Ok(Image::new(side(size.x())?, side(size.y())?, read.layer_data.channel_data.pixels.1))
}

fn read_png(file: BufReader<File>) -> Result<Image, String> {
    let decoded = image::ImageReader::with_format(file, image::ImageFormat::Png)
        .decode()
        .map_err(|e| format!("not a PNG picture: {e}"))?
        .into_rgb32f();
    let pixels = decoded.pixels().map(|p| Rgb::from(p.0).map(srgb::decode)).collect();
    Ok(Image::new(decoded.width(), decoded.height(), pixels))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_not_what_its_ending_says_is_refused() {
        let directory = tempfile::tempdir().unwrap();
        for name in ["a.png", "a.exr"] {
            let path = directory.path().join(name);
            for content in [&b""[..], b"no picture", &[0x76, 0x2f, 0x31, 0x01], b"\x89PNG\r\n\x1a\n"] {
                std::fs::write(&path, content).unwrap();
                let message = read_image(&path).unwrap_err().to_string();
                assert!(message.starts_with("cannot read") && message.contains(name), "{message}");
            }
        }
    }
}
