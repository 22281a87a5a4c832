//! A distribution over directions, learned from photons.

use glam::{Vec2, Vec3};

/// Bins along each edge of the square.
const EDGE: usize = 32;

/// Bins in all: 0.012 sr each on average.
const BINS: usize = EDGE * EDGE;

/// Bins between two of the coarse sums: those, and the bins between two of them, take a cache line each.
const COARSE: usize = 32;

/// What all probabilities sum to.
const TOTAL: u16 = u16::MAX;

/// A density over the sphere, constant in each of the bins of an octahedral map.
///
/// Small, since every ray of a guided surface reads another one: probabilities are multiples of `1 / TOTAL`.
#[derive(Clone, Debug)]
pub struct Directions {
    /// The running sum of the bins' probabilities before each bin along a Z-order curve, and after the last.
    ///
    /// Neighbours in that order are neighbours on the sphere, so that numbers that are spread well over the unit interval
    /// make directions that are spread well.
    sums: [u16; BINS + 1],
    /// Every so-manieth of them.
    coarse: [u16; BINS / COARSE],
}

impl Directions {
    /// The distribution of unit vectors with weights, each smoothed over the four bins around it; `None` if they have no
    /// weight.
    pub fn new(weighted: impl IntoIterator<Item = (Vec3, f32)>) -> Option<Self> {
        let mut bins = vec![0.0f64; BINS];
        for (wi, weight) in weighted {
            let p = 0.5 * (square(wi) + Vec2::ONE) * EDGE as f32 - 0.5;
            let low = p.floor();
            let part = p - low;
            for (corner, x_weight, y_weight) in [
                (Vec2::ZERO, 1.0 - part.x, 1.0 - part.y),
                (Vec2::X, part.x, 1.0 - part.y),
                (Vec2::Y, 1.0 - part.x, part.y),
                (Vec2::ONE, part.x, part.y),
            ] {
                bins[bin(low + corner)] += f64::from(weight * x_weight * y_weight);
            }
        }
        let total: f64 = bins.iter().sum();
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        let mut sums = [0; BINS + 1];
        let mut sum = 0.0;
        for (after, bin) in sums[1..].iter_mut().zip(bins) {
            sum += bin;
            *after = (f64::from(TOTAL) * (sum / total).min(1.0)).round() as u16;
        }
        let mut coarse = [0; BINS / COARSE];
        for (coarse, sum) in coarse.iter_mut().zip(sums.iter().step_by(COARSE)) {
            *coarse = *sum;
        }
        Some(Self { sums, coarse })
    }

    /// Draws a unit vector; `u` is in `[0, 1)`.
    #[inline(always)]
    pub fn sample(&self, u: [f32; 2]) -> Vec3 {
        let x = u[0] * f32::from(TOTAL);
        // To count them all takes a few wide instructions, which do not wait for each other as the steps of a search do.
        let last_up_to = |sums: &[u16]| {
            let count: u16 = sums.iter().map(|&sum| u16::from(sum <= x as u16)).sum();
            usize::from(count.max(1) - 1)
        };
        let first = COARSE * last_up_to(&self.coarse);
        let bin = first + last_up_to(&self.sums[first..first + COARSE]);
        let [low, high] = [self.sums[bin], self.sums[bin + 1]].map(f32::from);
        let along = ((x - low) / (high - low)).min(1.0 - 0.5 * f32::EPSILON);
        on_sphere((place(bin) + Vec2::new(along, u[1])) * (2.0 / EDGE as f32) - Vec2::ONE)
    }

    /// The density of [`sample`](Self::sample) at the unit vector `wi`, in 1/sr.
    #[inline]
    pub fn pdf(&self, wi: Vec3) -> f32 {
        /// Bins per unit of area of the square, whose edge is 2, by the total.
        const SCALE: f32 = BINS as f32 / 4.0 / TOTAL as f32;
        let length = wi.x.abs() + wi.y.abs() + wi.z.abs();
        let bin = bin(0.5 * (square(wi) + Vec2::ONE) * EDGE as f32);
        SCALE * f32::from(self.sums[bin + 1] - self.sums[bin]) / (length * length * length)
    }
}

/// Where the octahedral map puts a direction: the octahedron `|x| + |y| + |z| = 1` with its lower half unfolded, in
/// `[-1, 1]^2` (Cigolle et al. 2014, *A Survey of Efficient Representations for Independent Unit Vectors*).
///
/// An area of the square is `(|x| + |y| + |z|)^3` times as large a solid angle about the unit vector `(x, y, z)`.
#[inline]
fn square(w: Vec3) -> Vec2 {
    let p = w.truncate() / (w.x.abs() + w.y.abs() + w.z.abs());
    if w.z >= 0.0 { p } else { fold(p) }
}

