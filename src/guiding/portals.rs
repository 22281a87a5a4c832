//! Looking for the environment from the surfaces that camera paths come to: where few rays find it, those tell of portals.

use super::map::{Cell, GuideMap, Making, Photon};
use super::photons::{hits, light, occluded};
use crate::accel::Accelerator;
use crate::bxdf::{Bxdf, Diffuse};
use crate::core::{Ray, Sampler, SamplerKind};
use crate::geometry::Aabb;
use crate::scene::{Environment, Plan, Rivals, Scene, SurfaceInteraction};
use rayon::prelude::*;
use std::f32::consts::PI;
use std::ops::Range;

/// Camera paths that tell whether it is worth while to follow more.
const FIRST_PATHS: u32 = 512;

/// Camera paths at most.
const MOST_PATHS: u32 = 1 << 14;

/// Pixels for each path.
const PIXELS_PER_PATH: u32 = 16;

/// Camera paths that one thread follows together.
const TOGETHER: u32 = 256;

/// Surfaces that a path comes to.
const SURFACES: u32 = 3;

/// Rays that look for the environment from each, drawn from a diffuse lobe.
const LOOKS: u32 = 16;

/// Samples of other lights that are taken there: of a sun, which no ray finds, too.
const SAMPLES: u32 = 2;

/// Where up to so many of the rays from a surface find it, it is seen through a portal.
const FEW: usize = 3;

/// The least share of surfaces that see it through portals, among those that see it: the folds of a statue in the open are no
/// portals.
const LEAST_SURFACES: f32 = 0.25;

/// Where more rays than this find the environment, weighted by what they find, lobes see it well enough by themselves.
const MOST_OPEN: f32 = 0.2;

/// Cells: as large as it takes to tell the shape of a window.
const PORTALS: Making = Making { most: 192, counts_dark: false, cell: Cell::to_portals };

/// The greatest share of light samples that look through portals.
const GREATEST_SHARE: f32 = 0.8;

impl GuideMap {
    /// Guides to the environment for surfaces that see little of it; empty where there are none.
    ///
    /// The same for any number of threads: it depends on the scene, its settings and the accelerator's answers alone.
    pub fn to_portals(scene: &Scene, accel: &dyn Accelerator) -> Self {
        let environment = scene.lights.environment.as_ref().filter(|_| Plan::of(scene).portals);
        let Some(environment) = environment else { return Self::default() };
        let lookout = Lookout { scene, accel, environment };
        let [width, height] = scene.camera.resolution;
        let count = (width.saturating_mul(height) / PIXELS_PER_PATH).clamp(FIRST_PATHS, MOST_PATHS);
        // Paths are spread over the picture from the first on.
        let mut found = lookout.look_along(0..FIRST_PATHS);
        if !sees_portals(&found) {
            return Self::default();
        }
        let starts: Vec<u32> = (FIRST_PATHS..count).step_by(TOGETHER as usize).collect();
        let more: Vec<Vec<Photon>> = starts
            .into_par_iter()
            .map(|start| lookout.look_along(start..count.min(start + TOGETHER)))
            .collect();
        found.extend(more.into_iter().flatten());
        Self::new(found, PORTALS)
    }
}

impl Cell {
    /// The guide to the environment as rays have found it, for the points of `bounds`.
    fn to_portals(looks: &[Photon], bounds: &Aabb) -> Option<Self> {
        // The others tell of other light.
        let rays = looks.iter().filter(|look| look.other.is_none()).count() as f32;
        let sky = looks.iter().map(|look| look.power).sum::<f32>() / rays;
        let mean_square = looks.iter().map(|look| look.power * look.power).sum::<f32>() / rays;
        if sky * sky > MOST_OPEN * mean_square {
            return None;
        }
        let lit: Vec<Photon> = looks.iter().filter(|look| look.power > 0.0).copied().collect();
        Self::new(&lit, bounds, Self::share_of(sky, Self::other(looks)), GREATEST_SHARE)
    }
}

