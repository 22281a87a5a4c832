//! The sphere and the sphere with bumps, both from a subdivided icosahedron.

use super::noise::{fractal_noise, octaves_for};
use crate::geometry::MeshSource;
use glam::DVec3;
use rayon::prelude::*;

/// The corners of a regular icosahedron about the origin, not of unit length.
const CORNERS: [[f64; 3]; 12] = {
    const G: f64 = 1.618_033_988_749_895;
    [
        [-1., G, 0.],
        [1., G, 0.],
        [-1., -G, 0.],
        [1., -G, 0.],
        [0., -1., G],
        [0., 1., G],
        [0., -1., -G],
        [0., 1., -G],
        [G, 0., -1.],
        [G, 0., 1.],
        [-G, 0., -1.],
        [-G, 0., 1.],
    ]
};

/// Its faces, counter-clockwise as seen from outside.
const FACES: [[u32; 3]; 20] = [
    [0, 11, 5],
    [0, 5, 1],
    [0, 1, 7],
    [0, 7, 10],
    [0, 10, 11],
    [1, 5, 9],
    [5, 11, 4],
    [11, 10, 2],
    [10, 7, 6],
    [7, 1, 8],
    [3, 9, 4],
    [3, 4, 2],
    [3, 2, 6],
    [3, 6, 8],
    [3, 8, 9],
    [4, 9, 5],
    [2, 4, 11],
    [6, 2, 10],
    [8, 6, 7],
    [9, 8, 1],
];

/// A unit sphere.
pub(super) fn sphere(triangles: usize) -> MeshSource {
    let (positions, indices) = icosphere(triangles);
    let normals = positions.par_iter().map(|p| p.as_vec3()).collect();
    MeshSource { positions, indices, normals, uvs: vec![] }
}

/// A sphere of mean radius about 0.85 whose radius follows fractal noise, as fine as the triangles can show; the normals are those of the true surface.
pub(super) fn blob(triangles: usize, seed: u64) -> MeshSource {
    const FREQUENCY: f64 = 2.0;
    const HEIGHT: f64 = 0.25;
    let (directions, indices) = icosphere(triangles);
    let octaves = octaves_for(FREQUENCY, (30.0 / triangles.max(1) as f64).sqrt());
    let displaced = |&n: &DVec3| {
        let (value, gradient) = fractal_noise(FREQUENCY * n, octaves, seed);
        let radius = 0.85 + HEIGHT * value;
        // For r(n) n the normal is r n less the gradient of r along the sphere.
        let rise = HEIGHT * FREQUENCY * gradient;
        let normal = radius * n - (rise - n * rise.dot(n));
        (radius * n, normal.normalize().as_vec3())
    };
    let (positions, normals) = directions.par_iter().map(displaced).unzip();
    MeshSource { positions, indices, normals, uvs: vec![] }
}

/// Unit vectors and triangles of an icosahedron whose edges are cut into the number of pieces that gives the
/// count of triangles closest to the given one. Neighbours share their vertices.
fn icosphere(triangles: usize) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let pieces = ((triangles as f64 / 20.0).sqrt().round() as u32).clamp(1, 10_000);
    let edges = edges();
    let corner = |i: u32| DVec3::from_array(CORNERS[i as usize]);
    let between = |a: DVec3, b: DVec3, i: u32, n: u32| a + (b - a) * (f64::from(i) / f64::from(n));

    // First the corners, then the inside of each edge, then the inside of each face by rows.
    let mut points: Vec<DVec3> = (0..12).map(corner).collect();
    for &[a, b] in &edges {
        points.extend((1..pieces).map(|i| between(corner(a), corner(b), i, pieces)));
    }
    for [a, b, c] in FACES.map(|face| face.map(corner)) {
        for row in 2..pieces {
            let (left, right) = (between(a, b, row, pieces), between(a, c, row, pieces));
            points.extend((1..row).map(|i| between(left, right, i, row)));
        }
    }
    points.par_iter_mut().for_each(|p| *p = p.normalize());

    let mut indices = Vec::with_capacity(20 * (pieces * pieces) as usize);
    for (number, face) in (0..).zip(FACES) {
        let vertex = |row, i| face_vertex(&edges, face, number, pieces, row, i);
        for row in 0..pieces {
            for i in 0..=row {
                indices.push([vertex(row, i), vertex(row + 1, i), vertex(row + 1, i + 1)]);
                if i < row {
                    indices.push([vertex(row, i), vertex(row + 1, i + 1), vertex(row, i + 1)]);
                }
            }
        }
    }
    (points, indices)
}

/// The thirty edges, lower corner first.
fn edges() -> Vec<[u32; 2]> {
    let sides = FACES.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    sides.filter(|[a, b]| a < b).collect()
}

/// The vertex at place `i` (0 to `row`) of a row (0 to `pieces`) of a face: row 0 is its first corner.
fn face_vertex(edges: &[[u32; 2]], face: [u32; 3], number: u32, pieces: u32, row: u32, i: u32) -> u32 {
    let on_edge = |a: u32, b: u32, step: u32| {
        let (low, high, step) = if a < b { (a, b, step) } else { (b, a, pieces - step) };
        let edge = edges.iter().position(|e| *e == [low, high]).expect("each side of a face is an edge");
        12 + edge as u32 * (pieces - 1) + step - 1
    };
    let [a, b, c] = face;
    match (row, i) {
        (0, _) => a,
        (_, 0) if row == pieces => b,
        _ if row == pieces && i == row => c,
        (_, 0) => on_edge(a, b, row),
        _ if i == row => on_edge(a, c, row),
        _ if row == pieces => on_edge(b, c, i),
        _ => {
            let inside = (pieces - 1) * (pieces.max(2) - 2) / 2;
            12 + 30 * (pieces - 1) + number * inside + (row - 1) * (row - 2) / 2 + i - 1
        }
    }
}
