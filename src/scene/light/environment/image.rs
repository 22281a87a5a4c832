//! Environments from lat-long images.

use super::super::{EightSamples, Receivers, Rivals};
use super::cumulative::Cumulative;
use crate::core::lanes::{Floats, LANES, Vectors};
use crate::core::{Rgb, prefetch, warp};
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// Why pixels make no environment.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum EnvironmentImageError {
    /// There is nothing to look at, or the pixels are not a rectangle.
    #[error("an environment of {width} x {height} pixels needs {} and at least one, not {found}", width * height)]
    Size {
        /// Pixels in a row.
        width: usize,
        /// Rows.
        height: usize,
        /// Pixels that there are.
        found: usize,
    },
    /// A pixel is NaN or infinite.
    #[error("pixel ({x}, {y}) of the environment is not a finite number, or becomes none by the scale")]
    NotFinite {
        /// From the left.
        x: usize,
        /// From the top.
        y: usize,
    },
}

/// Radiance from all directions as a lat-long image, and how to sample it by luminance.
///
/// The direction `w` looks up the image at `u = atan2(w.x, -w.z) / 2 pi` (wrapped to `[0, 1)`) from the left and
/// `v = acos(w.y) / pi` from the top: the top row is the zenith +y, the left and right edges are -z, the middle is
/// +z, and the left quarter is +x (the convention of Mitsuba's `envmap`). Radiance is bilinear between the middles
/// of pixels, across the left and right edges too, and constant above the first and below the last row's.
///
/// Sampling follows luminance times the sine of the polar angle, taken at the middles of the pixels and bilinear
/// between them (and zero at the poles). Its density is exact and follows the radiance, so that `le / pdf` hardly varies.
/// Rows, then columns, are chosen by inverting their cumulative sums and not by an alias table: neighbours in the unit
/// square stay neighbours on the sphere, which keeps the stratification of the numbers. With 64 Sobol points the
/// variance of the irradiance from a sky is a tenth to a hundredth of that from independent numbers, which is what an
/// alias table would make of them.
///
/// Where a receiver's own lobes look for light too, the mean is taken off the luminance first (Karlik et al. 2019, *MIS
/// Compensation*): samples go to what is brighter, and lobes find the rest.
#[derive(Clone, Debug, PartialEq)]
pub struct EnvironmentImage {
    width: usize,
    height: usize,
    pixels: Vec<Rgb>,
    /// Sine and cosine of the rotation.
    turn: [f32; 2],
    /// The zenith, the rows of pixels, the nadir.
    grid: Vec<GridRow>,
    /// How directions are chosen beside each kind of [`Rivals`]: by what is bright; by what is brighter than the mean; by what
    /// is brighter than [`SUN`] times that.
    tables: [Table; 3],
}

/// The function that sampling follows, summed up.
#[derive(Clone, Debug, Default, PartialEq)]
struct Table {
    /// Luminance that counts as black.
    level: f32,
    /// Which row of cells. A cell is what lies between the middles of four pixels.
    rows: Cumulative,
    /// Which cell of each row.
    columns: Cumulative,
    /// Row and column of each cell that is chosen among, if those are few: then each is a row of its own, without columns.
    few: Vec<[u32; 2]>,
    /// Mean of the function over the unit square; zero where there is nothing to choose.
    norm: f64,
}

impl Table {
    /// Bytes of the table.
    fn memory_bytes(&self) -> usize {
        self.columns.memory_bytes() + self.rows.memory_bytes() + size_of_val(&self.few[..])
    }

    /// What its function is to be divided by for a density over solid angle, beside the sine of the polar angle: infinite
    /// where there is nothing to choose.
    #[inline(always)]
    fn measure(&self) -> f64 {
        // du dv = dw / (2 pi^2 sin theta).
        if self.norm > 0.0 { self.norm * 2.0 * std::f64::consts::PI.powi(2) } else { f64::INFINITY }
    }
}

/// Eight cells of four pixels each: upper left and right, lower left and right.
#[derive(Default)]
struct Cells {
    /// The function that sampling follows, at the corners.
    weights: [Floats; 4],
    /// Radiance there, by channel.
    le: [[Floats; 3]; 4],
    /// How far down the image the upper and the lower edge are.
    v: [Floats; 2],
    /// Columns from the left.
    column: Floats,
    /// [`Table::measure`].
    measure: [f64; LANES],
}

