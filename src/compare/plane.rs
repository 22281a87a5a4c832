//! One channel of a picture, and convolution by separable kernels.

use rayon::prelude::*;

/// One number per pixel.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Plane {
    /// Columns.
    pub(super) width: usize,
    /// Row by row.
    pub(super) data: Vec<f32>,
}

impl Plane {
    /// `value(i)` for the pixel number `i`, row by row.
    pub(super) fn from_pixels(width: u32, height: u32, value: impl Fn(usize) -> f32 + Sync + Send) -> Self {
        let count = width as usize * height as usize;
        Self { width: width as usize, data: (0..count).into_par_iter().map(value).collect() }
    }
}

/// Correlates with `along_row` in x and `along_column` in y; beyond its borders the picture goes on as at them.
///
/// Both kernels have an odd number of weights, the middle one for the pixel itself.
pub(super) fn separable(plane: &Plane, along_row: &[f32], along_column: &[f32]) -> Plane {
    if plane.data.is_empty() {
        return plane.clone();
    }
    let width = plane.width;
    let mut rows = vec![0.0; plane.data.len()];
    rows.par_chunks_mut(width).zip(plane.data.par_chunks(width)).for_each_init(
        Vec::new,
        |padded, (out, row)| {
            let radius = along_row.len() / 2;
            padded.clear();
            padded.resize(radius, row[0]);
            padded.extend_from_slice(row);
            padded.resize(width + 2 * radius, row[width - 1]);
            for (shift, weight) in along_row.iter().enumerate() {
                add_scaled(out, *weight, &padded[shift..shift + width]);
            }
        },
    );
    let height = rows.len() / width;
    let radius = along_column.len() / 2;
    let mut data = vec![0.0; rows.len()];
    data.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
        for (shift, weight) in along_column.iter().enumerate() {
            let source = (y + shift).saturating_sub(radius).min(height - 1);
            add_scaled(out, *weight, &rows[source * width..(source + 1) * width]);
        }
    });
    Plane { width, data }
}

fn add_scaled(out: &mut [f32], weight: f32, row: &[f32]) {
    for (out, value) in out.iter_mut().zip(row) {
        *out += weight * value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By the definition, one pixel at a time.
    fn slow(plane: &Plane, along_row: &[f32], along_column: &[f32]) -> Vec<f32> {
        let (width, height) = (plane.width as i64, (plane.data.len() / plane.width) as i64);
        let (rx, ry) = (along_row.len() as i64 / 2, along_column.len() as i64 / 2);
        let at =
            |x: i64, y: i64| plane.data[(y.clamp(0, height - 1) * width + x.clamp(0, width - 1)) as usize];
        let mut out = Vec::new();
        for y in 0..height {
            for x in 0..width {
                let mut sum = 0.0;
                for (j, wy) in (-ry..=ry).zip(along_column) {
                    for (i, wx) in (-rx..=rx).zip(along_row) {
                        sum += wx * wy * at(x + i, y + j);
                    }
                }
                out.push(sum);
            }
        }
        out
    }

    #[test]
    fn separable_is_the_convolution_even_where_the_kernel_is_wider_than_the_picture() {
        for (width, height) in [(7, 5), (1, 1), (2, 9), (9, 1)] {
            let plane = Plane::from_pixels(width, height, |i| ((i * 37) % 11) as f32);
            let (row, column) = ([1.0, -2.0, 3.0, 0.5, 0.25], [0.5, 1.0, 2.0, -1.0, 4.0, 3.0, 1.0]);
            for (fast, slow) in separable(&plane, &row, &column).data.iter().zip(slow(&plane, &row, &column))
            {
                assert!((fast - slow).abs() < 1e-3, "{fast} {slow}");
            }
        }
    }
}