/// The unit vector at a point of the square.
#[inline]
fn on_sphere(p: Vec2) -> Vec3 {
    let z = 1.0 - p.x.abs() - p.y.abs();
    if z >= 0.0 { p } else { fold(p) }.extend(z).normalize()
}

/// Turns the corners of the square onto its inner diamond, and back.
#[inline]
fn fold(p: Vec2) -> Vec2 {
    Vec2::new((1.0 - p.y.abs()).copysign(p.x), (1.0 - p.x.abs()).copysign(p.y))
}

/// The number of the bin with a point in it, in bins along each edge; the nearest one for a point beyond the square.
#[inline]
fn bin(p: Vec2) -> usize {
    let [x, y] = p.to_array().map(|c| (c as i32).clamp(0, EDGE as i32 - 1) as usize);
    spread(x) | spread(y) << 1
}

/// The least corner of a bin.
#[inline]
fn place(bin: usize) -> Vec2 {
    Vec2::new(gather(bin) as f32, gather(bin >> 1) as f32)
}

/// The five bits of a number with zeros between them.
#[inline]
fn spread(x: usize) -> usize {
    let x = (x | x << 4) & 0x10f;
    let x = (x | x << 2) & 0x133;
    (x | x << 1) & 0x155
}

/// Every second one of ten bits, from the lowest.
#[inline]
fn gather(x: usize) -> usize {
    let x = x & 0x155;
    let x = (x | x >> 1) & 0x133;
    let x = (x | x >> 2) & 0x10f;
    (x | x >> 4) & 0x1f
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::warp;

    /// Well spread points of the unit square.
    fn points(count: u32) -> impl Iterator<Item = [f32; 2]> {
        (0..count).map(move |i| {
            let y = (i as f64 * 0.618_033_988_749_894_9).fract();
            [((f64::from(i) + 0.5) / f64::from(count)) as f32, y as f32]
        })
    }

    /// A narrow and a wide cluster.
    fn two_clusters() -> Directions {
        let about = |axis: Vec3, width: f32| {
            points(50).map(move |u| (axis + width * warp::uniform_sphere(u)).normalize())
        };
        let narrow = about(Vec3::new(0.3, -0.8, 0.5).normalize(), 0.05).map(|w| (w, 3.0));
        Directions::new(narrow.chain(about(-Vec3::Z, 0.4).map(|w| (w, 1.0)))).expect("there is weight")
    }

    #[test]
    fn the_map_and_the_order_of_its_bins_can_be_undone() {
        for u in points(10_000) {
            let w = warp::uniform_sphere(u);
            assert!((on_sphere(square(w)) - w).length() < 1e-6, "{w}");
        }
        for i in 0..BINS {
            assert_eq!(bin(place(i)), i);
        }
    }

    #[test]
    fn the_density_integrates_to_one() {
        let directions = two_clusters();
        let count = 6_000_000;
        let sum: f64 = points(count).map(|u| f64::from(directions.pdf(warp::uniform_sphere(u)))).sum();
        let integral = sum / f64::from(count) * 4.0 * std::f64::consts::PI;
        assert!((integral - 1.0).abs() < 2e-3, "{integral}");
    }

    #[test]
    fn directions_are_drawn_with_their_density() {
        // Chi-square over the eight octants and two heights, of independent draws.
        let directions = two_clusters();
        let class = |w: Vec3| {
            usize::from(w.x > 0.3)
                | usize::from(w.y > -0.7) << 1
                | usize::from(w.z > 0.4) << 2
                | usize::from(w.z > -0.9) << 3
        };
        let (draws, grid) = (100_000, 1_000_000);
        let (mut seen, mut expected) = ([0.0f64; 16], [0.0f64; 16]);
        let sampler = crate::core::Sampler::new(crate::core::SamplerKind::Independent, 1, 0, 0);
        for i in 0..draws {
            seen[class(directions.sample(sampler.pair(i, 0)))] += 1.0;
        }
        for u in points(grid) {
            let w = warp::uniform_sphere(u);
            expected[class(w)] += f64::from(directions.pdf(w)) * 4.0 * std::f64::consts::PI / f64::from(grid)
                * f64::from(draws);
        }
        let used = expected.iter().filter(|e| **e > 5.0).count();
        assert!(used >= 6, "{expected:?}");
        let chi_square: f64 =
            seen.iter().zip(expected).filter(|(_, e)| *e > 5.0).map(|(s, e)| (s - e).powi(2) / e).sum();
        assert!(chi_square < 40.0, "{chi_square}: {seen:?} {expected:?}");
    }

    #[test]
    fn no_weight_is_no_distribution() {
        assert!(Directions::new([]).is_none());
        assert!(Directions::new([(Vec3::X, 0.0)]).is_none());
        assert!(Directions::new([(Vec3::X, f32::INFINITY)]).is_none());
    }
}
