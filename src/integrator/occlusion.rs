//! Reflections of the environment without rays along the lobe: what is lost by a cheap estimate of occlusion.
//!
//! The reflected radiance `Int p V E` of a cosine-power lobe p in the environment E becomes `[Int p E] v`. The integral
//! is estimated by samples of the lobe that look the environment up; v, the visibility of the lobe, by the setting
//! [`Occlusion`]. Nothing is precomputed: per-vertex tables are as good as the mesh is fine, and the floor of a room
//! may be two triangles. `ao` and `mirror-visibility` are linear in V, so that one ray per sample has the right mean;
//! `cone` and `sh` are not, and take [`RAYS`] per hit, which leaves them a small error of their own: v is estimated from
//! the share of rays that are blocked, exact where none is.
//!
//! On a convex thing all modes are exact. After Kozlowski and Kautz 2007, *Is Accurate Occlusion of Glossy Reflections
//! Necessary?*

use super::bounce::Dimension;
use super::path::Path;
use super::tally::{RayClass, Tally};
use super::vertex::Outgoing;
use super::wave::Integrator;
use crate::accel::Coherence;
use crate::bxdf::{Bsdf, Bxdf, LobeKind};
use crate::core::{Frame, Ray, Sampler, warp};
use crate::scene::{Environment, Occlusion, SurfaceInteraction};
use glam::Vec3;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Rays per hit of the modes that are not linear in visibility.
const RAYS: usize = 16;

/// A surface where visibility is wanted.
struct Place<'a> {
    path: &'a Path,
    point: &'a SurfaceInteraction,
    sampler: &'a Sampler,
}

