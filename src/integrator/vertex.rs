//! One end of a ray: what is seen where it hits, or where it misses.

use super::bounce::{Leaving, Reached};
use super::direct::{Unoccluded, emitter_hit};
use super::eight::Lane;
use super::guide::Trail;
use super::path::{Path, Vertex, Wave};
use super::roots::Roots;
use super::tally::Tally;
use super::wave::{Integrator, Shadows};
use crate::bxdf::{Bsdf, Drawn};
use crate::core::lanes::{Floats, Vectors};
use crate::core::{Hit, Ray, Rgb};
use crate::scene::{LightSample, Material, Receivers};
use glam::Vec3;

/// Where what leaves a surface goes.
pub(super) struct Outgoing<'a> {
    /// The camera samples, each with its radiance.
    pub roots: &'a mut Roots,
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

impl Outgoing<'_> {
    /// Adds light to the camera sample of a path.
    #[inline(always)]
    pub(super) fn add(&mut self, path: &Path, radiance: Rgb) {
        self.roots.add(path.slot, radiance, self.tally);
    }

    /// Where to note what the camera sample of a path shows, if the path is the one to tell.
    #[inline(always)]
    fn trail(&mut self, path: &Path) -> Option<&mut Trail> {
        if path.followed { self.trails.get_mut(path.slot as usize) } else { None }
    }
}

/// A surface at the end of a ray.
#[derive(Clone, Copy)]
pub(super) struct Seen<'a> {
    /// The ray.
    pub ray: &'a Ray,
    /// What it hit.
    pub hit: &'a Hit,
    /// The point there, the path that has come to it, and what is drawn there.
    pub drawn: Lane<'a>,
}

impl Integrator<'_> {
    /// What up to eight rays of paths see that hit nothing, by their numbers: the environment.
    #[inline(always)]
    pub(super) fn miss(&self, group: &[u32], paths: &[Path], rays: &[Ray], out: &mut Outgoing) {
        let lights = &self.scene.lights;
        let Some(environment) = lights.detailed_environment() else {
            for (path, ray) in group.iter().map(|&i| (&paths[i as usize], &rays[i as usize])) {
                out.add(path, self.bounded(path.beta * self.environment_seen(path, ray), path.depth));
            }
            return;
        };
        let (mut receivers, mut directions) = (Receivers::default(), Vectors::default());
        let mut competes = false;
        for (lane, &i) in group.iter().enumerate() {
            let (path, ray) = (&paths[i as usize], &rays[i as usize]);
            receivers.set(lane, &path.receiver(ray.origin));
            directions.set(lane, ray.dir);
            competes |= path.rate != f32::INFINITY;
        }
        let ([r, g, b], pdf) = if competes {
            lights.environment_and_pdf_eight(environment, &receivers, &directions)
        } else {
            (environment.le_eight(&receivers, &directions), Floats::default())
        };
        for (lane, &i) in group.iter().enumerate() {
            let path = &paths[i as usize];
            let le = Rgb::new(r[lane], g[lane], b[lane]);
            let ray = &rays[i as usize];
            let seen = le * self.found_weight(path, || self.through_portal(path, ray, pdf[lane]));
            out.add(path, self.bounded(path.beta * seen, path.depth));
        }
    }

    /// What a ray sees that hits: light of the surface's own. Gives back the lobes of a surface that reflects, and plans
    /// which rays leave it; the lobes are put into `here` where they are not the same everywhere.
    #[inline(always)]
    pub(super) fn look_at<'b>(
        &'b self,
        seen: &Seen,
        here: &'b mut Option<Bsdf>,
        leaving: &mut Leaving,
        out: &mut Outgoing,
    ) -> Option<&'b Bsdf> {
        let Seen { ray, hit, drawn } = *seen;
        let (path, point) = (drawn.path(), &drawn.point());
        let geometry = &self.scene.geometries[hit.geom_id as usize];
        let material = &self.scene.materials[geometry.material as usize];

        if let Some(trail) = out.trail(path) {
            trail.way += hit.t;
        }

        // Light of the surface's own.
        if let Some(emission) = material.emission
            && (point.at.front || material.emits_both_sides)
            && !path.emission_apart
        {
            let weight = geometry
                .light
                .map_or(1.0, |light| self.emitter_weight(path, ray, &emitter_hit(light, ray, hit.t, point)));
            out.add(path, self.bounded(path.beta * emission * weight, path.depth));
        }
        if path.emission_only {
            return None;
        }
        self.reflect_ambient(path, material, point.p, out);
        if !material.reflects() {
            if let Some(trail) = out.trail(path) {
                self.describe(path, point, Rgb::BLACK, trail);
            }
            return None;
        }

        let bsdf = match &self.bsdfs[geometry.material as usize] {
            Some(everywhere) => everywhere,
            None => here.insert(material.bsdf(point.p)),
        };
        leaving.portal = drawn.portal();
        self.plan_rays(path, &point.at, bsdf, || drawn.choice(), leaving);
        leaving.guide = Self::needed(drawn.guide(), bsdf, leaving);
        if let Some(trail) = out.trail(path) {
            leaving.followed = self.tell(path, point, bsdf, leaving, trail);
        }
        Some(bsdf)
    }

    /// What a point of a surface shows of the scene's ambient light.
    #[inline(always)]
    pub(super) fn reflect_ambient(&self, path: &Path, material: &Material, p: Vec3, out: &mut Outgoing) {
        if let Some(ambient) = &material.ambient {
            let ambient = path.beta * ambient.at(p) * self.scene.ambient;
            out.add(path, self.bounded(ambient, path.depth + 1));
        }
    }

    /// What a surface reflects of light from elsewhere: of `light` straight from a light, and by the rays that leave, of
    /// which the only one may have its `direction`.
    #[inline(always)]
    pub(super) fn reflect(
        &self,
        (drawn, direction): (Lane, Option<Drawn>),
        bsdf: &Bsdf,
        leaving: &mut Leaving,
        light: Option<LightSample>,
        out: &mut Outgoing,
    ) {
        let (path, point, sampler) = (drawn.path(), &drawn.point(), drawn.sampler());
        let from = Reached { path, point, bsdf };
        if self.is_last(path) {
            let seen = self.end(path, &point.at, bsdf, sampler, out.tally);
            out.add(path, self.bounded(seen, path.depth + 1));
        }
        if !self.scene.settings.occlusion.is_exact() && !self.is_last(path) {
            self.reflect_environment(path, point, bsdf, out);
        }
        self.take_light(&from, leaving, light, out);
        self.make_rays(&from, leaving, sampler, Some((drawn, direction)), out.next);
        if leaving.remaining() > 0 {
            out.waiting.push(Vertex { path: *path, point: *point, bsdf: *bsdf, leaving: *leaving });
        }
    }

    /// Adds what a surface reflects of a light's sample, if it has one and nothing is in the way.
    #[inline(always)]
    pub(super) fn take_light(
        &self,
        from: &Reached,
        leaving: &Leaving,
        light: Option<LightSample>,
        out: &mut Outgoing,
    ) {
        match light.and_then(|light| self.reflect_light(from, leaving, &light)) {
            Some(Unoccluded { radiance, ray: Some(ray) }) => out.shadows.push(from.path.slot, radiance, ray),
            Some(Unoccluded { radiance, ray: None }) => out.add(from.path, radiance),
            None => {}
        }
    }
}