impl Cells {
    #[inline(always)]
    fn set(&mut self, lane: usize, image: &EnvironmentImage, table: &Table, (row, column): (usize, usize)) {
        let corners = image.corners(row, column);
        let weights = image.by_sine(row, corners, table.level);
        for (k, (le, weight)) in corners.as_flattened().iter().zip(weights.as_flattened()).enumerate() {
            self.weights[k][lane] = *weight;
            let le = le.to_array();
            for channel in 0..3 {
                self.le[k][channel][lane] = le[channel];
            }
        }
        for k in 0..2 {
            self.v[k][lane] = image.grid[row + k].v;
        }
        self.column[lane] = column as f32;
        self.measure[lane] = table.measure();
    }

    /// Radiance by channel and the density of sampling at places in the cells where the polar angle has these sines.
    #[inline(always)]
    fn le_and_pdf(&self, at: &[Floats; 2], sin_theta: &Floats) -> ([Floats; 3], Floats) {
        let (mut le, mut pdf) = ([Floats::default(); 3], Floats::default());
        for i in 0..LANES {
            let at = [at[0][i], at[1][i]];
            let mix = |[a, b, c, d]: [&Floats; 4]| bilinear([[a[i], b[i]], [c[i], d[i]]], at);
            pdf[i] = (f64::from(mix(self.weights.each_ref())) / (self.measure[i] * f64::from(sin_theta[i])))
                as f32;
            for (channel, le) in le.iter_mut().enumerate() {
                let [a, b, c, d] = &self.le;
                le[i] = mix([&a[channel], &b[channel], &c[channel], &d[channel]]);
            }
        }
        (le, pdf)
    }
}

/// A row of points at which radiance is given.
#[derive(Clone, Copy, Debug, PartialEq)]
struct GridRow {
    /// How far down the image, from 0 to 1.
    v: f32,
    /// Sine of the polar angle.
    sin_theta: f32,
}

/// A place between four grid points.
#[derive(Clone, Copy)]
struct Place {
    row: usize,
    column: usize,
    /// From the cell's upper left corner, in cells.
    at: [f32; 2],
}

/// How many times brighter than the mean a sun is: of what is less bright, few rays find enough.
const SUN: f32 = 8.0;

/// Polar angles nearer to a pole than this, in radians, count as this far: there the density is 0 / 0.
const POLE: f32 = 1e-6;

/// Sum of the four, weighted bilinearly.
#[inline(always)]
fn bilinear<T: std::ops::Mul<f32, Output = T> + std::ops::Add<Output = T>>(
    [top, bottom]: [[T; 2]; 2],
    [s, t]: [f32; 2],
) -> T {
    let [[a, b], [c, d]] = [top, bottom];
    (a * (1.0 - s) + b * s) * (1.0 - t) + (c * (1.0 - s) + d * s) * t
}

/// Inverts the integral of the linear function from `a` at 0 to `b` at 1, both at least 0.
#[inline(always)]
fn invert_linear(x: f64, a: f32, b: f32) -> f32 {
    let (a, b) = (f64::from(a), f64::from(b));
    let end = a + (a * a + x * (b * b - a * a)).max(0.0).sqrt();
    if end > 0.0 { (x * (a + b) / end) as f32 } else { x as f32 }
}

