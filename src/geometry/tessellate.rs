//! Simple shapes as triangles, in the coordinates of the scene.
//!
//! Flat faces carry no normals (the triangle's own is exact); round ones carry the normals of the true surface, on
//! whose inside the triangles lie. All are closed where the shape is: vertices that share a place share their bits.

use super::MeshSource;
use glam::{DVec2, DVec3, Vec2};
use std::f64::consts::{PI, TAU};

/// Two triangles that span `corner`, `corner + u`, `corner + u + v` and `corner + v`.
///
/// The front is the side that `u x v` points to; texture coordinates run 0 to 1 along the edges.
pub fn rectangle(corner: DVec3, u: DVec3, v: DVec3) -> MeshSource {
    let mut mesh = MeshSource::default();
    mesh.push_quad([corner, corner + u, corner + u + v, corner + v]);
    mesh
}

/// A square of the given half side about `center`, facing `normal` (any length but zero): a finite stand-in for
/// an endless plane.
pub fn plane(center: DVec3, normal: DVec3, half_side: f64) -> MeshSource {
    let (u, v) = normal.normalize().any_orthonormal_pair();
    let (u, v) = (2.0 * half_side * u, 2.0 * half_side * v);
    rectangle(center - 0.5 * (u + v), u, v)
}

/// The axis-aligned box between two opposite corners, in any order; each face has texture coordinates of its own.
pub fn box_(corner: DVec3, opposite: DVec3) -> MeshSource {
    let (low, high) = (corner.min(opposite), corner.max(opposite));
    let at = |x: u8, y: u8, z: u8| {
        let pick = |bit: u8, axis: usize| if bit == 0 { low[axis] } else { high[axis] };
        DVec3::new(pick(x, 0), pick(y, 1), pick(z, 2))
    };
    let mut mesh = MeshSource::default();
    mesh.push_quad([at(0, 0, 0), at(0, 0, 1), at(0, 1, 1), at(0, 1, 0)]);
    mesh.push_quad([at(1, 0, 1), at(1, 0, 0), at(1, 1, 0), at(1, 1, 1)]);
    mesh.push_quad([at(0, 0, 0), at(1, 0, 0), at(1, 0, 1), at(0, 0, 1)]);
    mesh.push_quad([at(0, 1, 1), at(1, 1, 1), at(1, 1, 0), at(0, 1, 0)]);
    mesh.push_quad([at(1, 0, 0), at(0, 0, 0), at(0, 1, 0), at(1, 1, 0)]);
    mesh.push_quad([at(0, 0, 1), at(1, 0, 1), at(1, 1, 1), at(0, 1, 1)]);
    mesh
}

/// A disk about `center`, facing `normal` (any length but zero), as a fan of `segments` (at least 3) triangles.
///
/// Texture coordinates are those of the square around it.
pub fn disk(center: DVec3, normal: DVec3, radius: f64, segments: u32) -> MeshSource {
    let mut mesh = MeshSource::default();
    mesh.push_fan(&Ring::new(normal, segments), center, radius, true);
    mesh
}

/// A cylinder from `base` along `axis` (its direction and its height), of `segments` (at least 3) flat strips with
/// the round surface's normals; `caps` closes both ends.
///
/// Texture coordinates of the side: the turn about the axis and the height, both 0 to 1.
pub fn cylinder(base: DVec3, axis: DVec3, radius: f64, caps: bool, segments: u32) -> MeshSource {
    let ring = Ring::new(axis, segments);
    let mut mesh = MeshSource::default();
    for (i, &direction) in ring.directions.iter().enumerate() {
        let turn = i as f64 / ring.segments() as f64;
        for (center, height) in [(base, 0.0), (base + axis, 1.0)] {
            mesh.positions.push(center + radius * direction);
            mesh.normals.push(direction.as_vec3());
            mesh.uvs.push(DVec2::new(turn, height).as_vec2());
        }
    }
    for i in 0..ring.segments() as u32 {
        let [a, b, c, d] = [2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1];
        mesh.indices.extend([[a, b, c], [a, c, d]]);
    }
    if caps {
        for (center, up) in [(base, false), (base + axis, true)] {
            let first = mesh.positions.len();
            mesh.push_fan(&ring, center, radius, up);
            let facing = if up { axis } else { -axis }.normalize().as_vec3();
            mesh.normals.resize(first, facing);
            mesh.normals.resize(mesh.positions.len(), facing);
        }
    }
    mesh
}

