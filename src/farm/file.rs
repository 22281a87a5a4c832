//! The file of a checkpoint: an EXR of exact sums that any viewer can show.
//!
//! | channels | type | what |
//! | --- | --- | --- |
//! | `R G B` | float | mean radiance, for viewers: not read again |
//! | `sum.{r,g,b}.{0..3}` | uint | sums of radiance, multiples of 2^-72: 128-bit integers, least significant word first |
//! | `squares.{0..3}` | uint | sum of squared luminance, multiples of 2^-64 |
//! | `count` | uint | number of samples |
//!
//! Of a picture with AOVs there are besides, sums over the samples as [`GuidePixel`](crate::film::GuidePixel) has them:
//!
//! | channels | type | what |
//! | --- | --- | --- |
//! | `albedo.{r,g,b}.{0..3}` | uint | of the albedo, multiples of 2^-72 |
//! | `normal.{x,y,z}.{0..3}`, `depth.{0..3}` | uint | of the normal and of the length of the way, likewise |
//! | `squares.{r,g,b}.{0..3}` | uint | of the squared radiance, multiples of 2^-64 |
//! | `met` | uint | number of samples that have met a surface |
//!
//! The attributes `gloss.*` are the fields of the [`Header`]: texts as they are, everything else as JSON. Two BLAKE3
//! sums stand over the whole: `gloss.pixels_sum` over the pixels' words, `gloss.header_sum` over the other attributes,
//! so that a damaged file is never taken for a picture.

use super::header::{FORMAT, Header, Identity};
use super::words::InWords;
use crate::film::{Film, PixelRect};
use crate::image_io::{ImageError, write_atomically};
use exr::meta::attribute::{AttributeValue, IntegerBounds, Text};
use exr::meta::header::{ImageAttributes, LayerAttributes};
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Layer, ReadChannels, ReadLayers, Vec2, WritableImage,
};
use serde_json::{Map, Value};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufReader, BufWriter, Seek};
use std::path::{Path, PathBuf};

/// A film that knows of which picture it is a part.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint {
    /// Of which, and how far.
    pub header: Header,
    /// The samples.
    pub film: Film,
}

/// Why a file is no checkpoint that can be used.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// It cannot be opened or read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// It is something else.
    #[error("{} is no checkpoint of gloss: {reason}", path.display())]
    Foreign {
        /// Which file.
        path: PathBuf,
        /// What is missing.
        reason: String,
    },
    /// It was one, and has been cut off or changed.
    #[error("{} is damaged ({reason}): remove it, or put a good copy in its place", path.display())]
    Damaged {
        /// Which file.
        path: PathBuf,
        /// What does not fit.
        reason: String,
    },
    /// Its format is another.
    #[error("{} has format {found} of checkpoints, this gloss reads format {FORMAT}", path.display())]
    Format {
        /// Which file.
        path: PathBuf,
        /// What it says.
        found: String,
    },
}

/// Writes a film with its header, whole or not at all.
pub(super) fn write(path: &Path, mut header: Header, film: &Film) -> Result<(), ImageError> {
    header.dropped = film.dropped;
    let mut attributes = attributes_of(&header);
    attributes.insert("gloss.pixels_sum".into(), pixels_sum(film));
    attributes.insert("gloss.header_sum".into(), header_sum(&attributes));

    let texts = attributes
        .iter()
        .map(|(name, value)| (Text::from(name.as_str()), AttributeValue::Text(Text::from(value.as_str()))));
    let PixelRect { x0, y0, .. } = film.rect;
    let own = LayerAttributes {
        layer_position: Vec2(x0 as i32, y0 as i32),
        software_name: Some(Text::from(concat!("gloss ", env!("CARGO_PKG_VERSION")))),
        other: texts.collect(),
        ..LayerAttributes::default()
    };
    let size = (film.rect.width() as usize, film.rect.height() as usize);
    // Mostly the highest words of the sums are zero, which run lengths tell shortly and fast.
    let layer = Layer::new(size, own, Encoding::FAST_LOSSLESS, channels(film));
    let [width, height] = film.resolution.map(|n| n as usize);
    let window = ImageAttributes::new(IntegerBounds::from_dimensions(Vec2(width, height)));
    let image = exr::prelude::Image::empty(window).with_layer(layer);
    write_atomically(path, |file: &mut File| {
        let writer = BufWriter::new(file);
        // The threads of this process have a picture to render.
        image.write().non_parallel().to_buffered(writer).map_err(|e| e.to_string())
    })
}

