//! All lights of a scene, and which of them to ask.

use super::bounds::LightBounds;
use super::far::{FarLights, Pick};
use super::tree::LightTree;
use super::unit::below_one;
use super::{EightSamples, EmitterHit, Environment, Light, LightSample, Receiver};
use crate::core::lanes::{LANES, Vectors};
use crate::core::{Rgb, sampler};
use glam::Vec3;

/// All lights of a scene and how one is chosen.
///
/// One light is asked per receiver, with a probability near its share of the irradiance: a tree finds it among the
/// lights that weaken with distance; the environment, directional lights and point lights without falloff are listed
/// beside it. Where there is one light only, it is asked always.
///
/// An environment that is about the same all around is not asked at all where the receiver's own lobes look for
/// light: samples of it would do no better than the lobe's own ray, and would be missing at the lights that need them
/// (the limit of Karlik et al. 2019, *MIS Compensation*). Beside a lamp, that halves a picture's squared error.
#[derive(Clone, Debug, Default)]
pub struct Lights {
    /// Lights by index: what [`Geometry::light`](crate::scene::Geometry::light) refers to. To be read only: the
    /// choice is prepared by [`new`](Self::new).
    pub lights: Vec<Light>,
    /// What a ray sees that hits nothing. To be read only, as above.
    pub environment: Option<Environment>,
    tree: LightTree,
    far: FarLights,
    /// Those of `far` that are worth a sample where lobes look for light themselves.
    beside_lobes: FarLights,
}

/// Which numbers [`Lights::sample`] looks at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Needs {
    /// `u`.
    pub direction: bool,
    /// `fine`.
    pub fine: bool,
}

/// Least probability of asking a far light, and of asking a near one, where there are both.
const LEAST_SHARE: f64 = 0.1;

impl Lights {
    /// Prepares the choice among these.
    pub fn new(lights: Vec<Light>, environment: Option<Environment>) -> Self {
        let bounds: Vec<_> = lights.iter().map(LightBounds::new).collect();
        let far = FarLights::new(&lights, environment.as_ref());
        let narrow = environment.as_ref().filter(|environment| !environment.is_broad());
        let beside_lobes = FarLights::new(&lights, narrow);
        Self { tree: LightTree::new(&bounds), far, beside_lobes, lights, environment }
    }

    /// Whether there is nothing to sample: no light, or none that emits.
    pub fn is_empty(&self) -> bool {
        self.tree.is_empty() && self.far.is_empty()
    }

    /// Chooses a light that matters to the receiver and a direction towards it.
    ///
    /// `None` where nothing would arrive. `fine` and `u` are in `[0, 1)`: the first of `u` chooses the light, and what
    /// is left of it goes on to the light itself, so that points that are spread well over the unit square are spread
    /// well over each light. With numbers of its own for the choice, each light would get a random part of them; where
    /// a lamp and a sky share 64 Sobol points, the variance of a highlight is then two to three times as high. `fine` stands for the
    /// bits that `u` has not.
    #[inline(always)]
    pub fn sample(&self, to: &Receiver, fine: f32, u: [f32; 2]) -> Option<LightSample> {
        let (pick, probability, u) = match (self.simple(), self.far(to).is_empty()) {
            (None, true) if self.tree.is_empty() => return None,
            (Some(light), true) => (Pick::Light(light), 1.0, [f64::from(u[0]), f64::from(u[1])]),
            _ => {
                let [choice, v] = widen(fine, u);
                let (pick, probability, rest) = self.choose(to, choice)?;
                (pick, probability, [rest, v])
            }
        };
        let sample = match (pick, &self.environment) {
            (Pick::Light(i), _) => self.lights[i as usize].sample(to, u)?,
            (Pick::Environment, Some(environment)) => environment.sample(to, u)?,
            (Pick::Environment, None) => return None,
        };
        let le_over_pdf = sample.le_over_pdf / probability as f32;
        let pdf = sample.pdf * probability as f32;
        arrives(LightSample { le_over_pdf, pdf, ..sample })
    }

    /// The one near light, if it is one and 24 bits are enough to choose a direction to it.
    #[inline(always)]
    fn simple(&self) -> Option<u32> {
        self.tree.only().filter(|&light| !matches!(self.lights[light as usize], Light::Mesh(_)))
    }

    /// What [`sample`](Self::sample) needs for receivers whose lobes look for light or do not.
    pub fn needs(&self, lobes_look: bool) -> Needs {
        let far = if lobes_look { &self.beside_lobes } else { &self.far };
        let fine = !far.is_empty() || self.simple().is_none() && !self.tree.is_empty();
        Needs { direction: fine || !self.tree.is_empty(), fine }
    }

