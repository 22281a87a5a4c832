//! FLIP: how different two pictures look when one flips between them, per pixel in `[0, 1]`.
//!
//! Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild 2020, *FLIP: A Difference Evaluator for
//! Alternating Images*; for high dynamic range Andersson, Nilsson, Shirley and Akenine-Möller 2021, *Visualizing
//! Errors in Rendered High Dynamic Range Images*. The filters are separated as the authors' own code does (version
//! 1.7, against which the tests hold this one), so the numbers agree with theirs and with nobody's approximation.
//!
//! Read [`ldr`], then [`hdr`], which is the greatest `ldr` over a range of exposures.

use super::plane::{Plane, separable};
use crate::core::Rgb;
use crate::image_io::Image;
use std::f32::consts::PI;

/// Pixels per degree of visual angle for a 0.7 m wide display of 3840 pixels seen from 0.7 m: the authors' default.
pub const DEFAULT_PPD: f32 = 67.020_645;

/// `q_c`: exponent of the colour difference.
const COLOUR_EXPONENT: f32 = 0.7;
/// `p_c`: share of the greatest colour difference up to which the map is steep.
const COLOUR_KNEE: f32 = 0.4;
/// `p_t`: value of the map at the knee.
const COLOUR_AT_KNEE: f32 = 0.95;
/// `w`: width of the feature detectors, in degrees.
const FEATURE_WIDTH_DEG: f32 = 0.082;
/// `q_f`: exponent of the feature difference.
const FEATURE_EXPONENT: f32 = 0.5;

/// FLIP of each pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Flip {
    /// Row by row, each in `[0, 1]`.
    pub map: Vec<f32>,
    /// Over which exposures, if the pictures have a high dynamic range.
    pub exposures: Option<Exposures>,
}

/// The mean of a map: *the* FLIP of two pictures.
pub fn mean(map: &[f32]) -> f64 {
    map.iter().map(|&e| f64::from(e)).sum::<f64>() / map.len().max(1) as f64
}

/// FLIP of two pictures of linear light that a display shows as they are; light outside `[0, 1]` is clipped.
///
/// `ppd` is in pixels per degree of visual angle.
///
/// # Panics
/// If the sizes differ.
pub fn ldr(reference: &Image, test: &Image, ppd: f32) -> Flip {
    assert_eq!(reference.size(), test.size(), "FLIP compares pictures of one size");
    let shown = |image: &Image| Opponent::of(image, |c| c.map(|x| x.clamp(0.0, 1.0)));
    Flip { map: flip(&shown(reference), &shown(test), &Filters::new(ppd)), exposures: None }
}

/// FLIP of two pictures of linear light of any range: of each pixel the greatest over all exposures at which the
/// reference may sensibly be shown, through a film-like curve (ACES). Negative light counts as none.
///
/// # Panics
/// If the sizes differ.
pub fn hdr(reference: &Image, test: &Image, ppd: f32) -> Flip {
    assert_eq!(reference.size(), test.size(), "FLIP compares pictures of one size");
    let exposures = Exposures::of(reference);
    let filters = Filters::new(ppd);
    let mut map = vec![0.0f32; reference.pixels.len()];
    for stops in exposures.stops() {
        let factor = stops.exp2();
        let shown = |image: &Image| Opponent::of(image, |c| c.map(|x| aces((x * factor).max(0.0))));
        let at_exposure = flip(&shown(reference), &shown(test), &filters);
        for (greatest, e) in map.iter_mut().zip(at_exposure) {
            *greatest = greatest.max(e);
        }
    }
    Flip { map, exposures: Some(exposures) }
}

/// A range of exposures, evenly spaced in stops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposures {
    /// In stops: the brightest pixel of the reference just does not clip.
    pub start: f32,
    /// In stops: the median pixel of the reference is bright.
    pub stop: f32,
    /// How many.
    pub count: u32,
}

