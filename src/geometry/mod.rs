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
