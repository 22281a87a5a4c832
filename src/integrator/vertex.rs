//! One end of a ray: what is seen where it hits, or where it misses.

use super::direct::{Unoccluded, emitter_hit};
use super::path::{Path, Vertex, Wave};
use super::tally::Tally;
use super::wave::{Integrator, Root, Shadows};
use crate::core::{Hit, Ray, Rgb};

/// Where what leaves a surface goes.
pub(super) struct Outgoing<'a> {
    /// The rays of the next step.
    pub next: &'a mut Wave,
    /// Surfaces with more rays than the next step has room for.
    pub waiting: &'a mut Vec<Vertex>,
    /// Shadow rays of this step.
    pub shadows: &'a mut Shadows,
    /// What is counted.
    pub tally: &'a mut Tally,
}

impl Integrator<'_> {
    /// What a ray sees that hits nothing.
    pub(super) fn miss(&self, path: &Path, ray: &Ray) -> Rgb {
        match &self.scene.lights.environment {
            Some(environment) => path.beta * environment.le(ray.dir) * self.environment_weight(path, ray),
            None => Rgb::BLACK,
        }
    }

    /// What a ray sees that hits: light of the surface's own, light straight from lights, and which rays leave.
    pub(super) fn shade(&self, path: &Path, ray: &Ray, hit: &Hit, root: &mut Root, out: &mut Outgoing) {
        let point = self.scene.interaction(ray, hit);
        let geometry = &self.scene.geometries[hit.geom_id as usize];
        let material = &self.scene.materials[geometry.material as usize];

        // Light of the surface's own.
        if let Some(emission) = material.emission
            && (point.at.front || material.emits_both_sides)
        {
            let weight = geometry
                .light
                .map_or(1.0, |light| self.emitter_weight(path, ray, &emitter_hit(light, ray, hit.t, &point)));
            root.add(path.beta * emission * weight, out.tally);
        }
        if path.emission_only {
            return;
        }
        if let Some(ambient) = &material.ambient {
            root.add(path.beta * ambient.at(point.p) * self.scene.ambient, out.tally);
        }
        if !material.reflects() {
            return;
        }

        // Light from elsewhere.
        let bsdf = material.bsdf(point.p);
        let choice = root.choice(path);
        let leaving = self.plan_rays(path, &point.at, &bsdf, choice[0]);
        if self.is_last(path) {
            let seen = self.end(path, &point.at, &bsdf, &root.sampler, out.tally);
            root.add(seen, out.tally);
        }
        if !self.scene.settings.occlusion.is_exact() && !self.is_last(path) {
            self.reflect_environment(path, &point, &bsdf, root, out);
        }
        if self.samples_lights {
            match self.sample_light(path, &point, &bsdf, &leaving, choice[1], &root.sampler) {
                Some(Unoccluded { radiance, ray: Some(ray) }) => out.shadows.push(path.slot, radiance, ray),
                Some(Unoccluded { radiance, ray: None }) => root.add(radiance, out.tally),
                None => {}
            }
        }
        if leaving.remaining() > 0 {
            let mut vertex = Vertex { path: *path, point, bsdf, leaving };
            self.make_rays(&mut vertex, &root.sampler, out.next);
            if vertex.leaving.remaining() > 0 {
                out.waiting.push(vertex);
            }
        }
    }
}
