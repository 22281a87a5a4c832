//! How far a picture is from a reference, in numbers.

use super::flip::{self, Exposures, Flip};
use super::magma::magma;
use crate::image_io::Image;
use serde::Serialize;

/// How FLIP looks at the pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Range {
    /// As a display shows them: light outside `[0, 1]` is clipped.
    Ldr,
    /// Over all exposures that suit the reference.
    Hdr,
}

/// One of the numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Metric {
    /// Root of the mean squared difference.
    Rmse,
    /// Mean squared difference relative to the reference.
    Relmse,
    /// Greatest absolute difference of a channel.
    Max,
    /// Absolute value of the mean difference.
    Mean,
    /// Perceived difference, 0 to 1.
    #[default]
    Flip,
}

/// Why two pictures cannot be compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DiffError {
    /// They differ in size.
    #[error("the pictures differ in size: {} x {} and {} x {}", test[0], test[1], reference[0], reference[1])]
    Size {
        /// Of the tested picture.
        test: [u32; 2],
        /// Of the reference.
        reference: [u32; 2],
    },
    /// A picture has no pixels.
    #[error("the pictures have no pixels")]
    Empty,
    /// A pixel is NaN or infinite.
    #[error("{count} pixels of the {which} are NaN or infinite, the first in column {x}, row {y}")]
    NotFinite {
        /// `test` or `reference`.
        which: &'static str,
        /// How many.
        count: usize,
        /// Column of the first.
        x: usize,
        /// Row of the first.
        y: usize,
    },
}

/// How far a picture is from a reference, over all pixels and channels, in linear light.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// `sqrt(mean((test - reference)^2))`.
    pub rmse: f64,
    /// `mean((test - reference)^2 / (reference + 0.01)^2)`: pbrt-v4's form.
    pub relmse: f64,
    /// `max |test - reference|`.
    pub max: f64,
    /// Column and row where that is.
    pub max_at: [usize; 2],
    /// `mean(test - reference)`: positive where the test is brighter.
    pub mean: f64,
    /// Mean of FLIP.
    pub flip: f64,
    /// Which FLIP.
    pub range: Range,
    /// For how many pixels per degree.
    pub ppd: f32,
    /// The exposures of HDR-FLIP.
    #[serde(skip)]
    pub exposures: Option<Exposures>,
    /// FLIP of each pixel, row by row.
    #[serde(skip)]
    pub map: Vec<f32>,
}

impl Difference {
    /// The number that a metric names; never negative.
    pub fn value(&self, metric: Metric) -> f64 {
        match metric {
            Metric::Rmse => self.rmse,
            Metric::Relmse => self.relmse,
            Metric::Max => self.max,
            Metric::Mean => self.mean.abs(),
            Metric::Flip => self.flip,
        }
    }

    /// The map of FLIP as sRGB bytes in the colours of `magma`: three per pixel.
    pub fn map_rgb8(&self) -> Vec<u8> {
        self.map.iter().flat_map(|&e| magma(e)).collect()
    }
}

/// Compares a picture with its reference; `ppd` (pixels per degree) and `range` are for FLIP.
///
/// # Errors
/// If the sizes differ, or a pixel is not finite.
pub fn compare(test: &Image, reference: &Image, range: Range, ppd: f32) -> Result<Difference, DiffError> {
    if test.size() != reference.size() {
        return Err(DiffError::Size { test: test.size(), reference: reference.size() });
    }
    if test.pixels.is_empty() {
        return Err(DiffError::Empty);
    }
    require_finite(test, "test")?;
    require_finite(reference, "reference")?;
    let (mut square, mut relative, mut sum) = (0.0, 0.0, 0.0);
    let (mut max, mut max_pixel) = (0.0f64, 0);
    for (i, (t, r)) in test.pixels.iter().zip(&reference.pixels).enumerate() {
        for (t, r) in t.to_array().map(f64::from).into_iter().zip(r.to_array().map(f64::from)) {
            let d = t - r;
            square += d * d;
            relative += (d / (r + 0.01)).powi(2);
            sum += d;
            if d.abs() > max {
                (max, max_pixel) = (d.abs(), i);
            }
        }
    }
    let Flip { map, exposures } = match range {
        Range::Ldr => flip::ldr(reference, test, ppd),
        Range::Hdr => flip::hdr(reference, test, ppd),
    };
    let (n, width) = (3.0 * test.pixels.len() as f64, test.width as usize);
    Ok(Difference {
        rmse: (square / n).sqrt(),
        relmse: relative / n,
        max,
        max_at: [max_pixel % width, max_pixel / width],
        mean: sum / n,
        flip: flip::mean(&map),
        range,
        ppd,
        exposures,
        map,
    })
}

