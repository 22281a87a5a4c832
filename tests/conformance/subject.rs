//! A backend with its options, and how hard it is tried.

#[cfg(feature = "embree")]
use gloss::accel::EmbreeMode;
use gloss::accel::bvh::{Bvh, Isa};
use gloss::accel::{self, Accelerator, Backend, BuildOptions, Coherence, Quality, SkipSupport};
use gloss::core::{Hit, Ray};
use gloss::geometry::Shape;

/// Both hints: no answer may depend on them.
pub(crate) const HINTS: [Coherence; 2] = [Coherence::Coherent, Coherence::Incoherent];

/// How a backend is built.
type Build = Box<dyn Fn(&[Shape], &BuildOptions) -> Box<dyn Accelerator>>;

/// What is tested.
pub(crate) struct Subject {
    build: Build,
    options: BuildOptions,
    /// Rays against a closed mesh.
    pub(crate) rays: usize,
}

impl Subject {
    /// A backend as `accel::build` makes it.
    pub(crate) fn new(backend: Backend) -> Self {
        Self::made_by(move |shapes, options| accel::build(backend, shapes, options).unwrap())
    }

    /// The pure-Rust hierarchy, traversed by a given instruction set.
    pub(crate) fn bvh_on(isa: Isa) -> Self {
        Self::made_by(move |shapes, options| {
            let bvh = Bvh::new(shapes, options).unwrap();
            Box::new(bvh.with_isa(isa).expect("the set is one that every such processor has"))
        })
    }

    #[cfg(feature = "embree")]
    pub(crate) fn embree(mode: EmbreeMode) -> Self {
        let mut subject = Self::new(Backend::Embree);
        subject.options.embree_mode = mode;
        subject
    }

    /// Any implementation.
    fn made_by(build: impl Fn(&[Shape], &BuildOptions) -> Box<dyn Accelerator> + 'static) -> Self {
        let options = BuildOptions { threads: 1, ..BuildOptions::default() };
        Self { build: Box::new(build), options, rays: 100_000 }
    }

    pub(crate) fn rays(self, rays: usize) -> Self {
        Self { rays, ..self }
    }

    pub(crate) fn quality(mut self, quality: Quality) -> Self {
        self.options.quality = quality;
        self
    }

    #[cfg(feature = "embree")]
    pub(crate) fn compact(mut self) -> Self {
        self.options.compact = true;
        self
    }

    pub(crate) fn not_robust(mut self) -> Self {
        self.options.robust = false;
        self
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
