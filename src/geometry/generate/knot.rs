//! The tube about a torus knot.

use super::grid::Grid;
use crate::geometry::MeshSource;
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Radii of the torus that the knot lies on and of the tube about it: together 1.
const MAJOR: f64 = 0.62;
const MINOR: f64 = 0.27;
const TUBE: f64 = 0.11;

/// Turns about the axis and about the torus; seed 0 is the trefoil.
const KNOTS: [[f64; 2]; 5] = [[2.0, 3.0], [2.0, 5.0], [3.0, 4.0], [3.0, 2.0], [3.0, 5.0]];

/// A closed tube about a torus knot in the xz plane; the normals are those of the round tube.
pub(super) fn knot(triangles: usize, seed: u64) -> MeshSource {
    let turns = KNOTS[(seed % KNOTS.len() as u64) as usize];
    // The cells are about square if the tube's length over its girth is the ratio of their numbers.
    let length = (0..1000).map(|i| tangent(turns, f64::from(i) / 1000.0).length() / 1000.0).sum::<f64>();
    let grid = Grid::of_cells(triangles as f64 / 2.0, length / (TAU * TUBE), true);

    let vertex = |i: usize| {
        let [along, around] = grid.fractions(i);
        let (center, out) = center_and_out(turns, along);
        let side = tangent(turns, along).normalize().cross(out);
        let (sin, cos) = (TAU * around).sin_cos();
        let normal = cos * out + sin * side;
        (center + TUBE * normal, normal.as_vec3())
    };
    let (positions, normals) = (0..grid.vertices()).into_par_iter().map(vertex).unzip();
    MeshSource { positions, indices: grid.triangles(), normals, uvs: vec![] }
}

/// The point of the knot at parameter t in 0..1, and there the unit normal of the torus.
fn center_and_out([p, q]: [f64; 2], t: f64) -> (DVec3, DVec3) {
    let ((sin_p, cos_p), (sin_q, cos_q)) = ((TAU * p * t).sin_cos(), (TAU * q * t).sin_cos());
    let out = DVec3::new(cos_q * cos_p, sin_q, cos_q * sin_p);
    (MAJOR * DVec3::new(cos_p, 0.0, sin_p) + MINOR * out, out)
}

/// The derivative of the point by t: at right angles to the normal of the torus.
fn tangent([p, q]: [f64; 2], t: f64) -> DVec3 {
    let ((sin_p, cos_p), (sin_q, cos_q)) = ((TAU * p * t).sin_cos(), (TAU * q * t).sin_cos());
    let about_axis = (MAJOR + MINOR * cos_q) * DVec3::new(-sin_p, 0.0, cos_p);
    let about_torus = MINOR * DVec3::new(-sin_q * cos_p, cos_q, -sin_q * sin_p);
    TAU * (p * about_axis + q * about_torus)
}
