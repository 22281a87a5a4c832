//! The state of a path between two surfaces, and of a surface whose rays are still to be made.

use super::bounce::{Leaving, Reached};
use super::portals::Portal;
use super::tally::RayClass;
use crate::bxdf::Bsdf;
use crate::core::{Ray, Rgb};
use crate::scene::{Receiver, Rivals, SurfaceInteraction};
use glam::Vec3;

/// A path on its way along a ray.
#[derive(Clone, Copy, Debug)]
pub(super) struct Path {
    /// Weight of whatever the ray will find.
    pub beta: Rgb,
    /// By how much guides have made its directions likelier than lobes alone would.
    pub favour: f32,
    /// The camera sample of the wave that it belongs to.
    pub slot: u32,
    /// Index of its random numbers; the m rays of a split hit take m consecutive ones.
    pub index: u32,
    /// Reflections so far.
    pub depth: u32,
    /// Glossy reflections so far.
    pub glossy_depth: u32,
    /// Rays that leave its first glossy hit, or the first hit of any kind that is no mirror.
    pub split: u32,
    /// Rays times density with which the last lobe goes this way, in 1/sr; infinite where no light sample competes:
    /// from the camera, from mirrors, and from glossy surfaces that sample no lights.
    pub rate: f32,
    /// Normal of the surface that the ray left: what the light's density depends on.
    pub receiver_n: Vec3,
    /// What the light's choice at that surface depended on: see [`Receiver::rivals`].
    pub rivals: Rivals,
    /// Through which portals light samples of that surface looked for the environment: see [`Portal`].
    pub portal: Portal,
    /// Whether only light that comes straight from a light counts.
    pub emission_only: bool,
    /// Whether the emission of the first surface is found by other rays.
    pub emission_apart: bool,
    /// Whether what it meets is what the camera sample shows: nothing but mirrors and the like came before.
    pub followed: bool,
}

impl Path {
    /// A path that starts at the camera.
    pub(super) fn from_camera(slot: u32, index: u32, split: u32) -> Self {
        Self {
            beta: Rgb::WHITE,
            favour: 1.0,
            slot,
            index,
            depth: 0,
            glossy_depth: 0,
            split,
            rate: f32::INFINITY,
            receiver_n: Vec3::Z,
            rivals: Rivals::None,
            portal: Portal::default(),
            emission_only: false,
            emission_apart: false,
            followed: true,
        }
    }

    /// Index of the random numbers of one of so many at a hit that splits.
    #[inline(always)]
    pub(super) fn index_of(&self, number: u32, of: u32) -> u32 {
        self.index.wrapping_mul(of).wrapping_add(number)
    }

    /// The surface at `origin` that the ray left, as lights saw it.
    #[inline]
    pub(super) fn receiver(&self, origin: Vec3) -> Receiver {
        Receiver { p: origin, n: self.receiver_n, rivals: self.rivals }
    }
}

/// Paths and their rays, side by side.
#[derive(Default)]
pub(super) struct Rays {
    pub paths: Vec<Path>,
    pub rays: Vec<Ray>,
}

impl Rays {
    fn clear(&mut self) {
        self.paths.clear();
        self.rays.clear();
    }
}

/// The rays that take the next step: those of one class together, so that each can be asked, and timed, in its way.
#[derive(Default)]
pub(super) struct Wave {
    /// By the number of their [`RayClass`]; shadow rays are never part of a wave.
    pub classes: [Rays; 3],
}

impl Wave {
    #[inline]
    pub(super) fn push(&mut self, class: RayClass, path: Path, ray: Ray) {
        let rays = &mut self.classes[class as usize];
        rays.paths.push(path);
        rays.rays.push(ray);
    }

    pub(super) fn len(&self) -> usize {
        self.classes.iter().map(|c| c.rays.len()).sum()
    }

    pub(super) fn clear(&mut self) {
        self.classes.iter_mut().for_each(Rays::clear);
    }
}

/// A surface that a path has reached and the rays that shall leave it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Vertex {
    /// The path that came.
    pub path: Path,
    /// Where it came to.
    pub point: SurfaceInteraction,
    /// What is there.
    pub bsdf: Bsdf,
    /// Which rays leave.
    pub leaving: Leaving,
}

impl Vertex {
    /// The surface and the rays that are still to be made.
    pub(super) fn parts(&mut self) -> (Reached<'_>, &mut Leaving) {
        let Self { path, point, bsdf, leaving } = self;
        (Reached { path, point, bsdf }, leaving)
    }
}
