//! Samples of lights of which part look for the environment through portals: for surfaces that see little of it.
//!
//! Whichever way a direction to the environment was drawn, it counts with the density of both ways together.

use super::eight::{Eight, Pairs};
use super::guided::mix;
use super::path::Path;
use super::wave::Integrator;
use crate::core::lanes::{Floats, LANES, Vectors};
use crate::core::warp::within;
use crate::core::{Ray, Rgb, Wide, widely};
use crate::guiding::{Cell, unguided};
use crate::scene::{EightSamples, Receivers, Rivals};

/// The number of a guide to portals, if there is one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Portal(u32);

impl Default for Portal {
    fn default() -> Self {
        Self(u32::MAX)
    }
}

impl Portal {
    pub(super) fn new(number: Option<u32>) -> Self {
        number.map_or(Self::default(), Self)
    }

    /// Whether there is none.
    #[inline(always)]
    pub(super) fn is_none(self) -> bool {
        self == Self::default()
    }
}

impl<'a> Integrator<'a> {
    /// Whether a surface takes samples of lights, if one of its lobes does.
    #[inline(always)]
    pub(super) fn asks_lights(&self, rivals: Rivals, portal: Portal) -> bool {
        self.samples_lights[rivals as usize] || !portal.is_none()
    }

    /// Who looks for light beside samples of lights.
    #[inline(always)]
    pub(super) fn rivals(lobes_look: bool, portal: Portal) -> Rivals {
        match (lobes_look, portal.is_none()) {
            (false, _) => Rivals::None,
            (true, true) => Rivals::Lobes,
            (true, false) => Rivals::Portals,
        }
    }

    /// The guide of a number, and the share of light samples that follow it: all where there is no other light to sample.
    #[inline(always)]
    fn portal(&self, portal: Portal, rivals: Rivals) -> Option<(&'a Cell, f32)> {
        let portals = self.portals.filter(|_| !portal.is_none())?;
        let cell = portals.cell(portal.0);
        let share = if self.samples_lights[rivals as usize] { cell.share } else { 1.0 };
        Some((cell, share))
    }

    /// The share of light samples of a surface that do not follow a guide to portals.
    #[inline(always)]
    pub(super) fn beside_portal(&self, portal: Portal, rivals: Rivals) -> f32 {
        self.portal(portal, rivals).map_or(1.0, |(_, share)| 1.0 - share)
    }

    /// The density with which light samples of the surface that a ray left go along it to the environment, where those without a
    /// guide have the density `pdf`.
    #[inline(always)]
    pub(super) fn through_portal(&self, path: &Path, ray: &Ray, pdf: f32) -> f32 {
        match self.portal(path.portal, path.rivals) {
            Some((cell, share)) => mix(share * cell.mixture.pdf(ray.origin, ray.dir), 1.0 - share, pdf),
            None => pdf,
        }
    }

    /// Samples of lights for eight receivers, by the numbers `u`; `fine` as for [`Lights::sample_eight`].
    ///
    /// [`Lights::sample_eight`]: crate::scene::Lights::sample_eight
    #[inline(always)]
    pub(super) fn sample_through_portals(
        &self,
        drawn: &Eight,
        to: &Receivers,
        fine: impl FnOnce() -> Floats,
        u: &Pairs,
        samples: &mut EightSamples,
    ) {
        if drawn.portals == [Portal::default(); LANES] {
            self.scene.lights.sample_eight(to, fine, u, samples);
        } else {
            widely(BothWays { integrator: self, drawn, to, fine, u, samples });
        }
    }

    /// Puts what receivers see along `wi` of the environment into their lanes: radiance, and the density of samples
    /// without a guide.
    #[inline(always)]
    fn look_along(&self, to: &Receivers, wi: &Vectors, samples: &mut EightSamples) {
        let lights = &self.scene.lights;
        let detailed = lights.detailed_environment();
        let eight = detailed.map(|environment| lights.environment_and_pdf_eight(environment, to, wi));
        for lane in to.lanes() {
            let (le, pdf) = match &eight {
                Some(([r, g, b], pdf)) => (Rgb::new(r[lane], g[lane], b[lane]), pdf[lane]),
                None => lights.environment_and_pdf(&to.get(lane), wi.get(lane)),
            };
            samples.set_environment(lane, wi.get(lane), le, pdf);
        }
    }
}

/// Samples of lights, where those of some receivers look through portals: apart from what is more ordinary.
struct BothWays<'a, F> {
    integrator: &'a Integrator<'a>,
    drawn: &'a Eight<'a>,
    to: &'a Receivers,
    fine: F,
    u: &'a Pairs,
    samples: &'a mut EightSamples,
}

impl<F: FnOnce() -> Floats> Wide for BothWays<'_, F> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { integrator, drawn, to, fine, u, samples } = self;
        let mut guides = [None; LANES];
        for lane in to.lanes() {
            guides[lane] = integrator.portal(drawn.portals[lane], to.rivals[lane]);
        }
        let (mut others, mut rest) = (*to, *u);
        let (mut through, mut wi) = (Receivers { there: [false; LANES], ..*to }, Vectors::default());
        for lane in to.lanes() {
            let Some((cell, share)) = guides[lane] else { continue };
            let [x, y] = u.map(|u| u[lane]);
            if x < share {
                let direction = cell.mixture.sample(to.p.get(lane), [within(x, 0.0, share), y]);
                wi.set(lane, direction);
                others.there[lane] = false;
                through.there[lane] = direction.dot(to.n.get(lane)) > 0.0;
            } else {
                rest[0][lane] = unguided(share, x);
            }
        }
        *samples = EightSamples::default();
        if !others.is_empty() {
            integrator.scene.lights.sample_eight(&others, fine, &rest, samples);
            // Where others have no light, they may have left something.
            for lane in 0..LANES {
                samples.there[lane] &= others.there[lane];
            }
        }
        integrator.look_along(&through, &wi, samples);
        for lane in 0..LANES {
            let (Some((cell, share)), true) = (guides[lane], samples.there[lane]) else { continue };
            let alone = samples.pdf[lane];
            // What no ray can hit is not the environment.
            let to_environment = samples.t_max[lane] == f32::INFINITY && alone < f32::INFINITY;
            let guided =
                if to_environment { cell.mixture.pdf(to.p.get(lane), samples.wi.get(lane)) } else { 0.0 };
            let pdf = mix(share * guided, 1.0 - share, alone);
            let scale = match (through.there[lane], to_environment) {
                (true, _) => pdf.recip(),
                (false, true) => alone / pdf,
                (false, false) => (1.0 - share).recip(),
            };
            samples.pdf[lane] = pdf;
            for le in &mut samples.le_over_pdf {
                le[lane] *= scale;
            }
        }
    }
}
