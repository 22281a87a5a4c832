//! Spherical emitters.

use super::unit::narrow;
use super::{EightSamples, LightSample, Receiver, Receivers, density, shadow_end};
use crate::core::lanes::LANES;
use crate::core::{Frame, Rgb, warp};
use crate::geometry::Sphere;
use glam::{DVec3, Vec3};
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

impl SphereLight {
    /// The squared sine of the half angle of the cone in which it is seen, of at least 1 from inside.
    #[inline(always)]
    fn sin_squared(&self, way: DVec3) -> f64 {
        let radius = f64::from(self.sphere.radius);
        radius * radius / way.length_squared()
    }

    /// One minus the cosine of that half angle.
    #[inline(always)]
    fn cone(sin_squared: f64) -> f64 {
        // 1 - sqrt(1 - s) without cancellation: right for the farthest and smallest sphere.
        sin_squared / (1.0 + (1.0 - sin_squared).sqrt())
    }

    /// Directions towards the sphere `of` each lane, for those receivers that are in `lanes`.
    #[inline(always)]
    pub(super) fn sample_eight<'a>(
        of: impl Fn(usize) -> &'a Self,
        to: &Receivers,
        u: &[[f64; LANES]; 2],
        lanes: [bool; LANES],
    ) -> EightSamples {
        let (mut samples, mut is_inside) = (EightSamples::default(), [false; LANES]);
        for i in 0..LANES {
            let (light, p) = (of(i), to.p.get(i));
            let way = light.sphere.center.as_dvec3() - p.as_dvec3();
            let sin_squared = light.sin_squared(way);
            let outside = light.sample_outside(way, sin_squared, [u[0][i], u[1][i]]);
            samples.set_surface(i, p, outside, light.radiance);
            samples.there[i] = lanes[i];
            is_inside[i] = lanes[i] & (sin_squared >= 1.0);
        }
        for i in 0..LANES {
            if is_inside[i] {
                samples.put(i, of(i).sample_inside(to.p.get(i), [u[0][i], u[1][i]]));
            }
        }
        samples
    }

    /// A direction along the cone about `way`, from the point to the centre; the distance, and the solid angle of all.
    #[inline(always)]
    fn sample_outside(&self, way: DVec3, sin_squared: f64, u: [f64; 2]) -> (Vec3, f64, f64) {
        let radius = f64::from(self.sphere.radius);
        let whole = Self::cone(sin_squared);
        let part = u[0] * whole;
        let (cos, sin_squared) = (1.0 - part, part * (2.0 - part));
        let around = sin_squared.sqrt() as f32 * warp::unit_vector(u[1] as f32);
        let distance_squared = way.length_squared();
        let distance = distance_squared.sqrt();
        let half = (radius * radius - distance_squared * sin_squared).max(0.0).sqrt();
        let frame = Frame::new((way / distance).as_vec3());
        (frame.to_world(around.extend(cos as f32)).normalize(), distance * cos - half, TAU * whole)
    }

    /// A direction from a point inside, if any light is there.
    #[cold]
    fn sample_inside(&self, p: Vec3, u: [f64; 2]) -> Option<LightSample> {
        let way = self.sphere.center.as_dvec3() - p.as_dvec3();
        let radius = f64::from(self.sphere.radius);
        let wi = warp::uniform_sphere(narrow(u));
        let middle = wi.as_dvec3().dot(way);
        let half = (middle * middle + radius * radius - way.length_squared()).max(0.0).sqrt();
        let solid_angle = 2.0 * TAU;
        self.both_sides.then(|| LightSample {
            wi,
            t_max: shadow_end(p, (middle + half) as f32),
            le_over_pdf: self.radiance * solid_angle as f32,
            pdf: density(solid_angle),
            shadow: true,
        })
    }

    /// The density of [`sample_eight`](Self::sample_eight) in every direction that meets the sphere.
    #[inline]
    pub(super) fn pdf(&self, to: &Receiver) -> f32 {
        let sin_squared = self.sin_squared(self.sphere.center.as_dvec3() - to.p.as_dvec3());
        if sin_squared < 1.0 {
            density(TAU * Self::cone(sin_squared))
        } else if self.both_sides {
            density(2.0 * TAU)
        } else {
            0.0
        }
    }
}
