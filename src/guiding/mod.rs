//! Path guiding: where a surface should look for light that its own rays hardly find.
//!
//! Towards caustics: a ray that leaves a wall meets the spot of a chrome ball that mirrors the lamp once in thousands of
//! times, and then brings thousands of times the mean: the bright dots of path tracing. So before a render photons are shot
//! that meet a lamp, then a sharp glossy surface, then a diffuse one (Jensen 1995, *Importance Driven Path Tracing using the
//! Photon Map*). Where they land they tell from where, and part of the rays that leave the surface are sent there, each ray
//! weighted by the density of the mixture. Photons carry no light into the picture: however few or wrong, they change
//! its noise and never its mean.
//!
//! Towards portals: of a sky that is seen through a window a wall's rays find as much as the window takes of the view, and
//! samples of the sky by its own brightness are stopped by the walls. So rays are sent out before a render that look for the
//! sky, and where few find it, those tell where samples of lights shall look for it too. Whoever wants that elsewhere puts
//! rectangles into his windows by hand (Bitterli et al. 2015, *Portal-Masked Environment Map Sampling*).
//!
//! Read [`GuideMap`] first; `photons` makes what it is made of, from points of `reflectors`, `look` finds what else there is,
//! and `portals` what finds the sky; a `mixture` is what it gives, which `fit` makes of photons.

mod fit;
mod look;
mod map;
mod mixture;
mod photons;
mod portals;
mod reflectors;

pub use map::{Cell, GuideMap};
pub use mixture::Mixture;

use crate::accel::Accelerator;
use crate::scene::{Plan, Scene};
use map::{Making, Photon};
use photons::Shooter;
use rayon::prelude::*;
use reflectors::Reflectors;
use std::f32::consts::PI;

/// Photons that are shot, at most, and at least.
const PHOTONS: std::ops::RangeInclusive<u32> = 1 << 12..=1 << 17;

/// Pixels for each photon.
const PIXELS_PER_PHOTON: u32 = 2;

/// Cells of caustics: small, since those have edges.
const CAUSTICS: Making = Making { most: 64, cell: Cell::to_caustics };

/// Photons that one thread shoots together.
const TOGETHER: u32 = 2048;

impl GuideMap {
    /// Guides to the caustics of a scene; empty where none is to be expected.
    ///
    /// The same for any number of threads: it depends on the scene, its settings and the accelerator's answers alone.
    pub fn to_caustics(scene: &Scene, accel: &dyn Accelerator) -> Self {
        if !Plan::of(scene).guides {
            return Self::default();
        }
        let reflectors = Reflectors::of(scene);
        if reflectors.area() == 0.0 {
            return Self::default();
        }
        let [width, height] = scene.camera.resolution;
        let count =
            (width.saturating_mul(height) / PIXELS_PER_PHOTON).clamp(*PHOTONS.start(), *PHOTONS.end());
        // Once: the mean of an image takes longer than a thousand photons.
        let environment = scene.lights.environment.as_ref();
        let environment_mean =
            environment.map_or(0.0, |environment| environment.irradiance().luminance() / PI);
        let shooter = Shooter { scene, accel, reflectors: &reflectors, count, environment_mean };
        let starts: Vec<u32> = (0..count).step_by(TOGETHER as usize).collect();
        let photons: Vec<Vec<Photon>> =
            starts.into_par_iter().map(|start| shooter.shoot(start..count.min(start + TOGETHER))).collect();
        Self::new(photons.concat(), CAUSTICS)
    }
}