impl EnvironmentImage {
    /// From linear `pixels`, row by row from the top, multiplied by `scale`. Negative numbers become zero.
    /// `rotation_deg` turns the environment about +y, counter-clockwise as seen from above.
    ///
    /// # Errors
    /// If there is no pixel, their count is not `width * height`, or one is not a finite number.
    pub fn new(
        width: usize,
        height: usize,
        mut pixels: Vec<Rgb>,
        rotation_deg: f32,
        scale: f32,
    ) -> Result<Self, EnvironmentImageError> {
        if pixels.is_empty() || width.checked_mul(height) != Some(pixels.len()) {
            return Err(EnvironmentImageError::Size { width, height, found: pixels.len() });
        }
        pixels.iter_mut().for_each(|pixel| *pixel *= scale);
        if let Some(i) = pixels.iter().position(|pixel| !pixel.is_finite()) {
            return Err(EnvironmentImageError::NotFinite { x: i % width, y: i / width });
        }
        pixels.iter_mut().for_each(|pixel| *pixel = pixel.map(|v| v.max(0.0)));
        let (sin, cos) = rotation_deg.to_radians().sin_cos();
        let grid = (0..height + 2).map(|k| {
            let v = grid_row(k, height);
            GridRow { v, sin_theta: (PI * v).sin().max(0.0) }
        });
        let mut image = Self {
            width,
            height,
            pixels,
            turn: [sin, cos],
            grid: grid.collect(),
            tables: Default::default(),
        };
        let mean = image.mean().luminance();
        image.tables =
            [image.tabulate(0.0), image.tabulate(mean * (1.0 + 1e-4)), image.tabulate_few(mean * SUN)];
        Ok(image)
    }

    /// Whether nothing is so much brighter than the rest that it would have to be sampled beside these rivals.
    pub(super) fn is_even(&self, rivals: Rivals) -> bool {
        rivals != Rivals::None && self.table(rivals).norm == 0.0
    }

    /// Luminance of what is brighter than all that is left to other ways than sampling lights.
    pub(super) fn sun(&self) -> f32 {
        self.table(Rivals::Portals).level
    }

    #[inline(always)]
    fn table(&self, rivals: Rivals) -> &Table {
        &self.tables[rivals as usize]
    }

    /// Sums up the luminance above `level`.
    fn tabulate(&self, level: f32) -> Table {
        let (width, height) = (self.width, self.height);
        let mut weights = vec![0.0; width * (height + 1)];
        for (row, weights) in weights.chunks_exact_mut(width).enumerate() {
            for (column, weight) in weights.iter_mut().enumerate() {
                *weight = self.mean_density(row, column, level);
            }
        }
        let (columns, mut rows) = Cumulative::new(weights, width);
        for (row, weight) in rows.iter_mut().enumerate() {
            *weight *= self.cell_area(row);
        }
        let (rows, total) = Cumulative::new(rows, height + 1);
        Table { level, rows, columns, few: vec![], norm: total[0] }
    }

    /// Sums up the luminance above a `level` that few cells are above.
    fn tabulate_few(&self, level: f32) -> Table {
        let (mut few, mut weights) = (vec![], vec![]);
        let is_bright = |row: &[Rgb]| row.iter().any(|pixel| pixel.luminance() > level);
        let bright: Vec<bool> = self.pixels.chunks_exact(self.width).map(is_bright).collect();
        for row in 0..=self.height {
            // Its cells lie between two rows of pixels.
            let [above, below] = [row.max(1) - 1, row.min(self.height - 1)];
            if !bright[above] && !bright[below] {
                continue;
            }
            for column in 0..self.width {
                let density = self.mean_density(row, column, level);
                if density > 0.0 {
                    few.push([row as u32, column as u32]);
                    weights.push(density * self.cell_area(row));
                }
            }
        }
        if few.is_empty() {
            return Table { level, ..Table::default() };
        }
        let (rows, total) = Cumulative::new(weights, few.len());
        Table { level, rows, columns: Cumulative::default(), few, norm: total[0] }
    }

    /// The pixel at grid row `k` (0 and `height + 1` are the poles), column `i` (may be `width`: the first again).
    #[inline]
    fn pixel(&self, k: usize, i: usize) -> &Rgb {
        let y = k.clamp(1, self.height) - 1;
        let x = if i == self.width { 0 } else { i };
        &self.pixels[y * self.width + x]
    }

    /// Radiance at the four corners of a cell.
    #[inline(always)]
    fn corners(&self, row: usize, column: usize) -> [[Rgb; 2]; 2] {
        let at = |k, i| *self.pixel(k, i);
        [[at(row, column), at(row, column + 1)], [at(row + 1, column), at(row + 1, column + 1)]]
    }

    /// The mean of the function that sampling follows over a cell.
    #[inline]
    fn mean_density(&self, row: usize, column: usize, level: f32) -> f64 {
        let corners = self.by_sine(row, self.corners(row, column), level);
        0.25 * corners.as_flattened().iter().map(|&weight| f64::from(weight)).sum::<f64>()
    }

