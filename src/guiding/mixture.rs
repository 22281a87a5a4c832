//! A distribution over directions that moves with the point that looks: a few lobes, each about a source.

use crate::core::lanes::{Floats, LANES};
use crate::core::{Frame, warp};
use glam::Vec3;
use std::f32::consts::FRAC_2_PI;

/// Light that comes about one direction, as from a source that may be near.
///
/// Its density over solid angle is `2 / (pi (a^-2 - (a + 4)^-2)) / (a + c)^3`, where `a` is the width and `c` the squared
/// chord between a direction and the axis, from 0 to 4: a bell with long tails, since what photons have not told must
/// not be missed by much.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lobe {
    /// The fraction of the light.
    pub weight: f32,
    /// The axis, seen from the mixture's origin; unit length.
    pub axis: Vec3,
    /// One by the distance of the source, by which the axis turns with the point that looks: as a mirror's virtual image is
    /// seen from elsewhere. Negative where light gathers behind the surface.
    pub nearness: f32,
    /// About the mean of squared chords to the axis.
    pub width: f32,
}

impl Lobe {
    /// The least width: chords of a thousandth.
    pub const LEAST_WIDTH: f32 = 1e-6;

    /// What makes the density of a lobe of a width integrate to one, in 1/sr.
    #[inline(always)]
    pub fn scale(width: f32) -> f32 {
        FRAC_2_PI / Self::inverse_squares(width)
    }

    /// `a^-2 - (a + 4)^-2`.
    #[inline(always)]
    fn inverse_squares(width: f32) -> f32 {
        (width * width).recip() - ((width + 4.0) * (width + 4.0)).recip()
    }

    /// The squared chord that a fraction `u` of the lobe is within.
    #[inline(always)]
    fn squared_chord(width: f32, u: f32) -> f32 {
        let s = (width * width).recip() - u * Self::inverse_squares(width);
        (s.sqrt().recip() - width).clamp(0.0, 4.0)
    }
}

/// Beyond all numbers that are drawn: where lobes would begin that are not there.
const BEYOND: f32 = 2.0;

/// Light that comes at a smaller cosine is thought to come at this one.
const LEAST_COS: f32 = 0.1;

/// Up to eight lobes, side by side; those that are not there have no weight.
#[derive(Clone, Copy, Debug)]
pub struct Mixture {
    /// Where the axes are seen from.
    origin: Vec3,
    x: Floats,
    y: Floats,
    z: Floats,
    nearness: Floats,
    width: Floats,
    /// Weight times [`Lobe::scale`].
    scale: Floats,
    weight: Floats,
    /// The sum of the weights before each lobe.
    before: Floats,
}

impl Mixture {
    /// A mixture of lobes, whose weights are scaled to sum to one.
    ///
    /// # Panics
    /// If there are more than eight.
    pub fn new(origin: Vec3, lobes: &[Lobe]) -> Self {
        let total: f32 = lobes.iter().map(|lobe| lobe.weight).sum();
        let none = [0.0; LANES];
        let mut mixture = Self {
            origin,
            x: none,
            y: none,
            z: [1.0; LANES],
            nearness: none,
            width: [1.0; LANES],
            scale: none,
            weight: none,
            before: [BEYOND; LANES],
        };
        let mut sum = 0.0;
        for (k, lobe) in lobes.iter().enumerate() {
            let weight = lobe.weight / total;
            [mixture.x[k], mixture.y[k], mixture.z[k]] = lobe.axis.to_array();
            (mixture.nearness[k], mixture.width[k]) = (lobe.nearness, lobe.width);
            (mixture.scale[k], mixture.weight[k]) = (weight * Lobe::scale(lobe.width), weight);
            mixture.before[k] = sum;
            sum += weight;
        }
        mixture
    }

