//! What the samples of a picture go by, found out before the first of them.

use super::pilot::{self, Best};
use crate::accel::Accelerator;
use crate::guiding::{GuideMap, Guides};
use crate::integrator::{EmitterEdges, Integrator};
use crate::scene::{Plan, Scene};
use std::sync::atomic::AtomicBool;

/// From where light comes, where emitters have edges, and what a pilot has found best: for any number of pictures of a scene, or of
/// parts of one.
pub struct Prepared<'a> {
    pub(super) scene: &'a Scene,
    accel: &'a dyn Accelerator,
    guides: Guides,
    portals: GuideMap,
    edges: EmitterEdges,
    best: Best,
}

impl<'a> Prepared<'a> {
    /// For a scene with the structure built from its shapes; anything if `stop` becomes true.
    ///
    /// The same for any number of threads: it depends on the scene, its settings and the accelerator's answers alone.
    pub fn new(scene: &'a Scene, accel: &'a dyn Accelerator, stop: &AtomicBool) -> Self {
        let mut prepared = Self {
            scene,
            accel,
            guides: Guides::of(scene, accel),
            portals: GuideMap::to_portals(scene, accel),
            edges: EmitterEdges::of(scene, accel),
            best: Best::planned(scene, &Integrator::new(scene, accel)),
        };
        let plan = Plan::of(scene);
        if plan.splits_by_pilot || plan.tries_guides && prepared.guides.has_indirect() {
            // The pilot's samples are not the picture's.
            prepared.best = pilot::best(scene, || prepared.plain().with_seed(!scene.settings.seed), stop);
        }
        prepared
    }

    /// What renders it.
    pub(super) fn integrator(&self) -> Integrator<'_> {
        self.best.of(self.plain())
    }

    /// Rays at first hits that split.
    pub(super) fn split(&self) -> u32 {
        self.best.split.rays
    }

    /// The integrator, knowing nothing of what the pilot has found.
    fn plain(&self) -> Integrator<'_> {
        let integrator = Integrator::new(self.scene, self.accel);
        integrator.guided_by(&self.guides).through(&self.portals).with_edges(&self.edges)
    }
}