impl Checkpoint {
    /// A film of what the header says; what the film could not add is in both.
    pub fn new(header: Header, film: Film) -> Self {
        Self { header: Header { dropped: film.dropped, ..header }, film }
    }

    /// Writes the file, whole or not at all.
    ///
    /// # Errors
    /// If it cannot be written; an older one of that name is then untouched.
    pub fn write(&self, path: &Path) -> Result<(), ImageError> {
        write(path, self.header.clone(), &self.film)
    }

    /// Reads a file back to the bit.
    ///
    /// # Errors
    /// If it is missing, something else, or damaged.
    pub fn read(path: &Path) -> Result<Self, CheckpointError> {
        // Opened once: the file may be replaced by a newer one at any moment, and half of each is neither.
        let mut file = open(path)?;
        let Summary { header, pixels_sum: said } = Summary::of(path, &file)?;
        file.rewind().map_err(|source| CheckpointError::Read { path: path.to_owned(), source })?;
        let damaged = |reason: String| CheckpointError::Damaged { path: path.to_owned(), reason };
        let image = exr::prelude::read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .first_valid_layer()
            .all_attributes()
            .from_buffered(BufReader::new(file))
            .map_err(|e| damaged(e.to_string()))?;
        let film = film_of(&header, &image.layer_data.channel_data).map_err(&damaged)?;
        if said != pixels_sum(&film) {
            return Err(damaged("its pixels do not fit their sum".into()));
        }
        Ok(Self { header, film })
    }
}

/// What can be known of a checkpoint without reading its pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// What the file says of itself.
    pub header: Header,
    /// BLAKE3 sum of the pixels' words: equal for equal samples.
    pub pixels_sum: String,
}

impl Summary {
    /// Reads the header of a file.
    ///
    /// # Errors
    /// If the file is missing or something else, or its header is damaged.
    pub fn read(path: &Path) -> Result<Self, CheckpointError> {
        Self::of(path, &open(path)?)
    }

    fn of(path: &Path, file: &File) -> Result<Self, CheckpointError> {
        let foreign = |reason: String| CheckpointError::Foreign { path: path.to_owned(), reason };
        let damaged =
            |reason: &str| CheckpointError::Damaged { path: path.to_owned(), reason: reason.into() };
        let meta = exr::meta::MetaData::read_from_buffered(BufReader::new(file), false)
            .map_err(|e| foreign(e.to_string()))?;
        let layer = meta.headers.first().ok_or_else(|| foreign("it has no layer".into()))?;
        let mut attributes = own_attributes(layer);
        let format = attributes.get("gloss.format").cloned();
        let format = format.ok_or_else(|| foreign("it has no exact sums".into()))?;
        if format != FORMAT.to_string() {
            return Err(CheckpointError::Format { path: path.to_owned(), found: format });
        }

        // Sums first: nothing is made as large as a damaged header says.
        let said = attributes.remove("gloss.header_sum");
        if said != Some(header_sum(&attributes)) {
            return Err(damaged("its header does not fit its sum"));
        }
        let pixels_sum = attributes.remove("gloss.pixels_sum").unwrap_or_default();
        let header = header_of(&attributes).map_err(|e| damaged(&e.to_string()))?;
        let rect = header.rect();
        let at = layer.own_attributes.layer_position;
        let window = (i64::from(at.x()), i64::from(at.y()), layer.layer_size.x(), layer.layer_size.y());
        let (x, y) = (i64::from(rect.x0), i64::from(rect.y0));
        if window != (x, y, rect.width() as usize, rect.height() as usize) {
            return Err(damaged("its size is not what its header says"));
        }
        Ok(Self { header, pixels_sum })
    }
}

fn open(path: &Path) -> Result<File, CheckpointError> {
    File::open(path).map_err(|source| CheckpointError::Read { path: path.to_owned(), source })
}