    /// The mixture of what a lobe, seen from `p` on a surface with the normal `n`, shows of the light of this one; and how much a
    /// unit of irradiance is of what the lobe shows.
    #[inline(always)]
    pub fn within(&self, p: Vec3, n: Vec3, lobe: &Lobe) -> (Self, f32) {
        let d = p - self.origin;
        let mut product = Self { origin: p, nearness: [0.0; LANES], ..*self };
        for k in 0..LANES {
            let axis = self.axis(k, d);
            let sum = self.width[k] + lobe.width;
            let span = sum + (axis - lobe.axis).length_squared();
            // As bells about two axes have it.
            let overlap = Lobe::scale(sum) / (span * span * span);
            product.weight[k] = self.weight[k] * overlap / n.dot(axis).max(LEAST_COS);
            product.width[k] = (self.width[k] * lobe.width / sum).max(Lobe::LEAST_WIDTH);
            let between = axis * lobe.width + lobe.axis * self.width[k];
            let length = between.length();
            let between = if length > 1e-3 * sum { between * length.recip() } else { axis };
            [product.x[k], product.y[k], product.z[k]] = between.to_array();
        }
        let shown = sum(product.weight);
        let scale = if shown > 0.0 { shown.recip() } else { 0.0 };
        let mut before = 0.0;
        for k in 0..LANES {
            product.weight[k] *= scale;
            product.scale[k] = product.weight[k] * Lobe::scale(product.width[k]);
            product.before[k] = if self.before[k] < 1.0 { before } else { BEYOND };
            before += product.weight[k];
        }
        (product, shown)
    }

    /// Of each lobe, its width and the squared chord between its axis, seen from `p`, and the unit vector `wi`.
    #[inline(always)]
    pub fn spans(&self, p: Vec3, wi: Vec3) -> Floats {
        let d = p - self.origin;
        let mut spans = Floats::default();
        for k in 0..LANES {
            spans[k] = self.span(k, self.axis(k, d), wi);
        }
        spans
    }

    /// The axis of a lobe, seen from `d` beside the origin; unit length.
    #[inline(always)]
    fn axis(&self, k: usize, d: Vec3) -> Vec3 {
        let axis = Vec3::new(
            self.x[k] - self.nearness[k] * d.x,
            self.y[k] - self.nearness[k] * d.y,
            self.z[k] - self.nearness[k] * d.z,
        );
        axis * (1.0 / axis.length())
    }

    #[inline(always)]
    fn span(&self, k: usize, axis: Vec3, wi: Vec3) -> f32 {
        self.width[k] + (wi - axis).length_squared()
    }

    #[inline(always)]
    fn density(&self, k: usize, span: f32) -> f32 {
        self.scale[k] / (span * span * span)
    }

    /// The density of each lobe where it has these [`spans`](Self::spans), times its weight: in 1/sr.
    #[inline(always)]
    pub fn densities(&self, spans: &Floats) -> Floats {
        let mut densities = Floats::default();
        for k in 0..LANES {
            densities[k] = self.density(k, spans[k]);
        }
        densities
    }

    /// The density of [`sample`](Self::sample) at the unit vector `wi`, in 1/sr.
    #[inline(always)]
    pub fn pdf(&self, p: Vec3, wi: Vec3) -> f32 {
        sum(self.densities(&self.spans(p, wi)))
    }

    /// [`pdf`](Self::pdf) at each of two unit vectors.
    #[inline(always)]
    pub fn pdfs(&self, p: Vec3, [first, second]: [Vec3; 2]) -> [f32; 2] {
        let d = p - self.origin;
        let [mut of_first, mut of_second] = [Floats::default(); 2];
        for k in 0..LANES {
            let axis = self.axis(k, d);
            of_first[k] = self.density(k, self.span(k, axis, first));
            of_second[k] = self.density(k, self.span(k, axis, second));
        }
        [sum(of_first), sum(of_second)]
    }

