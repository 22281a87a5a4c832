//! The one ray-triangle test of every path: watertight, and the same bits on every instruction set.
//!
//! Woop, Benthin and Wald 2013, "Watertight Ray/Triangle Intersection": the corners are sheared so that the ray runs
//! along the third axis from the origin, and three edge functions of the sheared corners tell on which sides the
//! ray passes. A corner's sheared place depends on the ray and the corner alone, and `a b - c d` in two rounded
//! products and a difference never has the wrong sign (rounding is monotone), so the triangles around an edge or a
//! corner leave no gap. There is no fused multiply-add here: it would break both properties.
//!
//! It costs no more than the test of Moeller and Trumbore 1997 with two kept edges, so there is no other mode.

use super::data::{BLOCK, TriangleBlock};
use super::ray::Prepared;
use super::simd::{Array, Lanes, Mask, Simd};
use glam::Vec3A;

/// The part of a ray that the triangle test needs, over lanes that hold one ray or many.
#[derive(Clone, Copy)]
pub(super) struct Shear<F> {
    /// Origin along the ray's axes.
    pub(super) origin: [F; 3],
    /// See [`Prepared::shear`].
    pub(super) shear: [F; 3],
}

/// A distance is blurred if the farthest corner's is this many times as large.
const BLURRED: f32 = 16.0;

/// A triangle's corners, `[corner][axis]` with the axes in the ray's order.
pub(super) type Corners<F> = [[F; 3]; 3];

/// What the test finds; lanes mean something where `inside` is set.
#[derive(Clone, Copy)]
pub(super) struct Crossing<F, M> {
    /// The line of the ray passes through the triangle or its border.
    pub(super) inside: M,
    /// Edge functions: the weights of the corners times `det`.
    u: F,
    pub(super) v: F,
    pub(super) w: F,
    /// Sum of the three edge functions: zero if the triangle is seen edge-on, or too small for these numbers.
    pub(super) det: F,
    /// Third coordinates of the corners, from the origin.
    depths: [F; 3],
}

/// Tests the line of the ray against a triangle.
#[inline(always)]
pub(super) fn cross<const N: usize, F: Lanes<N>>(
    ray: &Shear<F>,
    corners: &Corners<F>,
) -> Crossing<F, F::Mask> {
    let [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] = sheared(ray, corners);
    let u = cx * by - cy * bx;
    let v = ax * cy - ay * cx;
    let w = bx * ay - by * ax;
    let zero = u.splat(0.0);
    let inside = zero.le(u.min(v).min(w)) | u.max(v).max(w).le(zero);
    Crossing { inside, u, v, w, det: u + v + w, depths: [az, bz, cz] }
}

/// Corners seen from the origin, sheared so that the ray is the third axis; the third coordinate is unscaled.
#[inline(always)]
fn sheared<const N: usize, F: Lanes<N>>(ray: &Shear<F>, [a, b, c]: &Corners<F>) -> Corners<F> {
    [shear_corner(ray, a), shear_corner(ray, b), shear_corner(ray, c)]
}

#[inline(always)]
fn shear_corner<const N: usize, F: Lanes<N>>(ray: &Shear<F>, &[x, y, z]: &[F; 3]) -> [F; 3] {
    let z = z - ray.origin[2];
    [(x - ray.origin[0]) - ray.shear[0] * z, (y - ray.origin[1]) - ray.shear[1] * z, z]
}

impl<F> Shear<F> {
    /// One ray in all of four lanes.
    #[inline(always)]
    pub(super) fn of_ray<S: Simd<F4 = F>>(simd: S, ray: &Prepared) -> Self {
        let splat3 = |v: Vec3A| [simd.splat4(v.x), simd.splat4(v.y), simd.splat4(v.z)];
        Self { origin: splat3(ray.turned_origin), shear: splat3(ray.shear) }
    }
}

/// The corners of the four triangles of a block.
#[inline(always)]
pub(super) fn load_block<S: Simd>(simd: S, axes: [usize; 3], block: &TriangleBlock) -> Corners<S::F4> {
    let [x, y, z] = axes;
    let [a, b, c] = &block.corners;
    [
        [simd.load4(&a[x]), simd.load4(&a[y]), simd.load4(&a[z])],
        [simd.load4(&b[x]), simd.load4(&b[y]), simd.load4(&b[z])],
        [simd.load4(&c[x]), simd.load4(&c[y]), simd.load4(&c[z])],
    ]
}

