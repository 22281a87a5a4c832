//! Shapes that rays can hit, their readers and their generators.
//!
//! Knows nothing of materials. An accelerator is built from a slice of [`Shape`]s: the index of a shape in that
//! slice is its `geom_id`.

mod bounds;
mod file_error;
pub mod generate;
mod mesh;
mod number;
pub mod obj;
pub mod ply;
mod source;
mod sphere;
pub mod tessellate;

pub use bounds::Aabb;
pub use file_error::MeshFileError;
pub use generate::Generator;
pub use mesh::{MeshError, TriangleMesh};
pub use source::{Dropped, MeshSource};
pub use sphere::Sphere;

use crate::core::Hit;
use crate::core::lanes::LANES;
use std::sync::Arc;

/// One geometry: what a `geom_id` names.
#[derive(Clone, Debug)]
pub enum Shape {
    /// Triangles; `prim_id` indexes them.
    Mesh(Arc<TriangleMesh>),
    /// Analytic spheres; `prim_id` indexes them.
    Spheres(Arc<[Sphere]>),
}

/// Equal if they are one and the same, or hold the same: then a structure over one answers for the other.
impl PartialEq for Shape {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Mesh(a), Self::Mesh(b)) => Arc::ptr_eq(a, b) || a == b,
            (Self::Spheres(a), Self::Spheres(b)) => Arc::ptr_eq(a, b) || a == b,
            _ => false,
        }
    }
}

impl Shape {
    /// Number of primitives.
    pub fn primitive_count(&self) -> usize {
        match self {
            Self::Mesh(mesh) => mesh.triangle_count(),
            Self::Spheres(spheres) => spheres.len(),
        }
    }

    /// The box around all primitives; empty for a shape without any.
    pub fn bounds(&self) -> Aabb {
        match self {
            Self::Mesh(mesh) => mesh.bounds(),
            Self::Spheres(spheres) => spheres.iter().fold(Aabb::EMPTY, |b, s| b.union(s.bounds())),
        }
    }

    /// Bytes that the shape keeps in memory.
    pub fn memory_bytes(&self) -> usize {
        match self {
            Self::Mesh(mesh) => mesh.memory_bytes(),
            Self::Spheres(spheres) => size_of_val(&spheres[..]),
        }
    }
}

/// Triangles of a mesh from which on it is worth while to ask for what a hit needs before it is needed: fewer stay in
/// the cache.
const WORTH_ASKING: usize = 1 << 13;

/// Asks for the triangles of hits that come eight to sixteen hits later, and for what tells where those are that come
/// after 24: to be called every eight hits with those that are `next`, by number.
#[inline(always)]
pub fn prefetch_hits<'a>(shapes: &[Shape], next: impl Fn(usize) -> Option<&'a Hit>) {
    // Where the very next hit is on a small mesh, the others may be too.
    match next(0) {
        Some(hit) if large_mesh(shapes, hit).is_none() => return,
        _ => {}
    }
    for i in LANES..2 * LANES {
        if let Some(soon) = next(i)
            && let Some(mesh) = large_mesh(shapes, soon)
        {
            mesh.prefetch_corners(soon.prim_id);
        }
        if let Some(later) = next(i + 2 * LANES)
            && let Some(mesh) = large_mesh(shapes, later)
        {
            mesh.prefetch_indices(later.prim_id);
        }
    }
}

/// The mesh of a hit, if it is one that does not stay in the cache.
#[inline(always)]
fn large_mesh<'a>(shapes: &'a [Shape], hit: &Hit) -> Option<&'a TriangleMesh> {
    match &shapes[hit.geom_id as usize] {
        Shape::Mesh(mesh) if mesh.triangle_count() >= WORTH_ASKING => Some(mesh),
        _ => None,
    }
}