/// The attributes `gloss.*` that are texts.
fn own_attributes(layer: &exr::meta::header::Header) -> BTreeMap<String, String> {
    let texts = layer.own_attributes.other.iter().filter_map(|(name, value)| match value {
        AttributeValue::Text(value) => Some((name.to_string(), value.to_string())),
        _ => None,
    });
    texts.filter(|(name, _)| name.starts_with(PREFIX)).collect()
}

const PREFIX: &str = "gloss.";

fn channels(film: &Film) -> AnyChannels<FlatSamples> {
    let mut means: [Vec<f32>; 3] = Default::default();
    for pixel in &film.pixels {
        means.iter_mut().zip(pixel.mean().to_array()).for_each(|(mean, value)| mean.push(value));
    }
    let means = ["R", "G", "B"].into_iter().zip(means);
    let mut all: Vec<_> = means.map(|(name, mean)| AnyChannel::new(name, FlatSamples::F32(mean))).collect();
    all.extend(columns(&film.pixels));
    if !film.guides.is_empty() {
        all.extend(columns(&film.guides));
    }
    AnyChannels::sort(all.into())
}

/// A channel for each of the words of these.
fn columns<const N: usize, T: InWords<N>>(all: &[T]) -> impl Iterator<Item = AnyChannel<FlatSamples>> {
    let mut columns: [Vec<u32>; N] = std::array::from_fn(|_| Vec::with_capacity(all.len()));
    for one in all {
        columns.iter_mut().zip(one.to_words()).for_each(|(column, word)| column.push(word));
    }
    T::names().zip(columns).map(|(name, column)| AnyChannel::new(name.as_str(), FlatSamples::U32(column)))
}

fn film_of(header: &Header, channels: &AnyChannels<FlatSamples>) -> Result<Film, String> {
    let Identity { resolution, aovs, .. } = &header.identity;
    let mut film = Film::new(*resolution, header.rect()).with_guides(!aovs.is_empty());
    film.dropped = header.dropped;
    fill(&mut film.pixels, channels)?;
    if !film.guides.is_empty() {
        fill(&mut film.guides, channels)?;
    }
    Ok(film)
}

/// The reverse of [`columns`].
fn fill<const N: usize, T: InWords<N>>(
    all: &mut [T],
    channels: &AnyChannels<FlatSamples>,
) -> Result<(), String> {
    let mut columns = Vec::with_capacity(N);
    for name in T::names() {
        let found = channels.list.iter().find(|channel| channel.name == *name.as_str());
        match found.map(|channel| &channel.sample_data) {
            Some(FlatSamples::U32(column)) => columns.push(column),
            _ => return Err(format!("the channel {name} is missing")),
        }
    }
    if columns.iter().any(|column| column.len() != all.len()) {
        return Err("a channel has another size".into());
    }
    for (i, one) in all.iter_mut().enumerate() {
        *one = T::from_words(&std::array::from_fn(|word| columns[word][i]));
    }
    Ok(())
}

fn pixels_sum(film: &Film) -> String {
    let mut hasher = blake3::Hasher::new();
    hash(&film.pixels, &mut hasher);
    hash(&film.guides, &mut hasher);
    hasher.finalize().to_hex().to_string()
}

fn hash<const N: usize, T: InWords<N>>(all: &[T], hasher: &mut blake3::Hasher) {
    /// Pixels whose bytes are in memory at once.
    const AT_ONCE: usize = 1024;
    for some in all.chunks(AT_ONCE) {
        let bytes: Vec<u8> = some.iter().flat_map(InWords::to_words).flat_map(u32::to_le_bytes).collect();
        hasher.update(&bytes);
    }
}

fn header_sum(attributes: &BTreeMap<String, String>) -> String {
    let mut hasher = blake3::Hasher::new();
    for text in attributes.iter().flat_map(|(name, value)| [name, value]) {
        hasher.update(&(text.len() as u64).to_le_bytes()).update(text.as_bytes());
    }
    hasher.finalize().to_hex().to_string()
}

/// Fields of the header that are texts.
const TEXTS: [&str; 5] = ["version", "scene", "scene_hash", "settings", "backend"];

fn attributes_of(header: &Header) -> BTreeMap<String, String> {
    let Ok(Value::Object(fields)) = serde_json::to_value(header) else {
        unreachable!("a header is an object of plain values");
    };
    let text = |value: Value| match value {
        Value::String(text) => text,
        other => other.to_string(),
    };
    // EXR's texts are Latin-1.
    let plain = |text: String| if text.is_ascii() { text } else { text.escape_default().to_string() };
    fields.into_iter().map(|(name, value)| (format!("{PREFIX}{name}"), plain(text(value)))).collect()
}

