//! Flat rectangular (or parallelogram-shaped) emitters.

use super::spherical_rectangle::SphericalRectangle;
use super::{EightSamples, EmitterHit, LightSample, Receiver, Receivers, density, shadow_end};
use crate::core::Rgb;
use crate::core::lanes::LANES;
use glam::{DVec3, Vec3};

/// A rectangle that emits the same radiance everywhere.
///
/// From near, directions are uniform over the solid angle that the rectangle subtends; from afar, where that makes
/// no difference, points are uniform over its area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RectangleLight {
    corner: DVec3,
    /// Edges from the corner.
    edges: [DVec3; 2],
    /// Unit vectors along the edges.
    axes: [DVec3; 2],
    /// Unit normal of the front.
    normal: DVec3,
    area: f64,
    middle: DVec3,
    /// The squared distance from the middle from which on points are uniform over the area.
    far_squared: f64,
    radiance: Rgb,
    both_sides: bool,
}

/// Beyond this many half diagonals from its centre a rectangle is sampled by area. Weights then vary there by 7 %
/// (standard deviation) from right before it and by 40 to 60 % at slants of 45 to 75 degrees, which was little beside what
/// else varies: the error per sample of a Cornell box rose by 1 %. A point takes a tenth of the time.
const FAR: f64 = 2.0;

/// Least solid angle that is trusted: below are rectangles seen edge-on, whose sample would be ill-conditioned.
const LEAST_SOLID_ANGLE: f64 = 1e-6;

/// Points nearer to the plane than this fraction of the half diagonal are taken to be so far from it, which is about
/// the rounding of their coordinates.
const LEAST_HEIGHT: f64 = 1e-7;

impl RectangleLight {
    /// See [`Light::rectangle`](super::Light::rectangle).
    pub(super) fn new(corner: Vec3, edges: [Vec3; 2], radiance: Rgb, both_sides: bool) -> Self {
        let edges = edges.map(Vec3::as_dvec3);
        let cross = edges[0].cross(edges[1]);
        let axes = edges.map(DVec3::normalize_or_zero);
        Self {
            corner: corner.as_dvec3(),
            edges,
            axes,
            normal: cross.normalize_or_zero(),
            area: cross.length(),
            middle: corner.as_dvec3() + 0.5 * (edges[0] + edges[1]),
            // From no distance at all unless the edges are at right angles.
            far_squared: if axes[0].dot(axes[1]).abs() < 1e-5 {
                FAR * FAR * 0.25 * (edges[0] + edges[1]).length_squared()
            } else {
                0.0
            },
            radiance,
            both_sides,
        }
    }

    /// The corners in order around it.
    pub(super) fn corners(&self) -> [Vec3; 4] {
        let [u, v] = self.edges;
        [DVec3::ZERO, u, u + v, v].map(|offset| (self.corner + offset).as_vec3())
    }

    /// Unit normal of the front; zero if it has no area.
    pub(super) fn normal(&self) -> Vec3 {
        self.normal.as_vec3()
    }

    /// In unit lengths squared.
    pub(super) fn area(&self) -> f64 {
        self.area
    }

    /// What it emits.
    pub(super) fn radiance(&self) -> Rgb {
        self.radiance
    }

    /// Whether the back emits as well.
    pub(super) fn both_sides(&self) -> bool {
        self.both_sides
    }

    /// Height of `p` over the front, if light can reach it.
    #[inline]
    fn height(&self, p: DVec3) -> Option<f64> {
        let height = (p - self.corner).dot(self.normal);
        (height > 0.0 || (self.both_sides && height < 0.0)).then_some(height)
    }

    /// What the rectangle looks like from `p` at `height`; `None` if it is to be sampled by area.
    #[inline]
    fn near(&self, p: DVec3, height: f64) -> Option<SphericalRectangle> {
        if (self.middle - p).length_squared() < self.far_squared { self.seen_from(p, height) } else { None }
    }

    /// What it looks like; `None` if it is seen edge-on.
    #[inline(never)]
    fn seen_from(&self, p: DVec3, height: f64) -> Option<SphericalRectangle> {
        let [u, v] = self.edges;
        let from = self.corner - p;
        let [x, y] = [from.dot(self.axes[0]), from.dot(self.axes[1])];
        let seen = SphericalRectangle::new(
            [x, x + u.dot(self.axes[0])],
            [y, y + v.dot(self.axes[1])],
            -height.abs().max(LEAST_HEIGHT / FAR * self.far_squared.sqrt()),
        );
        (seen.solid_angle() > LEAST_SOLID_ANGLE).then_some(seen)
    }

    /// A direction towards the rectangle.
    #[inline(never)]
    pub(super) fn sample(&self, to: &Receiver, u: [f64; 2]) -> Option<LightSample> {
        let p = to.p.as_dvec3();
        let height = self.height(p)?;
        let (wi, distance, solid_angle) = match self.near(p, height) {
            Some(seen) => {
                let q = seen.sample(u);
                let way = self.axes[0] * q.x + self.axes[1] * q.y + self.normal * q.z.copysign(-height);
                let distance = way.length();
                ((way / distance).as_vec3(), distance, seen.solid_angle())
            }
            None => self.point(p, height, u),
        };
        Some(LightSample {
            wi,
            t_max: shadow_end(to.p, distance as f32),
            le_over_pdf: self.radiance * solid_angle as f32,
            pdf: density(solid_angle),
            shadow: true,
        })
    }

    /// A point, uniform by area, from `p` at `height`: the direction, the distance, and the solid angle that all of the
    /// area would have as it is seen there.
    #[inline(always)]
    fn point(&self, p: DVec3, height: f64, u: [f64; 2]) -> (Vec3, f64, f64) {
        let way = self.corner + self.edges[0] * u[0] + self.edges[1] * u[1] - p;
        let distance = way.length();
        let inverse = distance.recip();
        let solid_angle = self.area * height.abs() * (inverse * inverse * inverse);
        ((way * inverse).as_vec3(), distance, solid_angle)
    }

    /// [`sample`](Self::sample) of the rectangle `of` each lane, for those receivers that are there and in `lanes`.
    #[inline(always)]
    pub(super) fn sample_eight<'a>(
        of: impl Fn(usize) -> &'a Self,
        to: &Receivers,
        u: &[[f64; LANES]; 2],
        lanes: [bool; LANES],
    ) -> EightSamples {
        let (mut samples, mut is_near) = (EightSamples::default(), [false; LANES]);
        for i in 0..LANES {
            let (light, receiver) = (of(i), to.p.get(i));
            let p = receiver.as_dvec3();
            let height = (p - light.corner).dot(light.normal);
            let point = light.point(p, height, [u[0][i], u[1][i]]);
            samples.set_surface(i, receiver, point, light.radiance);
            samples.there[i] = lanes[i] & ((height > 0.0) | (light.both_sides & (height < 0.0)));
            is_near[i] = samples.there[i] & ((light.middle - p).length_squared() < light.far_squared);
        }
        for i in 0..LANES {
            if is_near[i] {
                samples.put(i, of(i).sample(&to.get(i), [u[0][i], u[1][i]]));
            }
        }
        samples
    }

    /// The density of [`sample`](Self::sample) at a point that a ray has found.
    #[inline]
    pub(super) fn pdf(&self, to: &Receiver, hit: &EmitterHit) -> f32 {
        let p = to.p.as_dvec3();
        let Some(height) = self.height(p) else { return 0.0 };
        match self.near(p, height) {
            Some(seen) => density(seen.solid_angle()),
            None => {
                let t = f64::from(hit.t);
                density(self.area * height.abs() / (t * t * t))
            }
        }
    }
}
