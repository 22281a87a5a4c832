//! Both guides of the rays that leave surfaces.

use super::map::{Cell, GuideMap};
use super::photons::Shooter;
use super::reflectors::Reflectors;
use crate::accel::Accelerator;
use crate::core::lanes::{LANES, Vectors};
use crate::scene::{Plan, Scene};
use std::f32::consts::PI;

/// Where surfaces look for light that others reflect: by their diffuse and their wide glossy lobes for caustics, by diffuse ones and
/// plastics for all else.
#[derive(Default)]
pub struct Guides {
    /// To caustics, and to all other light.
    maps: [GuideMap; 2],
}

/// The numbers of a point's cells in both maps, where it has any.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CellNumbers([u32; 2]);

impl CellNumbers {
    /// In place of a number.
    const NOWHERE: u32 = u32::MAX;

    /// A point without a cell.
    pub const NONE: Self = Self([Self::NOWHERE; 2]);
}

impl Default for CellNumbers {
    fn default() -> Self {
        Self::NONE
    }
}

impl Guides {
    /// Those of a scene; empty where nothing is to be expected of them.
    ///
    /// The same for any number of threads: they depend on the scene, its settings and the accelerator's answers alone.
    pub fn of(scene: &Scene, accel: &dyn Accelerator) -> Self {
        let plan = Plan::of(scene);
        if !(plan.guides || plan.guides_indirect) {
            return Self::default();
        }
        let reflectors = Reflectors::of(scene);
        // Once: the mean of an image takes longer than a thousand photons.
        let environment = scene.lights.environment.as_ref();
        let environment_mean =
            environment.map_or(0.0, |environment| environment.irradiance().luminance() / PI);
        let shooter = Shooter::new(scene, accel, &reflectors, environment_mean);
        let caustics = if plan.guides { shooter.to_caustics() } else { GuideMap::default() };
        let indirect = if plan.guides_indirect { shooter.to_indirect() } else { GuideMap::default() };
        Self { maps: [caustics, indirect] }
    }

    /// Whether there is no guide anywhere.
    pub fn is_empty(&self) -> bool {
        self.maps.iter().all(GuideMap::is_empty)
    }

    /// Whether there is any to other light than caustics.
    pub fn has_indirect(&self) -> bool {
        !self.maps[1].is_empty()
    }

    /// The numbers of the cells at eight points of surfaces with normals; of those to caustics alone, if the others are not
    /// wanted.
    #[inline(always)]
    pub fn find(&self, points: &Vectors, normals: &Vectors, indirect: bool) -> [CellNumbers; LANES] {
        let mut numbers = [CellNumbers::NONE; LANES];
        for (k, map) in self.maps.iter().enumerate() {
            if map.is_empty() || k == 1 && !indirect {
                continue;
            }
            for (numbers, found) in numbers.iter_mut().zip(map.find(points, normals)) {
                numbers.0[k] = found.unwrap_or(CellNumbers::NOWHERE);
            }
        }
        numbers
    }

    /// The cells of these numbers.
    #[inline(always)]
    pub fn cells(&self, numbers: CellNumbers) -> [Option<&Cell>; 2] {
        std::array::from_fn(|k| {
            (numbers.0[k] != CellNumbers::NOWHERE).then(|| self.maps[k].cell(numbers.0[k]))
        })
    }
}
