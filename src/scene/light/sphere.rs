//! Spherical emitters.

use super::unit::narrow;
use super::{LightSample, Receiver, density, shadow_end};
use crate::core::{Frame, Rgb, warp};
use crate::geometry::Sphere;
use glam::DVec3;
use std::f64::consts::TAU;

/// A sphere that emits the same radiance everywhere.
///
/// Directions are uniform over the cone in which the sphere is seen, or over all directions from inside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphereLight {
    pub(super) sphere: Sphere,
    pub(super) radiance: Rgb,
    pub(super) both_sides: bool,
}

/// How a sphere lies around or before a point.
enum View {
    Inside,
    /// One minus the cosine of the cone's half angle.
    Cone(f64),
}

impl SphereLight {
    /// The view along `way` from a point to the centre; `None` if nothing is emitted that way.
    #[inline]
    fn view(&self, way: DVec3) -> Option<View> {
        let radius = f64::from(self.sphere.radius);
        let sin_squared = radius * radius / way.length_squared();
        if sin_squared < 1.0 {
            // 1 - sqrt(1 - s) without cancellation: right for the farthest and smallest sphere.
            Some(View::Cone(sin_squared / (1.0 + (1.0 - sin_squared).sqrt())))
        } else {
            self.both_sides.then_some(View::Inside)
        }
    }

    /// A direction towards the sphere.
    #[inline]
    pub(super) fn sample(&self, to: &Receiver, u: [f64; 2]) -> Option<LightSample> {
        let way = self.sphere.center.as_dvec3() - to.p.as_dvec3();
        let radius = f64::from(self.sphere.radius);
        let (wi, t, solid_angle) = match self.view(way)? {
            View::Inside => {
                let wi = warp::uniform_sphere(narrow(u));
                let middle = wi.as_dvec3().dot(way);
                let half = (middle * middle + radius * radius - way.length_squared()).max(0.0).sqrt();
                (wi, middle + half, 2.0 * TAU)
            }
            View::Cone(whole) => {
                let part = u[0] * whole;
                let (cos, sin_squared) = (1.0 - part, part * (2.0 - part));
                let (sin_phi, cos_phi) = (TAU * u[1]).sin_cos();
                let sin = sin_squared.sqrt();
                let local = DVec3::new(sin * cos_phi, sin * sin_phi, cos).as_vec3();
                let distance_squared = way.length_squared();
                let distance = distance_squared.sqrt();
                let half = (radius * radius - distance_squared * sin_squared).max(0.0).sqrt();
                let frame = Frame::new((way / distance).as_vec3());
                (frame.to_world(local).normalize(), distance * cos - half, TAU * whole)
            }
        };
        Some(LightSample {
            wi,
            t_max: shadow_end(to.p, t as f32),
            le_over_pdf: self.radiance * solid_angle as f32,
            pdf: density(solid_angle),
            shadow: true,
        })
    }

    /// The density of [`sample`](Self::sample) in every direction that meets the sphere.
    #[inline]
    pub(super) fn pdf(&self, to: &Receiver) -> f32 {
        match self.view(self.sphere.center.as_dvec3() - to.p.as_dvec3()) {
            None => 0.0,
            Some(View::Inside) => density(2.0 * TAU),
            Some(View::Cone(whole)) => density(TAU * whole),
        }
    }
}
