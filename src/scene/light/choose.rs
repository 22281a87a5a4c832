//! All lights of a scene, and which of them to ask.

use super::bounds::LightBounds;
use super::far::{FarLights, Pick};
use super::tree::LightTree;
use super::unit::below_one;
use super::{
    EightSamples, EmitterHit, Environment, Light, LightSample, Receiver, Receivers, RectangleLight, Rivals,
    SphereLight,
};
use crate::core::lanes::{Floats, LANES, Vectors};
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
    /// Those that are worth a sample beside each kind of [`Rivals`].
    far: [FarLights; 3],
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
        let far = [Rivals::None, Rivals::Lobes, Rivals::Portals].map(|rivals| {
            let irradiance = environment.as_ref().map(|environment| environment.irradiance_beside(rivals));
            FarLights::new(&lights, irradiance.map(Rgb::luminance))
        });
        Self { tree: LightTree::new(&bounds), far, lights, environment }
    }

    /// Whether there is nothing to sample: no light, or none that emits.
    pub fn is_empty(&self) -> bool {
        self.tree.is_empty() && self.far(Rivals::None).is_empty()
    }

    /// Chooses a light that matters to the receiver and a direction towards it.
    ///
    /// `None` where nothing would arrive. `fine` and `u` are in `[0, 1)`: see [`sample_eight`](Self::sample_eight).
    pub fn sample(&self, to: &Receiver, fine: f32, u: [f32; 2]) -> Option<LightSample> {
        let mut receivers = Receivers::default();
        receivers.set(0, to);
        let mut samples = EightSamples::default();
        self.sample_eight(&receivers, || [fine; LANES], &u.map(|u| [u; LANES]), &mut samples);
        samples.get(0)
    }

    /// Chooses a light that matters to each receiver and a direction towards it.
    ///
    /// The first of `u` chooses the light, and what is left of it goes on to the light itself, so that points that are
    /// spread well over the unit square are spread well over each light. With numbers of its own for the choice, each
    /// light would get a random part of them; where a lamp and a sky share 64 Sobol points, the variance of a highlight is
    /// then two to three times as high. `fine` stands for the bits that `u` has not, and is asked for where they matter.
    /// Both are in `[0, 1)`; [`needs`](Self::needs) tells which of them matter.
    #[inline(always)]
    pub fn sample_eight(
        &self,
        to: &Receivers,
        fine: impl FnOnce() -> Floats,
        u: &[Floats; 2],
        samples: &mut EightSamples,
    ) {
        let mut wide = [[0.0; LANES]; 2];
        for lane in 0..LANES {
            (wide[0][lane], wide[1][lane]) = (f64::from(u[0][lane]), f64::from(u[1][lane]));
        }
        // Where there is one light only, without the detours of the others.
        match self.simple(to) {
            Some(Light::Rectangle(light)) => {
                *samples = RectangleLight::sample_eight(|_| light, to, &wide, to.there);
                samples.chosen_with(&[1.0; LANES]);
            }
            Some(Light::Sphere(light)) => {
                *samples = SphereLight::sample_eight(|_| light, to, &wide, to.there);
                samples.chosen_with(&[1.0; LANES]);
            }
            simple => {
                if simple.is_none() {
                    wide = widen(fine(), u);
                }
                let (picks, probability, u) = self.choose(to, wide);
                self.sample_lights(to, &picks, &u, samples);
                samples.chosen_with(&probability);
            }
        }
    }

    /// The one light that there is to choose for these receivers, if it is one and 24 bits are enough for a direction to it.
    #[inline(always)]
    fn simple(&self, to: &Receivers) -> Option<&Light> {
        let light = &self.lights[self.simple_near()? as usize];
        let far_is_empty = self.far.each_ref().map(FarLights::is_empty);
        let mut alone = true;
        for lane in 0..LANES {
            alone &= !to.there[lane] | far_is_empty[to.rivals[lane] as usize];
        }
        alone.then_some(light)
    }

    /// The one near light, if it is one and 24 bits are enough to choose a direction to it.
    #[inline(always)]
    fn simple_near(&self) -> Option<u32> {
        self.tree.only().filter(|&light| !matches!(self.lights[light as usize], Light::Mesh(_)))
    }

    /// What [`sample_eight`](Self::sample_eight) needs for receivers with such rivals.
    #[inline]
    pub fn needs(&self, rivals: Rivals) -> Needs {
        let far = self.far(rivals);
        let fine = !far.is_empty() || self.simple_near().is_none() && !self.tree.is_empty();
        Needs { direction: fine || !self.tree.is_empty(), fine }
    }

    /// Samples of the lights that were chosen, each as if it were the only one.
    #[inline(always)]
    fn sample_lights(
        &self,
        to: &Receivers,
        picks: &[Option<Pick>; LANES],
        u: &[[f64; LANES]; 2],
        samples: &mut EightSamples,
    ) {
        let (mut rectangles, mut spheres) = ([None; LANES], [None; LANES]);
        let (mut meshes, mut others, mut sky) = ([None; LANES], [None; LANES], [false; LANES]);
        for lane in to.lanes() {
            match picks[lane] {
                Some(Pick::Light(light)) => match &self.lights[light as usize] {
                    Light::Rectangle(rectangle) => rectangles[lane] = Some(rectangle),
                    Light::Sphere(sphere) => spheres[lane] = Some(sphere),
                    Light::Mesh(mesh) => meshes[lane] = Some(mesh),
                    light => others[lane] = Some(light),
                },
                Some(Pick::Environment) => sky[lane] = true,
                None => {}
            }
        }

        if let Some((eight, lanes)) = filled(rectangles) {
            *samples = RectangleLight::sample_eight(|lane| eight[lane], to, u, lanes);
        }
        if let Some((eight, lanes)) = filled(spheres) {
            samples.take(&SphereLight::sample_eight(|lane| eight[lane], to, u, lanes), lanes);
        }
        if sky.contains(&true)
            && let Some(environment) = &self.environment
        {
            samples.take(&environment.sample_eight(to, u, sky), sky);
        }
        while let Some(mesh) = meshes.iter().copied().flatten().next() {
            let mut of_this = *to;
            for lane in 0..LANES {
                of_this.there[lane] &= meshes[lane].is_some_and(|other| std::ptr::eq(other, mesh));
            }
            mesh.sample_eight(&of_this, u, samples);
            of_this.lanes().for_each(|lane| meshes[lane] = None);
        }
        for lane in 0..LANES {
            match others[lane] {
                Some(Light::Point(light)) => samples.put(lane, light.sample(to.p.get(lane))),
                Some(Light::Directional(light)) => samples.put(lane, Some(light.sample())),
                Some(Light::Rectangle(_) | Light::Sphere(_) | Light::Mesh(_)) | None => {}
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
    #[inline(always)]
    pub fn environment_and_pdf(&self, to: &Receiver, wi: Vec3) -> (Rgb, f32) {
        match &self.environment {
            Some(environment) if self.far(to.rivals).has_environment() => {
                let probability = (1.0 - self.near_share(to)) * self.far(to.rivals).probability(to, 0);
                (environment.le(wi), probability as f32 * environment.pdf(to, wi))
            }
            Some(environment) => (environment.le(wi), 0.0),
            None => (Rgb::BLACK, 0.0),
        }
    }

    /// The second of [`environment_and_pdf`](Self::environment_and_pdf).
    pub fn pdf_environment(&self, to: &Receiver, wi: Vec3) -> f32 {
        self.environment_and_pdf(to, wi).1
    }

    /// The environment, if looking at it along eight directions together saves time: see
    /// [`environment_and_pdf_eight`](Self::environment_and_pdf_eight).
    #[inline(always)]
    pub fn detailed_environment(&self) -> Option<&Environment> {
        self.environment.as_ref().filter(|environment| environment.is_detailed())
    }

    /// [`environment_and_pdf`](Self::environment_and_pdf) along eight directions, by channel, of the `environment` that
    /// there is.
    #[inline(always)]
    pub fn environment_and_pdf_eight(
        &self,
        environment: &Environment,
        to: &Receivers,
        wi: &Vectors,
    ) -> ([Floats; 3], Floats) {
        let (le, mut pdf) = environment.le_and_pdf_eight(to, wi);
        let near_share = self.near_shares(to);
        for lane in to.lanes() {
            let far = self.far(to.rivals[lane]);
            let share = if far.has_environment() { far.probability(&to.get(lane), 0) } else { 0.0 };
            pdf[lane] *= ((1.0 - near_share[lane]) * share) as f32;
        }
        (le, pdf)
    }

    /// Which light for each receiver, with what probability, and `u` with what is left of the first for the light.
    #[inline(always)]
    fn choose(
        &self,
        to: &Receivers,
        mut u: [[f64; LANES]; 2],
    ) -> ([Option<Pick>; LANES], [f64; LANES], [[f64; LANES]; 2]) {
        let (mut picks, mut probability) = ([None; LANES], [1.0; LANES]);
        let near_share = self.near_shares(to);
        let (mut near, mut choice) = (*to, [0.0; LANES]);
        for lane in 0..LANES {
            near.there[lane] &= u[0][lane] < near_share[lane];
            choice[lane] = below_one(u[0][lane] / near_share[lane]);
        }
        if !near.is_empty() {
            let chosen = self.tree.sample_eight(&near, &choice);
            for lane in near.lanes() {
                picks[lane] = chosen.light[lane].map(Pick::Light);
                probability[lane] = near_share[lane] * chosen.probability[lane];
                u[0][lane] = chosen.rest[lane];
            }
        }
        for (rivals, far) in self.far.iter().enumerate().filter(|(_, far)| !far.is_empty()) {
            let mut those = *to;
            for lane in 0..LANES {
                those.there[lane] &= !near.there[lane] & (to.rivals[lane] as usize == rivals);
                choice[lane] = below_one((u[0][lane] - near_share[lane]) / (1.0 - near_share[lane]));
            }
            if those.is_empty() {
                continue;
            }
            let chosen = far.sample_eight(&those, &choice);
            for lane in those.lanes() {
                picks[lane] = Some(chosen.pick[lane]);
                probability[lane] = (1.0 - near_share[lane]) * chosen.probability[lane];
                u[0][lane] = chosen.rest[lane];
            }
        }
        (picks, probability, u)
    }

    /// The far lights to choose among beside these rivals.
    #[inline(always)]
    fn far(&self, rivals: Rivals) -> &FarLights {
        &self.far[rivals as usize]
    }

    /// How often the light is one of the tree, for each receiver.
    #[inline(always)]
    fn near_shares(&self, to: &Receivers) -> [f64; LANES] {
        let far = &self.far;
        if far[0].is_empty() {
            return [1.0; LANES];
        }
        let near = self.tree.importances(to);
        let mut importances = [Floats::default(); 3];
        if !self.tree.is_empty() {
            for (k, importances) in importances.iter_mut().enumerate() {
                if to.rivals.iter().any(|&rivals| rivals as usize == k) {
                    *importances = far[k].importances(to);
                }
            }
        }
        let mut shares = [1.0; LANES];
        for lane in 0..LANES {
            let rivals = to.rivals[lane] as usize;
            if !far[rivals].is_empty() {
                shares[lane] = near_share(near[lane], importances[rivals][lane]);
            }
        }
        shares
    }

    /// [`near_shares`](Self::near_shares) for one receiver.
    #[inline]
    fn near_share(&self, to: &Receiver) -> f64 {
        let far = self.far(to.rivals);
        if far.is_empty() {
            return 1.0;
        }
        near_share(self.tree.importance(to), far.importance(to))
    }
}

/// The lights of a kind with another of them in the lanes that have none, and which have one; `None` if none has.
#[inline(always)]
fn filled<L>(lights: [Option<&L>; LANES]) -> Option<([&L; LANES], [bool; LANES])> {
    let first = lights.into_iter().flatten().next()?;
    let (mut all, mut lanes) = ([first; LANES], [false; LANES]);
    for lane in 0..LANES {
        all[lane] = lights[lane].unwrap_or(first);
        lanes[lane] = lights[lane].is_some();
    }
    Some((all, lanes))
}

/// How often to ask a near light, where near ones are this important, and far ones.
#[inline(always)]
fn near_share(near: f32, far: f32) -> f64 {
    if near == 0.0 {
        return 0.0;
    }
    let (near, far) = (f64::from(near), f64::from(far));
    LEAST_SHARE + (1.0 - 2.0 * LEAST_SHARE) * near / (near + far)
}

/// Each of `u` with 28 bits more, from hashes of all numbers: a walk down a deep tree leaves few of the 24.
#[inline(always)]
fn widen(fine: Floats, [x, y]: &[Floats; 2]) -> [[f64; LANES]; 2] {
    let mut wide = [[0.0; LANES]; 2];
    for lane in 0..LANES {
        let (x, y) = (x[lane], y[lane]);
        let low = fine[lane].to_bits() ^ sampler::hash(x.to_bits() ^ sampler::hash(y.to_bits()));
        let low = sampler::hash(low ^ 0x5bd1_e995);
        wide[0][lane] = lengthen(x, low);
        wide[1][lane] = lengthen(y, sampler::hash(low ^ 0x5bd1_e995));
    }
    wide
}

/// `u` with the upper 28 bits of `low` below its 24.
#[inline(always)]
fn lengthen(u: f32, low: u32) -> f64 {
    // Signed, which converts faster.
    f64::from(u) + f64::from((low >> 4) as i32) / (1u64 << 52) as f64
}

#[cfg(test)]
#[path = "choose_tests.rs"]
mod tests;
