//! The point that a ray hit, as everything above the accelerators sees it.

use super::Scene;
use crate::bxdf::{Bsdf, Incidence};
use crate::core::lanes::LANES;
use crate::core::{Hit, Ray, Skip};
use crate::geometry::{Sphere, prefetch_hits};
use crate::scene::SelfHit;
use glam::Vec3;

/// A point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceInteraction {
    /// The point, from the primitive itself and not from the ray's parameter.
    pub p: Vec3,
    /// Bound of the error of `p` along the geometric normal, above 0.
    pub p_error: f32,
    /// Directions and normals, on the viewer's side.
    pub at: Incidence,
    /// The hit's geometry.
    pub geom_id: u32,
    /// The hit's primitive.
    pub prim_id: u32,
    /// Whether the primitive is flat, so that no ray that leaves it can come back to it.
    pub flat: bool,
    /// Height over a flat primitive from which no test in f32 finds it again: see the function `clearance`. Zero for others.
    pub clearance: f32,
    /// Whether that height may take the place of a rule: not for what is not flat, nor for thin triangles, where it is large.
    pub clears: bool,
}

/// `n eps / (1 - n eps)`: bound of the relative error of n roundings (Higham).
pub(super) const fn gamma(n: f32) -> f32 {
    let eps = 0.5 * f32::EPSILON;
    n * eps / (1.0 - n * eps)
}

/// Least distance that a ray starts above a surface, in the unit world: where coordinates are exact, such as on a
/// plane through the origin, the error is 0, and a ray that starts in the plane hits its other triangles there.
pub(super) const LEAST_OFFSET: f32 = 1.0 / (1u64 << 40) as f32;

impl Scene {
    /// What `hit` means: the same for every backend.
    pub fn interaction(&self, ray: &Ray, hit: &Hit) -> SurfaceInteraction {
        self.interactions([(ray, hit); LANES]).get(0)
    }

    /// Asks for what the next hits will need, to be called every eight: see [`prefetch_hits`].
    #[inline(always)]
    pub fn prefetch<'a>(&self, next: impl Fn(usize) -> Option<&'a Hit>) {
        prefetch_hits(&self.shapes, next);
    }

    /// The lobes at a point of a geometry.
    pub fn bsdf(&self, geom_id: u32, p: Vec3) -> Bsdf {
        self.material(geom_id).bsdf(p)
    }
}

/// The point of a sphere that a ray hit.
pub(super) fn on_sphere(sphere: Sphere, ray: &Ray, hit: &Hit) -> SurfaceInteraction {
    let wo = -ray.dir;
    let ng = sphere.normal_at(ray.at(hit.t));
    let error = gamma(16.0) * (sphere.center.abs().max_element() + sphere.radius);
    let front = ng.dot(wo) >= 0.0;
    let facing = if front { ng } else { -ng };
    SurfaceInteraction {
        p: sphere.center + sphere.radius * ng,
        p_error: error.max(LEAST_OFFSET),
        at: Incidence { wo, n: facing, ng: facing, front },
        geom_id: hit.geom_id,
        prim_id: hit.prim_id,
        flat: false,
        clearance: 0.0,
        clears: false,
    }
}

/// The plane of a triangle.
pub(super) struct Plane {
    /// Unit normal, computed in f64, where the cross product of the edges does not cancel.
    pub(super) ng: Vec3,
    /// See [`clearance`].
    pub(super) clearance: f32,
    /// Whether the square of the longest edge is more than [`MOST_STRETCHED`] times twice the area.
    pub(super) thin: bool,
}

#[inline(always)]
pub(super) fn plane(a: Vec3, b: Vec3, c: Vec3) -> Plane {
    let longest_squared =
        (b - a).length_squared().max((c - a).length_squared()).max((c - b).length_squared());
    let a = a.as_dvec3();
    let cross = (b.as_dvec3() - a).cross(c.as_dvec3() - a);
    let length = cross.length();
    let ng = (cross * length.recip()).as_vec3();
    let thin = (longest_squared > MOST_STRETCHED * length as f32) | (length as f32 == 0.0);
    Plane { ng, clearance: clearance(longest_squared, length as f32), thin }
}

