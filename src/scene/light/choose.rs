//! All lights of a scene, and which of them to ask.

use super::alias::below_one;
use super::bounds::{LEAST_COSINE, LightBounds};
use super::tree::LightTree;
use super::{EmitterHit, Environment, Light, LightSample, Receiver};
use crate::core::sampler;
use glam::Vec3;

/// All lights of a scene and how one is chosen.
///
/// One light is asked per receiver, with a probability near its share of the irradiance: a tree finds it among the
/// lights that weaken with distance; the environment, directional lights and point lights without falloff are listed
/// beside it. Where there is one light only, it is asked always.
#[derive(Clone, Debug, Default)]
pub struct Lights {
    /// Lights by index: what [`Geometry::light`](crate::scene::Geometry::light) refers to. To be read only: the
    /// choice is prepared by [`new`](Self::new).
    pub lights: Vec<Light>,
    /// What a ray sees that hits nothing. To be read only, as above.
    pub environment: Option<Environment>,
    tree: LightTree,
    far: FarLights,
}

/// Which light.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Pick {
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
struct FarLights {
    list: Vec<FarLight>,
    /// Share of the irradiance of the lights up to and with each one.
    sums: Vec<f64>,
    /// Half of the irradiance of all: what a surface gets that faces half of them.
    unweighed: f32,
}

/// Up to so many far lights are weighed by how the receiver faces them; more are chosen by irradiance alone.
const WEIGHED: usize = 8;

/// Least probability of asking a far light, and of asking a near one, where there are both.
const LEAST_SHARE: f64 = 0.1;

impl FarLight {
    fn new(pick: Pick, toward: Toward, irradiance: f32) -> Option<Self> {
        (irradiance > 0.0 && irradiance.is_finite()).then_some(Self { pick, toward, irradiance })
    }

    /// About how much irradiance it gives to the receiver; never 0.
    #[inline]
    fn importance(&self, to: &Receiver) -> f32 {
        let cos = match self.toward {
            Toward::Everywhere => 1.0,
            Toward::Direction(wi) => to.n.dot(wi),
            Toward::Point(position) => to.n.dot((position - to.p).normalize_or_zero()),
        };
        self.irradiance * cos.max(LEAST_COSINE)
    }
}

impl FarLights {
    fn new(lights: &[Light], environment: Option<&Environment>) -> Self {
        let environment = environment.and_then(|environment| {
            FarLight::new(Pick::Environment, Toward::Everywhere, environment.irradiance().luminance())
        });
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

    /// About how much irradiance all of them give to the receiver.
    #[inline]
    fn importance(&self, to: &Receiver) -> f32 {
        if self.list.len() <= WEIGHED {
            self.list.iter().map(|light| light.importance(to)).sum()
        } else {
            self.unweighed
        }
    }

    /// One of them, the probability of choosing it, and what is left of `choice`. There must be one.
    #[inline]
    fn sample(&self, to: &Receiver, choice: f64) -> (Pick, f64, f64) {
        let last = self.list.len() - 1;
        if last == 0 {
            return (self.list[0].pick, 1.0, choice);
        }
        let (index, before) = if self.list.len() <= WEIGHED {
            let total = f64::from(self.importance(to));
            let mut before = 0.0;
            let mut index = 0;
            loop {
                let share = f64::from(self.list[index].importance(to)) / total;
                if index == last || choice < before + share {
                    break (index, before);
                }
                before += share;
                index += 1;
            }
        } else {
            let index = self.sums.partition_point(|&sum| sum <= choice).min(last);
            (index, if index == 0 { 0.0 } else { self.sums[index - 1] })
        };
        let probability = self.probability(to, index);
        (self.list[index].pick, probability, below_one((choice - before) / probability))
    }

    /// The probability with which [`sample`](Self::sample) chooses number `index`.
    #[inline]
    fn probability(&self, to: &Receiver, index: usize) -> f64 {
        if self.list.len() == 1 {
            1.0
        } else if self.list.len() <= WEIGHED {
            f64::from(self.list[index].importance(to)) / f64::from(self.importance(to))
        } else {
            self.sums[index] - if index == 0 { 0.0 } else { self.sums[index - 1] }
        }
    }
}

impl Lights {
    /// Prepares the choice among these.
    pub fn new(lights: Vec<Light>, environment: Option<Environment>) -> Self {
        let bounds: Vec<_> = lights.iter().map(LightBounds::new).collect();
        let far = FarLights::new(&lights, environment.as_ref());
        Self { tree: LightTree::new(&bounds), far, lights, environment }
    }