/// Whether enough surfaces see the environment through portals.
fn sees_portals(looks: &[Photon]) -> bool {
    let of_surfaces = looks.chunks((LOOKS + SAMPLES) as usize);
    let found = of_surfaces.map(|looks| looks.iter().filter(|look| look.power > 0.0).count());
    let (through, all) = found.fold((0, 0), |(through, all), found| {
        (through + usize::from((1..=FEW).contains(&found)), all + usize::from(found > 0))
    });
    through as f32 > LEAST_SURFACES * all as f32
}

/// Whether a lobe reflects what comes from anywhere.
fn is_wide(bxdf: &Bxdf) -> bool {
    matches!(bxdf, Bxdf::Diffuse(_) | Bxdf::Plastic(_))
}

/// Who looks for the environment.
struct Lookout<'a> {
    scene: &'a Scene,
    accel: &'a dyn Accelerator,
    environment: &'a Environment,
}

/// A surface that a path of this number has come to.
struct Stop {
    path: u32,
    point: SurfaceInteraction,
}

impl Lookout<'_> {
    /// What rays find that leave the surfaces of these camera paths, [`LOOKS`] from each, and samples of other lights there.
    fn look_along(&self, paths: Range<u32>) -> Vec<Photon> {
        let [width, height] = self.scene.camera.resolution.map(|n| n as f32);
        let camera = |path: u32| {
            let [x, y] = self.sampler().pair(path, 0);
            Ray::new(self.scene.camera.eye, self.scene.camera.direction(x * width, y * height))
        };
        let mut numbers: Vec<u32> = paths.collect();
        let mut rays: Vec<Ray> = numbers.iter().map(|&path| camera(path)).collect();
        let mut found = vec![];
        for surface in 1..=SURFACES {
            let hits = hits(self.accel, &rays);
            let arrived = numbers.iter().zip(&rays).zip(&hits).filter_map(|((&path, ray), hit)| {
                Some(Stop { path, point: self.scene.interaction(ray, hit.as_ref()?) })
            });
            let stops: Vec<Stop> = arrived.collect();
            self.look_from(&stops, surface, &mut found);
            let onward = stops.iter().filter_map(|stop| Some((stop.path, self.onward(stop, surface)?)));
            (numbers, rays) = onward.unzip();
        }
        found
    }

    fn sampler(&self) -> Sampler {
        Sampler::new(SamplerKind::Sobol, self.scene.settings.seed ^ 0x70_6f_72_74, 0, 0)
    }

    /// Looks for the environment from surfaces that reflect it from anywhere.
    fn look_from(&self, stops: &[Stop], surface: u32, found: &mut Vec<Photon>) {
        let (scene, sampler) = (self.scene, self.sampler());
        let (first, mut ways) = (found.len(), vec![]);
        for Stop { path, point } in stops {
            if !scene.bsdf(point.geom_id, point.p).lobes().iter().any(is_wide) {
                continue;
            }
            let (p, n) = (point.p, point.at.n);
            for look in 0..LOOKS {
                let u = sampler.pair(path.wrapping_mul(LOOKS).wrapping_add(look), 4 * surface);
                let drawn = Diffuse::draw(n, point.at.ng, u);
                ways.push(point.spawn(drawn.wi, f32::INFINITY, scene.settings.self_hit));
                found.push(Photon { p, n, wi: drawn.wi, power: drawn.weight, other: None, pdf: 0.0 });
            }
            for number in 0..SAMPLES {
                let u = sampler.pair(path.wrapping_mul(SAMPLES).wrapping_add(number), 4 * surface + 2);
                let light = light(scene, point, Rivals::Portals, u);
                let (way, wi, irradiance) = light.unwrap_or((Ray::inactive(), n, 0.0));
                ways.push(way);
                found.push(Photon { p, n, wi, power: 0.0, other: Some(irradiance / PI), pdf: 0.0 });
            }
        }
        for (photon, occluded) in found[first..].iter_mut().zip(occluded(self.accel, &ways)) {
            if occluded {
                (photon.power, photon.other) = (0.0, photon.other.map(|_| 0.0));
            } else if photon.power > 0.0 {
                // What is brighter is another light.
                photon.power = self.environment.le(photon.wi).luminance().min(self.environment.sun());
            }
        }
    }

    /// The ray with which a path goes on.
    fn onward(&self, Stop { path, point }: &Stop, surface: u32) -> Option<Ray> {
        let bsdf = self.scene.bsdf(point.geom_id, point.p);
        let u = self.sampler().pair(*path, 4 * surface + 1);
        let sample = bsdf.lobes().iter().find_map(|lobe| lobe.sample(&point.at, u))?;
        Some(point.spawn(sample.wi, f32::INFINITY, self.scene.settings.self_hit))
    }
}

