//! Meshes as files and formulas give them, before they move to the unit world.

use super::{MeshError, TriangleMesh};
use glam::{DAffine3, DMat3, DVec3, Vec2, Vec3};
use rayon::prelude::*;

/// A triangle mesh in the coordinates of its file, in f64: far from the origin it keeps its shape until
/// [`to_mesh`](Self::to_mesh) moves it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshSource {
    /// Vertices.
    pub positions: Vec<DVec3>,
    /// Three vertices per triangle, counter-clockwise as seen from outside.
    pub indices: Vec<[u32; 3]>,
    /// One normal per vertex, or none.
    pub normals: Vec<Vec3>,
    /// One texture coordinate per vertex, or none.
    pub uvs: Vec<Vec2>,
}

/// Triangles that [`MeshSource::to_mesh`] left out because nothing can hit them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dropped {
    /// Triangles without area: equal or collinear corners, or a transform that flattens them.
    pub zero_area: usize,
    /// Triangles that have an area in f64 and none in f32: too small for the size of the world.
    pub too_small: usize,
}

impl Dropped {
    /// All of them.
    pub fn total(self) -> usize {
        self.zero_area + self.too_small
    }
}

impl MeshSource {
    /// The box around the transformed triangles (not around unused vertices), as least and greatest corner;
    /// `min > max` if there are none.
    pub fn bounds_f64(&self, transform: &DAffine3) -> (DVec3, DVec3) {
        let empty = || (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let union = |a: (DVec3, DVec3), b: (DVec3, DVec3)| (a.0.min(b.0), a.1.max(b.1));
        let corners = |triangle: &[u32; 3]| {
            let corners = triangle.iter().filter_map(|&v| self.positions.get(v as usize));
            corners.map(|&p| transform.transform_point3(p)).fold(empty(), |b, p| union(b, (p, p)))
        };
        self.indices.par_iter().map(corners).reduce(empty, union)
    }

    /// The transformed mesh in f32, without the triangles that have no area.
    ///
    /// Normals go by the inverse transpose and become unit vectors (a zero normal stays zero: the triangle's own is
    /// used in its place). A mirroring transform turns the triangles round, so that outside stays outside.
    ///
    /// # Errors
    /// If an index is out of range, an attribute has another count than the vertices, or a number is not finite
    /// (also: too large for an f32).
    pub fn to_mesh(&self, transform: &DAffine3) -> Result<(TriangleMesh, Dropped), MeshError> {
        let count = self.positions.len();
        let stray = |t: &[u32; 3]| t.iter().any(|&v| v as usize >= count);
        if let Some(triangle) = self.indices.par_iter().position_first(stray) {
            let vertex = self.indices[triangle].into_iter().max().unwrap_or(0);
            return Err(MeshError::IndexOutOfRange { triangle, vertex, count });
        }

        // A mirror image keeps its outside if its triangles turn the other way.
        let turn = |[a, b, c]: [u32; 3]| [a, c, b];
        let mirrored = transform.matrix3.determinant() < 0.0;
        let oriented = |t: &[u32; 3]| if mirrored { turn(*t) } else { *t };

        let positions: Vec<Vec3> =
            self.positions.par_iter().map(|&p| transform.transform_point3(p).as_vec3()).collect();
        let flat = |t: &[u32; 3]| !has_area(t.map(|v| positions[v as usize].as_dvec3()));
        let flat_in_f64 =
            |t: &[u32; 3]| !has_area(t.map(|v| transform.transform_point3(self.positions[v as usize])));
        let (zero_area, total) = (self.indices.par_iter().filter(|t| flat(t)))
            .map(|t| (usize::from(flat_in_f64(t)), 1))
            .reduce(|| (0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
        let indices = match total {
            0 => self.indices.par_iter().map(oriented).collect(),
            _ => self.indices.par_iter().filter(|t| !flat(t)).map(oriented).collect(),
        };

        let normal_matrix = inverse_transpose_direction(transform.matrix3);
        let normal = |n: &Vec3| match n.is_finite() {
            true => (normal_matrix * n.as_dvec3()).normalize_or_zero().as_vec3(),
            false => *n,
        };
        let normals = self.normals.par_iter().map(normal).collect();
        let mesh = TriangleMesh::new(positions, indices, normals, self.uvs.clone())?;
        Ok((mesh, Dropped { zero_area, too_small: total - zero_area }))
    }
}

/// Whether a triangle has an area; one with a corner that is not finite has (to be complained of, not dropped).
#[inline]
fn has_area([a, b, c]: [DVec3; 3]) -> bool {
    (b - a).cross(c - a) != DVec3::ZERO
}

/// A positive multiple of the inverse transpose: the matrix of cofactors, with the sign of the determinant.
///
/// It exists for singular matrices too. The matrix is scaled first so that its products neither overflow nor vanish.
fn inverse_transpose_direction(m: DMat3) -> DMat3 {
    let size = m.to_cols_array().into_iter().fold(0.0_f64, |s, x| s.max(x.abs()));
    let m = if size > 0.0 && size.is_finite() { m * size.recip() } else { m };
    let cofactors =
        DMat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis));
    if m.determinant() < 0.0 { -cofactors } else { cofactors }
}
