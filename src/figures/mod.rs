//! The textbook's figures of glossy reflection, and those that show what this renderer does otherwise.
//!
//! A [`Family`] is a scene file and the pictures that vary it: its shapes are the same in all of them, so that one
//! accelerator serves them all. [`scatter`] shows what the samplers and the lobe draw. Read [`FAMILIES`] for the set,
//! [`Family::load`] and [`draw`] for the way to a picture. Knows nothing of files.

mod draw;
pub mod scatter;
mod set;

pub use draw::{Drawn, apart, draw, labelled, sheet};
pub use set::{FAMILIES, Family, Figure};

use crate::scene::load::{Format, load_str};
use crate::scene::{Camera, Override, Plan, Scene, SceneError};
use std::path::Path;

/// How the figures differ from the book's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Size {
    /// Factor of the pictures' width and height.
    pub scale: f32,
    /// Camera samples per pixel in place of the scene's; a figure whose point they are keeps its own.
    pub spp: Option<u32>,
}

impl Default for Size {
    /// As printed.
    fn default() -> Self {
        Self { scale: 1.0, spp: None }
    }
}

impl Family {
    /// The scenes of all its figures, in their order; all have the same shapes.
    ///
    /// # Errors
    /// If a scene does not load.
    pub fn load(&self, size: Size) -> Result<Vec<Scene>, SceneError> {
        self.figures.iter().map(|figure| self.load_one(figure, size)).collect()
    }

    fn load_one(&self, figure: &Figure, size: Size) -> Result<Scene, SceneError> {
        let spp = size.spp.map(|n| ("settings.spp", n.to_string()));
        let own = figure.overrides.iter().map(|&(path, value)| (path, value.to_owned()));
        let overrides: Vec<Override> =
            spp.into_iter().chain(own).map(|(path, value)| Override { path: path.into(), value }).collect();
        let mut scene = load_str(self.scene, Format::Toml, Path::new(""), &overrides)?;
        resize(&mut scene.camera, size.scale);
        Ok(scene)
    }
}

/// The same view in another number of pixels.
fn resize(camera: &mut Camera, scale: f32) {
    let [width, height] = camera.resolution;
    camera.resolution = [width, height].map(|n| ((n as f32 * scale).round() as u32).max(1));
    camera.right *= width as f32 / camera.resolution[0] as f32;
    camera.down *= height as f32 / camera.resolution[1] as f32;
}

/// Of scenes with the same shapes the one that asks most of an accelerator: built for it, it serves them all.
///
/// # Panics
/// If there is none.
pub fn most_demanding(scenes: &[Scene]) -> &Scene {
    scenes.iter().find(|scene| Plan::of(scene).needs_skip).unwrap_or(&scenes[0])
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DVec3, Vec3};

    #[test]
    fn another_number_of_pixels_shows_the_same_view() {
        let mut camera = Camera::look_at(Vec3::ZERO, DVec3::X, DVec3::Y, 0.01, [600, 200]);
        let corners = |c: &Camera| {
            let [w, h] = c.resolution.map(|n| n as f32);
            [c.direction(0.0, 0.0), c.direction(w, h)]
        };
        let before = corners(&camera);
        resize(&mut camera, 0.333);
        assert_eq!(camera.resolution, [200, 67]);
        for (before, after) in before.into_iter().zip(corners(&camera)) {
            assert!((before - after).length() < 1e-6);
        }
    }
}