fn require_finite(image: &Image, which: &'static str) -> Result<(), DiffError> {
    let mut bad = image.pixels.iter().enumerate().filter(|(_, p)| !p.is_finite()).map(|(i, _)| i);
    let Some(first) = bad.next() else { return Ok(()) };
    let width = image.width as usize;
    Err(DiffError::NotFinite { which, count: 1 + bad.count(), x: first % width, y: first / width })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::Rgb;

    fn compared(test: &Image, reference: &Image) -> Result<Difference, DiffError> {
        compare(test, reference, Range::Ldr, flip::DEFAULT_PPD)
    }

    #[test]
    fn a_picture_does_not_differ_from_itself() {
        let image = Image::from_fn(9, 5, |x, y| Rgb::new(x as f32, y as f32, 0.5));
        for range in [Range::Ldr, Range::Hdr] {
            let d = compare(&image, &image, range, 40.0).unwrap();
            for metric in [Metric::Rmse, Metric::Relmse, Metric::Max, Metric::Mean, Metric::Flip] {
                assert_eq!(d.value(metric), 0.0, "{metric:?}");
            }
        }
    }

    #[test]
    fn the_numbers_are_those_of_the_formulas() {
        let reference = Image::from_fn(2, 1, |_, _| Rgb::grey(0.49));
        let mut test = reference.clone();
        test.pixels[1].g = 0.24;
        let d = compared(&test, &reference).unwrap();
        assert!((d.rmse - (0.0625f64 / 6.0).sqrt()).abs() < 1e-7);
        assert!((d.relmse - 0.25 / 6.0).abs() < 1e-7);
        assert!((d.max - 0.25).abs() < 1e-7);
        assert!((d.mean + 0.25 / 6.0).abs() < 1e-7);
        assert_eq!(d.value(Metric::Mean), -d.mean);
        assert_eq!(d.max_at, [1, 0]);
    }

    #[test]
    fn the_second_picture_is_the_reference() {
        let [dark, bright] = [0.09, 0.99].map(|v| Image::from_fn(3, 3, |_, _| Rgb::grey(v)));
        assert!((compared(&bright, &dark).unwrap().relmse - 81.0).abs() < 1e-3);
        assert!((compared(&dark, &bright).unwrap().relmse - 0.81).abs() < 1e-5);
        assert!(compared(&bright, &dark).unwrap().mean > 0.0);
    }

    #[test]
    fn what_cannot_be_compared_is_said() {
        let image = |width, height, v| Image::from_fn(width, height, move |_, _| Rgb::grey(v));
        let size = compared(&image(2, 3, 0.0), &image(3, 2, 0.0)).unwrap_err();
        assert_eq!(size.to_string(), "the pictures differ in size: 2 x 3 and 3 x 2");
        assert_eq!(compared(&image(0, 3, 0.0), &image(0, 3, 0.0)), Err(DiffError::Empty));
        let mut test = image(2, 2, 0.0);
        test.pixels[3].b = f32::NAN;
        let bad = compared(&test, &image(2, 2, 0.0)).unwrap_err();
        assert_eq!(bad, DiffError::NotFinite { which: "test", count: 1, x: 1, y: 1 });
        assert!(compared(&image(2, 2, 0.0), &image(2, 2, f32::INFINITY)).is_err());
    }
}
