//! What emits.

use super::RgbDesc;
use schemars::JsonSchema;
use serde::Deserialize;
use std::path::PathBuf;

/// A light.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(tag = "type")]
pub enum LightDesc {
    /// From one point.
    Point(PointDesc),
    /// From one direction.
    Directional(DirectionalDesc),
    /// An emitting parallelogram: short for a `rect` shape with an `emissive` material.
    Rect(RectLightDesc),
    /// An emitting disk: short for a `disk` shape with an `emissive` material.
    Disk(DiskLightDesc),
    /// An emitting sphere: short for a `sphere` shape with an `emissive` material.
    Sphere(SphereLightDesc),
}

/// How a point light dims.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FalloffDesc {
    /// With the square of the distance: as light does.
    #[default]
    InverseSquare,
    /// Not at all: the textbook's.
    None,
}

/// A point light.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub struct PointDesc {
    /// What reports call it.
    pub name: Option<String>,
    /// Where it is.
    pub position: [f64; 3],
    /// Radiant intensity; without falloff, the irradiance that it makes on a surface that faces it, at any distance.
    pub intensity: RgbDesc,
    /// How it dims.
    #[serde(default)]
    pub falloff: FalloffDesc,
    /// Whether things in between cast a shadow.
    #[serde(default = "yes")]
    pub shadows: bool,
}

/// A light at infinity.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub struct DirectionalDesc {
    /// What reports call it.
    pub name: Option<String>,
    /// Where its light goes to; of any length but zero.
    pub direction: [f64; 3],
    /// The irradiance that it makes on a surface that faces it.
    pub irradiance: RgbDesc,
    /// Whether things in between cast a shadow.
    #[serde(default = "yes")]
    pub shadows: bool,
}

/// An emitting parallelogram.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub struct RectLightDesc {
    /// What reports call it.
    pub name: Option<String>,
    /// A corner.
    pub corner: [f64; 3],
    /// The edge from that corner to the next; the front is where `u` turns to `v` counter-clockwise.
    pub u: [f64; 3],
    /// The edge from that corner to the one before.
    pub v: [f64; 3],
    /// Radiance of the front.
    pub radiance: RgbDesc,
    /// Whether the back emits as well.
    #[serde(default)]
    pub both_sides: bool,
}

/// An emitting disk.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub struct DiskLightDesc {
    /// What reports call it.
    pub name: Option<String>,
    /// Its middle.
    pub center: [f64; 3],
    /// Where its front faces; of any length but zero.
    pub normal: [f64; 3],
    /// Radius.
    pub radius: f64,
    /// Radiance of the front.
    pub radiance: RgbDesc,
    /// Whether the back emits as well.
    #[serde(default)]
    pub both_sides: bool,
}

/// An emitting sphere.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub struct SphereLightDesc {
    /// What reports call it.
    pub name: Option<String>,
    /// Centre.
    pub center: [f64; 3],
    /// Radius.
    pub radius: f64,
    /// Radiance.
    pub radiance: RgbDesc,
}

/// Radiance from beyond everything.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(tag = "type")]
pub enum EnvironmentDesc {
    /// The same from everywhere.
    Constant(ConstantDesc),
    /// A sky that changes with height.
    Gradient(GradientDesc),
    /// Softboxes in a dark room.
    Studio(StudioDesc),
    /// A latitude-longitude picture.
    Image(ImageDesc),
}

/// The same radiance from everywhere.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub struct ConstantDesc {
    /// Radiance.
    pub radiance: RgbDesc,
}

/// Linear in the direction's height (the cosine to `up`), from the horizon to the zenith and to the nadir.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub struct GradientDesc {
    /// Radiance at the zenith.
    pub zenith: RgbDesc,
    /// Radiance at the horizon.
    pub horizon: RgbDesc,
    /// Radiance at the nadir; the same as at the horizon if it is left out.
    pub nadir: Option<RgbDesc>,
    /// Where the zenith is; of any length but zero.
    #[serde(default = "up")]
    pub up: [f64; 3],
}

/// Softboxes at infinity before a background: without any key, the studio of a product shot.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub struct StudioDesc {
    /// The lamps; a key, a strip, a bank and a rim light if they are left out.
    pub softboxes: Option<Vec<SoftboxDesc>>,
    /// Radiance between them, at the horizon; black if it is left out. Goes with `softboxes`.
    pub background: Option<RgbDesc>,
    /// The background above; the same as at the horizon if it is left out.
    pub zenith: Option<RgbDesc>,
    /// The background below; the same as at the horizon if it is left out.
    pub nadir: Option<RgbDesc>,
    /// Factor of all radiance.
    #[serde(default = "one")]
    pub scale: f64,
    /// Turn about +y, counter-clockwise from above.
    #[serde(default)]
    pub rotate_deg: f64,
}

/// A bright rectangle at infinity.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub struct SoftboxDesc {
    /// Towards its middle; of any length but zero.
    pub direction: [f64; 3],
    /// Angle that it subtends across, below 180.
    pub width_deg: f64,
    /// Angle that it subtends upwards, below 180.
    pub height_deg: f64,
    /// Radiance of its middle, in addition to the background.
    pub radiance: RgbDesc,
    /// The outer part of each half of its width and height over which it fades, 0 (a hard edge) to 1.
    #[serde(default)]
    pub softness: f64,
}

/// A latitude-longitude picture: OpenEXR, or Radiance HDR.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub struct ImageDesc {
    /// The file, relative to the scene file.
    pub file: PathBuf,
    /// Turn about the vertical.
    #[serde(default)]
    pub rotate_deg: f64,
    /// Factor of its radiance.
    #[serde(default = "one")]
    pub scale: f64,
}

fn yes() -> bool {
    true
}

fn one() -> f64 {
    1.0
}

fn up() -> [f64; 3] {
    [0.0, 1.0, 0.0]
}
