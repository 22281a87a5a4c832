//! Indexed triangle meshes in the layout that an accelerator reads in place.

use super::Aabb;
use crate::core::prefetch;
use glam::{Vec2, Vec3};

/// Why numbers do not make a mesh.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum MeshError {
    /// A triangle names a vertex that is not there.
    #[error("triangle {triangle} uses vertex {vertex}, but there are {count} vertices (the first is 0)")]
    IndexOutOfRange {
        /// Which triangle.
        triangle: usize,
        /// What it names.
        vertex: u32,
        /// How many vertices there are.
        count: usize,
    },
    /// Normals or texture coordinates are not one per vertex.
    #[error("{found} {what} for {expected} vertices: give one per vertex or none")]
    AttributeCount {
        /// `normals` or `texture coordinates`.
        what: &'static str,
        /// How many there are.
        found: usize,
        /// How many there should be.
        expected: usize,
    },
    /// A position, normal or texture coordinate is NaN or infinite.
    #[error("vertex {vertex} has a {what} that is not a finite number")]
    NotFinite {
        /// Which vertex.
        vertex: usize,
        /// `position`, `normal` or `texture coordinate`.
        what: &'static str,
    },
}

/// Triangles over shared vertices, checked once when they are made.
///
/// Positions are followed by one unused vertex, so that a 16-byte load at the last one stays inside the buffer:
/// Embree reads this memory in place.
#[derive(Clone, Debug, PartialEq)]
pub struct TriangleMesh {
    padded_positions: Vec<Vec3>,
    indices: Vec<[u32; 3]>,
    normals: Vec<Vec3>,
    uvs: Vec<Vec2>,
}

impl TriangleMesh {
    /// A mesh of the given vertices; `normals` and `uvs` are empty or one per vertex.
    ///
    /// # Errors
    /// If an index is out of range, an attribute has another count, or a number is not finite.
    pub fn new(
        mut positions: Vec<Vec3>,
        indices: Vec<[u32; 3]>,
        normals: Vec<Vec3>,
        uvs: Vec<Vec2>,
    ) -> Result<Self, MeshError> {
        let expected = positions.len();
        for (what, found) in [("normals", normals.len()), ("texture coordinates", uvs.len())] {
            if found != 0 && found != expected {
                return Err(MeshError::AttributeCount { what, found, expected });
            }
        }
        let bad_vertex = |what, vertex: Option<usize>| match vertex {
            Some(vertex) => Err(MeshError::NotFinite { vertex, what }),
            None => Ok(()),
        };
        bad_vertex("position", positions.iter().position(|p| !p.is_finite()))?;
        bad_vertex("normal", normals.iter().position(|n| !n.is_finite()))?;
        bad_vertex("texture coordinate", uvs.iter().position(|t| !t.is_finite()))?;
        for (triangle, corners) in indices.iter().enumerate() {
            if let Some(&vertex) = corners.iter().find(|&&v| v as usize >= expected) {
                return Err(MeshError::IndexOutOfRange { triangle, vertex, count: expected });
            }
        }
        positions.reserve_exact(1);
        positions.push(Vec3::ZERO);
        Ok(Self { padded_positions: positions, indices, normals, uvs })
    }

    /// The vertices.
    #[inline]
    pub fn positions(&self) -> &[Vec3] {
        &self.padded_positions[..self.padded_positions.len() - 1]
    }

    /// The vertices and one more that nothing refers to.
    pub fn padded_positions(&self) -> &[Vec3] {
        &self.padded_positions
    }

    /// Three vertices per triangle, counter-clockwise as seen from the side of the normal.
    #[inline]
    pub fn indices(&self) -> &[[u32; 3]] {
        &self.indices
    }

    /// One normal per vertex, or none.
    #[inline]
    pub fn normals(&self) -> &[Vec3] {
        &self.normals
    }

    /// One texture coordinate per vertex, or none.
    #[inline]
    pub fn uvs(&self) -> &[Vec2] {
        &self.uvs
    }

