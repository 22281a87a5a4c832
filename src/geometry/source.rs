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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::tessellate;
    use glam::DQuat;

    fn sphere() -> MeshSource {
        tessellate::sphere_mesh(DVec3::ZERO, 1.0, 32)
    }

    /// Whether each triangle's front and each normal point away from `center`.
    fn points_outward(mesh: &TriangleMesh, center: Vec3) -> bool {
        let front = (0..mesh.triangle_count() as u32).all(|i| {
            let [a, b, c] = mesh.triangle(i);
            (b - a).cross(c - a).dot(a - center) > 0.0
        });
        front && mesh.positions().iter().zip(mesh.normals()).all(|(p, n)| n.dot(*p - center) > 0.0)
    }

    #[test]
    fn outside_stays_outside_in_a_mirror() {
        let center = DVec3::new(3.0, -2.0, 1.0);
        for scale in [
            DVec3::ONE,
            DVec3::new(-1.0, 2.0, 0.5),
            DVec3::new(-1.0, -2.0, 3.0),
            DVec3::new(-0.1, -10.0, -1.0),
        ] {
            let turn = DQuat::from_rotation_z(0.4) * DQuat::from_rotation_x(2.0);
            let transform = DAffine3::from_scale_rotation_translation(scale, turn, center);
            let (mesh, dropped) = sphere().to_mesh(&transform).unwrap();
            assert_eq!(dropped, Dropped::default());
            assert!(points_outward(&mesh, center.as_vec3()), "{scale}");
        }
    }

    #[test]
    fn normals_go_by_the_inverse_transpose() {
        // A sphere squeezed by 2 in x is the ellipsoid 4 x^2 + y^2 + z^2 = 1 with the gradient (4 x, y, z).
        for size in [1e-200, 1.0, 1e200] {
            let squeeze = DMat3::from_diagonal(size * DVec3::new(0.5, 1.0, 1.0));
            let matrix = inverse_transpose_direction(squeeze);
            for n in sphere().normals {
                let n = n.as_dvec3();
                let expected = (DVec3::new(2.0, 1.0, 1.0) * n).normalize();
                assert!(((matrix * n).normalize() - expected).length() < 1e-12, "{size}");
            }
        }
    }

    #[test]
    fn a_transform_that_flattens_drops_all_triangles() {
        for scale in [DVec3::ZERO, DVec3::X] {
            let (mesh, dropped) = sphere().to_mesh(&DAffine3::from_scale(scale)).unwrap();
            assert_eq!(mesh.triangle_count(), 0);
            assert_eq!(dropped, Dropped { zero_area: sphere().indices.len(), too_small: 0 });
        }
    }

    #[test]
    fn dropped_triangles_are_counted_by_their_reason() {
        let mut mesh = tessellate::rectangle(DVec3::ONE, DVec3::X, DVec3::Y);
        mesh.indices.extend([[0, 1, 1], [2, 2, 2]]);
        // Far from the origin of f32, the smallest triangles lose their area.
        let first = mesh.positions.len() as u32;
        mesh.positions.extend([DVec3::ONE, DVec3::ONE + 1e-9 * DVec3::X, DVec3::ONE + 1e-9 * DVec3::Y]);
        mesh.uvs.extend([Vec2::ZERO; 3]);
        mesh.indices.push([first, first + 1, first + 2]);
        let (kept, dropped) = mesh.to_mesh(&DAffine3::IDENTITY).unwrap();
        assert_eq!((kept.triangle_count(), dropped), (2, Dropped { zero_area: 2, too_small: 1 }));
        assert_eq!(dropped.total(), 3);
    }

    #[test]
    fn wrong_meshes_are_errors_not_panics() {
        let mut stray = sphere();
        stray.indices[7] = [0, 1, 1_000_000];
        let count = stray.positions.len();
        let expected = MeshError::IndexOutOfRange { triangle: 7, vertex: 1_000_000, count };
        assert_eq!(stray.to_mesh(&DAffine3::IDENTITY).unwrap_err(), expected);
        assert!(stray.bounds_f64(&DAffine3::IDENTITY).1.max_element() <= 1.0);

        // What no f32 can hold is not finite.
        let huge = sphere().to_mesh(&DAffine3::from_scale(DVec3::splat(1e39))).unwrap_err();
        assert!(matches!(huge, MeshError::NotFinite { what: "position", .. }), "{huge}");
        let mut normals = sphere();
        normals.normals[3] = Vec3::NAN;
        let expected = MeshError::NotFinite { vertex: 3, what: "normal" };
        assert_eq!(normals.to_mesh(&DAffine3::IDENTITY).unwrap_err(), expected);
    }

    #[test]
    fn bounds_are_those_of_the_moved_triangles() {
        let mut mesh = tessellate::box_(DVec3::ZERO, DVec3::ONE);
        mesh.positions.push(DVec3::splat(1e9));
        let turn = DAffine3::from_rotation_z(std::f64::consts::FRAC_PI_4);
        let (min, max) = mesh.bounds_f64(&(DAffine3::from_translation(1e7 * DVec3::X) * turn));
        let half = 0.5_f64.sqrt();
        assert!((min - DVec3::new(1e7 - half, 0.0, 0.0)).length() < 1e-8, "{min}");
        assert!((max - DVec3::new(1e7 + half, 2.0 * half, 1.0)).length() < 1e-8, "{max}");
        let (min, max) = MeshSource::default().bounds_f64(&turn);
        assert!(min.cmpgt(max).all());
    }
}
