//! Where eight rays meet eight triangles, in f32, of those that f32 knows well enough.
//!
//! Most hits are such, and side by side they take less time than one by one in f64.

use super::Point;
use crate::core::lanes::{Floats, LANES, Vectors};
use crate::core::{Hit, Ray, Wide, widely};
use crate::geometry::{Shape, prefetch_hits};

/// The determinant, as a part of the product of the lengths that it is made of, above which f32 will do: that of the
/// ray and both edges, so that neither slivers nor grazing rays are, ...
///
/// All three numbers are quotients of triple products whose factors are exact to a rounding. With `eps = 2^-24` and
/// `ao` the way from a corner to the ray's origin, the point is off by about `8 eps |ao| |d| |ab| |ac| / |det|`: by no
/// more than `128 eps` of its distance.
const WELL_SEEN: f32 = 1.0 / 16.0;

/// ... and that of the ray, an edge and `ao`: the coordinates are off by about `8 eps |ao| |d| |edge| / |det|`, which is
/// less than `2^-10` of the triangle. Those that are smaller for their distance are left over.
const WELL_KNOWN: f32 = 1.0 / 2048.0;

/// Points of up to eight rays on the triangles that they hit.
pub(in crate::accel) struct EightPoints {
    /// Whether f32 will do.
    known: [bool; LANES],
    /// Whether, besides, the point is in the ray's interval and where the hit said, and no rule of the ray's rejects it.
    confirmed: [bool; LANES],
    t: Floats,
    u: Floats,
    v: Floats,
}

impl EightPoints {
    /// For as many rays and their hits.
    #[inline]
    pub(in crate::accel) fn new(shapes: &[Shape], rays: &[Ray], hits: &[Option<Hit>]) -> Self {
        widely(Solve { shapes, rays, hits })
    }

    /// The exact hit for one that was found, where f32 knows it, it is where it was found, and the ray may have it.
    #[inline]
    fn confirm(&self, lane: usize, found: &Hit) -> Option<Hit> {
        let [t, u, v] = [self.t[lane], self.u[lane], self.v[lane]];
        self.confirmed[lane].then_some(Hit { t, u, v, ..*found })
    }

    /// The point of a ray on the triangle that it hits, where f32 knows it and it is inside. Which points these are
    /// depends on the ray and the triangle alone.
    #[inline]
    pub(in crate::accel) fn get(&self, lane: usize) -> Option<Point> {
        self.known[lane].then(|| Point {
            t: f64::from(self.t[lane]),
            u: f64::from(self.u[lane]),
            v: f64::from(self.v[lane]),
            beside: 0.0,
        })
    }
}

/// Makes hits exact: those that f32 confirms at once, and the others by `judge`, which is told of the ray, its hit and,
/// where f32 knows it, its point.
#[inline]
pub(in crate::accel) fn settle(
    shapes: &[Shape],
    rays: &[Ray],
    hits: &mut [Option<Hit>],
    judge: impl Fn(&Ray, Hit, Option<Point>) -> Option<Hit>,
) {
    for start in (0..rays.len()).step_by(LANES) {
        let (hits, soon) = hits[start..].split_at_mut(LANES.min(rays.len() - start));
        prefetch_hits(shapes, |i| soon.get(i)?.as_ref());
        let rays = &rays[start..start + hits.len()];
        let points = EightPoints::new(shapes, rays, hits);
        for (lane, (ray, hit)) in rays.iter().zip(hits).enumerate() {
            let settled =
                |found: Hit| points.confirm(lane, &found).or_else(|| judge(ray, found, points.get(lane)));
            *hit = hit.and_then(settled);
        }
    }
}

/// By how much a hit's `t` may differ from the exact one, as a part of the coordinates that it comes from, before it is
/// not believed. Far above the error of an ordinary hit, so that to ask again is rare, and far below what a picture
/// shows.
pub(in crate::accel) const AGREEMENT: f32 = 256.0 * f32::EPSILON;

/// [`EightPoints::new`], to be compiled for wide instructions.
struct Solve<'a> {
    shapes: &'a [Shape],
    rays: &'a [Ray],
    hits: &'a [Option<Hit>],
}

