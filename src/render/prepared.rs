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
    known: Known,
    best: Best,
}

impl<'a> Prepared<'a> {
    /// For a scene with the structure built from its shapes; anything if `stop` becomes true.
    ///
    /// The same for any number of threads: it depends on the scene, its settings and the accelerator's answers alone.
    pub fn new(scene: &'a Scene, accel: &'a dyn Accelerator, stop: &AtomicBool) -> Self {
        let known = Known {
            guides: Guides::of(scene, accel),
            portals: GuideMap::to_portals(scene, accel),
            edges: EmitterEdges::of(scene, accel),
        };
        let integrator = || known.integrator(scene, accel);
        let plan = Plan::of(scene);
        let best = if plan.splits_by_pilot || plan.tries_guides && known.guides.has_indirect() {
            // The pilot's samples are not the picture's.
            pilot::best(scene, || integrator().with_seed(!scene.settings.seed), stop)
        } else {
            Best::planned(scene, &integrator())
        };
        Self { scene, accel, known, best }
    }

    /// What renders it.
    pub(super) fn integrator(&self) -> Integrator<'_> {
        self.best.of(self.known.integrator(self.scene, self.accel))
    }

    /// Rays at first hits that split.
    pub(super) fn split(&self) -> u32 {
        self.best.split.rays
    }
}

/// What is known of a scene before a pilot.
struct Known {
    guides: Guides,
    portals: GuideMap,
    edges: EmitterEdges,
}

impl Known {
    /// An integrator that knows it.
    fn integrator<'a>(&'a self, scene: &'a Scene, accel: &'a dyn Accelerator) -> Integrator<'a> {
        let integrator = Integrator::new(scene, accel);
        integrator.guided_by(&self.guides).through(&self.portals).with_edges(&self.edges)
    }
}
