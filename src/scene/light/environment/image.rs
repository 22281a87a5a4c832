//! Environments from lat-long images.

use super::super::Receiver;
use super::cumulative::Cumulative;
use crate::core::Rgb;
use glam::Vec3;
use std::f32::consts::{FRAC_1_PI, PI, TAU};

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
    /// Sine of the polar angle of each grid row: the zenith, the rows of pixels, the nadir.
    sin_theta: Vec<f32>,
    /// How directions are chosen for receivers that nothing else finds the light for.
    all: Table,
    /// How they are chosen where lobes look for light themselves: by what is brighter than the mean.
    bright: Table,
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
    /// Mean of the function over the unit square; zero where there is nothing to choose.
    norm: f64,
}

/// A place between four grid points.
#[derive(Clone, Copy)]
struct Place {
    row: usize,
    column: usize,
    /// From the cell's upper left corner, in cells.
    at: [f32; 2],
}

/// Polar angles nearer to a pole than this, in radians, count as this far: there the density is 0 / 0.
const POLE: f32 = 1e-6;

/// Sum of the four, weighted bilinearly.
#[inline]
fn bilinear<T: std::ops::Mul<f32, Output = T> + std::ops::Add<Output = T>>(
    [top, bottom]: [[T; 2]; 2],
    [s, t]: [f32; 2],
) -> T {
    let [[a, b], [c, d]] = [top, bottom];
    (a * (1.0 - s) + b * s) * (1.0 - t) + (c * (1.0 - s) + d * s) * t
}

