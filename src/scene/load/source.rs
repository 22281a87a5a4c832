//! A parsed scene file with its overrides, and cursors into it that check values and know where they were written.

use super::de;
use super::error::{Location, Place, SceneError};
use super::overrides::{self, Override};
use super::tree::{Node, SyntaxError};
use crate::core::Rgb;
use crate::scene::desc::{CameraDesc, RgbDesc, SceneDesc};
use glam::DVec3;
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// How a scene file is written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Format {
    /// TOML.
    #[default]
    Toml,
    /// JSON.
    Json,
}

impl Format {
    /// JSON for names that end in `.json`, else TOML.
    pub fn of(path: &Path) -> Self {
        match path.extension() {
            Some(ending) if ending.eq_ignore_ascii_case("json") => Self::Json,
            _ => Self::Toml,
        }
    }
}

/// A parsed scene file.
pub(super) struct Source {
    path: PathBuf,
    text: String,
    overrides: Vec<Override>,
    root: Node,
    /// Of the image, before the overrides.
    height: f64,
}

impl Source {
    /// Parses the text and applies the overrides; `path` is for messages.
    pub(super) fn new(
        path: &Path,
        text: String,
        format: Format,
        overrides: &[Override],
    ) -> Result<Self, SceneError> {
        let parsed = match format {
            Format::Toml => Node::from_toml(&text),
            Format::Json => Node::from_json(&text),
        };
        let mut root = parsed.map_err(|SyntaxError { message, offset }| SceneError::Invalid {
            location: Location::in_text(path, &text, offset),
            message,
        })?;
        let height = height_of(&root);
        overrides::apply(&mut root, overrides).map_err(|(index, message)| SceneError::Invalid {
            location: Location::Override(overrides[index].to_string()),
            message,
        })?;
        Ok(Self { path: path.to_owned(), text, overrides: overrides.to_vec(), root, height })
    }

    /// The description.
    pub(super) fn description(&self) -> Result<SceneDesc, SceneError> {
        SceneDesc::deserialize(&self.root).map_err(|de::Error { message, place }| {
            let location = self.location(place.unwrap_or(self.root.place));
            SceneError::Invalid { location, message }
        })
    }

    /// Times how much larger the textbook's pixels must be for the height that an override of the resolution asks
    /// for; 1 without one, or where the size of pixels is asked for as well.
    pub(super) fn resized_by(&self, desc: &CameraDesc) -> f64 {
        let overridden = |path| matches!(self.root.place_of(path), Place::Override(_));
        let resized = overridden("camera.resolution") || overridden("camera.resolution.1");
        if desc.view_plane_distance.is_none() || !resized || overridden("camera.pixel_size") {
            return 1.0;
        }
        self.height / f64::from(desc.resolution[1])
    }

    /// The document.
    pub(super) fn root(&self) -> &Node {
        &self.root
    }

    /// A cursor to a key of the document.
    pub(super) fn at(&self, key: &str) -> At<'_> {
        At { source: self, path: key.to_owned() }
    }

    fn location(&self, place: Place) -> Location {
        match place {
            Place::Offset(offset) => Location::in_text(&self.path, &self.text, offset),
            Place::Override(index) => Location::Override(self.overrides[index].to_string()),
        }
    }
}

/// The height of the image in pixels as the file gives it, or the default.
fn height_of(root: &Node) -> f64 {
    let resolution = root.field("camera").and_then(|camera| camera.field("resolution"));
    let written = resolution.and_then(|node| <[u32; 2]>::deserialize(node).ok());
    f64::from(written.unwrap_or(CameraDesc::default().resolution)[1])
}

/// A place in a scene file by the path of its key.
#[derive(Clone)]
pub(super) struct At<'a> {
    source: &'a Source,
    path: String,
}

/// The brightest radiance: far below where the sums of a film end.
const BRIGHTEST: f64 = 1e12;

