//! The pure-Rust bounding volume hierarchy: 8-wide nodes and leaves of 4 primitives, watertight or fast.
//!
//! Read `data` for what is kept, `builder` for how it is made, `single` for how one ray goes through it, `mode` for what
//! the watertight and the fast mode differ in. Few primitives, all of a scene or those around its large meshes, have a layout
//! and a traversal of their own: `small` and `sweep`.
//!
//! The answer to a ray is the least `(t, geom_id, prim_id)` among the primitives that the ray's test accepts. In the
//! watertight mode the test is the same arithmetic on every path and instruction set, and boxes are tested with room
//! for its rounding, so an answer does not depend on the order of traversal, the batch or the machine. The fast mode
//! promises no such thing, but has the same arithmetic on every path too.

mod batch;
mod binning;
mod boxes;
mod builder;
mod course;
mod data;
mod emit;
mod exactly;
mod huge;
mod mode;
mod moeller;
mod morton;
mod occlusion;
mod packet;
mod partition;
mod ray;
mod rows;
mod simd;
mod single;
mod small;
mod sphere;
mod splits;
mod stream;
mod sweep;
mod watertight;
mod ways;

pub use simd::Isa;

use super::exact::{self, Point};
use super::{AccelError, AccelInfo, Accelerator, BuildOptions, Coherence};
use crate::core::{Hit, Ray};
use crate::geometry::Shape;
use batch::Grouping;
use data::{Child, Hierarchy};
use emit::Primitives;
use mode::Mode;
use moeller::Fast;
use simd::Available;
use std::sync::Arc;
use std::time::Instant;
use watertight::Watertight;

/// The hierarchy. A clone shares it.
///
/// With `robust` in the options rays are watertight and hits are computed anew from their primitives; without it, both
/// are as f32 has them fastest. `compact` changes nothing, since the structure is smaller than Embree's fast one as it is.
#[derive(Clone)]
pub struct Bvh {
    data: Arc<Hierarchy>,
    /// What the hierarchy is over: an answer's numbers come from the primitive itself.
    shapes: Vec<Shape>,
    isa: Available,
    /// Whether `data` is for the watertight mode.
    watertight: bool,
    /// Whether hits are computed anew from their primitives.
    exact: bool,
    single_rays: bool,
    build_seconds: f64,
}

impl Bvh {
    /// Builds over the shapes, for the fastest instruction set of this processor.
    ///
    /// # Errors
    /// If there are more primitives than it can number.
    pub fn new(shapes: &[Shape], options: &BuildOptions) -> Result<Self, AccelError> {
        let start = Instant::now();
        let too_many = |count, what, limit| AccelError::TooMany { count, what, limit, backend: "bvh" };
        let count = shapes.iter().map(Shape::primitive_count).sum();
        let limit = Child::MAX_FIRST * data::BLOCK;
        if count > limit {
            return Err(too_many(count, "primitives", limit));
        }
        let kept = if options.robust { Watertight::kept } else { Fast::kept };
        let (primitives, swept) = (Primitives { shapes, kept }, small::swept(shapes));
        let mut data = in_pool(options.threads, || builder::build(primitives, options.quality, &swept));
        data.small = small::Small::new(&data, primitives, &swept);
        let blocks = data.triangles.len().max(data.spheres.len());
        if blocks > Child::MAX_FIRST {
            return Err(too_many(blocks, "leaf blocks", Child::MAX_FIRST));
        }
        let build_seconds = start.elapsed().as_secs_f64();
        Ok(Self {
            data: Arc::new(data),
            shapes: shapes.to_vec(),
            isa: Available::best(),
            watertight: options.robust,
            exact: options.robust,
            single_rays: false,
            build_seconds,
        })
    }

    /// The same hierarchy traversed by another instruction set, or `None` if this processor lacks it. For tests and
    /// benchmarks: the answers are the same.
    pub fn with_isa(self, isa: Isa) -> Option<Self> {
        Some(Self { isa: Available::new(isa)?, ..self })
    }

    /// The same hierarchy without packets and streams. For tests and benchmarks: the answers are the same.
    pub fn with_single_rays(self) -> Self {
        Self { single_rays: true, ..self }
    }

    /// The same hierarchy with hits as f32 finds them. For benchmarks: of traversal alone, without the exact hits.
    pub fn with_raw_hits(self) -> Self {
        Self { exact: false, ..self }
    }

    /// Computes a hit's numbers anew, in f64 where its point is not known: on a sliver seen at a grazing angle f32 leaves `u` and `v` few digits,
    /// and may name a primitive that the ray passes by, so that it must be asked again.
    ///
    /// The corners that it reads are those that shading needs next.
    #[inline]
    fn polish(&self, ray: &Ray, hit: Hit, known: Option<Point>) -> Option<Hit> {
        let Shape::Mesh(mesh) = &self.shapes[hit.geom_id as usize] else { return Some(hit) };
        match known.or_else(|| exact::nearest_on_triangle(ray, mesh.triangle(hit.prim_id))) {
            Some(point) if point.is_near(ray) => {
                let t = (point.t as f32).clamp(ray.t_min, ray.t_max);
                Some(Hit { t, u: point.u as f32, v: point.v as f32, ..hit })
            }
            _ => exactly::closest(&self.data, &self.shapes, ray),
        }
    }

    fn grouping(&self, coherence: Coherence) -> Grouping {
        if self.single_rays { Grouping::Single } else { Grouping::Groups(coherence) }
    }
}

/// Runs a build on so many threads; 0 for all that there are.
fn in_pool<T: Send>(threads: usize, build: impl FnOnce() -> T + Send) -> T {
    if threads == 0 {
        return build();
    }
    match rayon::ThreadPoolBuilder::new().num_threads(threads).build() {
        Ok(pool) => pool.install(build),
        // The system gives no more threads: those of the global pool build the same structure.
        Err(_) => build(),
    }
}

impl Accelerator for Bvh {
    fn intersect(&self, rays: &[Ray], coherence: Coherence, hits: &mut [Option<Hit>]) {
        assert_eq!(rays.len(), hits.len(), "one hit per ray");
        let (isa, data, grouping) = (self.isa, &*self.data, self.grouping(coherence));
        if self.watertight {
            batch::closest_hits::<Watertight>(isa, data, grouping, rays, hits);
        } else {
            batch::closest_hits::<Fast>(isa, data, grouping, rays, hits);
        }
        if self.exact {
            exact::settle(&self.shapes, rays, hits, |ray, hit, known| self.polish(ray, hit, known));
        }
    }

    fn occluded(&self, rays: &[Ray], coherence: Coherence, occluded: &mut [bool]) {
        assert_eq!(rays.len(), occluded.len(), "one answer per ray");
        let (isa, data, grouping) = (self.isa, &*self.data, self.grouping(coherence));
        if self.watertight {
            batch::any_hits::<Watertight>(isa, data, grouping, rays, occluded);
        } else {
            batch::any_hits::<Fast>(isa, data, grouping, rays, occluded);
        }
    }

    fn info(&self) -> AccelInfo {
        let isa = match self.isa.isa() {
            Isa::Avx2 => "avx2",
            Isa::Sse2 => "sse2",
            Isa::Portable => "portable",
        };
        let mode = if self.watertight { "" } else { " fast" };
        AccelInfo {
            name: format!("bvh {isa}{mode}"),
            memory_bytes: self.data.memory_bytes(),
            build_seconds: self.build_seconds,
        }
    }
}