impl Integrator<'_> {
    /// Whether the reflection of a lobe is approximated, so that no ray is traced along it.
    #[inline]
    pub(super) fn approximates(&self, bxdf: &Bxdf) -> bool {
        !self.scene.settings.occlusion.is_exact() && matches!(bxdf, Bxdf::CosinePower(_))
    }

    /// The environment in the lobes that are approximated.
    pub(super) fn reflect_environment(
        &self,
        path: &Path,
        point: &SurfaceInteraction,
        bsdf: &Bsdf,
        out: &mut Outgoing,
    ) {
        let Some(environment) = &self.scene.lights.environment else { return };
        let sampler = *out.roots.sampler(path.slot);
        let place = Place { path, point, sampler: &sampler };
        for (number, bxdf) in bsdf.lobes().iter().enumerate() {
            if let Bxdf::CosinePower(lobe) = bxdf {
                let lobe = Lobe { number, exponent: f64::from(lobe.exponent), environment, bxdf };
                self.reflect_lobe(&place, &lobe, out);
            }
        }
    }

    /// The lobe's samples of the environment, each with its share of visibility.
    fn reflect_lobe(&self, place: &Place, lobe: &Lobe, out: &mut Outgoing) {
        let (path, point) = (place.path, place.point);
        let settings = &self.scene.settings;
        let count = self.rays_of(path, LobeKind::Glossy);
        let visible = match settings.occlusion {
            Occlusion::Cone => self.cone_visibility(place, lobe.exponent, out.tally),
            Occlusion::Sh => self.harmonic_visibility(place, lobe.exponent, out.tally),
            Occlusion::Exact | Occlusion::None | Occlusion::Ao | Occlusion::MirrorVisibility => 1.0,
        };
        for number in 0..count {
            let index = path.index.wrapping_mul(count).wrapping_add(number);
            let u = place.sampler.pair(index, Dimension::Lobe(lobe.number).at(path.depth));
            let Some(sample) = lobe.bxdf.sample(&point.at, u) else { continue };
            let share = visible / count as f32;
            let light = path.beta * sample.weight * lobe.environment.le(sample.wi) * share;
            let towards = match settings.occlusion {
                Occlusion::Ao => {
                    let u = place.sampler.pair(index, Dimension::Occlusion.at(path.depth));
                    Some(Frame::new(point.at.ng).to_world(warp::cosine_hemisphere(u)).normalize())
                }
                Occlusion::MirrorVisibility => Some(point.at.mirror_direction()),
                _ => None,
            };
            match towards {
                Some(wi) if !light.is_black() => {
                    out.shadows.push(path.slot, light, point.spawn(wi, f32::INFINITY, settings.self_hit));
                }
                _ => out.add(path, light),
            }
        }
    }

    /// Directions above the surface by `warp`, and whether something is in the way of each.
    fn look_around(
        &self,
        place: &Place,
        warp: impl Fn([f32; 2]) -> Vec3,
        tally: &mut Tally,
    ) -> ([Vec3; RAYS], [bool; RAYS]) {
        let frame = Frame::new(place.point.at.ng);
        let dimension = Dimension::Occlusion.at(place.path.depth);
        let first = place.path.index.wrapping_mul(RAYS as u32);
        let directions: [Vec3; RAYS] = std::array::from_fn(|i| {
            frame.to_world(warp(place.sampler.pair(first.wrapping_add(i as u32), dimension))).normalize()
        });
        let self_hit = self.scene.settings.self_hit;
        let rays: [Ray; RAYS] = directions.map(|wi| place.point.spawn(wi, f32::INFINITY, self_hit));
        let mut blocked = [false; RAYS];
        self.log.inspect(|log| log.record(RayClass::Shadow, &rays));
        tally.time(RayClass::Shadow, RAYS, || {
            self.accel.occluded(&rays, Coherence::Incoherent, &mut blocked);
        });
        (directions, blocked)
    }

    /// What the lobe's cone and the cone of visibility share, by what the lobe's cone and the hemisphere share.
    ///
    /// The cone of visibility is about the mean of the free directions and as wide as lets the same ambient light in
    /// (Oat and Sander 2007, *Ambient Aperture Lighting*); that of the lobe holds 9 tenths of it.
    fn cone_visibility(&self, place: &Place, exponent: f64, tally: &mut Tally) -> f32 {
        let (directions, blocked) = self.look_around(place, warp::cosine_hemisphere, tally);
        let free = blocked.iter().filter(|blocked| !**blocked).count();
        if free == 0 || free == RAYS {
            return free as f32 / RAYS as f32;
        }
        let sum: Vec3 = directions.iter().zip(blocked).filter(|(_, blocked)| !blocked).map(|(w, _)| *w).sum();
        let bent = sum.try_normalize().unwrap_or(place.point.at.ng);
        let open = free as f64 / RAYS as f64;
        let r = place.point.at.mirror_direction();
        cone_share(open, exponent, angle(bent, r), angle(place.point.at.ng, r)) as f32
    }

    /// The mean over the lobe of visibility in spherical harmonics up to band 2, by that of a bare hemisphere.
    ///
    /// Directions are uniform above the surface, with density 1 / (2 pi).
    fn harmonic_visibility(&self, place: &Place, exponent: f64, tally: &mut Tally) -> f32 {
        let uniform = |[x, y]: [f32; 2]| {
            let z = 1.0 - x;
            let (sin, cos) = (std::f32::consts::TAU * y).sin_cos();
            let r = (1.0 - z * z).max(0.0).sqrt();
            Vec3::new(r * cos, r * sin, z)
        };
        let (directions, blocked) = self.look_around(place, uniform, tally);
        let r = place.point.at.mirror_direction();
        let taken = directions.iter().zip(blocked).filter(|(_, blocked)| *blocked);
        let taken: f64 = taken.map(|(w, _)| kernel(exponent, f64::from(w.dot(r)))).sum();
        let all = hemisphere(exponent, f64::from(place.point.at.ng.dot(r)));
        (1.0 - taken * TAU / RAYS as f64 / all).clamp(0.0, 1.0) as f32
    }
}

/// A lobe of a surface.
struct Lobe<'a> {
    number: usize,
    exponent: f64,
    environment: &'a Environment,
    bxdf: &'a Bxdf,
}

fn angle(a: Vec3, b: Vec3) -> f64 {
    f64::from(a.dot(b).clamp(-1.0, 1.0)).acos()
}

/// The lobe's coefficients in bands 1 and 2; that of band 0 is 1. Exact for every real exponent.
fn bands(exponent: f64) -> [f64; 2] {
    [(exponent + 1.0) / (exponent + 2.0), exponent / (exponent + 3.0)]
}

