//! Who answers rays. Never sees a material, a light or a pixel: a backend is a week's work.
//!
//! Read [`Accelerator`] first, then [`build`].

pub mod brute;
pub mod bvh;
#[cfg(feature = "embree")]
pub mod embree;
mod exact;

use crate::core::{Hit, Ray};
use crate::geometry::Shape;

/// What is known of a slice of rays. A wrong hint changes the speed and never an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coherence {
    /// Neighbours in the slice go nearly the same way from nearly the same place, such as camera rays in pixel
    /// blocks of 4 x 2.
    Coherent,
    /// Nothing is known.
    Incoherent,
}

/// Closest-hit and any-hit queries over committed geometry.
///
/// A ray is a slice of one, a packet a chunk, a stream a long slice; how a backend groups them is its own matter.
pub trait Accelerator: Send + Sync {
    /// Closest hits of a batch of rays.
    ///
    /// `hits[i]` becomes the first primitive along `rays[i]` with `t_min <= t <= t_max` that the ray's skip rule
    /// does not reject, or `None`. An inactive ray ([`Ray::is_active`]) hits nothing. The order of the rays never
    /// changes an answer; `coherence` is a hint that may change the speed.
    ///
    /// # Panics
    /// If `rays` and `hits` differ in length.
    fn intersect(&self, rays: &[Ray], coherence: Coherence, hits: &mut [Option<Hit>]);

    /// Whether anything lies on each ray: `occluded[i]` is what `intersect` would call `is_some()`.
    ///
    /// # Panics
    /// If `rays` and `occluded` differ in length.
    fn occluded(&self, rays: &[Ray], coherence: Coherence, occluded: &mut [bool]);

    /// What was built.
    fn info(&self) -> AccelInfo;
}

/// What a build made and what it cost.
#[derive(Clone, Debug, PartialEq)]
pub struct AccelInfo {
    /// Backend, version and mode, for people: `embree 3.13.5 auto`, `bvh avx2`, `brute`.
    pub name: String,
    /// Bytes that the structure keeps, without the meshes' own buffers.
    pub memory_bytes: usize,
    /// Wall time of the build.
    pub build_seconds: f64,
}

/// Which implementation answers; if none is named, the one whose whole renders are the fastest, which is there on every
/// machine.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    serde::Serialize,
    serde::Deserialize,
    schemars::JsonSchema,
    clap::ValueEnum,
)]
#[serde(rename_all = "kebab-case")]
pub enum Backend {
    /// Embree by C calls.
    Embree,
    /// The pure-Rust bounding volume hierarchy.
    #[default]
    Bvh,
    /// Every primitive against every ray: the oracle.
    Brute,
}

/// Which of Embree's calls are asked.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    serde::Serialize,
    serde::Deserialize,
    schemars::JsonSchema,
    clap::ValueEnum,
)]
#[serde(rename_all = "kebab-case")]
pub enum EmbreeMode {
    /// The fastest measured call for each kind of batch.
    #[default]
    Auto,
    /// One ray a call.
    Single,
    /// Packets of 4.
    Packet4,
    /// Packets of 8.
    Packet8,
    /// Packets of 16.
    Packet16,
    /// Embree 3's stream calls; on Embree 4, which has none, packets over the slice.
    Stream,
}

/// Time spent on the structure against speed of the rays.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    serde::Serialize,
    serde::Deserialize,
    schemars::JsonSchema,
    clap::ValueEnum,
)]
#[serde(rename_all = "kebab-case")]
pub enum Quality {
    /// For previews.
    Fast,
    /// Binned surface area heuristic.
    #[default]
    Medium,
    /// With spatial splits.
    High,
}

/// Which skip rules the rays will carry: what a backend need not be ready for costs nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SkipSupport {
    /// Every ray has `Skip::None`.
    None,
    /// Any rule.
    #[default]
    Any,
}

/// How to build.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BuildOptions {
    /// Time spent on the structure.
    pub quality: Quality,
    /// Watertight tests, so that no ray slips through a shared edge, and hits computed from the primitive
    /// itself, so that they do not depend on the call that found it. Off, a render takes 7 to 14 % less time, hits on
    /// thin triangles seen at a grazing angle may lie anywhere, and hits differ by roundings with their company.
    pub robust: bool,
    /// Less memory, slower rays.
    pub compact: bool,
    /// Embree's calls.
    pub embree_mode: EmbreeMode,
    /// Which skip rules may come.
    pub skip: SkipSupport,
    /// Threads of the build; 0 for all.
    pub threads: usize,
}

impl Default for BuildOptions {
    fn default() -> Self {
        Self {
            quality: Quality::default(),
            robust: true,
            compact: false,
            embree_mode: EmbreeMode::default(),
            skip: SkipSupport::default(),
            threads: 0,
        }
    }
}

/// Why a structure could not be built.
#[derive(Debug, thiserror::Error)]
pub enum AccelError {
    /// This program was compiled without the backend.
    #[error("this gloss was built without Embree: use --backend bvh, or build it with the feature `embree`")]
    NotCompiled,
    /// Embree refused; the text is its own.
    #[error("Embree: {message} (while {during})")]
    Embree {
        /// What was asked of it.
        during: &'static str,
        /// What it said.
        message: String,
    },
    /// Ids have 32 bits and some structures fewer.
    #[error("{count} {what} are more than the {limit} that the {backend} backend can number")]
    TooMany {
        /// How many there are.
        count: usize,
        /// Of what.
        what: &'static str,
        /// The most there can be.
        limit: usize,
        /// Whose limit it is.
        backend: &'static str,
    },
}

/// Builds the structure that answers rays against `shapes`; a shape's index is its `geom_id`.
///
/// # Errors
/// If the backend is not compiled in, is out of memory or refuses the geometry.
pub fn build(
    backend: Backend,
    shapes: &[Shape],
    options: &BuildOptions,
) -> Result<Box<dyn Accelerator>, AccelError> {
    match backend {
        Backend::Brute => Ok(Box::new(brute::Brute::new(shapes))),
        Backend::Bvh => Ok(Box::new(bvh::Bvh::new(shapes, options)?)),
        #[cfg(feature = "embree")]
        Backend::Embree => Ok(Box::new(embree::Embree::new(shapes, options)?)),
        #[cfg(not(feature = "embree"))]
        Backend::Embree => Err(AccelError::NotCompiled),
    }
}
