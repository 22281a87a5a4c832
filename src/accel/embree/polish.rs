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

use super::query::{Care, Query};
use super::scene::Scene;
use super::single::{intersect_one, occluded_one};
use crate::accel::Coherence;
use crate::accel::exact::{self, AGREEMENT, EightPoints, Point};
use crate::core::{Hit, Ray, Skip};
use crate::geometry::Shape;

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
    let known = EightPoints::new(shapes, std::slice::from_ref(ray), &[Some(found)]).get(0);
    verdict(shapes, ray, found, known)
}

/// [`judge`], where the point may be known already.
#[inline]
fn verdict(shapes: &[Shape], ray: &Ray, found: Hit, known: Option<Point>) -> Verdict {
    let point = known.or_else(|| match &shapes[found.geom_id as usize] {
        Shape::Mesh(mesh) => exact::nearest_on_triangle(ray, mesh.triangle(found.prim_id)),
        Shape::Spheres(spheres) => {
            let [enter, leave] = exact::sphere_ends(ray, spheres[found.prim_id as usize]);
            let t = f64::from(found.t);
            Some(if (enter.t - t).abs() <= (leave.t - t).abs() { enter } else { leave })
        }
    });
    let Some(point) = point else {
        return Verdict::Miss;
    };
    let t = point.t as f32;
    if !(t >= ray.t_min && t <= ray.t_max && point.is_near(ray)) {
        return Verdict::Miss;
    }
    let hit = Hit { t, u: point.u as f32, v: point.v as f32, ..found };
    let apart = (point.t - f64::from(found.t)).abs() * f64::from(ray.dir.abs().max_element());
    if apart <= f64::from(AGREEMENT) * point.size(ray) {
        Verdict::Right(hit)
    } else {
        Verdict::Elsewhere(hit)
    }
}

impl Scene {
    /// Makes Embree's closest hits exact, and finds others for those that a rule or the primitive itself denies.
    ///
    /// In f64 alone it took 40 to 65 ns a hit on 5,000 triangles and 30 to 115 ns on 1.3 million, on a loaded machine; with
    /// ordinary hits in f32, eight at a time, whole renders take 5 to 17 % less time. With many triangles the corners come
    /// from memory, and shading, which needs them next, finds them in the cache.
    pub(super) fn settle_exactly(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        exact::settle(self.shapes(), rays, hits, |ray, found, known| {
            if ray.skip.rejects(found.geom_id, found.prim_id) {
                return self.ask_again(ray, Care::Checking);
            }
            match verdict(self.shapes(), ray, found, known) {
                Verdict::Right(hit) => Some(hit),
                _ => self.ask_again(ray, Care::Exhaustive),
            }
        });
    }

    /// Takes Embree's closest hits as they are, up to a rounding at the interval's ends, and finds others for those
    /// that a rule rejects.
    ///
    /// A ray that starts at an error-bounded offset from the primitive that it skips nearly never hits it, so the
    /// answers without a filter are nearly all final and the rule costs nothing.
    pub(super) fn settle_rules(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        for (ray, answer) in rays.iter().zip(hits) {
            if answer.is_some_and(|hit| ray.skip.rejects(hit.geom_id, hit.prim_id)) {
                *answer = intersect_one(self, &mut Query::filtered(self.shapes(), ray, Care::Trusting), ray);
            }
            if let Some(hit) = answer {
                hit.t = hit.t.clamp(ray.t_min, ray.t_max);
            }
        }
    }

    /// The closest hit by a filter, which keeps the best of the candidates that Embree misplaced.
    #[cold]
    fn ask_again(&self, ray: &Ray, care: Care) -> Option<Hit> {
        let mut query = Query::filtered(self.shapes(), ray, care);
        let accepted = intersect_one(self, &mut query, ray).map(|found| judge(self.shapes(), ray, found));
        let best = query.best();
        match accepted {
            Some(Verdict::Right(hit)) if best.is_none_or(|best| hit.t < best.t) => Some(hit),
            _ => best,
        }
    }

    /// Any hit of rays of which some carry a rule, ray by ray.
    ///
    /// An answer does not say what was hit, so the filter is there from the start: to ask without it first and again
    /// for the occluded rays took 1.25 times as long on 1.3 million triangles (0.9 times on 5,000).
    pub(super) fn occluded_by_rules(&self, rays: &[Ray], occluded: &mut [bool]) {
        let mut all = Query::all(Coherence::Incoherent);
        for (ray, occluded) in rays.iter().zip(&mut *occluded).filter(|(ray, _)| ray.skip == Skip::None) {
            *occluded = occluded_one(self, &mut all, ray);
        }
        self.occluded_with_rules(rays, occluded);
    }

    /// Any hit of those rays that carry a rule; leaves the answers of the others as they are.
    pub(super) fn occluded_with_rules(&self, rays: &[Ray], occluded: &mut [bool]) {
        for (ray, occluded) in rays.iter().zip(occluded).filter(|(ray, _)| ray.skip != Skip::None) {
            *occluded = occluded_one(self, &mut Query::filtered(self.shapes(), ray, Care::Trusting), ray);
        }
    }
}