    /// The area of each cell of a row in the unit square.
    fn cell_area(&self, row: usize) -> f64 {
        f64::from(self.grid[row + 1].v - self.grid[row].v) / self.width as f64
    }

    /// Luminance above `level` times the sine of the polar angle, of the corners of a cell.
    #[inline(always)]
    fn by_sine(&self, row: usize, [[a, b], [c, d]]: [[Rgb; 2]; 2], level: f32) -> [[f32; 2]; 2] {
        let above = |pixel: Rgb| (pixel.luminance() - level).max(0.0);
        let [top, bottom] = [self.grid[row].sin_theta, self.grid[row + 1].sin_theta];
        [[above(a) * top, above(b) * top], [above(c) * bottom, above(d) * bottom]]
    }

    /// Where a direction looks up the image: in cells from the left, and down as a fraction; and the sine of its polar angle.
    #[inline(always)]
    fn look_up(&self, wi: Vec3) -> (f32, f32, f32) {
        let [sin, cos] = self.turn;
        let (x, z) = (cos * wi.x - sin * wi.z, sin * wi.x + cos * wi.z);
        let length = (x * x + z * z).sqrt();
        let sin_theta = if length > POLE { length } else { POLE };
        // Cell columns start at the middle of the first pixel.
        let width = self.width as f32;
        let s = warp::turns(Vec2::new(-z, x)) * width - 0.5;
        (if s < 0.0 { s + width } else { s }, 2.0 * warp::turns(Vec2::new(wi.y, sin_theta)), sin_theta)
    }

    /// The place that [`look_up`](Self::look_up) tells of.
    #[inline(always)]
    fn place(&self, s: f32, v: f32) -> Place {
        let column = (s as usize).min(self.width - 1);
        let row = ((v * self.height as f32 + 0.5) as usize).min(self.height);
        let [above, below] = [self.grid[row].v, self.grid[row + 1].v];
        let t = (v - above) / (below - above);
        Place { row, column, at: [(s - column as f32).clamp(0.0, 1.0), t.clamp(0.0, 1.0)] }
    }

    /// Radiance from the unit direction `wi`.
    #[inline]
    pub fn le(&self, wi: Vec3) -> Rgb {
        let (s, v, _) = self.look_up(wi);
        let Place { row, column, at } = self.place(s, v);
        bilinear(self.corners(row, column), at)
    }

    /// Radiance from eight unit directions, by channel, and the density of [`sample_eight`](Self::sample_eight) there.
    #[inline(always)]
    pub(in super::super) fn le_and_pdf_eight(&self, to: &Receivers, wi: &Vectors) -> ([Floats; 3], Floats) {
        let [mut s, mut v, mut sin_theta] = [Floats::default(); 3];
        for i in 0..LANES {
            (s[i], v[i], sin_theta[i]) = self.look_up(wi.get(i));
        }
        let (mut cells, mut at) = (Cells::default(), [Floats::default(); 2]);
        let mut places = [Place { row: 0, column: 0, at: [0.0; 2] }; LANES];
        for i in to.lanes() {
            places[i] = self.place(s[i], v[i]);
            for k in [places[i].row, places[i].row + 1] {
                prefetch(self.pixel(k, places[i].column));
            }
        }
        for i in to.lanes() {
            let Place { row, column, at: [s, t] } = places[i];
            cells.set(i, self, self.table(to.rivals[i]), (row, column));
            (at[0][i], at[1][i]) = (s, t);
        }
        cells.le_and_pdf(&at, &sin_theta)
    }

