//! A whole picture: tiles on threads, progress, and stopping.

use crate::accel::Accelerator;
use crate::film::{Film, PixelRect};
use crate::scene::Scene;
use std::sync::atomic::AtomicBool;

/// What of the picture to make, and with what.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RenderOptions {
    /// Threads; 0 for one per core.
    pub threads: usize,
    /// Only this part of the image.
    pub crop: Option<PixelRect>,
    /// Edge of a tile in pixels, a multiple of 8; 0 for the default. Changes no bit of the picture.
    pub tile_size: u32,
}

/// Rays asked, by class.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct RayCounts {
    /// From the camera.
    pub primary: u64,
    /// From mirrors and glossy lobes.
    pub glossy: u64,
    /// From diffuse lobes.
    pub diffuse: u64,
    /// Towards lights.
    pub shadow: u64,
}

impl RayCounts {
    /// Of all classes.
    pub fn total(&self) -> u64 {
        self.primary + self.glossy + self.diffuse + self.shadow
    }
}

/// Hears how a render is getting on; called from any thread.
pub trait Progress: Sync {
    /// `samples` more camera samples of `total` are done.
    fn advance(&self, samples: u64, total: u64);
}

/// Tells nobody.
pub struct Silent;

impl Progress for Silent {
    fn advance(&self, _: u64, _: u64) {}
}

/// A finished or interrupted render.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The picture.
    pub film: Film,
    /// What it took.
    pub rays: RayCounts,
    /// Wall time.
    pub seconds: f64,
    /// Share of all light-carrying throughput that was cut off at the greatest depth, in `[0, 1]`.
    pub lost_throughput: f64,
    /// Whether it was stopped before its end.
    pub interrupted: bool,
}

/// Renders a scene with the structure built from its shapes.
///
/// `stop` is looked at often: once it is true, the render returns within a fraction of a second.
pub fn render(
    scene: &Scene,
    _accel: &dyn Accelerator,
    options: &RenderOptions,
    _progress: &dyn Progress,
    _stop: &AtomicBool,
) -> Outcome {
    let resolution = scene.camera.resolution;
    let whole = PixelRect { x0: 0, y0: 0, x1: resolution[0], y1: resolution[1] };
    Outcome {
        film: Film::new(resolution, options.crop.unwrap_or(whole)),
        rays: RayCounts::default(),
        seconds: 0.0,
        lost_throughput: 0.0,
        interrupted: false,
    }
}