impl At<'_> {
    /// The cursor to a key or an index within this one.
    pub(super) fn key(&self, step: impl std::fmt::Display) -> Self {
        Self { source: self.source, path: format!("{}.{step}", self.path) }
    }

    /// An error about this value.
    pub(super) fn fail(&self, message: impl std::fmt::Display) -> SceneError {
        SceneError::Invalid {
            location: self.source.location(self.source.root.place_of(&self.path)),
            message: format!("{}: {message}", self.path),
        }
    }

    /// What a warning about this value begins with.
    pub(super) fn warn(&self, message: impl std::fmt::Display) -> String {
        format!("{}: {}: {message}", self.source.location(self.source.root.place_of(&self.path)), self.path)
    }

    /// A number that is finite.
    pub(super) fn finite(&self, key: &str, value: f64) -> Result<f64, SceneError> {
        match value.is_finite() {
            true => Ok(value),
            false => Err(self.key(key).fail(format!("{value} is not a finite number"))),
        }
    }

    /// A number that is finite and above zero.
    pub(super) fn positive(&self, key: &str, value: f64) -> Result<f64, SceneError> {
        match self.finite(key, value)? {
            v if v > 0.0 => Ok(v),
            v => Err(self.key(key).fail(format!("{v} is not above zero"))),
        }
    }

    /// A number that is finite and not below zero.
    pub(super) fn non_negative(&self, key: &str, value: f64) -> Result<f64, SceneError> {
        match self.finite(key, value)? {
            v if v >= 0.0 => Ok(v),
            v => Err(self.key(key).fail(format!("{v} is negative"))),
        }
    }

    /// A factor of light, the brightest of which is `brightest`: finite, not negative, and not too bright.
    pub(super) fn scale(&self, key: &str, value: f64, brightest: f64) -> Result<f32, SceneError> {
        match self.non_negative(key, value)? {
            v if v * brightest > BRIGHTEST => {
                let message =
                    format!("{v:e} times a radiance of {brightest:e} is too bright: at most {BRIGHTEST:e}");
                Err(self.key(key).fail(message))
            }
            v => Ok(v as f32),
        }
    }

    /// A point or a vector.
    pub(super) fn vector(&self, key: &str, value: [f64; 3]) -> Result<DVec3, SceneError> {
        for (i, x) in value.into_iter().enumerate() {
            self.key(key).finite(&i.to_string(), x)?;
        }
        Ok(value.into())
    }

    /// A vector that is not zero, as a unit vector.
    pub(super) fn direction(&self, key: &str, value: [f64; 3]) -> Result<DVec3, SceneError> {
        // Scaled first, so that neither huge nor tiny components spoil the length.
        let v = self.vector(key, value)?;
        (v / v.abs().max_element())
            .try_normalize()
            .ok_or_else(|| self.key(key).fail("a direction must not be zero: give it a length"))
    }

    /// A colour or radiance: finite and not negative.
    pub(super) fn rgb(&self, key: &str, value: RgbDesc) -> Result<Rgb, SceneError> {
        self.key(key).radiance(value)
    }

    /// This value itself as a colour or radiance.
    pub(super) fn radiance(&self, value: RgbDesc) -> Result<Rgb, SceneError> {
        self.scaled(value, 1.0)
    }

    /// A colour or intensity times a factor, which is what must not be too bright.
    pub(super) fn scaled(&self, value: RgbDesc, factor: f64) -> Result<Rgb, SceneError> {
        for x in value.to_array() {
            if !x.is_finite() {
                return Err(self.fail(format!("{x} is not a finite number")));
            }
            if x < 0.0 {
                return Err(self.fail(format!("{x} is negative: light and reflectance are not")));
            }
            if x * factor > BRIGHTEST {
                return Err(self.fail(format!("{x:e} is too bright: at most {:e}", BRIGHTEST / factor)));
            }
        }
        Ok(Rgb::from(value.to_array().map(|x| (x * factor) as f32)))
    }
}
