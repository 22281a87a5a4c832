//! One end of a ray: what is seen where it hits, or where it misses.

use super::bounce::{Leaving, Numbers, Reached};
use super::direct::{Unoccluded, emitter_hit};
use super::guide::Trail;
use super::path::{Path, Vertex, Wave};
use super::tally::Tally;
use super::wave::{Integrator, Root, Shadows};
use crate::core::{Hit, Ray, Rgb};
use crate::scene::{EightSamples, SurfaceInteraction};

/// Where what leaves a surface goes.
pub(super) struct Outgoing<'a> {
    /// The rays of the next step.
    pub next: &'a mut Wave,
    /// Surfaces with more rays than the next step has room for.
    pub waiting: &'a mut Vec<Vertex>,
    /// Shadow rays of this step.
    pub shadows: &'a mut Shadows,
    /// What denoisers are told of each camera sample; empty where nobody asks.
    pub trails: &'a mut [Trail],
    /// What is counted.
    pub tally: &'a mut Tally,
}

/// A surface at the end of a ray.
#[derive(Clone, Copy)]
pub(super) struct Seen<'a> {
    /// The path that the ray belongs to.
    pub path: &'a Path,
    /// The ray.
    pub ray: &'a Ray,
    /// What it hit.
    pub hit: &'a Hit,
    /// The point there.
    pub point: &'a SurfaceInteraction,
    /// The surface's random numbers.
    pub numbers: &'a Numbers,
    /// A sample of the only light, and its lane.
    pub prepared: Option<(&'a EightSamples, usize)>,
}

impl Integrator<'_> {
    /// What a ray sees that hits nothing.
    #[inline(always)]
    pub(super) fn miss(&self, path: &Path, ray: &Ray) -> Rgb {
        match &self.scene.lights.environment {
            Some(environment) => {
                let seen = path.beta * environment.le(ray.dir) * self.environment_weight(path, ray);
                self.bounded(seen, path.depth)
            }
            None => Rgb::BLACK,
        }
    }

    /// What a ray sees that hits: light of the surface's own, light straight from lights, and which rays leave.
    #[inline(always)]
    pub(super) fn shade(&self, seen: &Seen, root: &mut Root, out: &mut Outgoing) {
        let Seen { path, ray, hit, point, numbers, prepared } = *seen;
        let geometry = &self.scene.geometries[hit.geom_id as usize];
        let material = &self.scene.materials[geometry.material as usize];

        let mut trail = if path.followed { out.trails.get_mut(path.slot as usize) } else { None };
        if let Some(trail) = &mut trail {
            trail.way += hit.t;
        }

        // Light of the surface's own.
        if let Some(emission) = material.emission
            && (point.at.front || material.emits_both_sides)
        {
            let weight = geometry
                .light
                .map_or(1.0, |light| self.emitter_weight(path, ray, &emitter_hit(light, ray, hit.t, point)));
            root.add(self.bounded(path.beta * emission * weight, path.depth), out.tally);
        }
        if path.emission_only {
            return;
        }
        if let Some(ambient) = &material.ambient {
            let ambient = path.beta * ambient.at(point.p) * self.scene.ambient;
            root.add(self.bounded(ambient, path.depth + 1), out.tally);
        }
        if !material.reflects() {
            if let Some(trail) = trail {
                self.describe(path, point, Rgb::BLACK, trail);
            }
            return;
        }

        // Light from elsewhere.
        let here;
        let bsdf = match &self.bsdfs[geometry.material as usize] {
            Some(everywhere) => everywhere,
            None => {
                here = material.bsdf(point.p);
                &here
            }
        };
        let mut leaving = Leaving::default();
        self.plan_rays(path, &point.at, bsdf, numbers.choice, &mut leaving);
        leaving.guide = self.find_guide(point, bsdf, &leaving);
        if let Some(trail) = trail {
            leaving.followed = self.tell(path, point, bsdf, &leaving, trail);
        }
        let from = Reached { path, point, bsdf };
        if self.is_last(path) {
            let seen = self.end(path, &point.at, bsdf, &root.sampler, out.tally);
            root.add(self.bounded(seen, path.depth + 1), out.tally);
        }
        if !self.scene.settings.occlusion.is_exact() && !self.is_last(path) {
            self.reflect_environment(path, point, bsdf, root, out);
        }
        if self.samples_lights {
            match self.sample_light(&from, &leaving, numbers, prepared) {
                Some(Unoccluded { radiance, ray: Some(ray) }) => out.shadows.push(path.slot, radiance, ray),
                Some(Unoccluded { radiance, ray: None }) => root.add(radiance, out.tally),
                None => {}
            }
        }
        self.make_rays(&from, &mut leaving, &root.sampler, Some(numbers), out.next);
        if leaving.remaining() > 0 {
            out.waiting.push(Vertex { path: *path, point: *point, bsdf: *bsdf, leaving });
        }
    }
}
