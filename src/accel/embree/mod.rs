//! Embree 3 or 4 through its C interface.
//!
//! `ffi` holds what bindgen read from the installed header, `device` and `scene` own Embree's objects, `query` makes
//! one set of calls of the two versions', and `single`, `packet` and `stream` turn slices of rays into them. This
//! file chooses among these.
#![allow(unsafe_code, reason = "Embree is a C library")]

mod device;
mod ffi;
mod packet;
mod polish;
mod query;
mod scene;
mod single;
#[cfg(embree3)]
mod stream;

use super::{AccelError, AccelInfo, Accelerator, BuildOptions, Coherence, EmbreeMode, SkipSupport};
use crate::core::{Hit, Ray, Skip};
use crate::geometry::Shape;
use device::Device;
use query::Query;
use scene::Scene;
use std::sync::Arc;
use std::time::Instant;

/// Rays that are answered before their skip rules are looked at, while they are in the first-level cache; also
/// the length of a stream.
const CHUNK: usize = 256;

/// A committed scene and how it is asked. A clone shares the scene.
#[derive(Clone)]
pub struct Embree {
    scene: Arc<Scene>,
    mode: EmbreeMode,
    robust: bool,
    skip: SkipSupport,
    info: AccelInfo,
}

/// The mode as the command line spells it.
fn mode_name(mode: EmbreeMode) -> &'static str {
    match mode {
        EmbreeMode::Auto => "auto",
        EmbreeMode::Single => "single",
        EmbreeMode::Packet4 => "packet4",
        EmbreeMode::Packet8 => "packet8",
        EmbreeMode::Packet16 => "packet16",
        EmbreeMode::Stream => "stream",
    }
}

/// A way to ask.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Call {
    Single,
    Packet4,
    Packet8,
    Packet16,
    #[cfg(embree3)]
    Stream,
}

impl Call {
    /// For closest hits. Measured over six scenes (as multiples of one ray a call): coherent rays ran 1.78 times as
    /// fast by Embree 3's stream of packets and 1.51 times by Embree 4's packets of 8; for incoherent rays nothing
    /// beat one ray a call.
    fn for_closest(mode: EmbreeMode, coherence: Coherence) -> Self {
        match (mode, coherence) {
            (EmbreeMode::Auto, Coherence::Incoherent) => Self::Single,
            (EmbreeMode::Auto, Coherence::Coherent) => Self::STREAM,
            _ => Self::forced(mode),
        }
    }

    /// For any hit: Embree 3's stream, which bins by octant, ran 1.54 times as fast as one ray a call even for
    /// incoherent rays, and Embree 4's packets of 8 ran 1.12 times as fast.
    fn for_any(mode: EmbreeMode) -> Self {
        if mode == EmbreeMode::Auto { Self::STREAM } else { Self::forced(mode) }
    }

    fn forced(mode: EmbreeMode) -> Self {
        match mode {
            EmbreeMode::Single => Self::Single,
            EmbreeMode::Packet4 => Self::Packet4,
            EmbreeMode::Packet8 => Self::Packet8,
            EmbreeMode::Packet16 => Self::Packet16,
            EmbreeMode::Stream | EmbreeMode::Auto => Self::STREAM,
        }
    }

    /// Many rays a call: Embree 4 has packets at most.
    #[cfg(embree3)]
    const STREAM: Self = Self::Stream;
    #[cfg(embree4)]
    const STREAM: Self = Self::Packet8;
}

impl Embree {
    /// Builds over the shapes, whose buffers Embree reads in place.
    ///
    /// # Errors
    /// If Embree does not run on this machine, is out of memory or refuses a shape; with its own words.
    pub fn new(shapes: &[Shape], options: &BuildOptions) -> Result<Self, AccelError> {
        let start = Instant::now();
        let scene = Arc::new(Scene::commit(Device::new(options)?, shapes, options)?);
        let info = AccelInfo {
            name: format!("embree {} {}", scene.device().version(), mode_name(options.embree_mode)),
            memory_bytes: scene.device().memory_bytes(),
            build_seconds: start.elapsed().as_secs_f64(),
        };
        Ok(Self { scene, mode: options.embree_mode, robust: options.robust, skip: options.skip, info })
    }

