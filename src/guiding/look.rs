//! What surfaces see beside the caustics that photons have told of: what the share of a guide goes by.

use super::photons::{Landed, Shooter, diffuse, dimension, hits, occluded};
use crate::bxdf::{Bxdf, Diffuse};
use crate::core::{Ray, Rgb};
use std::f32::consts::PI;

/// One of so many photons looks what else its surface sees.
const LOOKING: u32 = 4;

/// Surfaces that a look comes to, at most. In a bright room most of what a wall sees has come by more than one other wall:
/// where only the next one counts, guides get too large a share.
const MOST_SURFACES: u32 = 8;

/// What a photon's surface sees along one path from it.
struct Look {
    /// The number of the landed photon among those that look.
    of: usize,
    /// Its own number, which the random numbers go by.
    index: u32,
    /// How much of what the ray meets is seen.
    weight: f32,
    ray: Ray,
}

/// Light that a look has come to, if nothing is in its way.
struct Lit {
    of: usize,
    radiance: f32,
    way: Ray,
}

impl Shooter<'_> {
    /// Finds what else the surfaces of some landed photons see, by one path each.
    pub(super) fn look_around(&self, landed: &mut [Landed]) {
        let mut looking: Vec<&mut Landed> = landed.iter_mut().filter(|l| l.index % LOOKING == 0).collect();
        let first = looking.iter().enumerate().filter_map(|(of, landed)| self.first_look(of, landed));
        let mut looks: Vec<Look> = first.collect();
        let mut seen = vec![0.0; looking.len()];
        for surface in 0..self.scene.settings.most_reflections().min(MOST_SURFACES) {
            looks = self.look_on(&looks, surface, &mut seen);
        }
        for (landed, seen) in looking.iter_mut().zip(seen) {
            landed.photon.other = Some(seen);
        }
    }

    /// The look of a landed photon, where it begins.
    fn first_look(&self, of: usize, Landed { index, point, .. }: &Landed) -> Option<Look> {
        let white = Bxdf::Diffuse(Diffuse { reflectance: Rgb::WHITE });
        let sample = white.sample(&point.at, self.sampler().pair(*index, dimension::LOOK))?;
        let ray = point.spawn(sample.wi, f32::INFINITY, self.scene.settings.self_hit);
        Some(Look { of, index: *index, weight: 1.0, ray })
    }

    /// Adds what some looks meet to what is `seen` and gives where they go on: light on diffuse surfaces alone, since that on
    /// others is what photons tell of.
    fn look_on(&self, looks: &[Look], surface: u32, seen: &mut [f32]) -> Vec<Look> {
        let rays: Vec<Ray> = looks.iter().map(|look| look.ray).collect();
        let numbers = dimension::LOOK + 1 + 3 * surface;
        let (mut onward, mut lit) = (vec![], vec![]);
        for (look, hit) in looks.iter().zip(&hits(self.accel, &rays)) {
            let Look { of, index, weight, ref ray } = *look;
            let Some(hit) = hit else {
                seen[of] += weight * self.sky(ray);
                continue;
            };
            let point = self.scene.interaction(ray, hit);
            let bsdf = self.bsdf(&point);
            if let Some(albedo) = diffuse(&bsdf)
                && let Some((way, _, irradiance)) = self.light(&point, index, numbers)
            {
                lit.push(Lit { of, radiance: weight * albedo * irradiance / PI, way });
            }
            if let Some((ray, share, _)) =
                self.reflect(&bsdf, (&point, &point.at), |_| true, index, numbers + 1)
            {
                onward.push(Look { weight: weight * share, ray, ..*look });
            }
        }
        let ways: Vec<Ray> = lit.iter().map(|lit| lit.way).collect();
        for (lit, occluded) in lit.iter().zip(occluded(self.accel, &ways)) {
            seen[lit.of] += if occluded { 0.0 } else { lit.radiance };
        }
        onward
    }

    /// Radiance of the environment along a ray, but for what is brighter than its mean: samples of lights find that.
    pub(super) fn sky(&self, ray: &Ray) -> f32 {
        let environment = self.scene.lights.environment.as_ref();
        environment.map_or(0.0, |sky| sky.le(ray.dir).luminance().min(self.environment_mean))
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::map::Photon;
    use super::super::reflectors::Reflectors;
    use super::*;
    use crate::accel::bvh::Bvh;
    use crate::scene::Scene;
    use crate::scene::load::{Format, load_str};
    use glam::Vec3;
    use std::path::Path;

    /// A diffuse sphere around a lamp and the camera.
    const INTEGRATING_SPHERE: &str = r#"
        [camera]
        eye = [0.1, 0, 0]
        look_at = [1, 0, 0]
        resolution = [8, 8]
        [materials.wall]
        type = "diffuse"
        cd = [0.8, 0.8, 0.8]
        [[shapes]]
        type = "sphere"
        center = [0, 0, 0]
        radius = 1
        material = "wall"
        [[lights]]
        type = "point"
        position = [0, 0, 0]
        intensity = [2, 2, 2]
    "#;

    /// It, with paths of so many reflections.
    pub fn integrating_sphere(max_depth: u32, at_max_depth: &str) -> Scene {
        let settings = format!("max_depth = {max_depth}\nat_max_depth = \"{at_max_depth}\"");
        let text = format!("[settings]\n{settings}\n{INTEGRATING_SPHERE}");
        load_str(&text, Format::Toml, Path::new(""), &[]).expect("the sphere loads")
    }

    #[test]
    fn surfaces_see_what_has_come_by_others() {
        for (max_depth, at_max_depth, surfaces) in
            [(1, "black", 1), (3, "black", 3), (20, "black", MOST_SURFACES), (3, "roulette", MOST_SURFACES)]
        {
            let scene = integrating_sphere(max_depth, at_max_depth);
            let accel = Bvh::new(&scene.shapes, &Default::default()).expect("the sphere is built");
            let reflectors = Reflectors::of(&scene);
            let shooter = Shooter::new(&scene, &accel, &reflectors, 0.0);
            let land = |index: u32| {
                let dir = Vec3::new(1.0, 0.1 * index as f32, -0.5).normalize();
                let ray = Ray::new(Vec3::ZERO, dir);
                let hit = hits(&accel, std::slice::from_ref(&ray))[0].expect("the ray is inside");
                let point = scene.interaction(&ray, &hit);
                let photon =
                    Photon { p: point.p, n: point.at.n, wi: -dir, power: 1.0, other: None, pdf: 0.0 };
                Landed { photon, index, point }
            };
            let mut landed: Vec<Landed> = (0..16).map(land).collect();
            shooter.look_around(&mut landed);

            let expected = (1..=surfaces).map(|n| 0.8f32.powi(n as i32)).sum::<f32>() * 2.0 / PI;
            for Landed { photon, index, .. } in &landed {
                assert_eq!(photon.other.is_some(), index % LOOKING == 0);
                let error = photon.other.map_or(0.0, |other| (other / expected - 1.0).abs());
                assert!(error < 1e-3, "photon {index}: {:?} instead of {expected}", photon.other);
            }
        }
    }
}