fn header_of(attributes: &BTreeMap<String, String>) -> serde_json::Result<Header> {
    let mut fields = Map::new();
    for (name, text) in attributes {
        let name = name.trim_start_matches(PREFIX);
        let value =
            if TEXTS.contains(&name) { Value::String(text.clone()) } else { serde_json::from_str(text)? };
        fields.insert(name.to_owned(), value);
    }
    serde_json::from_value(Value::Object(fields))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::Rgb;
    use crate::farm::Part;
    use crate::farm::header::tests::identity;
    use crate::film::{Guide, RadianceGathered};
    use crate::image_io::read_image;
    use crate::render::Decisions;
    use crate::scene::Aov;

    fn checkpoint(aovs: Vec<Aov>) -> Checkpoint {
        let identity = Identity { aovs, ..identity() };
        let rect = PixelRect { x0: 1, y0: 1, x1: 5, y1: 3 };
        let mut film = Film::new(identity.resolution, rect).with_guides(!identity.aovs.is_empty());
        film.dropped.nan = 3;
        for (i, pixel) in film.pixels.iter_mut().enumerate() {
            for n in 0..i {
                let value = (i as f32 * 0.37 + n as f32).exp();
                let radiance = [value, 1e-9 * value, 1e9 * value].map(RadianceGathered::from);
                pixel.add(radiance);
                if let Some(guide_pixel) = film.guides.get_mut(i) {
                    let (albedo, normal) = (Rgb::new(0.1, 1e-9, 0.9), [-0.6, 0.0, 0.8]);
                    guide_pixel.add(&Guide { albedo, normal, depth: value }, radiance);
                }
            }
        }
        let header = Header {
            format: FORMAT,
            parts: vec![Part { rect, first: 0, end: 16, shard: None, finished: false }],
            dropped: film.dropped,
            tally: Default::default(),
            decisions: Decisions::default(),
            seconds: 0.1,
            identity,
        };
        Checkpoint { header, film }
    }

    #[test]
    fn a_checkpoint_comes_back_to_the_bit_and_is_a_picture() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.exr");
        for aovs in [vec![], vec![Aov::Normal, Aov::Depth]] {
            let mut written = checkpoint(aovs);
            written.header.identity.scene = "Zimt \"1\".toml".into();
            written.write(&path).unwrap();
            assert_eq!(Checkpoint::read(&path).unwrap(), written);
            assert_eq!(read_image(&path).unwrap().pixels, written.film.image());
        }
    }

    #[test]
    fn no_damaged_file_is_taken_for_a_checkpoint() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.exr");
        let written = checkpoint(vec![Aov::Albedo]);
        written.write(&path).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        for length in (0..bytes.len()).step_by(97) {
            std::fs::write(&path, &bytes[..length]).unwrap();
            assert!(Checkpoint::read(&path).is_err(), "cut off at {length} of {}", bytes.len());
        }
        // A flipped bit is seen, or it is in the copy for viewers or in a part of the file that says nothing.
        for at in (0..bytes.len()).step_by(11) {
            let mut flipped = bytes.clone();
            flipped[at] ^= 1 << (at % 8);
            std::fs::write(&path, &flipped).unwrap();
            if let Ok(read) = Checkpoint::read(&path) {
                assert_eq!(read, written, "byte {at}");
            }
        }
    }

    #[test]
    fn other_files_are_told_apart() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.exr");
        let message = |path: &Path| Checkpoint::read(path).unwrap_err().to_string();
        assert!(message(&path).contains("cannot read"));
        std::fs::write(&path, "text").unwrap();
        assert!(message(&path).contains("is no checkpoint"));
        let picture = crate::image_io::Image::new(1, 1, vec![crate::core::Rgb::WHITE]);
        crate::image_io::write_exr(&path, &picture, &Default::default()).unwrap();
        assert!(message(&path).contains("no exact sums"));
        let mut newer = checkpoint(vec![]);
        newer.header.format = 99;
        newer.write(&path).unwrap();
        assert!(message(&path).contains("has format 99"));
    }
}
