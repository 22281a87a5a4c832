//! What surfaces are made of.

use super::{ColourDesc, RgbDesc};
use crate::bxdf::Horizon;
use schemars::JsonSchema;
use serde::Deserialize;
use serde::de::{Deserializer, Visitor};
use std::fmt;

/// A material; `kd cd`, `kr cr` and `ka ca` are a factor and a colour, multiplied.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(tag = "type")]
pub enum MaterialDesc {
    /// Lambert's.
    Diffuse(DiffuseDesc),
    /// The glossy lobe about the mirror direction, over an optional diffuse part.
    CosinePower(CosinePowerDesc),
    /// A perfect mirror, over an optional diffuse part.
    Mirror(MirrorDesc),
    /// A metal: smooth, or rough with GGX microfacets.
    Conductor(ConductorDesc),
    /// A rough clear coat (GGX) over a diffuse base.
    Plastic(PlasticDesc),
    /// Smooth glass.
    Dielectric(DielectricDesc),
    /// Emits light and reflects none.
    Emissive(EmissiveDesc),
}

/// The diffuse and the ambient part of a material.
#[derive(Clone, Debug, Default)]
pub struct MatteDesc {
    /// `kd`, 0 to 1; 0 if it is left out.
    pub kd: Option<f64>,
    /// `cd`.
    pub cd: ColourDesc,
    /// `ka`: how much of the scene's ambient radiance it shows.
    pub ka: f64,
    /// `ca`; the same as `cd` if it is left out.
    pub ca: Option<ColourDesc>,
}

/// Lambert's material.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields, expecting = "a table")]
pub struct DiffuseDesc {
    /// Factor of the diffuse reflectance, 0 to 1.
    pub kd: f64,
    /// Colour of the diffuse reflectance.
    pub cd: ColourDesc,
    /// Factor of the ambient reflectance.
    pub ka: f64,
    /// Colour of the ambient reflectance; the same as `cd` if it is left out.
    pub ca: Option<ColourDesc>,
}

/// The glossy material.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub struct CosinePowerDesc {
    /// Factor of the glossy reflectance, 0 to 1.
    #[serde(default = "one")]
    pub kr: f64,
    /// Colour of the glossy reflectance.
    #[serde(default)]
    pub cr: ColourDesc,
    /// Exponent of the cosine: 0 is as wide as can be, 100 to 1000 is glossy, `inf` is a mirror.
    pub exponent: ExponentDesc,
    /// What becomes of directions below the surface; the settings' if it is left out.
    pub horizon: Option<Horizon>,
    /// Factor of the diffuse reflectance, 0 to 1; 0 if it is left out.
    #[serde(default)]
    pub kd: Option<f64>,
    /// Colour of the diffuse reflectance.
    #[serde(default)]
    pub cd: ColourDesc,
    /// Factor of the ambient reflectance.
    #[serde(default)]
    pub ka: f64,
    /// Colour of the ambient reflectance; the same as `cd` if it is left out.
    pub ca: Option<ColourDesc>,
}

/// The mirror.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields, expecting = "a table")]
pub struct MirrorDesc {
    /// Factor of the mirror's reflectance, 0 to 1.
    pub kr: f64,
    /// Colour of the mirror's reflectance.
    pub cr: ColourDesc,
    /// Factor of the diffuse reflectance, 0 to 1; 0 if it is left out.
    pub kd: Option<f64>,
    /// Colour of the diffuse reflectance.
    pub cd: ColourDesc,
    /// Factor of the ambient reflectance.
    pub ka: f64,
    /// Colour of the ambient reflectance; the same as `cd` if it is left out.
    pub ca: Option<ColourDesc>,
}

/// A metal: `metal`, or `eta` and `k`, or none of them for one that reflects everything at every angle.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields, expecting = "a table")]
pub struct ConductorDesc {
    /// A metal by name.
    pub metal: Option<MetalDesc>,
    /// Real part of the index of refraction.
    pub eta: Option<RgbDesc>,
    /// Imaginary part of the index of refraction.
    pub k: Option<RgbDesc>,
    /// Colour that multiplies the reflection.
    pub reflectance: ColourDesc,
    /// Roughness, 0 (smooth) to 1; 0.1 if neither this nor `exponent` is given.
    pub alpha: Option<f64>,
    /// The cosine power about as wide as the roughness meant: `alpha = 1 / sqrt(2 exponent)`.
    pub exponent: Option<ExponentDesc>,
}

/// Metals by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum MetalDesc {
    /// Al.
    Aluminium,
    /// Cr.
    Chromium,
    /// Cu.
    Copper,
    /// Au.
    Gold,
    /// Ag.
    Silver,
}

