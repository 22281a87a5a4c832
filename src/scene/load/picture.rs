//! Pictures that scenes name: OpenEXR and Radiance HDR.

use crate::core::Rgb;
use std::path::Path;

/// Linear pixels, row by row from the top.
pub(super) struct Picture {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) pixels: Vec<Rgb>,
}

/// Reads a picture by its ending; on failure, what is wrong and what would mend it.
pub(super) fn read(path: &Path) -> Result<Picture, String> {
    let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    match ending.as_deref() {
        Some("exr") => read_exr(path),
        Some("hdr" | "pic" | "rgbe") => read_hdr(path),
        _ => Err("a picture of linear radiance is .exr or .hdr: convert this file".into()),
    }
}

fn read_exr(path: &Path) -> Result<Picture, String> {
    use exr::prelude::{Vec2, read_first_rgba_layer_from_file};
    let image = read_first_rgba_layer_from_file(
        path,
        |size: Vec2<usize>, _| Picture {
            width: size.width(),
            height: size.height(),
            pixels: vec![Rgb::BLACK; size.area()],
        },
        |picture, at, (r, g, b, _): (f32, f32, f32, f32)| {
            picture.pixels[at.y() * picture.width + at.x()] = Rgb::new(r, g, b);
        },
    );
    image.map(|image| image.layer_data.channel_data.pixels).map_err(|e| e.to_string())
}

fn read_hdr(path: &Path) -> Result<Picture, String> {
    let mut reader = image::ImageReader::open(path).map_err(|e| e.to_string())?;
    reader.set_format(image::ImageFormat::Hdr);
    reader.no_limits();
    let image = reader.decode().map_err(|e| e.to_string())?.into_rgb32f();
    let (width, height) = (image.width() as usize, image.height() as usize);
    let pixels = image.pixels().map(|p| Rgb::from(p.0)).collect();
    Ok(Picture { width, height, pixels })
}
