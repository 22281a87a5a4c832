//! Triangles over a grid of vertices, open or closed round in both directions.

use rayon::prelude::*;

/// Cells along two directions; vertices are numbered along the second direction first.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grid {
    cells: [usize; 2],
    /// Whether the last cells end at the first vertices, as on a torus.
    closed: bool,
}

impl Grid {
    /// A grid of about so many cells, of which `aspect` times as many lie along the first direction as along the
    /// second.
    pub(super) fn of_cells(count: f64, aspect: f64, closed: bool) -> Self {
        let (least, most) = (if closed { 3.0 } else { 1.0 }, 1e9);
        let second = (count / aspect).sqrt().round().clamp(least, most);
        let first = (count / second).round().clamp(least, most);
        Self { cells: [first as usize, second as usize], closed }
    }

    /// Vertices along each direction.
    fn lines(self) -> [usize; 2] {
        self.cells.map(|n| if self.closed { n } else { n + 1 })
    }

    /// Number of vertices.
    pub(super) fn vertices(self) -> usize {
        let [first, second] = self.lines();
        first * second
    }

    /// Where a vertex is along each direction, 0 to 1.
    pub(super) fn fractions(self, vertex: usize) -> [f64; 2] {
        let row = self.lines()[1];
        [(vertex / row) as f64 / self.cells[0] as f64, (vertex % row) as f64 / self.cells[1] as f64]
    }

    /// Two triangles a cell; their front is the side of (second direction) x (first direction).
    pub(super) fn triangles(self) -> Vec<[u32; 3]> {
        let [rows, row] = self.lines();
        let vertex = |i: usize, j: usize| (i % rows * row + j % row) as u32;
        let cell = |cell: usize| {
            let (i, j) = (cell / self.cells[1], cell % self.cells[1]);
            let [a, b, c, d] = [vertex(i, j), vertex(i, j + 1), vertex(i + 1, j + 1), vertex(i + 1, j)];
            [[a, b, c], [a, c, d]]
        };
        (0..self.cells[0] * self.cells[1]).into_par_iter().flat_map_iter(cell).collect()
    }
}