#[cfg(test)]
mod tests {
    use super::super::map::SPREAD;
    use super::*;
    use glam::Vec3;

    /// Rays from a floor, of which one in `nth` finds a sky of this brightness in a small window, and samples of other light.
    fn looks(nth: usize, sky: f32, other: f32) -> Vec<Photon> {
        let look = |i: usize| {
            let [x, z] = [0.754_877_7, 0.569_840_3].map(|step| (i as f32 * step).fract());
            let to_window = Vec3::new(0.1 * x, 1.0, 0.1 * z).normalize();
            let power = if i.is_multiple_of(nth) { sky } else { 0.0 };
            let ray =
                Photon { p: Vec3::new(x, 0.0, z), n: Vec3::Y, wi: to_window, power, other: None, pdf: 0.0 };
            [ray, Photon { power: 0.0, other: Some(other), ..ray }]
        };
        (0..4096).flat_map(look).collect()
    }

    fn cell(looks: &[Photon]) -> Option<Cell> {
        Cell::to_portals(looks, &Aabb::around(looks.iter().map(|look| look.p)))
    }

    #[test]
    fn the_share_of_samples_through_portals_goes_by_irradiance() {
        for (sky, other) in [(32.0, 1.4), (32.0, 5.6), (8.0, 1.4)] {
            let found = cell(&looks(16, sky, other)).expect("a window");
            let expected = SPREAD * sky / 16.0 / (SPREAD * sky / 16.0 + other);
            assert!((found.share - expected).abs() < 1e-3, "{} instead of {expected}", found.share);
            assert!(found.mixture.pdf(Vec3::ZERO, Vec3::Y) > 3.0);
        }
        assert_eq!(cell(&looks(16, 32.0, 0.0)).expect("a window").share, GREATEST_SHARE);
    }

    #[test]
    fn open_skies_and_dark_rooms_have_no_portals() {
        // One in four rays is many, and next to a bright lamp a dim sky is little.
        for (nth, sky, other) in [(4, 1.0, 0.0), (16, 0.0, 1.0), (16, 1.0, 100.0)] {
            assert!(cell(&looks(nth, sky, other)).is_none(), "one in {nth} finds {sky} beside {other}");
        }
        let surfaces = |found: usize| {
            let power = move |i: usize| if i < found { 1.0 } else { 0.0 };
            let look = looks(1, 0.0, 0.0)[0];
            (0..(LOOKS + SAMPLES) as usize).map(move |i| Photon { power: power(i), ..look })
        };
        assert!(sees_portals(&[0, 2, 0].into_iter().flat_map(surfaces).collect::<Vec<_>>()));
        assert!(!sees_portals(&[16, 2, 12, 14].into_iter().flat_map(surfaces).collect::<Vec<_>>()));
        assert!(!sees_portals(&[0, 0].into_iter().flat_map(surfaces).collect::<Vec<_>>()));
    }
}