impl Exposures {
    /// The range that suits a reference (Andersson et al. 2021, section 4).
    ///
    /// Where more than half of the picture is black, the median is that of the rest: the authors' code has no answer
    /// there.
    pub fn of(reference: &Image) -> Self {
        let mut luminances: Vec<f32> = reference.pixels.iter().map(|p| p.luminance()).collect();
        let mut median = median(&mut luminances);
        if median <= 0.0 {
            luminances.retain(|&y| y > 0.0);
            median = self::median(&mut luminances);
        }
        let brightest = luminances.iter().copied().fold(0.0, f32::max);
        if !(median > 0.0 && brightest.is_finite()) {
            return Self { start: 0.0, stop: 0.0, count: 2 };
        }
        let bright = aces_inverse(0.85);
        // Quotients of the darkest numbers would be infinite.
        let [start, stop] = [brightest, median].map(|y| bright.log2() - y.log2());
        Self { start, stop, count: (stop - start).ceil().max(2.0) as u32 }
    }

    /// Each exposure, in stops.
    fn stops(self) -> impl Iterator<Item = f32> {
        let step = (self.stop - self.start) / (self.count - 1) as f32;
        (0..self.count).map(move |i| self.start + i as f32 * step)
    }
}

/// The upper median; zero of nothing.
fn median(values: &mut [f32]) -> f32 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f32::total_cmp).1
}

/// Coefficients of `(a x^2 + b x) / (c x^2 + d x + e)`: Narkowicz's fit of the ACES curve, its pre-exposure of 0.6
/// taken out.
const ACES: [f32; 5] = [0.36 * 2.51, 0.6 * 0.03, 0.36 * 2.43, 0.6 * 0.59, 0.14];

fn aces(x: f32) -> f32 {
    /// The curve has reached its end long before, and the square is still finite.
    const WHITE: f32 = 1e9;
    let [a, b, c, d, e] = ACES;
    let x = x.min(WHITE);
    ((x * x * a + x * b) / (x * x * c + x * d + e)).clamp(0.0, 1.0)
}

/// The light that [`aces`] shows as `y`.
fn aces_inverse(y: f32) -> f32 {
    let [a, b, c, d, e] = ACES;
    let (a, b, c) = (a - y * c, b - y * d, -y * e);
    let half = -0.5 * b / a;
    half + (half * half - c / a).sqrt()
}

/// A picture in the opponent space YCxCz, where contrast sensitivity is known.
struct Opponent {
    y: Plane,
    cx: Plane,
    cz: Plane,
}

impl Opponent {
    fn of(image: &Image, shown: impl Fn(Rgb) -> Rgb + Sync) -> Self {
        let channel = |f: fn([f32; 3]) -> f32| {
            Plane::from_pixels(image.width, image.height, |i| f(to_xyz(shown(image.pixels[i]).to_array())))
        };
        Self {
            y: channel(|[_, y, _]| 116.0 * y - 16.0),
            cx: channel(|[x, y, _]| 500.0 * (x - y)),
            cz: channel(|[_, y, z]| 200.0 * (y - z)),
        }
    }
}

/// The filters for one viewing distance.
struct Filters {
    /// Contrast sensitivity to light and dark, and to red and green.
    y: Vec<f32>,
    cx: Vec<f32>,
    /// To blue and yellow: a sum of two.
    cz: [Vec<f32>; 2],
    /// A Gaussian and its first and second derivative.
    feature: [Vec<f32>; 3],
}