    /// Samples of the light that may be the only one to choose, for eight receivers side by side; `None` where several
    /// are, or it is no rectangle.
    #[inline(always)]
    pub fn prepare(&self, receivers: &Vectors, u: &[[f32; 2]; LANES]) -> Option<EightSamples> {
        match self.lights.get(self.tree.only()? as usize)? {
            Light::Rectangle(light) => Some(light.sample_eight(receivers, u)),
            _ => None,
        }
    }

    /// [`sample`](Self::sample), where it may have been [prepared](Self::prepare) in a lane; else by `numbers`, `fine` and
    /// `u`, which are asked for where there is a light.
    #[inline(always)]
    pub fn sample_prepared(
        &self,
        to: &Receiver,
        prepared: Option<(&EightSamples, usize)>,
        numbers: impl FnOnce() -> (f32, [f32; 2]),
    ) -> Option<LightSample> {
        let far_is_empty = self.far(to).is_empty();
        match prepared.filter(|_| far_is_empty).and_then(|(samples, lane)| samples.get(lane)) {
            Some(sample) => arrives(sample),
            None if far_is_empty && self.tree.is_empty() => None,
            None => {
                let (fine, u) = numbers();
                self.sample(to, fine, u)
            }
        }
    }

    /// The density with which [`sample`](Self::sample) goes to this point of a light.
    #[inline(always)]
    pub fn pdf(&self, to: &Receiver, hit: &EmitterHit) -> f32 {
        let probability = self.near_share(to) * self.tree.probability(to, hit.light);
        if probability == 0.0 {
            return 0.0;
        }
        probability as f32 * self.lights[hit.light as usize].pdf(to, hit)
    }

    /// Radiance from the environment along `wi`, and the density with which [`sample`](Self::sample) goes there.
    #[inline]
    pub fn environment_and_pdf(&self, to: &Receiver, wi: Vec3) -> (Rgb, f32) {
        match &self.environment {
            Some(environment) if self.far(to).has_environment() => {
                let probability = (1.0 - self.near_share(to)) * self.far(to).probability(to, 0);
                let (le, pdf) = environment.le_and_pdf(to, wi);
                (le, probability as f32 * pdf)
            }
            Some(environment) => (environment.le(wi), 0.0),
            None => (Rgb::BLACK, 0.0),
        }
    }

    /// The second of [`environment_and_pdf`](Self::environment_and_pdf).
    #[inline]
    pub fn pdf_environment(&self, to: &Receiver, wi: Vec3) -> f32 {
        self.environment_and_pdf(to, wi).1
    }

    /// Which light, with what probability, and what is left of `choice`.
    #[inline(always)]
    fn choose(&self, to: &Receiver, choice: f64) -> Option<(Pick, f64, f64)> {
        let near_share = self.near_share(to);
        if choice < near_share {
            let (light, probability, rest) = self.tree.sample(to, below_one(choice / near_share))?;
            Some((Pick::Light(light), near_share * probability, rest))
        } else if self.far(to).is_empty() {
            None
        } else {
            let rest = below_one((choice - near_share) / (1.0 - near_share));
            let (pick, probability, rest) = self.far(to).sample(to, rest);
            Some((pick, (1.0 - near_share) * probability, rest))
        }
    }

    /// The far lights to choose among.
    #[inline]
    fn far(&self, to: &Receiver) -> &FarLights {
        if to.lobes_look { &self.beside_lobes } else { &self.far }
    }

    /// How often the light is one of the tree.
    #[inline]
    fn near_share(&self, to: &Receiver) -> f64 {
        let far = self.far(to);
        if far.is_empty() {
            return 1.0;
        }
        let near = f64::from(self.tree.importance(to));
        if near == 0.0 {
            return 0.0;
        }
        let far = f64::from(far.importance(to));
        LEAST_SHARE + (1.0 - 2.0 * LEAST_SHARE) * near / (near + far)
    }
}

/// The sample if it has any light.
#[inline(always)]
fn arrives(sample: LightSample) -> Option<LightSample> {
    (sample.le_over_pdf.is_finite() && !sample.le_over_pdf.is_black()).then_some(sample)
}