/// Inverts the integral of the linear function from `a` at 0 to `b` at 1, both at least 0.
#[inline]
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
        let sin_theta = (0..height + 2).map(|k| (PI * grid_row(k, height)).sin().max(0.0)).collect();
        let mut image = Self {
            width,
            height,
            pixels,
            turn: [sin, cos],
            sin_theta,
            all: Table::default(),
            bright: Table::default(),
        };
        image.all = image.tabulate(0.0);
        image.bright = image.tabulate(image.mean().luminance() * (1.0 + 1e-4));
        Ok(image)
    }

    /// Whether nothing is brighter than the rest.
    pub(super) fn is_even(&self) -> bool {
        self.bright.norm == 0.0
    }

    /// The table for a receiver.
    #[inline]
    fn table(&self, to: &Receiver) -> &Table {
        if to.lobes_look { &self.bright } else { &self.all }
    }

    /// Sums up the luminance above `level`.
    fn tabulate(&self, level: f32) -> Table {
        let (width, height) = (self.width, self.height);
        let mut weights = vec![0.0; width * (height + 1)];
        for (row, weights) in weights.chunks_exact_mut(width).enumerate() {
            for (column, weight) in weights.iter_mut().enumerate() {
                let [[a, b], [c, d]] = self.density_corners(row, column, level).map(|r| r.map(f64::from));
                *weight = 0.25 * (a + b + c + d);
            }
        }
        let (columns, mut rows) = Cumulative::new(weights, width);
        for (row, weight) in rows.iter_mut().enumerate() {
            *weight *= f64::from(grid_row(row + 1, height) - grid_row(row, height)) / width as f64;
        }
        let (rows, total) = Cumulative::new(rows, height + 1);
        Table { level, rows, columns, norm: total[0] }
    }

    /// The pixel at grid row `k` (0 and `height + 1` are the poles), column `i` (may be `width`: the first again).
    #[inline]
    fn pixel(&self, k: usize, i: usize) -> Rgb {
        let y = k.clamp(1, self.height) - 1;
        let x = if i == self.width { 0 } else { i };
        self.pixels[y * self.width + x]
    }

    /// Radiance at the four corners of a cell.
    #[inline]
    fn corners(&self, row: usize, column: usize) -> [[Rgb; 2]; 2] {
        [row, row + 1].map(|k| [column, column + 1].map(|i| self.pixel(k, i)))
    }

    /// The function that sampling follows, at the four corners of a cell.
    #[inline]
    fn density_corners(&self, row: usize, column: usize, level: f32) -> [[f32; 2]; 2] {
        self.by_sine(row, self.corners(row, column), level)
    }

    /// Luminance above `level` times the sine of the polar angle, of the corners of a cell.
    #[inline]
    fn by_sine(&self, row: usize, [top, bottom]: [[Rgb; 2]; 2], level: f32) -> [[f32; 2]; 2] {
        let above = |pixel: Rgb| (pixel.luminance() - level).max(0.0);
        [
            top.map(|pixel| above(pixel) * self.sin_theta[row]),
            bottom.map(|pixel| above(pixel) * self.sin_theta[row + 1]),
        ]
    }

    /// Where a direction looks up the image, and the sine of its polar angle.
    #[inline]
    fn place(&self, wi: Vec3) -> (Place, f32) {
        let [sin, cos] = self.turn;
        let (x, z) = (cos * wi.x - sin * wi.z, sin * wi.x + cos * wi.z);
        let sin_theta = (x * x + z * z).sqrt().max(POLE);
        // Cell columns start at the middle of the first pixel.
        let s = (x.atan2(-z) * (1.0 / TAU)).rem_euclid(1.0) * self.width as f32 - 0.5;
        let s = if s < 0.0 { s + self.width as f32 } else { s };
        let column = (s as usize).min(self.width - 1);
        let v = sin_theta.atan2(wi.y) * FRAC_1_PI;
        let row = ((v * self.height as f32 + 0.5) as usize).min(self.height);
        let [above, below] = [row, row + 1].map(|k| grid_row(k, self.height));
        let t = (v - above) / (below - above);
        (Place { row, column, at: [s - column as f32, t].map(|x| x.clamp(0.0, 1.0)) }, sin_theta)
    }

    /// Radiance from the unit direction `wi`.
    #[inline]
    pub fn le(&self, wi: Vec3) -> Rgb {
        let (Place { row, column, at }, _) = self.place(wi);
        bilinear(self.corners(row, column), at)
    }

    /// The density of [`sample`](Self::sample) over solid angle.
    #[inline]
    pub(super) fn pdf(&self, to: &Receiver, wi: Vec3) -> f32 {
        let (place, sin_theta) = self.place(wi);
        self.density(self.table(to), self.corners(place.row, place.column), place, sin_theta)
    }

    /// Both [`le`](Self::le) and [`pdf`](Self::pdf).
    #[inline]
    pub(super) fn le_and_pdf(&self, to: &Receiver, wi: Vec3) -> (Rgb, f32) {
        let (place, sin_theta) = self.place(wi);
        let corners = self.corners(place.row, place.column);
        (bilinear(corners, place.at), self.density(self.table(to), corners, place, sin_theta))
    }

    #[inline]
    fn density(&self, table: &Table, corners: [[Rgb; 2]; 2], place: Place, sin_theta: f32) -> f32 {
        let value = f64::from(bilinear(self.by_sine(place.row, corners, table.level), place.at));
        // du dv = dw / (2 pi^2 sin theta).
        (value / (table.norm * 2.0 * std::f64::consts::PI.powi(2) * f64::from(sin_theta))) as f32
    }

    /// A direction by luminance, the radiance from there, and the density of the direction over solid angle.
    #[inline]
    pub(super) fn sample(&self, to: &Receiver, [x, y]: [f64; 2]) -> (Vec3, Rgb, f32) {
        let table = self.table(to);
        let (row, y) = table.rows.invert(0, y);
        let (column, x) = table.columns.invert(row, x);

        // Within the cell: the height by the sums of both sides, then along the line.
        let corners = self.corners(row, column);
        let [[a, b], [c, d]] = self.by_sine(row, corners, table.level);
        let t = invert_linear(y, a + b, c + d);
        let s = invert_linear(x, a + (c - a) * t, b + (d - b) * t);

        let [above, below] = [row, row + 1].map(|k| grid_row(k, self.height));
        let (sin_theta, cos_theta) = (PI * (above + t * (below - above))).sin_cos();
        let (sin_phi, cos_phi) = (TAU * ((column as f32 + 0.5 + s) / self.width as f32)).sin_cos();
        let (x, z) = (sin_theta * sin_phi, -sin_theta * cos_phi);
        let [sin, cos] = self.turn;
        let wi = Vec3::new(cos * x + sin * z, cos_theta, cos * z - sin * x).normalize();
        let place = Place { row, column, at: [s, t] };
        (wi, bilinear(corners, place.at), self.density(table, corners, place, sin_theta.max(POLE)))
    }

    /// Mean radiance of all directions.
    pub(super) fn mean(&self) -> Rgb {
        let mut sum = [0.0f64; 3];
        let mut weights = 0.0;
        for (row, sin) in self.pixels.chunks_exact(self.width).zip(&self.sin_theta[1..]) {
            let sin = f64::from(*sin);
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
        let tables = [&self.all, &self.bright].map(|t| t.columns.memory_bytes() + t.rows.memory_bytes());
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