impl Filters {
    fn new(ppd: f32) -> Self {
        // Andersson et al. 2020, table 1: a sqrt(pi / b) exp(-pi^2 x^2 / b), x in degrees.
        let radius = (3.0 * (0.04f32 / (2.0 * PI * PI)).sqrt() * ppd).ceil() as i32;
        let gaussian = |a: f32, b: f32| -> Vec<f32> {
            let at = |x: f32| a * (PI / b).sqrt() * (-PI * PI * x * x / b).exp();
            (-radius..=radius).map(|i| at(i as f32 / ppd)).collect()
        };
        let sum_to_one = |kernel: Vec<f32>| -> Vec<f32> {
            let sum: f32 = kernel.iter().sum();
            kernel.iter().map(|k| k / sum).collect()
        };
        // Applied in x and in y, the roots of the two amplitudes make the amplitudes.
        let root = |a: f32, b: f32| -> Vec<f32> {
            let amplitude = (a * (PI / b).sqrt()).sqrt();
            gaussian(1.0, b).iter().map(|k| k / (PI / b).sqrt() * amplitude).collect()
        };
        let (first, second) = (root(34.1, 0.04), root(13.5, 0.025));
        let sums: [f32; 2] = [first.iter().sum(), second.iter().sum()];
        let norm = (sums[0] * sums[0] + sums[1] * sums[1]).sqrt();
        Self {
            y: sum_to_one(gaussian(1.0, 0.0047)),
            cx: sum_to_one(gaussian(1.0, 0.0053)),
            cz: [first, second].map(|kernel| kernel.iter().map(|k| k / norm).collect()),
            feature: feature_filters(0.5 * FEATURE_WIDTH_DEG * ppd),
        }
    }
}

/// A Gaussian of standard deviation `sigma` pixels that sums to 1, and its first and second derivatives, whose positive
/// weights sum to 1 and whose negative ones to -1.
fn feature_filters(sigma: f32) -> [Vec<f32>; 3] {
    let radius = (3.0 * sigma).ceil() as i32;
    let sample = |f: fn(f32) -> f32| -> Vec<f32> {
        (-radius..=radius).map(|i| i as f32 / sigma).map(|x| f(x) * (-0.5 * x * x).exp()).collect()
    };
    let normalised = |kernel: Vec<f32>| -> Vec<f32> {
        let positive: f32 = kernel.iter().filter(|&&k| k > 0.0).sum();
        let negative: f32 = -kernel.iter().filter(|&&k| k < 0.0).sum::<f32>();
        kernel
            .iter()
            .map(|&k| {
                if k > 0.0 {
                    k / positive
                } else if k < 0.0 {
                    k / negative
                } else {
                    0.0
                }
            })
            .collect()
    };
    [normalised(sample(|_| 1.0)), normalised(sample(|x| -x)), normalised(sample(|x| x * x - 1.0))]
}

/// FLIP per pixel of two pictures as shown (Andersson et al. 2020, equation 8).
fn flip(reference: &Opponent, test: &Opponent, filters: &Filters) -> Vec<f32> {
    let perceived = [perceive(reference, filters), perceive(test, filters)];
    let features = [features_of(&reference.y, filters), features_of(&test.y, filters)];
    let greatest = greatest_colour_difference();
    let colours = perceived[0].iter().zip(&perceived[1]).map(|(r, t)| colour_difference(*r, *t, greatest));
    let edges = features[0].iter().zip(&features[1]).map(|(r, t)| feature_difference(*r, *t));
    colours.zip(edges).map(|(colour, feature)| colour.powf(1.0 - feature)).collect()
}

/// L*a*b* with the Hunt effect of each pixel as the eye blurs it (equations 1 to 4).
fn perceive(picture: &Opponent, filters: &Filters) -> Vec<[f32; 3]> {
    let y = separable(&picture.y, &filters.y, &filters.y);
    let cx = separable(&picture.cx, &filters.cx, &filters.cx);
    let [first, second] = &filters.cz;
    let cz = [separable(&picture.cz, first, first), separable(&picture.cz, second, second)];
    let pixels = y.data.iter().zip(&cx.data).zip(cz[0].data.iter().zip(&cz[1].data));
    pixels
        .map(|((y, cx), (cz_1, cz_2))| {
            let luminance = (y + 16.0) / 116.0;
            let xyz = [luminance + cx / 500.0, luminance, luminance - (cz_1 + cz_2) / 200.0];
            hunt(to_lab(to_xyz(from_xyz(xyz).map(|c| c.clamp(0.0, 1.0)))))
        })
        .collect()
}