/// `u` with 28 bits more, from hashes of all numbers: a walk down a deep tree leaves few of the 24.
#[inline]
fn widen(fine: f32, u: [f32; 2]) -> [f64; 2] {
    let mut low = fine.to_bits() ^ sampler::hash(u[0].to_bits() ^ sampler::hash(u[1].to_bits()));
    u.map(|u| {
        low = sampler::hash(low ^ 0x5bd1_e995);
        f64::from(u) + f64::from(low >> 4) / (1u64 << 52) as f64
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::{Sampler, SamplerKind, warp};

    /// Independent numbers `(choice, u)` in a fixed order.
    fn numbers(seed: u32, i: u32) -> (f32, [f32; 2]) {
        let sampler = Sampler::new(SamplerKind::Independent, seed, 0, 0);
        (sampler.single(i, 0), sampler.pair(i, 1))
    }

    fn direction(seed: u32, i: u32) -> Vec3 {
        warp::uniform_sphere(numbers(seed, i).1)
    }

    /// Small rectangles, spheres and points all over the cube from -1 to 1, their powers a thousandfold apart.
    fn crowd(count: u32) -> Vec<Light> {
        (0..count)
            .map(|i| {
                let (power, [y, z]) = numbers(1, i);
                let p = 2.0 * Vec3::new(numbers(2, i).0, y, z) - 1.0;
                let radiance = Rgb::grey(1000f32.powf(power));
                let (u, v) = (0.01 * direction(3, i), direction(4, i));
                match i % 4 {
                    0 => Light::point(p, radiance * 1e-4, true, true),
                    1 => Light::sphere(crate::geometry::Sphere { center: p, radius: 0.005 }, radiance, false),
                    _ => Light::rectangle(p, u, 0.01 * u.cross(v).normalize(), radiance, i % 8 == 2),
                }
            })
            .collect()
    }

    fn receivers(count: u32) -> impl Iterator<Item = Receiver> {
        (0..count).map(|i| Receiver {
            p: 1.5 * direction(5, i) * numbers(6, i).0,
            n: direction(7, i),
            lobes_look: i % 2 == 0,
        })
    }

    #[test]
    fn probabilities_over_ten_thousand_lights_sum_to_one_and_are_those_of_the_choice() {
        let lights = Lights::new(crowd(10_000), None);
        for (i, to) in receivers(8).enumerate() {
            let of = |light| lights.tree.probability(&to, light);
            let sum: f64 = (0..10_000).map(of).sum();
            // A walk may end where neither side shines on the receiver: what it loses gives no light.
            assert!(sum > 0.95 && sum < 1.0 + 1e-9, "{sum}");
            let mut lost = 0.0;
            for j in 0..2000 {
                let (choice, u) = numbers(i as u32, j);
                let Some((Pick::Light(light), probability, rest)) = lights.choose(&to, widen(choice, u)[0])
                else {
                    lost += 1.0;
                    continue;
                };
                assert!((probability / of(light) - 1.0).abs() < 1e-9 && (0.0..1.0).contains(&rest));
            }
            let expected = 2000.0 * (1.0 - sum).max(0.0);
            assert!(lost <= expected + 5.0 * f64::max(expected, 1.0).sqrt(), "{lost} lost, not {expected}");
        }
    }

    #[test]
    fn every_light_is_reachable_from_before_it() {
        let lights = Lights::new(crowd(10_000), None);
        for (i, light) in (0u32..).zip(&lights.lights) {
            let p = match light {
                Light::Rectangle(light) => light.corners()[0] + 0.3 * light.normal(),
                Light::Sphere(light) => light.sphere.center + 0.3 * Vec3::X,
                Light::Point(light) => light.position + 0.3 * Vec3::X,
                _ => unreachable!("the crowd has none"),
            };
            let probability = lights.tree.probability(&Receiver { p, n: Vec3::Y, lobes_look: false }, i);
            assert!(probability > 0.0, "{i}");
        }
    }

    #[test]
    fn lights_are_chosen_as_often_as_their_probability_says() {
        let point = |x: f32| Light::point(Vec3::new(x, 1.0, 0.0), Rgb::WHITE, false, true);
        for far in [0u8, 3, 20] {
            let mut crowd = crowd(60);
            crowd.extend((0..far).map(|x| point(f32::from(x) - 5.0)));
            let count = crowd.len();
            let lights = Lights::new(crowd, (far > 0).then_some(Environment::Constant(Rgb::grey(50.0))));
            for (i, to) in receivers(4).enumerate() {
                let (mut found, mut expected, n) = (vec![0.0; count + 1], vec![0.0; count + 1], 40_000);
                for j in 0..n {
                    let (choice, u) = numbers(i as u32, j);
                    let Some((pick, probability, _)) = lights.choose(&to, widen(choice, u)[0]) else {
                        continue;
                    };
                    let index = match pick {
                        Pick::Light(light) => light as usize,
                        Pick::Environment => count,
                    };
                    found[index] += 1.0;
                    expected[index] = f64::from(n) * probability;
                }
                // Lights that are expected fewer than 5 times count as one.
                let (mut rare, mut chi_square, mut bins) = ([0.0; 2], 0.0f64, 0.0f64);
                for (found, expected) in found.into_iter().zip(expected) {
                    if expected < 5.0 {
                        rare = [rare[0] + found, rare[1] + expected];
                    } else {
                        chi_square += (found - expected) * (found - expected) / expected;
                        bins += 1.0;
                    }
                }
                assert!((rare[0] - rare[1]).abs() <= 5.0 * f64::max(rare[1], 1.0).sqrt(), "{rare:?}");
                assert!(bins > 2.0 && chi_square < bins + 5.0 * (2.0 * bins).sqrt(), "{chi_square} {bins}");
            }
        }
    }

    /// Mean and relative standard deviation of the irradiance by sampling.
    fn irradiance(lights: &Lights, to: &Receiver, n: u32) -> (f64, f64) {
        let (mut sum, mut squares) = (0.0, 0.0);
        for i in 0..n {
            let (choice, u) = numbers(9, i);
            let sample = lights.sample(to, choice, u);
            let x = sample.map_or(0.0, |s| f64::from(s.le_over_pdf.g * s.wi.dot(to.n).max(0.0)));
            sum += x;
            squares += x * x;
        }
        let mean = sum / f64::from(n);
        (mean, (squares / f64::from(n) - mean * mean).sqrt() / mean)
    }

    #[test]
    fn ten_thousand_lights_add_up_with_little_noise() {
        let lights = Lights::new(crowd(10_000), None);
        for to in receivers(4) {
            // 64 samples of each alone.
            let alone = lights.lights.iter().map(|light| Lights::new(vec![light.clone()], None));
            let alone: Vec<f64> = alone.map(|light| irradiance(&light, &to, 64).0).collect();
            let exact: f64 = alone.iter().sum();
            let n = 40_000;
            let (mean, deviation) = irradiance(&lights, &to, n);
            let error = 5.0 * deviation / f64::from(n).sqrt() + 0.01;
            assert!((mean / exact - 1.0).abs() < error, "{mean} is not {exact} +- {error}");
            let evenly = (alone.iter().map(|e| e * e).sum::<f64>() * 1e4).sqrt() / exact;
            assert!(deviation < evenly / 3.0, "{deviation}, evenly {evenly}");
        }
    }

    #[test]
    fn a_broad_environment_is_left_to_lobes_that_look() {
        let lamp = || vec![Light::rectangle(Vec3::Y, Vec3::X, Vec3::Z, Rgb::WHITE, true)];
        let looking = Receiver { p: Vec3::ZERO, n: Vec3::Y, lobes_look: true };
        let alone = Receiver { lobes_look: false, ..looking };
        let broad = Lights::new(lamp(), Some(Environment::Constant(Rgb::WHITE)));
        for choice in [0.0, 0.5, 0.99] {
            assert_eq!(broad.choose(&looking, choice), Some((Pick::Light(0), 1.0, choice)));
        }
        assert_eq!(broad.pdf_environment(&looking, Vec3::Y), 0.0);
        assert!(broad.pdf_environment(&alone, Vec3::Y) > 0.0);
        assert_eq!(broad.choose(&alone, 0.99).map(|(pick, ..)| pick), Some(Pick::Environment));
        let sky = Lights::new(vec![], Some(Environment::Constant(Rgb::WHITE)));
        assert!(sky.sample(&looking, 0.5, [0.5; 2]).is_none() && sky.sample(&alone, 0.5, [0.5; 2]).is_some());
        let softboxes = Lights::new(lamp(), Some(Environment::product_shot(1.0, 0.0)));
        let [key_light, cove] = [Vec3::new(-0.75, 0.75, 0.65).normalize(), Vec3::NEG_Y];
        assert!(softboxes.pdf_environment(&looking, key_light) > 0.0);
        assert_eq!(softboxes.pdf_environment(&looking, cove), 0.0);
        assert!(softboxes.pdf_environment(&alone, cove) > 0.0);
    }

    #[test]
    fn one_light_is_asked_always() {
        let rectangle = Light::rectangle(Vec3::Y, Vec3::X, Vec3::Z, Rgb::WHITE, true);
        let dark = Light::rectangle(Vec3::Y, Vec3::X, Vec3::Z, Rgb::BLACK, true);
        let to = Receiver { p: Vec3::ZERO, n: Vec3::Y, lobes_look: false };
        let lights = Lights::new(vec![dark, rectangle], Some(Environment::Constant(Rgb::BLACK)));
        assert_eq!(lights.choose(&to, 0.7), Some((Pick::Light(1), 1.0, 0.7)));
        assert_eq!(lights.tree.probability(&to, 0), 0.0);
        let sky = Lights::new(vec![], Some(Environment::Constant(Rgb::WHITE)));
        assert_eq!(sky.choose(&to, 0.7), Some((Pick::Environment, 1.0, 0.7)));
        assert!(Lights::new(vec![], None).choose(&to, 0.7).is_none() && Lights::default().is_empty());
    }
}
