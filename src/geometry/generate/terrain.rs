//! Fractal hills.

use super::grid::Grid;
use super::noise::{fractal_noise, octaves_for};
use crate::geometry::MeshSource;
use glam::{DVec2, DVec3};
use rayon::prelude::*;

/// A square from -1 to 1 in x and z, with y the height: a fractal sum of noise, as fine as
/// the triangles can show. Normals point up and are those of
/// the true surface; texture coordinates run 0 to 1 along x and z.
pub(super) fn terrain(triangles: usize, seed: u64) -> MeshSource {
    const FREQUENCY: f64 = 1.5;
    const HEIGHT: f64 = 0.3;
    // Through the noise in a plane that no octave has lattice points in: there noise is zero.
    const SLICE: f64 = 0.37;
    let grid = Grid::of_cells(triangles as f64 / 2.0, 1.0, false);
    let octaves = octaves_for(FREQUENCY, (8.0 / triangles.max(1) as f64).sqrt());
    let vertex = |i: usize| {
        let [x, z] = grid.fractions(i);
        let (x, z) = (2.0 * x - 1.0, 2.0 * z - 1.0);
        let (value, gradient) = fractal_noise(DVec3::new(FREQUENCY * x, SLICE, FREQUENCY * z), octaves, seed);
        let slope = HEIGHT * FREQUENCY * gradient;
        (DVec3::new(x, HEIGHT * value, z), DVec3::new(-slope.x, 1.0, -slope.z).normalize().as_vec3())
    };
    let count = grid.vertices();
    let (positions, normals) = (0..count).into_par_iter().map(vertex).unzip();
    let uvs = (0..count).into_par_iter().map(|i| DVec2::from_array(grid.fractions(i)).as_vec2()).collect();
    MeshSource { positions, indices: grid.triangles(), normals, uvs }
}