impl MetalDesc {
    /// Real and imaginary part of the index of refraction for linear Rec. 709: measured spectra averaged per
    /// channel, as renderers since Mitsuba 0.5 tabulate them.
    pub fn ior(self) -> [[f32; 3]; 2] {
        match self {
            Self::Aluminium => [[1.657_46, 0.880_369, 0.521_229], [9.223_869, 6.269_523, 4.837_001]],
            Self::Chromium => [[4.369_683, 2.916_703, 1.654_701], [5.206_434, 4.231_365, 3.754_947]],
            Self::Copper => [[0.200_438, 0.924_033, 1.102_212], [3.912_949, 2.452_848, 2.142_188]],
            Self::Gold => [[0.143_119, 0.374_957, 1.442_479], [3.983_16, 2.385_721, 1.603_215]],
            Self::Silver => [[0.155_265, 0.116_723, 0.138_381], [4.828_35, 3.122_25, 2.146_96]],
        }
    }
}

/// Plastic.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields, expecting = "a table")]
pub struct PlasticDesc {
    /// Factor of the base's diffuse reflectance, 0 to 1. If it is left out 1, or 0.5 where `cd` is left out too.
    pub kd: Option<f64>,
    /// Colour of the base; white if it is left out.
    pub cd: Option<ColourDesc>,
    /// Index of refraction of the coat, 1 to 100.
    pub eta: f64,
    /// Roughness of the coat, 0.001 to 1; 0.1 if neither this nor `exponent` is given.
    pub alpha: Option<f64>,
    /// The cosine power about as wide as the roughness meant: `alpha = 1 / sqrt(2 exponent)`.
    pub exponent: Option<ExponentDesc>,
}

/// Glass.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields, expecting = "a table")]
pub struct DielectricDesc {
    /// Index of refraction of the inside over that of the outside.
    pub eta: f64,
    /// Colour that multiplies the reflection.
    pub reflectance: ColourDesc,
    /// Colour that multiplies the transmission.
    pub transmittance: ColourDesc,
}

/// The material of lamps.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub struct EmissiveDesc {
    /// Radiance from every point of the front, in every direction.
    pub radiance: RgbDesc,
    /// Whether the back emits as well.
    #[serde(default)]
    pub both_sides: bool,
}

fn one() -> f64 {
    1.0
}

impl Default for DiffuseDesc {
    fn default() -> Self {
        Self { kd: 1.0, cd: ColourDesc::default(), ka: 0.0, ca: None }
    }
}

impl Default for MirrorDesc {
    fn default() -> Self {
        let white = ColourDesc::default;
        Self { kr: 1.0, cr: white(), kd: None, cd: white(), ka: 0.0, ca: None }
    }
}

impl Default for PlasticDesc {
    fn default() -> Self {
        Self { kd: None, cd: None, eta: 1.5, alpha: None, exponent: None }
    }
}

impl PlasticDesc {
    /// `kd` and `cd`.
    pub fn base(&self) -> (f64, ColourDesc) {
        let kd = self.kd.unwrap_or(if self.cd.is_some() { 1.0 } else { 0.5 });
        (kd, self.cd.clone().unwrap_or_default())
    }
}

impl Default for DielectricDesc {
    fn default() -> Self {
        Self { eta: 1.5, reflectance: ColourDesc::default(), transmittance: ColourDesc::default() }
    }
}

/// Gathers `kd cd ka ca`, which several materials have.
macro_rules! matte {
    ($($desc:ident),*) => {$(
        impl $desc {
            /// The diffuse and the ambient part.
            pub fn matte(&self) -> MatteDesc {
                MatteDesc { kd: self.kd.into(), cd: self.cd.clone(), ka: self.ka, ca: self.ca.clone() }
            }
        }
    )*};
}

matte!(DiffuseDesc, CosinePowerDesc, MirrorDesc);

impl MatteDesc {
    /// Whether there is a `cd` that nothing shows, since `kd` was forgotten.
    pub fn forgets_kd(&self) -> bool {
        self.kd.is_none() && self.ka == 0.0 && self.cd != ColourDesc::default()
    }
}

/// An exponent: a number, `inf`, or `"inf"` (JSON has no infinity).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExponentDesc(pub f64);

impl<'de> Deserialize<'de> for ExponentDesc {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Exponent;
        impl Visitor<'_> for Exponent {
            type Value = ExponentDesc;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an exponent: a number of at least 0, or \"inf\"")
            }
            fn visit_f64<E>(self, v: f64) -> Result<ExponentDesc, E> {
                Ok(ExponentDesc(v))
            }
            fn visit_i64<E>(self, v: i64) -> Result<ExponentDesc, E> {
                Ok(ExponentDesc(v as f64))
            }
            fn visit_u64<E>(self, v: u64) -> Result<ExponentDesc, E> {
                Ok(ExponentDesc(v as f64))
            }
            fn visit_str<E: serde::de::Error>(self, v: &str) -> Result<ExponentDesc, E> {
                match v {
                    "inf" => Ok(ExponentDesc(f64::INFINITY)),
                    _ => Err(E::invalid_value(serde::de::Unexpected::Str(v), &self)),
                }
            }
        }
        deserializer.deserialize_any(Exponent)
    }
}

impl JsonSchema for ExponentDesc {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Exponent".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "anyOf": [{ "type": "number", "minimum": 0 }, { "const": "inf" }] })
    }
}
