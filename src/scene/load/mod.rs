//! From a scene file to a [`Scene`].
//!
//! The way: text, a tree that knows where each value was written (`tree`), overrides (`overrides`), description types
//! (`de`, [`desc`](super::desc)), the mesh files side by side (`files`), then shapes in the scene's own coordinates (`shape`), the unit world around them,
//! and in it everything else. What is wrong is said with its place in the file (`error`, `source`).

mod cache;
mod camera;
mod de;
mod error;
mod files;
mod hash;
mod light;
mod material;
mod overrides;
mod part;
mod settings;
mod shape;
mod source;
mod surface;
mod transform;
mod tree;

pub use cache::GeometryCache;
pub use error::{Location, SceneError};
pub use overrides::Override;
pub use source::Format;

use super::{Geometry, Scene, Settings};
use crate::core::Rgb;
use crate::geometry::Shape;
use material::MaterialTable;
use source::Source;
use std::path::{Path, PathBuf};

/// Reads, checks and converts a scene file (TOML, or JSON by its ending) with overrides.
///
/// # Errors
/// If a file is missing or malformed, or a value is out of its range; the message says which, where and what would
/// mend it.
pub fn load(path: &Path, overrides: &[Override]) -> Result<Scene, SceneError> {
    load_with(path, overrides, &mut GeometryCache::new(0))
}

/// [`load`] for one of several scenes: geometry that the cache has is not read again, and shapes that are the same as
/// those of a scene before are the same pointers.
///
/// # Errors
/// As [`load`].
pub fn load_with(
    path: &Path,
    overrides: &[Override],
    cache: &mut GeometryCache,
) -> Result<Scene, SceneError> {
    build(&open(path, overrides)?, path.parent().unwrap_or(Path::new("")), cache)
}

/// The settings alone: no file that the scene names is read.
///
/// # Errors
/// As [`load`], but for what is wrong in the rest of the scene.
pub fn load_settings(path: &Path, overrides: &[Override]) -> Result<Settings, SceneError> {
    let source = open(path, overrides)?;
    settings::checked(&source.description()?.settings, &source)
}

/// The files that a scene names; none is read, and what they name in turn, such as an OBJ file's materials, is left out.
///
/// # Errors
/// If the scene file is missing or malformed.
pub fn named_files(path: &Path, overrides: &[Override]) -> Result<Vec<PathBuf>, SceneError> {
    let base_dir = path.parent().unwrap_or(Path::new(""));
    let desc = open(path, overrides)?.description()?;
    Ok(desc.files().map(|file| base_dir.join(file)).collect())
}

fn open(path: &Path, overrides: &[Override]) -> Result<Source, SceneError> {
    let text =
        std::fs::read_to_string(path).map_err(|source| SceneError::Read { path: path.to_owned(), source })?;
    Source::new(path, text, Format::of(path), overrides)
}

/// The same of a text; files that it names are sought in `base_dir`, and messages call it `<scene>`.
///
/// # Errors
/// As [`load`].
pub fn load_str(
    text: &str,
    format: Format,
    base_dir: &Path,
    overrides: &[Override],
) -> Result<Scene, SceneError> {
    let source = Source::new(Path::new("<scene>"), text.to_owned(), format, overrides)?;
    build(&source, base_dir, &mut GeometryCache::new(0))
}

/// What is found on the way besides the scene itself.
struct Notes<'a> {
    /// What scenes before have left.
    cache: &'a mut GeometryCache,
    /// Where relative paths begin.
    base_dir: PathBuf,
    /// Every file that the scene names, in the order in which they were read.
    files: Vec<PathBuf>,
    /// What was odd.
    warnings: Vec<String>,
}

impl Notes<'_> {
    /// The full path of a file that the scene names.
    fn path_of(&self, file: &Path) -> PathBuf {
        self.base_dir.join(file)
    }
}

fn build(source: &Source, base_dir: &Path, cache: &mut GeometryCache) -> Result<Scene, SceneError> {
    let desc = source.description()?;
    let settings = settings::checked(&desc.settings, source)?;
    let mut notes = Notes { cache, base_dir: base_dir.to_owned(), files: vec![], warnings: vec![] };

    // Shapes as they are, in f64, and what they are made of by index.
    let mut materials = MaterialTable::new(&desc);
    let mut parts = shape::parts(&desc, source, &mut materials, &mut notes)?;
    parts.extend(light::lamp_parts(&desc, source, &mut materials)?);

    // Everything moves to the unit world.
    let world = part::place_planes(&mut parts, desc.camera.eye.into());
    let camera = camera::build(&desc.camera, source, &world)?;
    let materials = materials.build(source, &world, settings.horizon, &mut notes)?;
    let (mut shapes, mut geometries): (Vec<Shape>, Vec<Geometry>) = (vec![], vec![]);
    for part in parts {
        let (name, material) = (part.name.clone(), part.material);
        let emits = materials[material as usize].emission.is_some();
        for shape in part.into_shapes(source, &world, emits, &mut notes)? {
            shapes.push(shape);
            geometries.push(Geometry { name: name.clone(), material, light: None });
        }
    }

    // Lights, now that emitting shapes are in their places.
    let lights = light::build(&desc, source, &world, (&shapes, &mut geometries), &materials, &mut notes)?;
    let ambient = match desc.ambient {
        Some(ambient) => source.at("ambient").radiance(ambient)?,
        None => Rgb::BLACK,
    };
    let hash = hash::of(source.root(), &settings, &notes.files, notes.cache)?;
    let Notes { warnings, files, .. } = notes;
    Ok(Scene {
        camera,
        shapes,
        geometries,
        materials,
        lights,
        ambient,
        world,
        settings,
        warnings,
        hash,
        files,
    })
}
