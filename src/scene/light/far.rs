//! Choosing among lights that do not weaken with distance.

use super::bounds::LEAST_COSINE;
use super::pick::Picking;
use super::unit::below_one;
use super::{Light, Receiver, Receivers};
use crate::core::lanes::{Floats, LANES};
use glam::Vec3;

/// Which light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Pick {
    Light(u32),
    Environment,
}

/// A light that is as strong at any distance.
#[derive(Clone, Copy, Debug)]
struct FarLight {
    pick: Pick,
    toward: Toward,
    /// Luminance of what arrives on a surface that faces it.
    irradiance: f32,
}

#[derive(Clone, Copy, Debug)]
enum Toward {
    Everywhere,
    Direction(Vec3),
    Point(Vec3),
}

/// Lights that are as strong at any distance.
#[derive(Clone, Debug, Default)]
pub(super) struct FarLights {
    list: Vec<FarLight>,
    /// Share of the irradiance of the lights up to and with each one.
    sums: Vec<f64>,
    /// Half of the irradiance of all: what a surface gets that faces half of them.
    unweighed: f32,
}

/// The light that is chosen for each of eight receivers.
pub(super) struct FarChosen {
    pub pick: [Pick; LANES],
    /// With what probability.
    pub probability: [f64; LANES],
    /// What is left of each choice.
    pub rest: [f64; LANES],
}

/// Up to so many far lights are weighed by how the receiver faces them; more are chosen by irradiance alone.
const WEIGHED: usize = 8;

impl FarLight {
    fn new(pick: Pick, toward: Toward, irradiance: f32) -> Option<Self> {
        (irradiance > 0.0 && irradiance.is_finite()).then_some(Self { pick, toward, irradiance })
    }

    /// About how much irradiance it gives to the receiver; never 0.
    #[inline(always)]
    fn importance(&self, to: &Receiver) -> f32 {
        let cos = match self.toward {
            Toward::Everywhere => 1.0,
            Toward::Direction(wi) => to.n.dot(wi),
            Toward::Point(position) => to.n.dot((position - to.p).normalize_or_zero()),
        };
        self.irradiance * cos.max(LEAST_COSINE)
    }

    /// The same for eight receivers.
    #[inline(always)]
    fn importances(&self, to: &Receivers) -> Floats {
        let mut cos = [1.0; LANES];
        match self.toward {
            Toward::Everywhere => {}
            Toward::Direction(wi) => {
                for lane in 0..LANES {
                    cos[lane] = to.n.get(lane).dot(wi);
                }
            }
            Toward::Point(position) => {
                for lane in 0..LANES {
                    cos[lane] = to.n.get(lane).dot((position - to.p.get(lane)).normalize_or_zero());
                }
            }
        }
        for cos in &mut cos {
            *cos = self.irradiance * cos.max(LEAST_COSINE);
        }
        cos
    }
}

impl FarLights {
    /// Those of `lights` and an environment of this irradiance, in luminance; an environment that emits is the first.
    pub(super) fn new(lights: &[Light], environment: Option<f32>) -> Self {
        let environment = environment
            .and_then(|irradiance| FarLight::new(Pick::Environment, Toward::Everywhere, irradiance));
        let lights = lights.iter().enumerate().filter_map(|(i, light)| {
            let pick = Pick::Light(i as u32);
            match light {
                Light::Directional(light) => {
                    FarLight::new(pick, Toward::Direction(light.wi), light.irradiance.luminance())
                }
                Light::Point(light) if !light.falloff => {
                    FarLight::new(pick, Toward::Point(light.position), light.intensity.luminance())
                }
                _ => None,
            }
        });
        let list: Vec<_> = environment.into_iter().chain(lights).collect();
        let total: f64 = list.iter().map(|light| f64::from(light.irradiance)).sum();
        let mut sum = 0.0;
        let sums = list.iter().map(|light| {
            sum += f64::from(light.irradiance) / total;
            sum
        });
        Self { sums: sums.collect(), list, unweighed: (0.5 * total) as f32 }
    }

    /// Whether there is none.
    #[inline]
    pub(super) fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Whether the environment is among them, as number 0.
    #[inline]
    pub(super) fn has_environment(&self) -> bool {
        self.list.first().is_some_and(|first| first.pick == Pick::Environment)
    }

    /// About how much irradiance all of them give to the receiver.
    #[inline]
    pub(super) fn importance(&self, to: &Receiver) -> f32 {
        if self.list.len() <= WEIGHED {
            self.list.iter().map(|light| light.importance(to)).sum()
        } else {
            self.unweighed
        }
    }

    /// The same for eight receivers.
    #[inline(always)]
    pub(super) fn importances(&self, to: &Receivers) -> Floats {
        if self.list.len() > WEIGHED {
            return [self.unweighed; LANES];
        }
        let mut total = Floats::default();
        for light in &self.list {
            let importances = light.importances(to);
            for lane in 0..LANES {
                total[lane] += importances[lane];
            }
        }
        total
    }

    /// For each of eight receivers one of them, the probability of choosing it, and what is left of `choice`. There must be
    /// one.
    #[inline(always)]
    pub(super) fn sample_eight(&self, to: &Receivers, choice: &[f64; LANES]) -> FarChosen {
        let mut chosen =
            FarChosen { pick: [self.list[0].pick; LANES], probability: [1.0; LANES], rest: *choice };
        if self.list.len() > WEIGHED {
            for lane in to.lanes() {
                let last = self.list.len() - 1;
                let index = self.sums.partition_point(|&sum| sum <= choice[lane]).min(last);
                let before = if index == 0 { 0.0 } else { self.sums[index - 1] };
                let probability = self.sums[index] - before;
                chosen.pick[lane] = self.list[index].pick;
                chosen.probability[lane] = probability;
                chosen.rest[lane] = below_one((choice[lane] - before) / probability);
            }
        } else if self.list.len() > 1 {
            let mut picking = Picking::new(&self.importances(to), choice);
            for (index, light) in (0..).zip(&self.list) {
                picking = picking.offer(index, &light.importances(to));
            }
            let picked = picking.picked();
            for lane in 0..LANES {
                chosen.pick[lane] = self.list[picked.index[lane] as usize].pick;
            }
            (chosen.probability, chosen.rest) = (picked.share, picked.rest);
        }
        chosen
    }

    /// The probability with which [`sample_eight`](Self::sample_eight) chooses number `index`.
    #[inline]
    pub(super) fn probability(&self, to: &Receiver, index: usize) -> f64 {
        if self.list.len() == 1 {
            1.0
        } else if self.list.len() <= WEIGHED {
            f64::from(self.list[index].importance(to)) / f64::from(self.importance(to))
        } else {
            self.sums[index] - if index == 0 { 0.0 } else { self.sums[index - 1] }
        }
    }
}
