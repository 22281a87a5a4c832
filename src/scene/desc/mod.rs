//! What a scene file says: plain data for serde and for the JSON schema, checked by no more than its types.
//!
//! Lengths are in the scene's own unit, angles in degrees, colours linear Rec. 709. Everything is f64: nothing is
//! rounded before it has moved to the unit world. `load` makes a [`Scene`](super::Scene) of it.
//!
//! An enum with content is tagged by the key `type` in a document. Its `Deserialize` is serde's externally tagged
//! one, which the loader's reader feeds from `type`; the schema says what the document looks like.

pub mod camera;
pub mod colour;
pub mod light;
pub mod material;
pub mod settings;
pub mod shape;

pub use camera::CameraDesc;
pub use colour::{CheckerDesc, ColourDesc, RgbDesc};
pub use light::{EnvironmentDesc, LightDesc, SoftboxDesc};
pub use material::{ExponentDesc, MaterialDesc};
pub use settings::SettingsDesc;
pub use shape::{GeneratorDesc, ShapeDesc, TransformDesc};

use schemars::JsonSchema;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;

/// A scene file. Everything may be left out: an empty scene is black.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(title = "gloss scene")]
pub struct SceneDesc {
    /// How to render.
    #[serde(default)]
    pub settings: SettingsDesc,
    /// Who looks.
    #[serde(default)]
    pub camera: CameraDesc,
    /// Radiance that the textbook's `ka ca` part of a material reflects, from nowhere in particular.
    pub ambient: Option<RgbDesc>,
    /// What a ray sees that hits nothing; black if it is left out.
    pub environment: Option<EnvironmentDesc>,
    /// Materials by name.
    #[serde(default)]
    pub materials: BTreeMap<String, MaterialDesc>,
    /// What can be hit.
    #[serde(default)]
    pub shapes: Vec<ShapeDesc>,
    /// What emits, besides shapes of an `emissive` material.
    #[serde(default)]
    pub lights: Vec<LightDesc>,
}

impl SceneDesc {
    /// The files that it names, as it writes them: meshes and the environment.
    pub fn files(&self) -> impl Iterator<Item = &Path> {
        let meshes = self.shapes.iter().filter_map(|shape| match shape {
            ShapeDesc::Obj(desc) => Some(&*desc.file),
            ShapeDesc::Ply(desc) => Some(&*desc.file),
            _ => None,
        });
        let environment = match &self.environment {
            Some(EnvironmentDesc::Image(desc)) => Some(&*desc.file),
            _ => None,
        };
        meshes.chain(environment)
    }
}

/// The JSON schema of scene files.
pub fn schema() -> serde_json::Value {
    schemars::schema_for!(SceneDesc).to_value()
}
