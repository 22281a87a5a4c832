//! Cosine powers of eight surfaces, side by side.

use super::eight::{Directions, Pairs};
use crate::bxdf::{Bxdf, CosinePower, Horizon, Policy, Width};
use crate::core::lanes::{Colours, Floats, LANES, Vectors};
use crate::scene::Interactions;

/// The shapes of eight cosine powers, whatever their colours.
#[derive(Clone, Copy, Default)]
pub(super) struct Powers {
    exponent: Floats,
    /// See [`Policy`].
    turns: Floats,
    divides: Floats,
    reciprocal: Floats,
}

impl Powers {
    /// Whether a lobe can be one of eight: not where it may have to be drawn more than once.
    pub(super) fn takes(lobe: &CosinePower) -> bool {
        lobe.horizon != Horizon::Reject
    }

    /// Puts a lobe into a lane.
    #[inline(always)]
    pub(super) fn set(&mut self, lane: usize, lobe: &CosinePower) {
        let Policy { turns, divides, reciprocal } = lobe.policy();
        (self.exponent[lane], self.turns[lane]) = (lobe.exponent, turns);
        (self.divides[lane], self.reciprocal[lane]) = (divides, reciprocal);
    }

    #[inline(always)]
    fn policy(&self, lane: usize) -> Policy {
        let Self { turns, divides, reciprocal, .. } = self;
        Policy { turns: turns[lane], divides: divides[lane], reciprocal: reciprocal[lane] }
    }

    /// The directions that the numbers `u` draw.
    #[inline(always)]
    pub(super) fn draw(&self, points: &Interactions, [x, y]: &Pairs) -> Directions {
        let (at, mut directions) = (points.incidences(), Directions::default());
        for lane in 0..LANES {
            let u = [x[lane], y[lane]];
            let drawn = CosinePower::draw(self.exponent[lane], self.policy(lane), &at.get(lane), u);
            directions.set(lane, drawn);
        }
        directions
    }

    /// What reflects of light from `wi`, without its colour, and the density of rays there.
    #[inline(always)]
    fn evaluate(&self, points: &Interactions, wi: &Vectors) -> [Floats; 2] {
        let at = points.incidences();
        let [mut f_cos, mut pdf] = [Floats::default(); 2];
        for lane in 0..LANES {
            let (exponent, policy) = (self.exponent[lane], self.policy(lane));
            [f_cos[lane], pdf[lane]] = CosinePower::value(exponent, policy, &at.get(lane), wi.get(lane));
        }
        [f_cos, pdf]
    }
}

/// The lobes of eight surfaces.
#[derive(Clone, Copy, Default)]
pub(super) struct ColouredPowers {
    powers: Powers,
    reflectance: Colours,
}

impl ColouredPowers {
    /// `None` if a lobe is none of these.
    #[inline(always)]
    pub(super) fn of(lobe: impl Fn(usize) -> Bxdf) -> Option<Self> {
        let mut made = Self::default();
        for lane in 0..LANES {
            let Bxdf::CosinePower(lobe) = lobe(lane) else { return None };
            made.powers.set(lane, &lobe);
            made.reflectance.set(lane, lobe.reflectance);
        }
        Some(made)
    }

    /// See [`Bxdf::width`].
    #[inline(always)]
    pub(super) fn width(&self, lane: usize) -> Width {
        Width::of_power(self.powers.exponent[lane])
    }

    /// What is reflected of light from `wi`, and the density of rays there.
    #[inline(always)]
    pub(super) fn evaluate(&self, points: &Interactions, wi: &Vectors) -> (Colours, Floats) {
        let ([colourless, pdf], mut f_cos) = (self.powers.evaluate(points, wi), Colours::default());
        for lane in 0..LANES {
            f_cos.set(lane, self.reflectance.get(lane) * colourless[lane]);
        }
        (f_cos, pdf)
    }

    /// The directions that the numbers `u` draw, and the colour of each one's weight.
    #[inline(always)]
    pub(super) fn draw(&self, points: &Interactions, u: &Pairs) -> (Directions, Colours) {
        (self.powers.draw(points, u), self.reflectance)
    }

    /// The greatest channel of each lobe's albedo.
    #[inline(always)]
    pub(super) fn albedo(&self, points: &Interactions) -> Floats {
        let (at, mut albedo) = (points.incidences(), Floats::default());
        for lane in 0..LANES {
            let Powers { exponent, .. } = self.powers;
            let whole = CosinePower::whole_albedo(exponent[lane], self.powers.policy(lane), &at.get(lane));
            albedo[lane] = (self.reflectance.get(lane) * whole).max_channel();
        }
        albedo
    }
}