/// Strength of the edge and of the point at each pixel (section 4.2).
fn features_of(y: &Plane, filters: &Filters) -> Vec<[f32; 2]> {
    let y = Plane { width: y.width, data: y.data.iter().map(|y| (y + 16.0) / 116.0).collect() };
    let [gaussian, first, second] = &filters.feature;
    let magnitude = |kernel| {
        let (dx, dy) = (separable(&y, kernel, gaussian), separable(&y, gaussian, kernel));
        dx.data.into_iter().zip(dy.data).map(|(dx, dy)| (dx * dx + dy * dy).sqrt())
    };
    magnitude(first).zip(magnitude(second)).map(|(edge, point)| [edge, point]).collect()
}

/// In `[0, 1]`; both colours as [`perceive`] gives them, `greatest` from [`greatest_colour_difference`] (equations 5
/// and 6).
fn colour_difference(reference: [f32; 3], test: [f32; 3], greatest: f32) -> f32 {
    let difference = hyab(reference, test).powf(COLOUR_EXPONENT);
    let knee = COLOUR_KNEE * greatest;
    if difference < knee {
        difference * COLOUR_AT_KNEE / knee
    } else {
        COLOUR_AT_KNEE + (difference - knee) / (greatest - knee) * (1.0 - COLOUR_AT_KNEE)
    }
}

/// In `[0, 1]`; edges and points as [`features_of`] gives them (equation 7).
fn feature_difference([edge_r, point_r]: [f32; 2], [edge_t, point_t]: [f32; 2]) -> f32 {
    let difference = (edge_r - edge_t).abs().max((point_r - point_t).abs());
    (difference * std::f32::consts::FRAC_1_SQRT_2).powf(FEATURE_EXPONENT).min(1.0)
}

/// Between pure green and pure blue.
fn greatest_colour_difference() -> f32 {
    let [green, blue] = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|rgb| hunt(to_lab(to_xyz(rgb))));
    hyab(green, blue).powf(COLOUR_EXPONENT)
}

/// The distance of Abasi, Amani Tehran and Fairchild 2020: city block in lightness, Euclidean in colour.
fn hyab(a: [f32; 3], b: [f32; 3]) -> f32 {
    (a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])
}

/// Colours look the more colourful the brighter they are.
fn hunt([l, a, b]: [f32; 3]) -> [f32; 3] {
    [l, 0.01 * l * a, 0.01 * l * b]
}

/// XYZ in units of the white point D65.
fn to_xyz([r, g, b]: [f32; 3]) -> [f32; 3] {
    // Exact for sRGB's primaries; each row is divided by its sum's value for white.
    const WHITE_INVERSE: [f32; 3] = [1.052_156_9, 1.0, 0.918_357_7];
    [
        (0.412_386_56 * r + 0.357_591_5 * g + 0.180_450_49 * b) * WHITE_INVERSE[0],
        (0.212_636_82 * r + 0.715_183 * g + 0.072_180_2 * b) * WHITE_INVERSE[1],
        (0.019_330_62 * r + 0.119_197_16 * g + 0.950_372_6 * b) * WHITE_INVERSE[2],
    ]
}

/// The inverse of [`to_xyz`].
fn from_xyz([x, y, z]: [f32; 3]) -> [f32; 3] {
    const WHITE: [f32; 3] = [0.950_428_55, 1.0, 1.088_900_4];
    let (x, y, z) = (x * WHITE[0], y * WHITE[1], z * WHITE[2]);
    [
        3.241_003_3 * x - 1.537_399 * y - 0.498_615_86 * z,
        -0.969_224_33 * x + 1.875_930_1 * y + 0.041_554_224 * z,
        0.055_639_423 * x - 0.204_011_2 * y + 1.057_148_9 * z,
    ]
}

/// L*a*b* of XYZ in units of the white point (CIE 1976).
fn to_lab(xyz: [f32; 3]) -> [f32; 3] {
    const DELTA: f32 = 6.0 / 29.0;
    let [x, y, z] = xyz
        .map(|t| if t > DELTA * DELTA * DELTA { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 });
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

#[cfg(test)]
#[path = "flip_tests.rs"]
mod tests;