    /// Draws a unit vector for the point `p`; `u` is in `[0, 1)`.
    #[inline(always)]
    pub fn sample(&self, p: Vec3, u: [f32; 2]) -> Vec3 {
        let begun: u32 = self.before.iter().map(|&before| u32::from(before <= u[0])).sum();
        let k = begun.max(1) as usize - 1;
        let rest = ((u[0] - self.before[k]) / self.weight[k]).min(1.0 - 0.5 * f32::EPSILON);
        let c = Lobe::squared_chord(self.width[k], u[1]);
        // The chord of an angle is twice the sine of its half.
        let (sin, cos) = ((c * (1.0 - 0.25 * c)).sqrt(), 1.0 - 0.5 * c);
        let axis = Vec3::new(self.x[k], self.y[k], self.z[k]) - self.nearness[k] * (p - self.origin);
        Frame::new(axis.normalize()).to_world((sin * warp::unit_vector(rest)).extend(cos)).normalize()
    }
}

/// In an order in which four additions do not wait for each other.
#[inline(always)]
pub fn sum([a, b, c, d, e, f, g, h]: Floats) -> f32 {
    ((a + b) + (c + d)) + ((e + f) + (g + h))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::{Sampler, SamplerKind};

    /// Well spread points of the unit square.
    fn points(count: u32) -> impl Iterator<Item = [f32; 2]> {
        (0..count).map(move |i| {
            let y = (i as f64 * 0.618_033_988_749_894_9).fract();
            [((f64::from(i) + 0.5) / f64::from(count)) as f32, y as f32]
        })
    }

    /// A narrow lobe about a near source and two wide ones.
    fn three_lobes() -> Mixture {
        let lobe =
            |weight, axis: Vec3, nearness, width| Lobe { weight, axis: axis.normalize(), nearness, width };
        Mixture::new(
            Vec3::new(1.0, 2.0, 3.0),
            &[
                lobe(1.0, Vec3::new(0.3, -0.8, 0.5), 0.5, 0.01),
                lobe(0.5, Vec3::NEG_Z, 0.0, 0.3),
                lobe(0.5, Vec3::X, -0.2, 2.0),
            ],
        )
    }

    const NEARBY: Vec3 = Vec3::new(1.4, 1.9, 3.2);

    #[test]
    fn the_density_integrates_to_one() {
        let (mixture, count) = (three_lobes(), 4_000_000);
        let density = |u| f64::from(mixture.pdf(NEARBY, warp::uniform_sphere(u)));
        let integral =
            points(count).map(density).sum::<f64>() / f64::from(count) * 4.0 * std::f64::consts::PI;
        assert!((integral - 1.0).abs() < 1e-3, "{integral}");
    }

    #[test]
    fn directions_are_drawn_with_their_density() {
        // Chi-square over classes of cosines to the lobes' axes, of independent draws.
        let mixture = three_lobes();
        let source = mixture.origin + Vec3::new(0.3, -0.8, 0.5).normalize() / 0.5;
        let axis = (source - NEARBY).normalize();
        let class = |w: Vec3| {
            let near = [0.999, 0.99, 0.9, 0.0].iter().filter(|&&cos| w.dot(axis) > cos).count();
            near | usize::from(w.x > 0.3) << 3 | usize::from(w.z > -0.7) << 4
        };
        let (draws, grid) = (100_000, 4_000_000);
        let (mut seen, mut expected) = ([0.0f64; 32], [0.0f64; 32]);
        let sampler = Sampler::new(SamplerKind::Independent, 1, 0, 0);
        for i in 0..draws {
            let wi = mixture.sample(NEARBY, sampler.pair(i, 0));
            assert!((wi.length() - 1.0).abs() < 1e-6);
            seen[class(wi)] += 1.0;
        }
        for u in points(grid) {
            let w = warp::uniform_sphere(u);
            expected[class(w)] += f64::from(mixture.pdf(NEARBY, w)) * 4.0 * std::f64::consts::PI
                / f64::from(grid)
                * f64::from(draws);
        }
        let used = expected.iter().filter(|e| **e > 5.0).count();
        assert!(used >= 10, "{expected:?}");
        let chi_square: f64 =
            seen.iter().zip(expected).filter(|(_, e)| *e > 5.0).map(|(s, e)| (s - e).powi(2) / e).sum();
        assert!(
            chi_square < used as f64 + 5.0 * (2.0 * used as f64).sqrt(),
            "{chi_square}: {seen:?} {expected:?}"
        );
    }

    #[test]
    fn a_lobe_follows_its_source() {
        let towards = |nearness: f32, p: Vec3| {
            let lobe = Lobe { weight: 1.0, axis: Vec3::Y, nearness, width: Lobe::LEAST_WIDTH };
            // The middle of the lobe.
            Mixture::new(Vec3::ZERO, &[lobe]).sample(p, [0.5, 0.0])
        };
        // A source 4 above the origin, one as far below it, and one at infinity.
        let p = Vec3::new(1.0, 0.0, 0.0);
        for (nearness, expected) in
            [(0.25, Vec3::new(-1.0, 4.0, 0.0)), (-0.25, Vec3::new(1.0, 4.0, 0.0)), (0.0, Vec3::Y)]
        {
            assert!((towards(nearness, p) - expected.normalize()).length() < 1e-3, "{nearness}");
        }
    }

    #[test]
    fn within_a_lobe_light_counts_as_the_lobe_shows_it() {
        let [left, right] = [Vec3::new(-0.6, 0.8, 0.0), Vec3::new(0.6, 0.8, 0.0)];
        let narrow = |weight, axis| Lobe { weight, axis, nearness: 0.0, width: 1e-4 };
        // The first was given up when it was fitted.
        let lobes = [narrow(0.0, right), narrow(0.5, left), narrow(0.5, right)];
        let mixture = Mixture::new(Vec3::ZERO, &lobes);
        let lobe = Lobe { weight: 1.0, axis: right, nearness: 0.0, width: 0.3 };
        let (within, shown) = mixture.within(Vec3::ZERO, Vec3::Y, &lobe);

        // Narrow light is shown as the lobe's density along it has it.
        let bell = Mixture::new(Vec3::ZERO, &[lobe]);
        let [of_left, of_right] = [left, right].map(|wi| 0.5 * bell.pdf(Vec3::ZERO, wi) / 0.8);
        assert!((shown / (of_left + of_right) - 1.0).abs() < 0.01, "{shown}");
        let draws = points(10_000).map(|u| within.sample(Vec3::ZERO, u));
        let share = draws.filter(|wi| wi.x < 0.0).count() as f32 / 10_000.0;
        let expected = of_left / (of_left + of_right);
        assert!((share - expected).abs() < 0.01, "{share} and not {expected}");
    }

    #[test]
    fn within_a_lobe_the_density_integrates_to_one() {
        let count = 4_000_000;
        for width in [0.06, 1.0] {
            let lobe = Lobe { weight: 1.0, axis: Vec3::new(0.6, 0.0, -0.8), nearness: 0.0, width };
            let (within, _) = three_lobes().within(NEARBY, Vec3::NEG_Z, &lobe);
            let density = |u| f64::from(within.pdf(NEARBY, warp::uniform_sphere(u)));
            let integral =
                points(count).map(density).sum::<f64>() / f64::from(count) * 4.0 * std::f64::consts::PI;
            assert!((integral - 1.0).abs() < 2e-3, "{width}: {integral}");
        }
    }

    #[test]
    fn the_sharpest_and_the_widest_lobe_stay_finite() {
        for width in [Lobe::LEAST_WIDTH, 1e-3, 1.0, 4.0] {
            let lobe = Lobe { weight: 1.0, axis: Vec3::Z, nearness: 0.0, width };
            let mixture = Mixture::new(Vec3::ZERO, &[lobe]);
            for u in [[0.0, 0.0], [0.3, 1.0 - 0.5 * f32::EPSILON], [1.0 - 0.5 * f32::EPSILON, 0.5]] {
                let wi = mixture.sample(Vec3::ZERO, u);
                let pdf = mixture.pdf(Vec3::ZERO, wi);
                assert!(
                    (wi.length() - 1.0).abs() < 1e-6 && pdf > 0.0 && pdf.is_finite(),
                    "{width} {u:?}: {wi} {pdf}"
                );
            }
        }
    }
}
