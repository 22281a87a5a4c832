//! Embree's answers held against the primitives themselves, in f64.
//!
//! Embree divides by an approximate reciprocal of a determinant in f32. On a thin triangle seen at a grazing angle
//! the determinant is mostly rounding, and the hit lands anywhere along the ray (its issue 387): of rays at
//! triangles of aspect 100, 10 % of the grazing ones were wrong by more than 0.01 of the triangle's length. Below
//! edges of 1e-9 its `u` and `v` are zero. So Embree's word is taken for *which* primitive is hit, and the point is
//! computed here; where the two differ by more than roundings, or the ray's own rule rejects the primitive, the ray
//! is asked again with a filter that sees every candidate.
//!
//! The points no longer depend on the call, the packet or the version that found the primitive.

use super::query::Query;
use super::scene::Scene;
use super::single::{intersect_one, occluded_one};
use crate::accel::exact;
use crate::core::{Hit, Ray, Skip};
use crate::geometry::Shape;
use glam::Vec3;

/// By how much `t` may differ from the exact one, as a part of the coordinates that it comes from, before the ray is
/// asked again. Far above the error of an ordinary hit, so that asking again is rare, and far below what a picture
/// shows.
const AGREEMENT: f64 = 256.0 * f32::EPSILON as f64;

/// What the primitive itself says of a hit; the hit has the exact numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Verdict {
    /// It is where Embree found it.
    Right(Hit),
    /// It is elsewhere in the ray's interval.
    Elsewhere(Hit),
    /// The ray does not hit this primitive in its interval.
    Miss,
}

/// Computes the hit of a primitive that Embree named.
#[inline]
pub(super) fn judge(shapes: &[Shape], ray: &Ray, found: Hit) -> Verdict {
    let point = match &shapes[found.geom_id as usize] {
        Shape::Mesh(mesh) => exact::nearest_on_triangle(ray, mesh.triangle(found.prim_id)),
        Shape::Spheres(spheres) => {
            let [enter, leave] = exact::sphere_ends(ray, spheres[found.prim_id as usize]);
            let t = f64::from(found.t);
            Some(if (enter.t - t).abs() <= (leave.t - t).abs() { enter } else { leave })
        }
    };
    let Some(point) = point else {
        return Verdict::Miss;
    };
    let t = point.t as f32;
    let speed = largest(ray.dir);
    let slack = AGREEMENT * (largest(ray.origin) + point.t.abs() * speed);
    if !(t >= ray.t_min && t <= ray.t_max && point.beside <= slack) {
        return Verdict::Miss;
    }
    let hit = Hit { t, u: point.u as f32, v: point.v as f32, ..found };
    let apart = (point.t - f64::from(found.t)).abs() * speed;
    if apart <= slack { Verdict::Right(hit) } else { Verdict::Elsewhere(hit) }
}

fn largest(v: Vec3) -> f64 {
    f64::from(v.abs().max_element())
}

impl Scene {
    /// Makes Embree's closest hits exact, and finds others for those that a rule or the primitive itself denies.
    pub(super) fn settle_hits(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        for (ray, answer) in rays.iter().zip(hits) {
            let Some(found) = *answer else { continue };
            *answer = if ray.skip.rejects(found.geom_id, found.prim_id) {
                self.ask_again(ray, false)
            } else {
                match judge(self.shapes(), ray, found) {
                    Verdict::Right(hit) => Some(hit),
                    _ => self.ask_again(ray, true),
                }
            };
        }
    }

    /// The closest hit by a filter, which keeps the best of the candidates that Embree misplaced.
    ///
    /// An `exhaustive` filter looks at all candidates along the ray: after one misplaced hit, others are likely.
    #[cold]
    fn ask_again(&self, ray: &Ray, exhaustive: bool) -> Option<Hit> {
        let mut query = Query::filtered(self.shapes(), ray, exhaustive);
        let accepted = intersect_one(self, &mut query, ray).map(|found| judge(self.shapes(), ray, found));
        let best = query.best();
        match accepted {
            Some(Verdict::Right(hit)) if best.is_none_or(|best| hit.t < best.t) => Some(hit),
            _ => best,
        }
    }

    /// Asks again, with a filter, for each occluded ray that carries a rule: any hit does not say of what.
    pub(super) fn settle_occluded(&self, rays: &[Ray], occluded: &mut [bool]) {
        for (ray, occluded) in rays.iter().zip(occluded) {
            if *occluded && ray.skip != Skip::None {
                let mut query = Query::filtered(self.shapes(), ray, false);
                *occluded = occluded_one(self, &mut query, ray) || query.best().is_some();
            }
        }
    }
}
