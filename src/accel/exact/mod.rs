//! Where a ray meets one primitive, in f64: what brute force answers, and what an answer in f32 is polished to.
//!
//! Coordinates are f32, so the differences and products below lose next to nothing in f64, and an answer rounded
//! to f32 is the same whoever found the primitive. Where f32 is as good, `eight` does it for eight rays at once.

mod eight;

pub(super) use eight::settle;
#[cfg(feature = "embree")]
pub(super) use eight::{AGREEMENT, EightPoints};

use crate::core::Ray;
use crate::geometry::Sphere;
use glam::{DVec3, Vec3};

/// A ray's parameter and the barycentric coordinates of the point there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Point {
    pub(super) t: f64,
    pub(super) u: f64,
    pub(super) v: f64,
    /// How far the point lies from the ray, in units of the scene: zero but for roundings where the ray crosses the
    /// primitive.
    pub(super) beside: f64,
}

/// How far beside a primitive a ray may pass and still be said to hit it, as a part of the coordinates that the hit
/// comes from: edge tests in f32 are as generous as their rounding errors are large.
const EDGE: f64 = 16.0 * f32::EPSILON as f64;

impl Point {
    /// The largest coordinate that the point is made of.
    #[inline]
    pub(super) fn size(&self, ray: &Ray) -> f64 {
        let largest = |v: Vec3| f64::from(v.abs().max_element());
        largest(ray.origin).max(self.t.abs() * largest(ray.dir))
    }

    /// Whether the ray passes so near that a test in f32 may say that it hits.
    #[inline]
    pub(super) fn is_near(&self, ray: &Ray) -> bool {
        self.beside <= EDGE * self.size(ray)
    }
}

/// Scalar triple products of the edges seen from the origin (Woop, Benthin and Wald 2013 without the shear, which
/// f64 does not need), one per corner.
///
/// An edge gives both of its triangles the same product, up to its sign: no ray passes between them.
struct Products {
    corners: [DVec3; 3],
    dir: DVec3,
    /// Weights of the corners, not normalised.
    weights: [f64; 3],
}

impl Products {
    fn new(ray: &Ray, corners: [Vec3; 3]) -> Self {
        let dir = ray.dir.as_dvec3();
        let [a, b, c] = corners.map(|p| p.as_dvec3() - ray.origin.as_dvec3());
        let weights = [(c, b), (a, c), (b, a)].map(|(p, q)| p.cross(q).dot(dir));
        Self { corners: [a, b, c], dir, weights }
    }

    /// The point that the weights name, of which no part is outside the triangle; `None` for a triangle that has
    /// no area as seen along the ray.
    fn point(&self) -> Option<Point> {
        let sign = self.weights.iter().sum::<f64>().signum();
        let inside = self.weights.map(|w| (w * sign).max(0.0));
        let sum: f64 = inside.iter().sum();
        if sum == 0.0 {
            return None;
        }
        let [w, u, v] = inside.map(|w| w / sum);
        let [a, b, c] = self.corners;
        let p = w * a + u * b + v * c;
        let t = p.dot(self.dir) / self.dir.length_squared();
        Some(Point { t, u, v, beside: (p - t * self.dir).length() })
    }
}

/// Where the ray's line crosses a triangle, edges included; a triangle without area is not crossed.
pub(super) fn crossing(ray: &Ray, corners: [Vec3; 3]) -> Option<Point> {
    let products = Products::new(ray, corners);
    let outside = products.weights.iter().any(|&w| w < 0.0) && products.weights.iter().any(|&w| w > 0.0);
    if outside { None } else { products.point() }
}

/// The triangle's point for a ray that is known to cross it, at its border if roundings say that it does not.
///
/// Nearly all points are inside, where one division gives them (Moeller and Trumbore 1997).
#[inline]
pub(super) fn nearest_on_triangle(ray: &Ray, corners: [Vec3; 3]) -> Option<Point> {
    let [a, b, c, o, d] = [corners[0], corners[1], corners[2], ray.origin, ray.dir].map(Vec3::as_dvec3);
    let (ab, ac, ao) = (b - a, c - a, o - a);
    let (p, q) = (d.cross(ac), ao.cross(ab));
    let scale = 1.0 / ab.dot(p);
    let (u, v) = (scale * ao.dot(p), scale * d.dot(q));
    if u >= 0.0 && v >= 0.0 && u + v <= 1.0 {
        return Some(Point { t: scale * ac.dot(q), u, v, beside: 0.0 });
    }
    Products::new(ray, corners).point()
}

/// Where the ray's line enters and leaves a sphere, or its closest approach and the distance beside the sphere.
pub(super) fn sphere_ends(ray: &Ray, sphere: Sphere) -> [Point; 2] {
    let d = ray.dir.as_dvec3();
    let to_center = sphere.center.as_dvec3() - ray.origin.as_dvec3();
    let t_closest = to_center.dot(d) / d.length_squared();
    let off_center = to_center - t_closest * d;
    let radius = f64::from(sphere.radius);
    let squared_half_chord = (radius * radius - off_center.length_squared()) / d.length_squared();
    let beside = (off_center.length() - radius).max(0.0);
    let half_chord = squared_half_chord.max(0.0).sqrt();
    [t_closest - half_chord, t_closest + half_chord].map(|t| Point { t, u: 0.0, v: 0.0, beside })
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [Vec3; 3] = [Vec3::ZERO, Vec3::X, Vec3::Y];

    fn down(x: f32, y: f32) -> Ray {
        Ray::new(Vec3::new(x, y, 2.0), -0.5 * Vec3::Z)
    }

    #[test]
    fn a_crossing_has_its_barycentrics() {
        let p = crossing(&down(0.25, 0.5), CORNERS).expect("inside");
        assert_eq!((p.t, p.u, p.v, p.beside), (4.0, 0.25, 0.5, 0.0));
        assert!(crossing(&down(0.0, 0.5), CORNERS).is_some(), "an edge belongs to the triangle");
        assert!(crossing(&down(-1e-7, 0.5), CORNERS).is_none());
        let flat = [Vec3::ZERO, Vec3::X, 2.0 * Vec3::X];
        assert!(crossing(&down(0.5, 0.0), flat).is_none());
    }

    #[test]
    fn the_nearest_point_is_on_the_border() {
        let p = nearest_on_triangle(&down(-0.125, 0.5), CORNERS).expect("it has an area");
        assert!(p.u == 0.0 && (p.beside - 0.125).abs() < 0.1 && (p.t - 4.0).abs() < 1e-12, "{p:?}");
    }

    #[test]
    fn a_sphere_has_two_ends() {
        let sphere = Sphere { center: Vec3::ZERO, radius: 1.0 };
        assert_eq!(sphere_ends(&down(0.0, 0.0), sphere).map(|p| p.t), [2.0, 6.0]);
        let missed = sphere_ends(&down(1.5, 0.0), sphere);
        assert_eq!(missed.map(|p| (p.t, p.beside)), [(4.0, 0.5), (4.0, 0.5)]);
    }
}
