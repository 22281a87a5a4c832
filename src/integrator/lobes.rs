//! The lobes of eight surfaces, side by side: where a kind of lobe that is shaded so has its place beside the others.

use super::eight::{Directions, Pairs};
use super::metals::Metals;
use super::order::Order;
use super::plastics::Plastics;
use super::powers::ColouredPowers;
use crate::bxdf::{Bxdf, Diffuse, LobeKind, Width};
use crate::core::lanes::{Colours, Floats, LANES, Vectors};
use crate::scene::Interactions;

/// One lobe of each of eight surfaces, all of one kind.
pub(super) enum Lobes {
    /// Diffuse ones, by their reflectance.
    Diffuse(Colours),
    /// Those of rough metals.
    Metal(Metals),
    /// Those of plastics.
    Plastic(Plastics),
    /// Cosine powers.
    Power(ColouredPowers),
}

impl Lobes {
    /// The lobes of eight surfaces of a kind, if that kind is one of these: only then is each `lobe` asked for.
    #[inline(always)]
    pub(super) fn of(kind: usize, lobe: impl Fn(usize) -> Bxdf) -> Option<Self> {
        match kind {
            Order::DIFFUSE => Self::diffuse(lobe),
            Order::METAL => Metals::of(lobe).map(Self::Metal),
            Order::PLASTIC => Plastics::of(lobe).map(Self::Plastic),
            Order::POWER => ColouredPowers::of(lobe).map(Self::Power),
            _ => None,
        }
    }

    /// `None` if a lobe is not diffuse.
    #[inline(always)]
    fn diffuse(lobe: impl Fn(usize) -> Bxdf) -> Option<Self> {
        let mut reflectances = Colours::default();
        for lane in 0..LANES {
            let Bxdf::Diffuse(lobe) = lobe(lane) else { return None };
            reflectances.set(lane, lobe.reflectance);
        }
        Some(Self::Diffuse(reflectances))
    }

    /// What is reflected of light from `wi`, and the density of rays there.
    #[inline(always)]
    pub(super) fn evaluate(&self, points: &Interactions, wi: &Vectors) -> (Colours, Floats) {
        match self {
            Self::Diffuse(reflectance) => {
                let (mut f_cos, mut pdf) = (Colours::default(), Floats::default());
                for lane in 0..LANES {
                    pdf[lane] = Diffuse::density(points.n.get(lane), points.ng.get(lane), wi.get(lane));
                    f_cos.set(lane, reflectance.get(lane) * pdf[lane]);
                }
                (f_cos, pdf)
            }
            Self::Metal(metals) => metals.evaluate(points, wi),
            Self::Plastic(plastics) => plastics.evaluate(points, wi),
            Self::Power(powers) => powers.evaluate(points, wi),
        }
    }

    /// The directions that the numbers `u` draw, and the colour of each one's weight.
    #[inline(always)]
    pub(super) fn draw(&self, points: &Interactions, u: &Pairs) -> (Directions, Colours) {
        match self {
            Self::Diffuse(reflectance) => (Directions::diffuse(points, u), *reflectance),
            Self::Metal(metals) => metals.draw(points, u),
            Self::Plastic(plastics) => plastics.draw(points, u),
            Self::Power(powers) => powers.draw(points, u),
        }
    }

    /// See [`Bxdf::width`].
    #[inline(always)]
    pub(super) fn width(&self, lane: usize) -> Width {
        match self {
            Self::Diffuse(_) | Self::Plastic(_) => Width::EVERYWHERE,
            Self::Metal(metals) => metals.width(lane),
            Self::Power(powers) => powers.width(lane),
        }
    }

    /// Of all of them.
    pub(super) fn kind(&self) -> LobeKind {
        match self {
            Self::Diffuse(_) => LobeKind::Diffuse,
            Self::Metal(_) | Self::Plastic(_) | Self::Power(_) => LobeKind::Glossy,
        }
    }
}