/// A sphere of `segments` (at least 3) meridians and half as many rings (at least 2), poles along y.
///
/// Texture coordinates: longitude and latitude, both 0 to 1, v = 0 at the lower pole.
pub fn sphere_mesh(center: DVec3, radius: f64, segments: u32) -> MeshSource {
    let ring = Ring::new(DVec3::Y, segments);
    let (around, rings) = (ring.segments() as u32, (ring.segments() as u32 / 2).max(2));
    let mut mesh = MeshSource::default();
    for row in 0..=rings {
        let v = f64::from(row) / f64::from(rings);
        let height = if row == rings { 1.0 } else { -(PI * v).cos() };
        let width = if row == 0 || row == rings { 0.0 } else { (PI * v).sin() };
        for (i, &direction) in ring.directions.iter().enumerate() {
            let n = width * direction + height * DVec3::Y;
            mesh.positions.push(center + radius * n);
            mesh.normals.push(n.as_vec3());
            mesh.uvs.push(DVec2::new(i as f64 / f64::from(around), v).as_vec2());
        }
    }
    for row in 0..rings {
        for i in 0..around {
            let a = row * (around + 1) + i;
            let [a, b, c, d] = [a, a + 1, a + around + 2, a + around + 1];
            // At a pole one of the two triangles has no area.
            if row > 0 {
                mesh.indices.push([a, b, c]);
            }
            if row + 1 < rings {
                mesh.indices.push([a, c, d]);
            }
        }
    }
    mesh
}

/// Unit vectors about an axis, counter-clockwise as seen from its tip; the last repeats the first, bit for bit.
struct Ring {
    directions: Vec<DVec3>,
}

impl Ring {
    fn new(axis: DVec3, segments: u32) -> Self {
        let (u, v) = axis.normalize().any_orthonormal_pair();
        let segments = segments.max(3);
        let direction = |i: u32| {
            let (sin, cos) = (TAU * f64::from(i % segments) / f64::from(segments)).sin_cos();
            cos * u + sin * v
        };
        Self { directions: (0..=segments).map(direction).collect() }
    }

    fn segments(&self) -> usize {
        self.directions.len() - 1
    }
}

impl MeshSource {
    /// Adds a quadrilateral, counter-clockwise as seen from its front, with texture coordinates 0 to 1.
    fn push_quad(&mut self, corners: [DVec3; 4]) {
        let a = self.positions.len() as u32;
        self.positions.extend(corners);
        self.uvs.extend([Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y]);
        self.indices.extend([[a, a + 1, a + 2], [a, a + 2, a + 3]]);
    }