/// Height over a triangle's plane from which no test in f32 says that a ray upwards hits the triangle.
///
/// A test finds the ray's parameter as `(v - o) . m / (d . m)`, `v` a corner and `m` the cross product of two edges.
/// With `l` the longest edge and `eps = 2^-24`, `m` is off by at most `4 eps l^2`, so that the numerator has the
/// wrong sign only below the height `4 eps l (1 + l^2 / |m|)`. Twice that is left.
#[inline(always)]
fn clearance(longest_squared: f32, cross_length: f32) -> f32 {
    4.0 * f32::EPSILON * longest_squared.sqrt() * (1.0 + longest_squared / cross_length)
}

/// The offset alone keeps no more than this from a surface, in the unit world: slivers of an aspect beyond a few hundred and
/// endless planes would need it.
const MOST_CLEARANCE: f32 = 1.0 / (1u32 << 13) as f32;

/// The square of a triangle's longest edge over twice its area, above which a triangle is thin.
const MOST_STRETCHED: f32 = 16.0;

/// Whether the mirror direction about `n` leaves the surface: `r . ng > 0` with `r = 2 (n . wo) n - wo`.
#[inline(always)]
pub(super) fn mirror_leaves(n: Vec3, ng: Vec3, wo: Vec3) -> bool {
    2.0 * n.dot(wo) * n.dot(ng) > wo.dot(ng)
}

/// The interpolated normal `n`, which faces the viewer, bent towards `ng` as little as makes the mirror direction leave
/// the surface.
pub(super) fn bent_normal(n: Vec3, ng: Vec3, wo: Vec3) -> Vec3 {
    // The normal halfway between wo and its mirror image just above the tangent plane, in the plane of n and ng; not
    // where the two are so nearly opposite that nothing but rounding is left of their sum.
    let r = 2.0 * n.dot(wo) * n - wo;
    let lifted = (r - ng * (r.dot(ng) - 0.01 * wo.dot(ng).max(1e-4))).try_normalize();
    let halfway = lifted.and_then(|r| (wo + r).try_normalize());
    halfway.filter(|n| n.dot(wo) > 0.0 && mirror_leaves(*n, ng, wo)).unwrap_or(ng)
}

impl SurfaceInteraction {
    /// A ray from this point along the unit vector `wi`, which does not hit the surface that it leaves.
    ///
    /// The origin moves along the geometric normal, to `wi`'s side, past the error of the point (pbrt-v4, 6.8.6), and where that
    /// is all that keeps it from the surface, past the error of the test in f32 too.
    #[inline]
    pub fn spawn(&self, wi: Vec3, t_max: f32, self_hit: SelfHit) -> Ray {
        let origin = self.start(wi, self.lift(self_hit));
        Ray { origin, t_min: 0.0, dir: wi, t_max, skip: self.rule(wi, self_hit) }
    }

    /// A ray for which it only counts whether anything lies on it.
    ///
    /// As [`spawn`](Self::spawn), but where a little more distance from the surface does as well as the rule of
    /// [`SelfHit::Primitive`], it has that instead: accelerators answer rays without a rule faster.
    #[inline]
    pub fn spawn_shadow(&self, wi: Vec3, t_max: f32, self_hit: SelfHit) -> Ray {
        let origin = self.start(wi, self.shadow_lift(self_hit));
        self.shadow_ray(origin, wi, t_max, self_hit)
    }