impl Wide for Solve<'_> {
    type Output = EightPoints;

    #[inline(always)]
    fn run(self) -> EightPoints {
        let [mut origins, mut directions, mut a, mut b, mut c] = [Vectors::default(); 5];
        let [mut found, mut t_min, mut t_max] = [Floats::default(); 3];
        let mut allowed = [false; LANES];
        for (lane, (ray, hit)) in self.rays.iter().zip(self.hits).enumerate().take(LANES) {
            let Some(hit) = hit else { continue };
            let Shape::Mesh(mesh) = &self.shapes[hit.geom_id as usize] else { continue };
            let corners = mesh.triangle(hit.prim_id);
            origins.set(lane, ray.origin);
            directions.set(lane, ray.dir);
            a.set(lane, corners[0]);
            b.set(lane, corners[1]);
            c.set(lane, corners[2]);
            (found[lane], t_min[lane], t_max[lane]) = (hit.t, ray.t_min, ray.t_max);
            allowed[lane] = !ray.skip.rejects(hit.geom_id, hit.prim_id);
        }
        // A lane without a triangle has no area there: its determinant is zero.
        let mut points = EightPoints {
            known: [false; LANES],
            confirmed: [false; LANES],
            t: Floats::default(),
            u: Floats::default(),
            v: Floats::default(),
        };
        for i in 0..LANES {
            let (d, corner) = (directions.get(i), a.get(i));
            let (ab, ac, ao) = (b.get(i) - corner, c.get(i) - corner, origins.get(i) - corner);
            let (p, q) = (d.cross(ac), ao.cross(ab));
            let determinant = ab.dot(p);
            let scale = 1.0 / determinant;
            let (u, v) = (scale * ao.dot(p), scale * d.dot(q));
            let (squared, dd) = (determinant * determinant, d.length_squared());
            let [edge_b, edge_c] = [ab.length_squared(), ac.length_squared()];
            let sizes = dd * edge_b.max(edge_c) * ao.length_squared();
            let well_known = (squared > WELL_SEEN * WELL_SEEN * dd * edge_b * edge_c)
                & (squared > WELL_KNOWN * WELL_KNOWN * sizes);
            let inside = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0);
            let t = scale * ac.dot(q);
            let reach = d.abs().max_element();
            let size = origins.get(i).abs().max_element().max(t.abs() * reach);
            let agrees =
                (t >= t_min[i]) & (t <= t_max[i]) & ((t - found[i]).abs() * reach <= AGREEMENT * size);
            points.known[i] = well_known & inside;
            points.confirmed[i] = well_known & inside & agrees & allowed[i];
            (points.t[i], points.u[i], points.v[i]) = (t, u, v);
        }
        points
    }
}

#[cfg(test)]
mod tests {
    use super::super::nearest_on_triangle;
    use super::*;
    use crate::core::sampler::hash;
    use crate::geometry::TriangleMesh;
    use glam::Vec3;

    #[test]
    fn what_is_known_is_as_f64_says_and_ordinary_hits_are_known() {
        let number = |i: u32| hash(i) as f32 / u32::MAX as f32 - 0.5;
        let vector = |i: u32| Vec3::new(number(i), number(i + 1), number(i + 2));
        let (mut known, mut ordinary_known, mut ordinary) = (0, 0, 0);
        for i in (0..40_000u32).map(|i| i * 32) {
            // Triangles of all sizes and shapes, from near and far, rays at points of them.
            let stretch = Vec3::new(1.0, 10f32.powf(8.0 * number(i + 3) - 4.0), 1.0);
            let size = 10f32.powf(4.0 * number(i + 4) - 2.0);
            let at = vector(i + 5);
            let corners = [i + 8, i + 11, i + 14].map(|k| at + size * stretch * vector(k));
            let (u, v) = (0.5 * (number(i + 17) + 0.5), 0.5 * (number(i + 18) + 0.5));
            let target = (1.0 - u - v) * corners[0] + u * corners[1] + v * corners[2];
            let origin = 2.0 * vector(i + 19);
            let ray = Ray::new(origin, (target - origin).normalize());
            let mesh =
                TriangleMesh::new(corners.to_vec(), vec![[0, 1, 2]], vec![], vec![]).expect("it is a mesh");
            let shapes = [Shape::Mesh(std::sync::Arc::new(mesh))];
            let hit = Hit { t: 1.0, u: 0.0, v: 0.0, geom_id: 0, prim_id: 0 };
            let points = EightPoints::new(&shapes, &[ray], &[Some(hit)]);
            let exact = nearest_on_triangle(&ray, corners);
            let cos = (corners[1] - corners[0])
                .cross(corners[2] - corners[0])
                .try_normalize()
                .map_or(0.0, |n| n.dot(ray.dir).abs());
            if size > 0.1 && (0.3..3.0).contains(&stretch.y) && cos > 0.3 {
                ordinary += 1;
                ordinary_known += u32::from(points.get(0).is_some());
            }
            let (Some(point), Some(exact)) = (points.get(0), exact) else { continue };
            known += 1;
            assert!((point.u - exact.u).abs() < 1.0 / 1024.0 && (point.v - exact.v).abs() < 1.0 / 1024.0);
            assert!((point.t - exact.t).abs() < 8e-6 * exact.t.max(1.0), "{point:?} {exact:?}");
        }
        assert!(known > 10_000 && ordinary > 300, "{known} {ordinary}");
        assert!(10 * ordinary_known > 9 * ordinary, "{ordinary_known} of {ordinary}");
    }
}