    /// Whether there is nothing to sample: no light, or none that emits.
    pub fn is_empty(&self) -> bool {
        self.tree.is_empty() && self.far.list.is_empty()
    }

    /// Chooses a light that matters to the receiver and a direction towards it.
    ///
    /// `None` where nothing would arrive. `choice` and `u` are in `[0, 1)`.
    #[inline]
    pub fn sample(&self, to: &Receiver, choice: f32, u: [f32; 2]) -> Option<LightSample> {
        let (pick, probability, rest) = self.choose(to, widen(choice, u))?;
        let sample = match (pick, &self.environment) {
            (Pick::Light(i), _) => self.lights[i as usize].sample(to, rest, u)?,
            (Pick::Environment, Some(environment)) => environment.sample(to, rest, u)?,
            (Pick::Environment, None) => return None,
        };
        let le_over_pdf = sample.le_over_pdf / probability as f32;
        let arrives = le_over_pdf.is_finite() && !le_over_pdf.is_black();
        let ln_pdf = sample.ln_pdf + probability.ln() as f32;
        arrives.then_some(LightSample { le_over_pdf, ln_pdf, ..sample })
    }

    /// Logarithm of the density with which [`sample`](Self::sample) goes to this point of a light.
    #[inline]
    pub fn ln_pdf(&self, to: &Receiver, hit: &EmitterHit) -> f32 {
        let probability = self.near_share(to) * self.tree.probability(to, hit.light);
        if probability == 0.0 {
            return f32::NEG_INFINITY;
        }
        probability.ln() as f32 + self.lights[hit.light as usize].ln_pdf(to, hit)
    }

    /// Logarithm of the density with which [`sample`](Self::sample) goes along `wi` to the environment.
    #[inline]
    pub fn ln_pdf_environment(&self, to: &Receiver, wi: Vec3) -> f32 {
        // An environment that emits is the first of the far lights.
        let sampled = self.far.list.first().is_some_and(|first| first.pick == Pick::Environment);
        match &self.environment {
            Some(environment) if sampled => {
                let probability = (1.0 - self.near_share(to)) * self.far.probability(to, 0);
                probability.ln() as f32 + environment.pdf(to, wi).ln()
            }
            _ => f32::NEG_INFINITY,
        }
    }

    /// Which light, with what probability, and what is left of `choice`.
    #[inline]
    fn choose(&self, to: &Receiver, choice: f64) -> Option<(Pick, f64, f64)> {
        let near_share = self.near_share(to);
        if choice < near_share {
            let (light, probability, rest) = self.tree.sample(to, below_one(choice / near_share))?;
            Some((Pick::Light(light), near_share * probability, rest))
        } else if self.far.list.is_empty() {
            None
        } else {
            let rest = below_one((choice - near_share) / (1.0 - near_share));
            let (pick, probability, rest) = self.far.sample(to, rest);
            Some((pick, (1.0 - near_share) * probability, rest))
        }
    }

    /// How often the light is one of the tree.
    #[inline]
    fn near_share(&self, to: &Receiver) -> f64 {
        if self.far.list.is_empty() {
            return 1.0;
        }
        let near = f64::from(self.tree.importance(to));
        if near == 0.0 {
            return 0.0;
        }
        let far = f64::from(self.far.importance(to));
        LEAST_SHARE + (1.0 - 2.0 * LEAST_SHARE) * near / (near + far)
    }
}

/// `choice` with 28 bits more, from a hash of `u`: a walk down a deep tree leaves few of the 24.
#[inline]
fn widen(choice: f32, u: [f32; 2]) -> f64 {
    let low = sampler::hash(u[0].to_bits() ^ sampler::hash(u[1].to_bits() ^ 0x5bd1_e995)) >> 4;
    f64::from(choice) + f64::from(low) / (1u64 << 52) as f64
}