    /// The ray of [`spawn_shadow`](Self::spawn_shadow) from its `origin`.
    #[inline(always)]
    pub(super) fn shadow_ray(&self, origin: Vec3, wi: Vec3, t_max: f32, self_hit: SelfHit) -> Ray {
        let ray = Ray { origin, t_min: 0.0, dir: wi, t_max, skip: Skip::None };
        match self_hit {
            SelfHit::Geometry => Ray { skip: self.rule(wi, self_hit), ..ray },
            SelfHit::Primitive if !self.clears => Ray { skip: self.rule(wi, self_hit), ..ray },
            // What starts nearer to a light must end as much earlier.
            _ => Ray { t_max: (t_max - self.shadow_lift(self_hit)).max(0.0), ..ray },
        }
    }

    /// Where a ray along `wi` starts: on its side of the surface, by `lift` above the error of the point.
    #[inline(always)]
    pub(super) fn start(&self, wi: Vec3, lift: f32) -> Vec3 {
        let side = if self.is_above(wi) { self.at.ng } else { -self.at.ng };
        self.p + side * (self.p_error + lift)
    }

    /// What is added to the error of the point: something where no rule keeps rays from the surface.
    #[inline(always)]
    pub(super) fn lift(&self, self_hit: SelfHit) -> f32 {
        match self_hit {
            // The lesser of the two also where a triangle without area has no number.
            SelfHit::Offset => self.clearance.min(MOST_CLEARANCE),
            SelfHit::Primitive | SelfHit::Geometry => 0.0,
        }
    }

    /// The same for shadow rays, where they have no rule.
    #[inline(always)]
    pub(super) fn shadow_lift(&self, self_hit: SelfHit) -> f32 {
        match self_hit {
            SelfHit::Primitive if self.clears => self.clearance,
            _ => self.lift(self_hit),
        }
    }

    /// What a ray along `wi` must not hit.
    #[inline(always)]
    pub(super) fn rule(&self, wi: Vec3, self_hit: SelfHit) -> Skip {
        match self_hit {
            SelfHit::Geometry => Skip::Geometry(self.geom_id),
            // A ray that goes into a sphere must meet its far side.
            SelfHit::Primitive if self.flat || self.is_above(wi) == self.at.front => {
                Skip::Primitive { geom: self.geom_id, prim: self.prim_id }
            }
            SelfHit::Primitive | SelfHit::Offset => Skip::None,
        }
    }

    /// Whether `wi` leaves on the viewer's side.
    #[inline(always)]
    fn is_above(&self, wi: Vec3) -> bool {
        wi.dot(self.at.ng) >= 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::warp;

    /// Directions of the hemisphere about `n`, the i-th of a sequence, at a height of `cos`.
    fn at_height(n: Vec3, cos: f32, phi: f32) -> Vec3 {
        let frame = crate::core::Frame::new(n);
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        frame.to_world(Vec3::new(sin * phi.cos(), sin * phi.sin(), cos)).normalize()
    }

    #[test]
    fn the_mirror_direction_about_a_shading_normal_leaves_the_surface() {
        let mut at_grazing = 0;
        for i in 0..200_000u32 {
            let u = |k: u32| crate::core::sampler::hash(i * 8 + k) as f32 / u32::MAX as f32;
            let ng = warp::uniform_sphere([u(0), u(1)]);
            let n = at_height(ng, u(2), 6.3 * u(3));
            // From overhead to half an ulp above the surface.
            let wo = at_height(ng, 10f32.powf(-8.0 * u(4)), 6.3 * u(5));
            if wo.dot(ng) <= 0.0 {
                continue;
            }
            if n.dot(wo) <= 0.0 {
                continue;
            }
            let bent = if mirror_leaves(n, ng, wo) { n } else { bent_normal(n, ng, wo) };
            let r = 2.0 * bent.dot(wo) * bent - wo;
            assert!((bent.length() - 1.0).abs() < 1e-5, "{bent} is no unit vector");
            assert!(bent.dot(wo) > 0.0, "{i}: the viewer is behind {bent}");
            assert!(r.dot(ng) > -1e-7, "{i}: {} below the surface at {}", r.dot(ng), wo.dot(ng));
            at_grazing += u32::from(wo.dot(ng) < 1e-6);
        }
        assert!(at_grazing > 10_000);
    }
}