    /// The same scene asked by other calls.
    pub fn with_mode(self, mode: EmbreeMode) -> Self {
        let name = format!("embree {} {}", self.scene.device().version(), mode_name(mode));
        Self { mode, info: AccelInfo { name, ..self.info }, ..self }
    }

    /// The same scene with hits as Embree's f32 finds them, also in its robust mode. For benchmarks.
    pub fn with_raw_hits(self) -> Self {
        Self { robust: false, ..self }
    }

    fn intersect_chunk(&self, call: Call, query: &mut Query<'_>, rays: &[Ray], hits: &mut [Option<Hit>]) {
        match call {
            Call::Single => single::intersect(&self.scene, query, rays, hits),
            Call::Packet4 => packet::intersect::<4>(&self.scene, query, rays, hits),
            Call::Packet8 => packet::intersect::<8>(&self.scene, query, rays, hits),
            Call::Packet16 => packet::intersect::<16>(&self.scene, query, rays, hits),
            #[cfg(embree3)]
            Call::Stream if query.coherence() == Coherence::Coherent => {
                stream::intersect_coherent(&self.scene, query, rays, hits)
            }
            #[cfg(embree3)]
            Call::Stream => stream::intersect(&self.scene, query, rays, hits),
        }
    }

    fn occluded_chunk(&self, call: Call, query: &mut Query<'_>, rays: &[Ray], occluded: &mut [bool]) {
        match call {
            Call::Single => single::occluded(&self.scene, query, rays, occluded),
            Call::Packet4 => packet::occluded::<4>(&self.scene, query, rays, occluded),
            Call::Packet8 => packet::occluded::<8>(&self.scene, query, rays, occluded),
            Call::Packet16 => packet::occluded::<16>(&self.scene, query, rays, occluded),
            #[cfg(embree3)]
            Call::Stream => stream::occluded(&self.scene, query, rays, occluded),
        }
    }
}

impl Accelerator for Embree {
    fn intersect(&self, rays: &[Ray], coherence: Coherence, hits: &mut [Option<Hit>]) {
        assert_eq!(rays.len(), hits.len(), "one hit per ray");
        let call = Call::for_closest(self.mode, coherence);
        let mut query = Query::all(coherence);
        for (rays, hits) in rays.chunks(CHUNK).zip(hits.chunks_mut(CHUNK)) {
            self.intersect_chunk(call, &mut query, rays, hits);
            if self.robust {
                self.scene.settle_exactly(rays, hits);
            } else {
                self.scene.settle_rules(rays, hits);
            }
        }
    }

    fn occluded(&self, rays: &[Ray], coherence: Coherence, occluded: &mut [bool]) {
        assert_eq!(rays.len(), occluded.len(), "one answer per ray");
        let call = Call::for_any(self.mode);
        let mut query = Query::all(coherence);
        for (rays, occluded) in rays.chunks(CHUNK).zip(occluded.chunks_mut(CHUNK)) {
            let with_rule = |ray: &&Ray| self.skip == SkipSupport::Any && ray.skip != Skip::None;
            match rays.iter().filter(with_rule).count() {
                0 => self.occluded_chunk(call, &mut query, rays, occluded),
                count if 4 * count >= rays.len() => self.scene.occluded_by_rules(rays, occluded),
                _ => {
                    let mut free = [Ray::inactive(); CHUNK];
                    for (free, ray) in free.iter_mut().zip(rays).filter(|(_, ray)| ray.skip == Skip::None) {
                        *free = *ray;
                    }
                    self.occluded_chunk(call, &mut query, &free[..rays.len()], occluded);
                    self.scene.occluded_with_rules(rays, occluded);
                }
            }
        }
    }

    fn info(&self) -> AccelInfo {
        self.info.clone()
    }
}
