//! The picture while it grows: per pixel the exact sum of the samples, the sum of their squares, and their count.
//!
//! Sums are [`Fixed`], so that merging films in any order gives the bits of the whole. Knows nothing of files.

use crate::core::{Fixed, Rgb};

/// A sum of radiance.
pub type RadianceSum = Fixed<72>;
/// A sum of squared luminance.
pub type SquareSum = Fixed<64>;

/// A rectangle of pixels, `x0 <= x < x1` and `y0 <= y < y1`; y counts downwards.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct PixelRect {
    /// First column.
    pub x0: u32,
    /// First row.
    pub y0: u32,
    /// One past the last column.
    pub x1: u32,
    /// One past the last row.
    pub y1: u32,
}

impl PixelRect {
    /// Number of columns.
    pub fn width(self) -> u32 {
        self.x1 - self.x0
    }

    /// Number of rows.
    pub fn height(self) -> u32 {
        self.y1 - self.y0
    }

    /// Number of pixels.
    pub fn area(self) -> usize {
        self.width() as usize * self.height() as usize
    }
}

/// What one pixel holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pixel {
    /// Sum of the samples' radiance, per channel.
    pub sum: [RadianceSum; 3],
    /// Sum of the samples' squared luminance.
    pub sum_of_squares: SquareSum,
    /// Number of samples.
    pub count: u32,
}

impl Pixel {
    /// Adds one sample of finite radiance.
    #[inline]
    pub fn add(&mut self, radiance: [RadianceSum; 3]) {
        let mut luminance = 0.0;
        for ((sum, channel), weight) in self.sum.iter_mut().zip(radiance).zip([0.2126, 0.7152, 0.0722]) {
            *sum += channel;
            luminance += weight * channel.to_f64();
        }
        self.sum_of_squares += SquareSum::new(luminance * luminance);
        self.count += 1;
    }

    /// Adds the samples of another film's pixel.
    pub fn merge(&mut self, other: &Self) {
        for (sum, channel) in self.sum.iter_mut().zip(other.sum) {
            *sum += channel;
        }
        self.sum_of_squares += other.sum_of_squares;
        self.count += other.count;
    }

    /// Mean radiance; black without samples.
    pub fn mean(&self) -> Rgb {
        let n = f64::from(self.count.max(1));
        Rgb::from(self.sum.map(|s| (s.to_f64() / n) as f32))
    }

    /// Estimated variance of the mean's luminance; zero with fewer than two samples.
    pub fn variance_of_mean(&self) -> f64 {
        if self.count < 2 {
            return 0.0;
        }
        let n = f64::from(self.count);
        let [r, g, b] = self.sum.map(|s| s.to_f64() / n);
        let mean = 0.2126 * r + 0.7152 * g + 0.0722 * b;
        ((self.sum_of_squares.to_f64() / n - mean * mean) / (n - 1.0)).max(0.0)
    }
}

/// Samples that could not be added, by what was wrong with them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Dropped {
    /// A channel was NaN.
    pub nan: u64,
    /// A channel was infinite.
    pub infinite: u64,
    /// A channel was negative.
    pub negative: u64,
}

impl Dropped {
    /// Adds the counts of another film.
    pub fn merge(&mut self, other: Self) {
        self.nan += other.nan;
        self.infinite += other.infinite;
        self.negative += other.negative;
    }

    /// Whether nothing was dropped.
    pub fn is_empty(self) -> bool {
        self == Self::default()
    }

    /// Counts what is wrong with a contribution, and says whether it may be added.
    #[inline]
    pub fn accepts(&mut self, radiance: Rgb) -> bool {
        let channels = radiance.to_array();
        if channels.iter().all(|c| c.is_finite() && *c >= 0.0) {
            return true;
        }
        if channels.iter().any(|c| c.is_nan()) {
            self.nan += 1;
        } else if channels.iter().any(|c| c.is_infinite()) {
            self.infinite += 1;
        } else {
            self.negative += 1;
        }
        false
    }
}

/// The pixels of a rectangle of the image.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Size of the full image.
    pub resolution: [u32; 2],
    /// The part of it that this film holds.
    pub rect: PixelRect,
    /// Row by row.
    pub pixels: Vec<Pixel>,
    /// What could not be added.
    pub dropped: Dropped,
}

impl Film {
    /// An empty film for a part of an image.
    pub fn new(resolution: [u32; 2], rect: PixelRect) -> Self {
        Self { resolution, rect, pixels: vec![Pixel::default(); rect.area()], dropped: Dropped::default() }
    }

    /// The pixel at column `x` and row `y` of the full image, which must lie within this film.
    #[inline]
    pub fn pixel(&self, x: u32, y: u32) -> &Pixel {
        &self.pixels[((y - self.rect.y0) * self.rect.width() + (x - self.rect.x0)) as usize]
    }

    /// Adds another film whose rectangle lies within this one's.
    ///
    /// # Panics
    /// If it does not.
    pub fn merge(&mut self, other: &Self) {
        let inside = other.rect.x0 >= self.rect.x0
            && other.rect.y0 >= self.rect.y0
            && other.rect.x1 <= self.rect.x1
            && other.rect.y1 <= self.rect.y1;
        assert!(inside, "a merged film lies within the whole");
        let width = other.rect.width() as usize;
        for (row, pixels) in other.pixels.chunks(width.max(1)).enumerate() {
            let y = other.rect.y0 as usize + row - self.rect.y0 as usize;
            let start = y * self.rect.width() as usize + (other.rect.x0 - self.rect.x0) as usize;
            for (pixel, more) in self.pixels[start..start + width].iter_mut().zip(pixels) {
                pixel.merge(more);
            }
        }
        self.dropped.merge(other.dropped);
    }

    /// Mean radiance of each pixel, row by row.
    pub fn image(&self) -> Vec<Rgb> {
        self.pixels.iter().map(Pixel::mean).collect()
    }
}
