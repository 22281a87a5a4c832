//! A backend with its options, and how hard it is tried.

use gloss::accel::{self, Accelerator, Backend, BuildOptions, Coherence, EmbreeMode, Quality, SkipSupport};
use gloss::core::{Hit, Ray};
use gloss::geometry::Shape;

/// Both hints: no answer may depend on them.
pub(crate) const HINTS: [Coherence; 2] = [Coherence::Coherent, Coherence::Incoherent];

/// How a backend is built.
type Build = fn(&[Shape], &BuildOptions) -> Box<dyn Accelerator>;

/// What is tested.
pub(crate) struct Subject {
    build: Build,
    pub(crate) options: BuildOptions,
    /// Rays against a closed mesh.
    pub(crate) rays: usize,
}

impl Subject {
    /// A backend as `accel::build` makes it.
    pub(crate) fn new(backend: Backend) -> Self {
        let build: Build = match backend {
            Backend::Brute => |shapes, options| accel::build(Backend::Brute, shapes, options).unwrap(),
            Backend::Bvh => |shapes, options| accel::build(Backend::Bvh, shapes, options).unwrap(),
            Backend::Embree => |shapes, options| accel::build(Backend::Embree, shapes, options).unwrap(),
        };
        Self::made_by(build)
    }

    /// Any implementation: what a forced variant of a backend registers itself with.
    pub(crate) fn made_by(build: Build) -> Self {
        Self { build, options: BuildOptions { threads: 1, ..BuildOptions::default() }, rays: 100_000 }
    }

    pub(crate) fn rays(self, rays: usize) -> Self {
        Self { rays, ..self }
    }

    pub(crate) fn quality(mut self, quality: Quality) -> Self {
        self.options.quality = quality;
        self
    }

    pub(crate) fn compact(mut self) -> Self {
        self.options.compact = true;
        self
    }

    pub(crate) fn not_robust(mut self) -> Self {
        self.options.robust = false;
        self
    }

    #[cfg(feature = "embree")]
    pub(crate) fn embree(mode: EmbreeMode) -> Self {
        let mut subject = Self::new(Backend::Embree);
        subject.options.embree_mode = mode;
        subject
    }

    pub(crate) fn build(&self, shapes: &[Shape]) -> Box<dyn Accelerator> {
        (self.build)(shapes, &self.options)
    }

    /// Built for rays that all have no rule.
    pub(crate) fn build_without_skip(&self, shapes: &[Shape]) -> Box<dyn Accelerator> {
        (self.build)(shapes, &BuildOptions { skip: SkipSupport::None, ..self.options })
    }
}

/// Closest hits of a batch.
pub(crate) fn closest(accel: &dyn Accelerator, rays: &[Ray], hint: Coherence) -> Vec<Option<Hit>> {
    // What was there before must not show through.
    let stale = Hit { t: 123.0, u: 4.0, v: 5.0, geom_id: 6, prim_id: 7 };
    let mut hits = vec![Some(stale); rays.len()];
    accel.intersect(rays, hint, &mut hits);
    hits
}

/// Any hit of a batch.
pub(crate) fn any(accel: &dyn Accelerator, rays: &[Ray], hint: Coherence) -> Vec<bool> {
    let mut occluded: Vec<bool> = (0..rays.len()).map(|i| i % 2 == 0).collect();
    accel.occluded(rays, hint, &mut occluded);
    occluded
}
