//! One end of a ray: what is seen where it hits, or where it misses.

use super::direct::{Unoccluded, emitter_hit};
use super::path::{Path, Vertex};
use super::tally::Tally;
use super::wave::Integrator;
use crate::core::{Hit, Ray, Rgb, Sampler};

/// What shading a hit makes.
pub(super) struct Shaded {
    /// Light that the path carries to its camera sample at once.
    pub radiance: Rgb,
    /// Light that arrives if nothing is in the way.
    pub direct: Option<Unoccluded>,
    /// The surface, if rays leave it.
    pub vertex: Option<Vertex>,
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
    pub(super) fn shade(
        &self,
        path: &Path,
        ray: &Ray,
        hit: &Hit,
        sampler: &Sampler,
        tally: &mut Tally,
    ) -> Shaded {
        let point = self.scene.interaction(ray, hit);
        let geometry = &self.scene.geometries[hit.geom_id as usize];
        let material = &self.scene.materials[geometry.material as usize];
        let mut shaded = Shaded { radiance: Rgb::BLACK, direct: None, vertex: None };

        // Light of the surface's own.
        if let Some(emission) = material.emission
            && (point.at.front || material.emits_both_sides)
        {
            let weight = geometry
                .light
                .map_or(1.0, |light| self.emitter_weight(path, ray, &emitter_hit(light, ray, hit.t, &point)));
            shaded.radiance += path.beta * emission * weight;
        }
        if path.emission_only {
            return shaded;
        }
        if let Some(ambient) = &material.ambient {
            shaded.radiance += path.beta * ambient.at(point.p) * self.scene.ambient;
        }

        // Light from elsewhere.
        let bsdf = material.bsdf(point.p);
        let leaving = self.plan_rays(path, &point.at, &bsdf, sampler);
        shaded.radiance += self.end(path, &point.at, &bsdf, sampler, tally);
        if self.has_lights {
            shaded.direct = self.sample_light(path, &point, &bsdf, &leaving, sampler);
        }
        if leaving.remaining() > 0 {
            shaded.vertex = Some(Vertex { path: *path, point, bsdf, leaving });
        }
        shaded
    }
}