/// The lobe up to band 2, at the cosine `x` to its axis, in 1/sr.
fn kernel(exponent: f64, x: f64) -> f64 {
    let [one, two] = bands(exponent);
    (1.0 + 3.0 * one * x + 5.0 * two * (1.5 * x * x - 0.5)) / (2.0 * TAU)
}

/// The integral of [`kernel`] over a hemisphere to whose axis the lobe's has the cosine `cos`.
fn hemisphere(exponent: f64, cos: f64) -> f64 {
    0.5 + 0.75 * bands(exponent)[0] * cos
}

/// What a lobe sees through a cone of visibility that lets the share `open` of the ambient light in, its axis `to_bent`
/// from the lobe's, by what it sees of the hemisphere, whose axis is `to_normal` from the lobe's. Angles in radians.
fn cone_share(open: f64, exponent: f64, to_bent: f64, to_normal: f64) -> f64 {
    let visible = (1.0 - open).max(0.0).sqrt().acos();
    let lobe = 0.1f64.powf(1.0 / (exponent + 1.0)).acos();
    let all = caps(FRAC_PI_2, lobe, to_normal);
    if all > 0.0 { (caps(visible, lobe, to_bent) / all).clamp(0.0, 1.0) } else { open }
}

/// The solid angle that two spherical caps of the radii `a` and `b` share whose axes are `d` apart, in radians.
fn caps(a: f64, b: f64, d: f64) -> f64 {
    if d >= a + b {
        return 0.0;
    }
    if d <= (a - b).abs() {
        return TAU * (1.0 - a.min(b).cos());
    }
    let acos = |x: f64| x.clamp(-1.0, 1.0).acos();
    let (sin_d, cos_d) = d.sin_cos();
    let between = acos((cos_d - a.cos() * b.cos()) / (a.sin() * b.sin()));
    let at_a = acos((b.cos() - cos_d * a.cos()) / (sin_d * a.sin()));
    let at_b = acos((a.cos() - cos_d * b.cos()) / (sin_d * b.sin()));
    (TAU - 2.0 * (between + at_a * a.cos() + at_b * b.cos())).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn caps_share_what_was_integrated_numerically() {
        for (a, b, d, shared) in [(0.5, 0.7, 0.6, 0.428_542_23), (1.2, 0.3, 1.1, 0.195_342_60)] {
            assert!((caps(a, b, d) - shared).abs() < 1e-7, "{}", caps(a, b, d));
            assert!((caps(b, a, d) - shared).abs() < 1e-7);
        }
        assert_eq!(caps(0.3, 0.2, 0.6), 0.0);
        assert!((caps(1.0, 0.2, 0.1) - TAU * (1.0 - 0.2f64.cos())).abs() < 1e-12);
        // Half of a cap whose axis lies in the edge of a hemisphere.
        assert!((caps(FRAC_PI_2, 0.4, FRAC_PI_2) - 0.5 * TAU * (1.0 - 0.4f64.cos())).abs() < 1e-9);
    }

    #[test]
    fn the_kernel_integrates_to_one_and_to_the_closed_form_over_a_hemisphere() {
        let steps = 400;
        for exponent in [0.0, 1.0, 10.0, 1e5] {
            for cos in [1.0f64, 0.6, 0.0] {
                let sin = (1.0 - cos * cos).sqrt();
                let (mut sphere, mut above) = (0.0, 0.0);
                for i in 0..steps {
                    let z = 2.0 * (f64::from(i) + 0.5) / f64::from(steps) - 1.0;
                    for j in 0..steps {
                        let phi = TAU * (f64::from(j) + 0.5) / f64::from(steps);
                        let x = cos * z + sin * (1.0 - z * z).sqrt() * phi.cos();
                        let part = kernel(exponent, x) * 2.0 * TAU / f64::from(steps).powi(2);
                        sphere += part;
                        above += if z > 0.0 { part } else { 0.0 };
                    }
                }
                assert!((sphere - 1.0).abs() < 1e-4, "{exponent} {cos}: {sphere}");
                assert!((above - hemisphere(exponent, cos)).abs() < 1e-4, "{exponent} {cos}: {above}");
            }
        }
    }
}