    /// Adds a disk (positions, texture coordinates and triangles), facing along the ring's axis or against it.
    fn push_fan(&mut self, ring: &Ring, center: DVec3, radius: f64, along: bool) {
        let hub = self.positions.len() as u32;
        self.positions.push(center);
        self.uvs.push(Vec2::splat(0.5));
        for (i, &direction) in ring.directions.iter().enumerate() {
            let (sin, cos) = (TAU * i as f64 / ring.segments() as f64).sin_cos();
            self.positions.push(center + radius * direction);
            self.uvs.push(DVec2::new(0.5 + 0.5 * cos, 0.5 + 0.5 * sin).as_vec2());
        }
        for i in 1..=ring.segments() as u32 {
            let (a, b) = (hub + i, hub + i + 1);
            self.indices.push(if along { [hub, a, b] } else { [hub, b, a] });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DAffine3;
    use std::collections::HashMap;

    const CENTER: DVec3 = DVec3::new(0.1, -0.7, 1e5);
    const AXIS: DVec3 = DVec3::new(0.3, -2.0, 0.9);

    fn closed_shapes() -> [MeshSource; 4] {
        [
            box_(CENTER, CENTER + DVec3::new(-1.0, 2.0, 3.0)),
            cylinder(CENTER, AXIS, 0.3, true, 17),
            sphere_mesh(CENTER, 0.3, 17),
            sphere_mesh(CENTER, 0.3, 0),
        ]
    }

    /// Six times the volume within the triangles, and twice their area.
    fn volume_and_area(mesh: &MeshSource) -> (f64, f64) {
        mesh.indices.iter().fold((0.0, 0.0), |(volume, area), triangle| {
            let [a, b, c] = triangle.map(|v| mesh.positions[v as usize] - CENTER);
            (volume + a.dot(b.cross(c)), area + (b - a).cross(c - a).length())
        })
    }

    #[test]
    fn closed_shapes_use_each_edge_of_places_once_in_each_direction() {
        for mesh in closed_shapes() {
            let mut edges: HashMap<[[u64; 3]; 2], usize> = HashMap::new();
            let place = |v: u32| mesh.positions[v as usize].to_array().map(f64::to_bits);
            for &[a, b, c] in &mesh.indices {
                for [from, to] in [[a, b], [b, c], [c, a]] {
                    *edges.entry([place(from), place(to)]).or_default() += 1;
                }
            }
            for ([from, to], uses) in &edges {
                assert_eq!((*uses, edges.get(&[*to, *from])), (1, Some(&1)));
            }
        }
    }

    #[test]
    fn volumes_and_areas_approach_those_of_the_shapes() {
        let (radius, height) = (0.3, AXIS.length());
        let disk_area = PI * radius * radius;
        let solids = [
            (box_(CENTER, CENTER + DVec3::new(-1.0, 2.0, 3.0)), 6.0, 22.0),
            (
                cylinder(CENTER, AXIS, radius, true, 1000),
                disk_area * height,
                2.0 * disk_area + TAU * radius * height,
            ),
            (sphere_mesh(CENTER, radius, 1000), 4.0 / 3.0 * disk_area * radius, 4.0 * disk_area),
        ];
        for (mesh, volume, area) in solids {
            let (found_volume, found_area) = volume_and_area(&mesh);
            assert!((found_volume / 6.0 / volume - 1.0).abs() < 2e-5, "{found_volume}");
            assert!((found_area / 2.0 / area - 1.0).abs() < 2e-5, "{found_area}");
        }
        let side = cylinder(CENTER, AXIS, radius, false, 1000);
        assert!((volume_and_area(&side).1 / 2.0 / (TAU * radius * height) - 1.0).abs() < 2e-5);
        assert!((volume_and_area(&disk(CENTER, AXIS, radius, 1000)).1 / 2.0 / disk_area - 1.0).abs() < 2e-5);
        assert!((volume_and_area(&plane(CENTER, AXIS, 3.0)).1 / 2.0 / 36.0 - 1.0).abs() < 1e-12);
    }

    #[test]
    fn flat_shapes_face_the_given_way() {
        let shapes = [
            (rectangle(CENTER, DVec3::X, DVec3::Y), DVec3::Z),
            (plane(CENTER, AXIS, 2.0), AXIS),
            (disk(CENTER, AXIS, 2.0, 5), AXIS),
        ];
        for (mesh, normal) in shapes {
            for triangle in &mesh.indices {
                let [a, b, c] = triangle.map(|v| mesh.positions[v as usize]);
                let found = (b - a).cross(c - a).normalize();
                assert!((found - normal.normalize()).length() < 1e-9, "{found}");
            }
            assert_eq!(mesh.uvs.len(), mesh.positions.len());
        }
    }

    #[test]
    fn round_shapes_have_the_normals_of_the_true_surface() {
        let sphere = sphere_mesh(DVec3::ZERO, 0.3, 17);
        for (p, n) in sphere.positions.iter().zip(&sphere.normals) {
            assert!((n.as_dvec3() - *p / 0.3).length() < 1e-6);
        }
        let tube = cylinder(DVec3::ZERO, 2.0 * DVec3::Y, 0.3, true, 9);
        assert_eq!(tube.normals.len(), tube.positions.len());
        for triangle in &tube.indices {
            let [a, b, c] = triangle.map(|v| tube.positions[v as usize]);
            let flat = (b - a).cross(c - a).normalize();
            for v in triangle.map(|v| v as usize) {
                let (p, n) = (tube.positions[v], tube.normals[v].as_dvec3());
                let expected =
                    if flat.y.abs() > 0.5 { flat } else { (p * DVec3::new(1.0, 0.0, 1.0)).normalize() };
                assert!((n - expected).length() < 1e-6, "{p}: {n} and {expected}");
            }
        }
    }

    #[test]
    fn shapes_have_no_triangle_to_drop() {
        let to_origin = DAffine3::from_translation(-CENTER);
        for mesh in closed_shapes() {
            assert_eq!(mesh.to_mesh(&to_origin).unwrap().1.total(), 0);
        }
    }
}
