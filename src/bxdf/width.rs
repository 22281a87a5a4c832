//! How wide lobes are: what one lobe has reflected of a small light, rays drawn from a much wider one hardly find.

use super::Bxdf;

/// The width of a lobe: where its density falls from the mirror's direction as `(1 + c / width)^-3` does, near it, where `c` is the
/// squared chord from there.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Width(pub f32);

impl Width {
    /// Of what reflects like a mirror.
    pub const NONE: Self = Self(0.0);

    /// Of what reflects everywhere, if only beside a gloss.
    pub const EVERYWHERE: Self = Self(f32::INFINITY);

    /// The narrowest that is wide: that of a metal of roughness 0.1.
    const LEAST: Self = Self(0.06);

    /// By how much a lobe must be wider than that which has reflected a light, to miss it: three times as rough.
    const WIDER: f32 = 9.0;

    /// That of a rough metal, seen head on.
    #[inline(always)]
    pub fn of_metal(alpha: f32) -> Self {
        // Half vectors turn by half as much: the squared tangent of their angle is a quarter of the squared chord, and
        // Trowbridge and Reitz's distribution falls as (1 + tan^2 / alpha^2)^-2.
        Self(6.0 * alpha * alpha)
    }

    /// That of a cosine power.
    #[inline(always)]
    pub fn of_power(exponent: f32) -> Self {
        // The cosine is 1 - c / 2.
        Self(6.0 / exponent)
    }

    /// Whether rays drawn from such a lobe may miss what is small and bright.
    #[inline(always)]
    pub fn is_wide(self) -> bool {
        self >= Self::LEAST
    }

    /// Whether they hardly find what a lobe of the width `reflector` has reflected of a small light.
    pub fn misses(self, reflector: Self) -> bool {
        self.is_wide() && self.0 > Self::WIDER * reflector.0
    }
}

impl Bxdf {
    /// How wide it is.
    #[inline(always)]
    pub fn width(&self) -> Width {
        match self {
            Self::Mirror(_) | Self::Dielectric(_) => Width::NONE,
            Self::Conductor(lobe) => Width::of_metal(lobe.alpha),
            Self::CosinePower(lobe) => Width::of_power(lobe.exponent),
            Self::Diffuse(_) | Self::Plastic(_) => Width::EVERYWHERE,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Conductor, CosinePower, Diffuse, Horizon, Incidence};
    use super::*;
    use crate::core::Rgb;
    use glam::Vec3;

    fn metal(alpha: f32) -> Bxdf {
        Bxdf::Conductor(Conductor { reflectance: Rgb::WHITE, ior: None, alpha })
    }

    fn power(exponent: f32) -> Bxdf {
        Bxdf::CosinePower(CosinePower { reflectance: Rgb::WHITE, exponent, horizon: Horizon::Fold })
    }

    #[test]
    fn densities_fall_as_their_width_says() {
        let at = Incidence { wo: Vec3::Z, n: Vec3::Z, ng: Vec3::Z, front: true };
        for lobe in [metal(0.1), metal(0.3), power(20.0), power(500.0)] {
            let Width(width) = lobe.width();
            let sin = (0.02 * width).sqrt();
            let wi = Vec3::new(sin, 0.0, (1.0 - sin * sin).sqrt());
            let falls = lobe.pdf(&at, Vec3::Z) / lobe.pdf(&at, wi) - 1.0;
            let expected = (1.0 + (wi - Vec3::Z).length_squared() / width).powi(3) - 1.0;
            assert!((falls / expected - 1.0).abs() < 0.1, "{lobe:?}: {falls} and not {expected}");
        }
    }

    #[test]
    fn wide_lobes_miss_what_narrow_ones_reflect() {
        let diffuse = Bxdf::Diffuse(Diffuse { reflectance: Rgb::WHITE });
        for (lobe, reflector, misses) in [
            (diffuse, metal(0.25), true),
            (metal(0.3), metal(0.05), true),
            (metal(0.3), metal(0.15), false),
            (power(5.0), metal(0.02), true),
            (metal(0.05), metal(0.0), false),
            (metal(0.3), diffuse, false),
            (diffuse, diffuse, false),
        ] {
            assert_eq!(lobe.width().misses(reflector.width()), misses, "{lobe:?} and {reflector:?}");
        }
    }
}
