//! EXR: what was measured, and how.

use super::{Image, ImageError, write_atomically};
use crate::core::Rgb;
use exr::meta::attribute::{AttributeValue, IntegerBounds, Text};
use exr::meta::header::{ImageAttributes, LayerAttributes};
use exr::prelude::{AnyChannel, AnyChannels, Encoding, FlatSamples, Layer, Vec2, WritableImage};
use std::fs::File;
use std::path::Path;

/// What goes into an EXR beside its pixels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExrOptions {
    /// Attributes of the file's header: names and texts. The standard's own names are best avoided by a prefix.
    pub attributes: Vec<(String, String)>,
    /// More channels: names such as `Depth.Z` (a layer, a point, a channel) and as many values as the image has pixels.
    pub channels: Vec<(String, Vec<f32>)>,
    /// Where the image lies in a larger picture: its upper left corner there, and that picture's size.
    pub crop: Option<([u32; 2], [u32; 2])>,
}

/// Writes linear 32-bit `R`, `G` and `B`, and what other channels there are, compressed without loss (ZIP).
///
/// A crop becomes the data window in the display window of the whole picture, as the format means it.
///
/// # Errors
/// If the file cannot be written; an older one of that name is then untouched.
pub fn write_exr(path: &Path, image: &Image, options: &ExrOptions) -> Result<(), ImageError> {
    let [width, height] = image.size().map(|n| n as usize);
    let ([x, y], whole) = options.crop.unwrap_or(([0, 0], image.size()));
    let channel = |name: &str, values| AnyChannel::new(text(name), FlatSamples::F32(values));
    let colour = |name, of: fn(&Rgb) -> f32| channel(name, image.pixels.iter().map(of).collect());
    let colours = [colour("R", |p| p.r), colour("G", |p| p.g), colour("B", |p| p.b)];
    let more = options.channels.iter().map(|(name, values)| channel(name, values.clone()));
    let channels = AnyChannels::sort(colours.into_iter().chain(more).collect());
    let other =
        options.attributes.iter().map(|(name, value)| (text(name), AttributeValue::Text(text(value))));
    let own = LayerAttributes {
        layer_position: Vec2(x as i32, y as i32),
        software_name: Some(text(concat!("gloss ", env!("CARGO_PKG_VERSION")))),
        other: other.collect(),
        ..LayerAttributes::default()
    };
    let layer = Layer::new((width, height), own, Encoding::SMALL_LOSSLESS, channels);
    let window = IntegerBounds::from_dimensions(Vec2(whole[0] as usize, whole[1] as usize));
    let picture = exr::prelude::Image::empty(ImageAttributes::new(window)).with_layer(layer);
    write_atomically(path, |file: &mut File| picture.write().to_unbuffered(file).map_err(|e| e.to_string()))
}

/// EXR's text is Latin-1: whatever is not becomes `\u{...}`.
fn text(s: &str) -> Text {
    Text::new_or_none(s).unwrap_or_else(|| Text::from(s.escape_default().to_string().as_str()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::Rgb;
    use crate::image_io::read_image;

    #[test]
    fn an_exr_comes_back_to_the_bit_with_its_attributes_and_its_place() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.exr");
        let image = Image::from_fn(37, 21, |x, y| Rgb::new(x as f32 * 1e3, -(y as f32), 1e-30 * x as f32));
        let options = ExrOptions {
            attributes: vec![
                ("gloss.spp".to_owned(), "64".to_owned()),
                ("gloss.scene".to_owned(), "Zimt\u{e9}/\u{4e2d}.toml".to_owned()),
            ],
            channels: vec![("Depth.Z".to_owned(), (0..37 * 21).map(|i| i as f32).collect())],
            crop: Some(([5, 6], [100, 50])),
        };
        write_exr(&path, &image, &options).unwrap();
        assert_eq!(read_image(&path).unwrap(), image);

        let meta = exr::meta::MetaData::read_from_file(&path, false).unwrap();
        let header = &meta.headers[0];
        assert_eq!(header.own_attributes.layer_position, Vec2(5, 6));
        assert_eq!(header.shared_attributes.display_window.size, Vec2(100, 50));
        let names: Vec<_> = header.channels.list.iter().map(|channel| channel.name.to_string()).collect();
        assert_eq!(names, ["B", "Depth.Z", "G", "R"]);
        let attribute = |name: &str| match header.own_attributes.other.get(&Text::from(name)) {
            Some(AttributeValue::Text(value)) => value.to_string(),
            other => panic!("{name}: {other:?}"),
        };
        assert_eq!(attribute("gloss.spp"), "64");
        assert_eq!(attribute("gloss.scene"), "Zimt\\u{e9}/\\u{4e2d}.toml");
    }

    #[test]
    fn values_that_are_no_numbers_survive() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.exr");
        let odd = Rgb::new(f32::NAN, f32::INFINITY, f32::NEG_INFINITY);
        write_exr(&path, &Image::new(1, 1, vec![odd]), &ExrOptions::default()).unwrap();
        let [r, g, b] = read_image(&path).unwrap().pixels[0].to_array();
        assert!(r.is_nan() && g == f32::INFINITY && b == f32::NEG_INFINITY);
    }
}
