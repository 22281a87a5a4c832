//! Colours: one number for grey, three for red, green and blue, or a checker of two.

use schemars::JsonSchema;
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};
use std::fmt;

/// A colour or a radiance.
#[derive(Clone, Copy, Debug, PartialEq, JsonSchema)]
#[schemars(untagged)]
pub enum RgbDesc {
    /// The same in each channel.
    Grey(f64),
    /// Red, green and blue.
    Rgb([f64; 3]),
}

impl RgbDesc {
    /// One in each channel.
    pub const WHITE: Self = Self::Grey(1.0);

    /// Red, green and blue.
    pub fn to_array(self) -> [f64; 3] {
        match self {
            Self::Grey(v) => [v; 3],
            Self::Rgb(rgb) => rgb,
        }
    }
}

/// A colour that may vary over space.
#[derive(Clone, Debug, PartialEq, JsonSchema)]
#[schemars(untagged)]
pub enum ColourDesc {
    /// The same everywhere.
    Constant(RgbDesc),
    /// Cubes of two colours.
    Checker(CheckerDesc),
}

impl Default for ColourDesc {
    fn default() -> Self {
        Self::Constant(RgbDesc::WHITE)
    }
}

/// Space cut into cubes of two colours.
///
/// The cubes are shifted by a 4096th of their size along each axis, so that a flat surface that lies where two layers
/// of cubes meet has the colours of one layer and not a mixture of both.
#[derive(Clone, Debug, PartialEq, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table { checker = [colour, colour], size = number }")]
pub struct CheckerDesc {
    /// The two colours; the first is that of the cube at the origin.
    pub checker: [RgbDesc; 2],
    /// Edge of a cube.
    #[serde(default = "one")]
    pub size: f64,
    /// The least corner of the cube at the origin.
    #[serde(default)]
    pub origin: [f64; 3],
}

fn one() -> f64 {
    1.0
}

struct RgbVisitor;

impl<'de> Visitor<'de> for RgbVisitor {
    type Value = RgbDesc;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a colour: a number or [red, green, blue]")
    }

    fn visit_f64<E>(self, v: f64) -> Result<RgbDesc, E> {
        Ok(RgbDesc::Grey(v))
    }

    fn visit_i64<E>(self, v: i64) -> Result<RgbDesc, E> {
        Ok(RgbDesc::Grey(v as f64))
    }

    fn visit_u64<E>(self, v: u64) -> Result<RgbDesc, E> {
        Ok(RgbDesc::Grey(v as f64))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<RgbDesc, A::Error> {
        <[f64; 3]>::deserialize(SeqAccessDeserializer::new(seq)).map(RgbDesc::Rgb)
    }
}

impl<'de> Deserialize<'de> for RgbDesc {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(RgbVisitor)
    }
}

struct ColourVisitor;

impl<'de> Visitor<'de> for ColourVisitor {
    type Value = ColourDesc;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a colour: a number, [red, green, blue] or { checker = [colour, colour], size = number }")
    }

    fn visit_f64<E>(self, v: f64) -> Result<ColourDesc, E> {
        Ok(ColourDesc::Constant(RgbDesc::Grey(v)))
    }

    fn visit_i64<E>(self, v: i64) -> Result<ColourDesc, E> {
        Ok(ColourDesc::Constant(RgbDesc::Grey(v as f64)))
    }

    fn visit_u64<E>(self, v: u64) -> Result<ColourDesc, E> {
        Ok(ColourDesc::Constant(RgbDesc::Grey(v as f64)))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<ColourDesc, A::Error> {
        RgbVisitor.visit_seq(seq).map(ColourDesc::Constant)
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<ColourDesc, A::Error> {
        CheckerDesc::deserialize(MapAccessDeserializer::new(map)).map(ColourDesc::Checker)
    }
}

impl<'de> Deserialize<'de> for ColourDesc {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ColourVisitor)
    }
}