/// Parameter and barycentrics in f64, where the products of the edge functions are exact: for triangles whose edge
/// functions vanish in f32 although the ray may pass between their edges.
#[cold]
#[inline(never)]
pub(super) fn solve_edge_on(ray: &Prepared, block: &TriangleBlock, lane: usize) -> Option<(f32, f32, f32)> {
    let (shear, corners) = scalar(ray, block, lane);
    let [a, b, c] = sheared::<1, Array<1>>(&shear, &corners).map(|corner| corner.map(|x| f64::from(x.0[0])));
    let u = c[0] * b[1] - c[1] * b[0];
    let v = a[0] * c[1] - a[1] * c[0];
    let w = b[0] * a[1] - b[1] * a[0];
    let det = u + v + w;
    if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) || det == 0.0 {
        return None;
    }
    let t = f64::from(ray.shear.z) * (u * a[2] + v * b[2] + w * c[2]) / det;
    Some((t as f32, (v / det) as f32, (w / det) as f32))
}

/// The distances of a block's triangles, with those of the flat ones among `lanes` replaced as by
/// [`Crossing::flat_distance`]. Out of line: few blocks have any.
#[inline(never)]
pub(super) fn with_flat_distances(
    ray: &Prepared,
    block: &TriangleBlock,
    mut lanes: u32,
    mut distances: [f32; BLOCK],
) -> [f32; BLOCK] {
    while lanes != 0 {
        let lane = lanes.trailing_zeros() as usize % BLOCK;
        lanes &= lanes - 1;
        let axis = usize::from(block.flat_axes[lane]);
        if axis < 3 {
            let [a, b, c] = &block.corners;
            let depth =
                |corner: &[[f32; BLOCK]; 3]| (corner[ray.axes[2]][lane] - ray.turned_origin.z) * ray.shear.z;
            let (u, v, w) = (depth(a), depth(b), depth(c));
            let plane = (a[axis][lane] - ray.origin[axis]) * ray.slabs.rcp[axis];
            distances[lane] = plane.max(u.min(v).min(w)).min(u.max(v).max(w));
        }
    }
    distances
}

/// One ray and one triangle, in vectors of one lane.
#[inline(always)]
fn scalar(ray: &Prepared, block: &TriangleBlock, lane: usize) -> (Shear<Array<1>>, Corners<Array<1>>) {
    let corners = block.corners.each_ref().map(|corner| ray.axes.map(|axis| Array([corner[axis][lane]])));
    let splat3 = |v: Vec3A| v.to_array().map(|x| Array([x]));
    (Shear { origin: splat3(ray.turned_origin), shear: splat3(ray.shear) }, corners)
}

impl<F: Copy, M: Mask> Crossing<F, M> {
    /// Ray parameters: the corners' depths weighted by the edge functions.
    #[inline(always)]
    pub(super) fn distance<const N: usize>(&self, ray: &Shear<F>) -> F
    where
        F: Lanes<N, Mask = M>,
    {
        let [a, b, c] = self.depths;
        let [a, b, c] = [a * ray.shear[2], b * ray.shear[2], c * ray.shear[2]];
        (self.u * a + self.v * b + self.w * c) / self.det
    }

    /// The lanes where `t` is small beside the farthest corner's: the weighted depths are wrong by the rounding of that
    /// one, which would spoil the distance to a floor much larger than what stands on it.
    #[inline(always)]
    pub(super) fn is_blurred<const N: usize>(&self, ray: &Shear<F>, t: F) -> M
    where
        F: Lanes<N, Mask = M>,
    {
        let [a, b, c] = self.depths.map(|depth| depth * ray.shear[2]);
        let farthest = a.max(b).max(c).max(t.splat(0.0) - a.min(b).min(c));
        (t * t.splat(BLURRED)).le(farthest)
    }

    /// Ray parameters for triangles at one coordinate of an axis, right to three roundings: that of their plane, but not
    /// before their nearest and after their farthest corner.
    #[inline(always)]
    pub(super) fn flat_distance<const N: usize>(&self, ray: &Shear<F>, origin: F, plane: F, rcp: F) -> F
    where
        F: Lanes<N, Mask = M>,
    {
        let [a, b, c] = self.depths;
        let [a, b, c] = [a * ray.shear[2], b * ray.shear[2], c * ray.shear[2]];
        ((plane - origin) * rcp).max(a.min(b).min(c)).min(a.max(b).max(c))
    }

    /// The lanes that count in the interval.
    #[inline(always)]
    pub(super) fn hits<const N: usize>(&self, t: F, t_min: F, t_max: F) -> M
    where
        F: Lanes<N, Mask = M>,
    {
        self.inside & self.det.ne(t.splat(0.0)) & t_min.le(t) & t.le(t_max)
    }

    /// The lanes for [`solve_edge_on`].
    #[inline(always)]
    pub(super) fn edge_on<const N: usize>(&self) -> u32
    where
        F: Lanes<N, Mask = M>,
    {
        self.inside.bits() & !self.det.ne(self.det.splat(0.0)).bits()
    }
}
