//! Reading pictures.

use super::read::{LinearImage, read_linear};
use super::{Image, ImageError, srgb};
use crate::core::Rgb;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// Reads a picture by its ending: `.exr` (the first layer with `R`, `G` and `B`, without alpha; of a crop the part that
/// is there), `.hdr`, or `.png` (any colour type; from sRGB to linear light).
///
/// # Errors
/// If the ending is unknown, the file cannot be read, or it is no picture of the kind that its ending says.
pub fn read_image(path: &Path) -> Result<Image, ImageError> {
    let ending = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    match ending.as_deref() {
        Some("exr" | "hdr") => from_linear(read_linear(path)?).ok_or("too many pixels on a side".to_owned()),
        Some("png") => File::open(path).map_err(|e| e.to_string()).and_then(|f| read_png(BufReader::new(f))),
        _ => Err("the name of a picture ends in .exr, .hdr or .png".to_owned()),
    }
    .map_err(|reason| ImageError::Read { path: path.to_owned(), reason })
}

fn from_linear(LinearImage { width, height, pixels }: LinearImage) -> Option<Image> {
    Some(Image::new(width.try_into().ok()?, height.try_into().ok()?, pixels))
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
        for name in ["a.png", "a.exr", "a.hdr", "a.jpg"] {
            let path = directory.path().join(name);
            for content in [&b""[..], b"no picture", &[0x76, 0x2f, 0x31, 0x01], b"\x89PNG\r\n\x1a\n"] {
                std::fs::write(&path, content).unwrap();
                let message = read_image(&path).unwrap_err().to_string();
                assert!(message.starts_with("cannot read") && message.contains(name), "{message}");
            }
        }
    }
}
