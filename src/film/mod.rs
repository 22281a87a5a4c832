//! The picture while it grows: per pixel the exact sum of the samples, the sum of their squares, and their count.
//!
//! Sums are [`Fixed`], so that merging films in any order gives the bits of the whole. Knows nothing of files.

use crate::core::{Fixed, Gathered, Rgb};

/// A sum of radiance.
pub type RadianceSum = Fixed<72>;
/// The same while it grows.
pub type RadianceGathered = Gathered<72>;
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
    pub fn add(&mut self, radiance: [RadianceGathered; 3]) {
        let mut luminance = 0.0;
        for ((sum, channel), weight) in self.sum.iter_mut().zip(radiance).zip([0.2126, 0.7152, 0.0722]) {
            *sum += channel.sum();
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

/// What denoisers ask of one pixel beside its colour: sums over its samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GuidePixel {
    /// Sum of the albedo.
    pub albedo: [RadianceSum; 3],
    /// Sum of the shading normal.
    pub normal: [RadianceSum; 3],
    /// Sum of the length of the way from the camera.
    pub depth: RadianceSum,
    /// Sum of the squared radiance, per channel.
    pub squares: [SquareSum; 3],
    /// Samples that have met a surface: normal and depth are theirs.
    pub met: u32,
}

/// What one camera sample has to say of the surface that it shows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Guide {
    /// Fraction of light that is reflected.
    pub albedo: Rgb,
    /// Unit normal; zero where there is no surface.
    pub normal: [f32; 3],
    /// Length of the way.
    pub depth: f32,
}

impl GuidePixel {
    /// Adds one sample, whose radiance is given in the same exact form as the film's.
    #[inline]
    pub fn add(&mut self, guide: &Guide, radiance: [RadianceGathered; 3]) {
        for c in 0..3 {
            self.albedo[c] += RadianceSum::from_finite(guide.albedo.to_array()[c]);
            self.normal[c] += RadianceSum::from_finite(guide.normal[c]);
            let value = radiance[c].to_f64();
            self.squares[c] += SquareSum::new(value * value);
        }
        if guide.normal != [0.0; 3] {
            self.depth += RadianceSum::from_finite(guide.depth);
            self.met += 1;
        }
    }

    /// Adds the samples of another film's pixel.
    pub fn merge(&mut self, other: &Self) {
        for c in 0..3 {
            self.albedo[c] += other.albedo[c];
            self.normal[c] += other.normal[c];
            self.squares[c] += other.squares[c];
        }
        self.depth += other.depth;
        self.met += other.met;
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
    /// What is known of them for denoisers, in the same order; empty where nobody has asked.
    pub guides: Vec<GuidePixel>,
    /// What could not be added.
    pub dropped: Dropped,
}

impl Film {
    /// Bytes of a film of so many pixels, with or without room for what denoisers ask.
    pub fn bytes(pixels: usize, guides: bool) -> u64 {
        let pixel = size_of::<Pixel>() + if guides { size_of::<GuidePixel>() } else { 0 };
        pixels as u64 * pixel as u64
    }

    /// An empty film for a part of an image.
    pub fn new(resolution: [u32; 2], rect: PixelRect) -> Self {
        let pixels = vec![Pixel::default(); rect.area()];
        Self { resolution, rect, pixels, guides: vec![], dropped: Dropped::default() }
    }

    /// The same with room for what denoisers ask, if `wanted`.
    pub fn with_guides(mut self, wanted: bool) -> Self {
        self.guides = if wanted { vec![GuidePixel::default(); self.pixels.len()] } else { vec![] };
        self
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
            if let (Some(mine), Some(more)) =
                (self.guides.get_mut(start..start + width), other.guides.get(row * width..(row + 1) * width))
            {
                mine.iter_mut().zip(more).for_each(|(guide, more)| guide.merge(more));
            }
        }
        self.dropped.merge(other.dropped);
    }

    /// Mean albedo of each pixel, row by row; black where nothing was asked for or met.
    pub fn albedo(&self) -> Vec<Rgb> {
        self.guided(|pixel, guide| Rgb::from(mean(guide.albedo, pixel.count)))
    }

    /// Mean normal of each pixel, row by row, its components as channels; zero where nothing was met. Shorter than one
    /// where normals differ within the pixel.
    pub fn normal(&self) -> Vec<Rgb> {
        self.guided(|pixel, guide| Rgb::from(mean(guide.normal, pixel.count)))
    }

    /// Mean length of the way from the camera over the samples that met a surface, row by row; infinite where none did.
    pub fn depth(&self) -> Vec<f32> {
        let depth = |guide: &GuidePixel| match guide.met {
            0 => f32::INFINITY,
            met => (guide.depth.to_f64() / f64::from(met)) as f32,
        };
        self.guides.iter().map(depth).collect()
    }

    /// Estimated variance of each pixel's value, per channel, row by row; zero with fewer than two samples.
    pub fn variance(&self) -> Vec<Rgb> {
        self.guided(|pixel, guide| {
            let n = f64::from(pixel.count);
            let of = |c: usize| {
                let mean = pixel.sum[c].to_f64() / n;
                ((guide.squares[c].to_f64() / n - mean * mean) / (n - 1.0)).max(0.0) as f32
            };
            if pixel.count < 2 { Rgb::BLACK } else { Rgb::new(of(0), of(1), of(2)) }
        })
    }

    fn guided(&self, of: impl Fn(&Pixel, &GuidePixel) -> Rgb) -> Vec<Rgb> {
        self.pixels.iter().zip(&self.guides).map(|(pixel, guide)| of(pixel, guide)).collect()
    }

    /// Mean radiance of each pixel, row by row.
    pub fn image(&self) -> Vec<Rgb> {
        self.pixels.iter().map(Pixel::mean).collect()
    }
}

fn mean(sum: [RadianceSum; 3], count: u32) -> [f32; 3] {
    sum.map(|sum| (sum.to_f64() / f64::from(count.max(1))) as f32)
}
