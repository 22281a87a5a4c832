//! Rough metals of eight surfaces, side by side.

use super::eight::{Directions, Pairs};
use crate::bxdf::{Bxdf, ComplexIor, Conductor, Width};
use crate::core::lanes::{Colours, Floats, LANES, Vectors};
use crate::scene::Interactions;

/// The lobes of eight rough metals.
#[derive(Clone, Copy, Default)]
pub(super) struct Metals {
    alpha: Floats,
    reflectance: Colours,
    /// Of those that have an index of refraction; some value for the others.
    eta: Colours,
    k: Colours,
    has_ior: [bool; LANES],
}

impl Metals {
    /// `None` if a lobe is no metal's.
    #[inline(always)]
    pub(super) fn of(lobe: impl Fn(usize) -> Bxdf) -> Option<Self> {
        let mut metals = Self::default();
        for lane in 0..LANES {
            let Bxdf::Conductor(Conductor { reflectance, ior, alpha }) = lobe(lane) else { return None };
            metals.alpha[lane] = alpha;
            metals.reflectance.set(lane, reflectance);
            if let Some(ComplexIor { eta, k }) = ior {
                metals.eta.set(lane, eta);
                metals.k.set(lane, k);
                metals.has_ior[lane] = true;
            }
        }
        Some(metals)
    }

    /// What is reflected of light from `wi`, and the density of rays there.
    #[inline(always)]
    pub(super) fn evaluate(&self, points: &Interactions, wi: &Vectors) -> (Colours, Floats) {
        let at = points.incidences();
        let [mut cos_half, mut colourless, mut pdf] = [Floats::default(); 3];
        for lane in 0..LANES {
            let value = Conductor::value(self.alpha[lane], &at.get(lane), wi.get(lane));
            (cos_half[lane], colourless[lane], pdf[lane]) = (value.cos_half, value.f_cos, value.pdf);
        }
        let mut f_cos = self.colours(&cos_half);
        for lane in 0..LANES {
            f_cos.set(lane, f_cos.get(lane) * colourless[lane]);
        }
        (f_cos, pdf)
    }

    /// The directions that the numbers `u` draw, and the colour of each one's weight.
    #[inline(always)]
    pub(super) fn draw(&self, points: &Interactions, u: &Pairs) -> (Directions, Colours) {
        let directions = Directions::metal(points, &self.alpha, u);
        (directions, self.colours(&directions.cos_half))
    }

    /// See [`Bxdf::width`].
    #[inline(always)]
    pub(super) fn width(&self, lane: usize) -> Width {
        Width::of_metal(self.alpha[lane])
    }

    /// The colours of reflections at these cosines of incidence, as each metal by itself has them.
    #[inline(always)]
    fn colours(&self, cos: &Floats) -> Colours {
        let mut colours = self.reflectance;
        if self.has_ior.contains(&true) {
            for lane in 0..LANES {
                let ior = ComplexIor { eta: self.eta.get(lane), k: self.k.get(lane) };
                let colour = self.reflectance.get(lane) * ior.reflectance(cos[lane]);
                colours.set(lane, if self.has_ior[lane] { colour } else { colours.get(lane) });
            }
        }
        colours
    }
}