    /// Number of triangles.
    #[inline]
    pub fn triangle_count(&self) -> usize {
        self.indices.len()
    }

    /// The corners of a triangle.
    #[inline]
    pub fn triangle(&self, prim_id: u32) -> [Vec3; 3] {
        self.indices[prim_id as usize].map(|v| self.padded_positions[v as usize])
    }

    /// Asks for the numbers of a triangle's corners, to be at hand soon.
    #[inline(always)]
    pub fn prefetch_indices(&self, prim_id: u32) {
        prefetch(&self.indices[prim_id as usize]);
    }

    /// Asks for a triangle's corners, and for their normals where it has any: their numbers should be at hand.
    #[inline(always)]
    pub fn prefetch_corners(&self, prim_id: u32) {
        for v in self.indices[prim_id as usize] {
            prefetch(&self.padded_positions[v as usize]);
            if let Some(normal) = self.normals.get(v as usize) {
                prefetch(normal);
            }
        }
    }

    /// The area of a triangle; from a cross product in f64, where thin triangles do not cancel.
    #[inline]
    pub fn triangle_area(&self, prim_id: u32) -> f32 {
        let [a, b, c] = self.triangle(prim_id).map(Vec3::as_dvec3);
        (0.5 * (b - a).cross(c - a).length()) as f32
    }

    /// The area of all triangles.
    pub fn area(&self) -> f32 {
        (0..self.triangle_count() as u32).map(|i| f64::from(self.triangle_area(i))).sum::<f64>() as f32
    }

    /// The box around the triangles (not around unused vertices).
    pub fn bounds(&self) -> Aabb {
        Aabb::around(self.indices.iter().flatten().map(|&v| self.padded_positions[v as usize]))
    }

    /// Bytes of the buffers.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(&self.padded_positions[..])
            + size_of_val(&self.indices[..])
            + size_of_val(&self.normals[..])
            + size_of_val(&self.uvs[..])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(positions: [Vec3; 3], indices: [u32; 3]) -> Result<TriangleMesh, MeshError> {
        TriangleMesh::new(positions.to_vec(), vec![indices], vec![], vec![])
    }

    #[test]
    fn bad_numbers_are_named() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
        assert!(triangle(corners, [0, 1, 2]).is_ok());
        assert_eq!(
            triangle(corners, [0, 1, 3]),
            Err(MeshError::IndexOutOfRange { triangle: 0, vertex: 3, count: 3 })
        );
        let not_finite = triangle([Vec3::ZERO, Vec3::NAN, Vec3::Y], [0, 1, 2]);
        assert_eq!(not_finite, Err(MeshError::NotFinite { vertex: 1, what: "position" }));
        let one_normal = TriangleMesh::new(corners.to_vec(), vec![[0, 1, 2]], vec![Vec3::Z], vec![]);
        assert_eq!(one_normal, Err(MeshError::AttributeCount { what: "normals", found: 1, expected: 3 }));
    }

    #[test]
    fn areas_do_not_cancel() {
        // A right triangle with legs 1 and 2^-20, far enough off that products of its coordinates lose the short leg.
        let far = Vec3::new(1.0, 1.0, 1.0);
        let thin =
            triangle([far, far + Vec3::X, far + Vec3::X + 2.0_f32.powi(-20) * Vec3::Y], [0, 1, 2]).unwrap();
        assert_eq!(thin.triangle_area(0), 2.0_f32.powi(-21));
        assert_eq!(thin.area(), 2.0_f32.powi(-21));
    }

    #[test]
    fn the_padding_is_not_part_of_the_mesh() {
        let mesh = triangle([Vec3::ONE, Vec3::ONE + Vec3::X, Vec3::ONE + Vec3::Y], [0, 1, 2]).unwrap();
        assert_eq!(mesh.positions().len(), 3);
        assert_eq!(mesh.padded_positions().len(), 4);
        assert_eq!(mesh.bounds().min, Vec3::ONE);
    }
}
