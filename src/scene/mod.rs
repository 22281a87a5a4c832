//! What is rendered: geometry, materials, lights, camera and settings, checked and in the unit world.
//!
//! A [`Scene`] is made once from a description (`desc`, then `load`) and never changes. It never sees an
//! accelerator, so that a scene can be checked without one. Loading works in f64 and moves and scales the world to
//! about a unit box, so that a scene of any size or place gives the same picture.

pub mod camera;
pub mod desc;
pub mod interaction;
pub mod interactions;
pub mod light;
pub mod load;
pub mod material;
pub mod plan;
pub mod preset;
pub mod settings;
pub mod world;

pub use camera::Camera;
pub use desc::{SceneDesc, schema};
pub use interaction::SurfaceInteraction;
pub use interactions::Interactions;
pub use light::{
    EightSamples, EmitterHit, Environment, Light, LightSample, Lights, Needs, Receiver, Receivers, Rivals,
};
pub use load::{
    Format, GeometryCache, Location, Override, SceneError, load, load_settings, load_str, load_with,
    named_files,
};
pub use material::{Material, Specular, Texture};
pub use plan::Plan;
pub use preset::Preset;
pub use settings::{
    Aov, AtMaxDepth, DirectLight, GlossySamples, IndirectGuiding, LightCandidates, LightSamples, Occlusion,
    SelfHit, Settings,
};
pub use world::World;

use crate::core::Rgb;
use crate::geometry::{Aabb, Shape};
use std::path::PathBuf;

/// What one shape looks like; parallel to [`Scene::shapes`].
#[derive(Clone, Debug)]
pub struct Geometry {
    /// Name in the scene file.
    pub name: String,
    /// Index into [`Scene::materials`].
    pub material: u32,
    /// Index of its light if it emits.
    pub light: Option<u32>,
}

/// Everything that a render needs but the accelerator.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Who looks.
    pub camera: Camera,
    /// What can be hit, in the unit world; the index is the `geom_id`.
    pub shapes: Vec<Shape>,
    /// What each shape looks like.
    pub geometries: Vec<Geometry>,
    /// Materials by index.
    pub materials: Vec<Material>,
    /// All that emits.
    pub lights: Lights,
    /// The constant ambient radiance of the textbook's materials.
    pub ambient: Rgb,
    /// The way between the unit world and the scene file's.
    pub world: World,
    /// How to render.
    pub settings: Settings,
    /// What was odd but could be mended: dropped triangles and the like.
    pub warnings: Vec<String>,
    /// Hash of the description and of every file that it names, in hexadecimal.
    pub hash: String,
    /// Every file that was read for it besides the description: meshes, their materials, environments.
    pub files: Vec<PathBuf>,
}

impl Scene {
    /// The material of a geometry.
    #[inline(always)]
    pub fn material(&self, geom_id: u32) -> &Material {
        &self.materials[self.geometries[geom_id as usize].material as usize]
    }

    /// The bounds of each shape that emits.
    pub fn emitters(&self) -> impl Iterator<Item = Aabb> {
        let of_ids = (0..).zip(&self.shapes);
        of_ids.filter(|(id, _)| self.material(*id).emission.is_some()).map(|(_, shape)| shape.bounds())
    }
}
