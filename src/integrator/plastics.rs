//! Plastics of eight surfaces, side by side.

use super::eight::{Directions, Pairs};
use crate::bxdf::{Bxdf, CoatEnergy, Drawn, Layers};
use crate::core::Rgb;
use crate::core::lanes::{Colours, Floats, LANES, Vectors};
use crate::scene::Interactions;

/// The lobes of eight plastics.
#[derive(Clone, Copy)]
pub(super) struct Plastics {
    eta: Floats,
    alpha: Floats,
    entering: Floats,
    base: Floats,
    transmitted: Colours,
    energy: [&'static CoatEnergy; LANES],
}

impl Plastics {
    /// `None` if a lobe is no plastic's.
    #[inline(always)]
    pub(super) fn of(lobe: impl Fn(usize) -> Bxdf) -> Option<Self> {
        let Bxdf::Plastic(first) = lobe(0) else { return None };
        let [eta, alpha, entering, base] = [Floats::default(); 4];
        let energy = [first.coat().energy(); LANES];
        let mut plastics = Self { eta, alpha, entering, base, transmitted: Colours::default(), energy };
        for lane in 0..LANES {
            let Bxdf::Plastic(lobe) = lobe(lane) else { return None };
            let Layers { eta, alpha, entering, base } = lobe.layers();
            (plastics.eta[lane], plastics.alpha[lane]) = (eta, alpha);
            (plastics.entering[lane], plastics.base[lane]) = (entering, base);
            plastics.transmitted.set(lane, lobe.transmitted());
            plastics.energy[lane] = lobe.coat().energy();
        }
        Some(plastics)
    }

    #[inline(always)]
    fn layers(&self, lane: usize) -> Layers {
        let Self { eta, alpha, entering, base, .. } = self;
        Layers { eta: eta[lane], alpha: alpha[lane], entering: entering[lane], base: base[lane] }
    }

    /// The coats' albedos towards `w`.
    #[inline(always)]
    fn reflected(&self, points: &Interactions, w: &Vectors) -> Floats {
        let mut cos = Floats::default();
        for lane in 0..LANES {
            cos[lane] = points.n.get(lane).dot(w.get(lane));
        }
        CoatEnergy::albedos(&self.energy, &cos)
    }

    /// What is reflected of light from `wi`, and the density of rays there.
    #[inline(always)]
    pub(super) fn evaluate(&self, points: &Interactions, wi: &Vectors) -> (Colours, Floats) {
        self.value(points, &self.reflected(points, &points.wo), wi)
    }

    /// The same, where the coats' albedos towards the viewer are `e`.
    #[inline(always)]
    fn value(&self, points: &Interactions, e: &Floats, wi: &Vectors) -> (Colours, Floats) {
        let (at, e_i) = (points.incidences(), self.reflected(points, wi));
        let (mut f_cos, mut pdf) = (Colours::default(), Floats::default());
        for lane in 0..LANES {
            let value = self.layers(lane).value(&at.get(lane), [e[lane], e_i[lane]], wi.get(lane));
            f_cos.set(lane, value.f_cos(self.transmitted.get(lane)));
            pdf[lane] = value.pdf;
        }
        (f_cos, pdf)
    }

    /// The directions that the numbers `u` draw, and the weight of each one.
    #[inline(always)]
    pub(super) fn draw(&self, points: &Interactions, [x, y]: &Pairs) -> (Directions, Colours) {
        let (at, e) = (points.incidences(), self.reflected(points, &points.wo));
        let mut wi = Vectors::default();
        for lane in 0..LANES {
            let drawn = self.layers(lane).draw(&at.get(lane), e[lane], [x[lane], y[lane]]);
            wi.set(lane, drawn);
        }
        let (f_cos, pdf) = self.value(points, &e, &wi);
        let (mut directions, mut weights) = (Directions::default(), Colours::default());
        for lane in 0..LANES {
            let (wi, pdf) = (wi.get(lane), pdf[lane]);
            let (there, weight) = (pdf > 0.0, f_cos.get(lane) / pdf);
            weights.set(lane, if there { weight } else { Rgb::BLACK });
            directions.set(lane, Drawn { wi, weight: f32::from(there), cos_half: 1.0, pdf });
        }
        (directions, weights)
    }
}