    /// Directions by luminance for the receivers in `lanes`, the radiance from there, and the density over solid angle.
    ///
    /// Each step for all of them before the next, so that they wait for memory together.
    #[inline(always)]
    pub(super) fn sample_eight(
        &self,
        to: &Receivers,
        u: &[[f64; LANES]; 2],
        lanes: [bool; LANES],
    ) -> EightSamples {
        let table = |lane: usize| self.table(to.rivals[lane]);
        let lanes = || (0..LANES).filter(move |&lane| lanes[lane]);
        let (mut row, mut column, mut between) = ([0; LANES], [0; LANES], [[0; 2]; LANES]);
        let mut rest = [[0.0; LANES]; 2];
        for i in lanes() {
            let rows = &table(i).rows;
            (row[i], rest[1][i]) = rows.find(0, rows.between(0, u[1][i]), u[1][i]);
            match table(i).few.get(row[i]) {
                Some(cell) => {
                    [row[i], column[i]] = cell.map(|at| at as usize);
                    rest[0][i] = u[0][i];
                }
                None => table(i).columns.prefetch_guide(row[i], u[0][i]),
            }
        }
        let in_rows = || lanes().filter(|&lane| table(lane).few.is_empty());
        for i in in_rows() {
            between[i] = table(i).columns.between(row[i], u[0][i]);
            table(i).columns.prefetch_sums(row[i], between[i]);
        }
        for i in in_rows() {
            (column[i], rest[0][i]) = table(i).columns.find(row[i], between[i], u[0][i]);
        }
        for i in lanes() {
            for k in [row[i], row[i] + 1] {
                prefetch(self.pixel(k, column[i]));
            }
        }
        let mut cells = Cells::default();
        for i in lanes() {
            cells.set(i, self, table(i), (row[i], column[i]));
        }
        self.directions(&cells, &rest)
    }

    /// Directions within cells, by two numbers each.
    #[inline(always)]
    fn directions(&self, cells: &Cells, [x, y]: &[[f64; LANES]; 2]) -> EightSamples {
        let (mut samples, mut at) = (EightSamples::default(), [Floats::default(); 2]);
        let (mut v, mut sines) = (Floats::default(), Floats::default());
        for i in 0..LANES {
            // Within the cell: the height by the sums of both sides, then along the line.
            let [a, b, c, d] = &cells.weights;
            let (a, b, c, d) = (a[i], b[i], c[i], d[i]);
            let t = invert_linear(y[i], a + b, c + d);
            at[0][i] = invert_linear(x[i], a + (c - a) * t, b + (d - b) * t);
            at[1][i] = t;
            v[i] = cells.v[0][i] + t * (cells.v[1][i] - cells.v[0][i]);
        }
        let ([sin, cos], width) = (self.turn, self.width as f32);
        for i in 0..LANES {
            let theta = warp::unit_vector(0.5 * v[i]);
            let phi = warp::unit_vector((cells.column[i] + 0.5 + at[0][i]) / width);
            let (x, z) = (theta.y * phi.y, -theta.y * phi.x);
            samples.wi.set(i, Vec3::new(cos * x + sin * z, theta.x, cos * z - sin * x).normalize());
            sines[i] = if theta.y > POLE { theta.y } else { POLE };
        }
        let (le, pdf) = cells.le_and_pdf(&at, &sines);
        for i in 0..LANES {
            for channel in 0..3 {
                samples.le_over_pdf[channel][i] = le[channel][i] / pdf[i];
            }
            samples.there[i] = pdf[i] > 0.0;
        }
        EightSamples { pdf, t_max: [f32::INFINITY; LANES], shadow: [true; LANES], ..samples }
    }

    /// Mean radiance of all directions.
    pub(super) fn mean(&self) -> Rgb {
        let mut sum = [0.0f64; 3];
        let mut weights = 0.0;
        for (row, sin) in self.pixels.chunks_exact(self.width).zip(&self.grid[1..]) {
            let sin = f64::from(sin.sin_theta);
            weights += sin * self.width as f64;
            for pixel in row {
                let pixel = pixel.to_array();
                sum = [0, 1, 2].map(|c| sum[c] + sin * f64::from(pixel[c]));
            }
        }
        Rgb::from(sum.map(|s| (s / weights) as f32))
    }

    /// Bytes of the pixels and the tables.
    pub fn memory_bytes(&self) -> usize {
        let tables = self.tables.each_ref().map(Table::memory_bytes);
        size_of_val(&self.pixels[..]) + tables.iter().sum::<usize>()
    }
}

/// How far down the image grid row `k` is: the zenith at 0, the middles of the rows of pixels, the nadir at 1.
#[inline]
fn grid_row(k: usize, height: usize) -> f32 {
    if k == 0 {
        0.0
    } else if k > height {
        1.0
    } else {
        (k as f32 - 0.5) / height as f32
    }
}
