//! The watertight mode's triangle test: the same bits on every path and instruction set.
//!
//! Woop, Benthin and Wald 2013, "Watertight Ray/Triangle Intersection": the corners are sheared so that the ray runs
//! along the third axis from the origin, and three edge functions of the sheared corners tell on which sides the
//! ray passes. A corner's sheared place depends on the ray and the corner alone, and `a b - c d` in two rounded
//! products and a difference never has the wrong sign (rounding is monotone), so the triangles around an edge or a
//! corner leave no gap. There is no fused multiply-add here: it would break both properties.

use super::data::{BLOCK, Hierarchy, Place, TriangleBlock};
use super::mode::{self, Mode, OfBlock, Triangle};
use super::ray::{Best, Prepared, Weights};
use super::rows::{Row, Rows};
use super::simd::{Array, Lanes, Mask, Simd};
use glam::{Vec3, Vec3A, Vec3Swizzles};

/// No ray slips between two triangles. A block keeps the corners.
#[derive(Clone, Copy, Debug)]
pub(super) struct Watertight;

/// What the test keeps of a ray.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    /// The axes in the order of the shear: `axes[2]` is the one along which the ray is fastest.
    pub(super) axes: [usize; 3],
    /// The origin by these axes.
    pub(super) origin: Vec3A,
    /// `dir[axes[0]] / dir[axes[2]]`, `dir[axes[1]] / dir[axes[2]]`, `1 / dir[axes[2]]`.
    pub(super) shear: Vec3A,
}

/// The same over lanes that hold one ray or many.
#[derive(Clone, Copy)]
pub(super) struct Shear<F> {
    origin: [F; 3],
    shear: [F; 3],
}

/// Eight rays with the same axes.
#[derive(Clone, Copy)]
pub(super) struct Bundle<F> {
    axes: [usize; 3],
    shear: Shear<F>,
    origin: [F; 3],
    rcp: [F; 3],
}

/// Axes of the shear for each fastest axis.
pub(super) const AXES: [[usize; 3]; 3] = [[1, 2, 0], [2, 0, 1], [0, 1, 2]];

/// Axes of the shear by the bits `x >= y`, `y >= z`, `z >= x` of the direction's absolute components.
const AXES_BY_ORDER: [[usize; 3]; 8] =
    [AXES[0], AXES[0], AXES[1], AXES[0], AXES[2], AXES[2], AXES[1], AXES[0]];

impl Mode for Watertight {
    const WATERTIGHT: bool = true;
    type Line = Line;
    type Lanes<F: Copy> = Shear<F>;
    type Bundle<F: Copy> = Bundle<F>;

    fn kept(corners: [Vec3; 3]) -> [Vec3; 3] {
        corners
    }

    #[inline(always)]
    fn line(origin: Vec3A, dir: Vec3A, rcp: Vec3A) -> Line {
        // Which components are at least the next one tells the greatest without branches, which incoherent rays would
        // mispredict.
        let length = dir.abs();
        let axes = AXES_BY_ORDER[length.cmpge(length.yzx()).bitmask() as usize & 7];
        let (along, from) = (dir.to_array(), origin.to_array());
        let z = rcp.to_array()[axes[2]];
        Line {
            axes,
            origin: Vec3A::new(from[axes[0]], from[axes[1]], from[axes[2]]),
            shear: Vec3A::new(along[axes[0]] * z, along[axes[1]] * z, z),
        }
    }

    #[inline(always)]
    fn lanes<S: Simd>(simd: S, ray: &Prepared<Self>) -> Shear<S::F4> {
        let splat3 = |v: Vec3A| [simd.splat4(v.x), simd.splat4(v.y), simd.splat4(v.z)];
        Shear { origin: splat3(ray.line.origin), shear: splat3(ray.line.shear) }
    }

    #[inline(always)]
    fn bundle<F: Lanes<8>>(axes: [usize; 3], origin: [F; 3], dir: [F; 3], rcp: [F; 3]) -> Bundle<F> {
        let z = rcp[axes[2]];
        let shear =
            Shear { origin: axes.map(|axis| origin[axis]), shear: [dir[axes[0]] * z, dir[axes[1]] * z, z] };
        Bundle { axes, shear, origin, rcp }
    }

    /// The axes are by the fastest one, as in [`AXES`].
    #[inline(always)]
    fn lines<F: Lanes<8>>(origin: [F; 3], dir: [F; 3], rcp: [F; 3]) -> ([F; 6], [u8; 8]) {
        let [x, y, z] = dir.map(|d| d.flip_sign(d));
        // As `AXES_BY_ORDER` has it.
        let is_y = z.le(y) & x.le(y) & x.ne(y);
        let is_z = x.le(z) & y.le(z) & y.ne(z);
        let sorted = |[x, y, z]: [F; 3]| {
            [
                x.select(is_z, z.select(is_y, y)),
                y.select(is_z, x.select(is_y, z)),
                z.select(is_z, y.select(is_y, x)),
            ]
        };
        let ([ox, oy, oz], [dx, dy, _], [_, _, rz]) = (sorted(origin), sorted(dir), sorted(rcp));
        let (is_y, is_z) = (is_y.bits(), is_z.bits());
        let axes = core::array::from_fn(|i| (is_y >> i & 1 | (is_z >> i & 1) << 1) as u8);
        ([ox, oy, oz, dx * rz, dy * rz, rz], axes)
    }

    #[inline(always)]
    fn pair<S: Simd>(simd: S, rows: &Rows, [a, b]: [usize; 2]) -> Shear<S::F8> {
        let [ox, oy, oz, sx, sy, sz] = rows.lines.each_ref().map(|row| simd.pair8(row[a], row[b]));
        Shear { origin: [ox, oy, oz], shear: [sx, sy, sz] }
    }

    #[inline(always)]
    fn test_block<S: Simd>(
        simd: S,
        ray: &Prepared<Self>,
        shear: &Shear<S::F4>,
        block: &TriangleBlock,
        t_max: f32,
    ) -> Option<mode::Crossing<S::F4, <S::F4 as Lanes<4>>::Mask>> {
        // The compiler cannot know that the axes are below 3.
        let axes = ray.line.axes.map(|axis| axis.min(2));
        let corners = block.vectors.each_ref().map(|corner| axes.map(|axis| simd.load4(&corner[axis])));
        let crossing = cross(shear, &corners);
        let inside = crossing.inside.bits();
        if inside == 0 {
            return None;
        }
        let mut t = crossing.distance(shear);
        let blurred = inside & crossing.is_blurred(shear, t).bits() & flat_lanes(&corners);
        if blurred != 0 {
            let given = [ray.origin, ray.slabs.rcp];
            t = simd.load4(&with_flat_distances(&ray.line, given, block, blurred, t.to_array()));
        }
        Some(crossing.within(t, [simd.splat4(ray.t_min), simd.splat4(t_max)]))
    }

    #[inline(always)]
    fn test_pair<S: Simd>(
        simd: S,
        rows: &Rows,
        rays: [usize; 2],
        shear: &Shear<S::F8>,
        block: &TriangleBlock,
        interval: [S::F8; 2],
    ) -> Option<mode::Crossing<S::F8, <S::F8 as Lanes<8>>::Mask>> {
        let [a, b] = rays.map(|ray| AXES[usize::from(rows.axes[ray]).min(2)]);
        let [first, second, third] = &block.vectors;
        let corners = [join(simd, first, a, b), join(simd, second, a, b), join(simd, third, a, b)];
        let crossing = cross(shear, &corners);
        let inside = crossing.inside.bits();
        if inside == 0 {
            return None;
        }
        let mut t = crossing.distance(shear);
        let blurred = inside & crossing.is_blurred(shear, t).bits() & flat_lanes(&corners);
        if blurred != 0 {
            t = simd.load8(&with_flat_distances_of_pair(rows, rays, block, blurred, t.to_array()));
        }
        Some(crossing.within(t, interval))
    }

    #[inline(always)]
    fn test_bundle<S: Simd, const EARLY: bool>(
        simd: S,
        bundle: &Bundle<S::F8>,
        triangle: impl Triangle,
        interval: [S::F8; 2],
    ) -> Option<mode::Crossing<S::F8, <S::F8 as Lanes<8>>::Mask>> {
        let axes = bundle.axes.map(|axis| axis.min(2));
        let [x, y, z] = axes;
        let mut corners = [[interval[0]; 3]; 3];
        for (k, corner) in corners.iter_mut().enumerate() {
            let at = |axis| triangle.vector(k, axis);
            *corner = [simd.splat8(at(x)), simd.splat8(at(y)), simd.splat8(at(z))];
        }
        let crossing = cross(&bundle.shear, &corners);
        if EARLY && crossing.inside.bits() == 0 {
            return None;
        }
        let mut t = crossing.distance(&bundle.shear);
        if let Some(axis) = triangle.flat_axis() {
            let plane = simd.splat8(triangle.vector(0, axis));
            let flat = crossing.flat_distance(&bundle.shear, bundle.origin[axis], plane, bundle.rcp[axis]);
            t = flat.select(crossing.is_blurred(&bundle.shear, t), t);
        }
        Some(crossing.within(t, interval))
    }

    #[cold]
    #[inline(never)]
    fn edge_on_lanes(
        data: &Hierarchy,
        ray: &Prepared<Self>,
        index: usize,
        lanes: u32,
        mut best: Best,
        weights: &mut Weights,
    ) -> Best {
        for lane in (0..BLOCK).filter(|lane| lanes >> lane & 1 == 1) {
            let place = Place::triangle(index, lane);
            if let Some((t, v, w)) = solve_edge_on(ray, &data.triangles[index], lane)
                && t >= ray.t_min
                && t <= best.t
                && best.loses_to(data, ray.skip, t, place)
            {
                best = Best { t, place };
                *weights = Weights([[v; 4], [w; 4], [1.0; 4]]);
            }
        }
        best
    }
}

/// A distance is blurred if the farthest corner's is this many times as large.
const BLURRED: f32 = 16.0;

/// A triangle's corners, `[corner][axis]` with the axes in the ray's order.
type Corners<F> = [[F; 3]; 3];

/// What the test finds; lanes mean something where `inside` is set.
#[derive(Clone, Copy)]
struct Crossing<F, M> {
    /// The line of the ray passes through the triangle or its border.
    inside: M,
    /// Edge functions: the weights of the corners times `det`.
    u: F,
    v: F,
    w: F,
    /// Sum of the three edge functions: zero if the triangle is seen edge-on, or too small for these numbers.
    det: F,
    /// Third coordinates of the corners, from the origin.
    depths: [F; 3],
}

/// Tests the line of the ray against a triangle.
#[inline(always)]
fn cross<const N: usize, F: Lanes<N>>(ray: &Shear<F>, corners: &Corners<F>) -> Crossing<F, F::Mask> {
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

/// Parameter and barycentrics in f64, where the products of the edge functions are exact: for triangles whose edge
/// functions vanish in f32 although the ray may pass between their edges.
fn solve_edge_on(ray: &Prepared<Watertight>, block: &TriangleBlock, lane: usize) -> Option<(f32, f32, f32)> {
    let (shear, corners) = scalar(ray, block, lane);
    let [a, b, c] = sheared::<1, Array<1>>(&shear, &corners).map(|corner| corner.map(|x| f64::from(x.0[0])));
    let u = c[0] * b[1] - c[1] * b[0];
    let v = a[0] * c[1] - a[1] * c[0];
    let w = b[0] * a[1] - b[1] * a[0];
    let det = u + v + w;
    if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) || det == 0.0 {
        return None;
    }
    let t = f64::from(ray.line.shear.z) * (u * a[2] + v * b[2] + w * c[2]) / det;
    Some((t as f32, (v / det) as f32, (w / det) as f32))
}

/// The lanes whose triangles have one coordinate of an axis at all corners, one bit each.
#[inline(always)]
fn flat_lanes<const N: usize, F: Lanes<N>>([a, b, c]: &Corners<F>) -> u32 {
    let differs = |axis: usize| a[axis].ne(b[axis]) | a[axis].ne(c[axis]);
    !(differs(0) & differs(1) & differs(2)).bits()
}

/// The distances of a block's triangles, with those of the flat ones among `lanes` replaced as by
/// [`Crossing::flat_distance`]. Out of line: few blocks have any.
#[inline(never)]
fn with_flat_distances(
    line: &Line,
    [origin, rcp]: [Vec3A; 2],
    block: &TriangleBlock,
    mut lanes: u32,
    mut distances: [f32; BLOCK],
) -> [f32; BLOCK] {
    while lanes != 0 {
        let lane = lanes.trailing_zeros() as usize % BLOCK;
        lanes &= lanes - 1;
        if let Some(axis) = (OfBlock { block, lane }).flat_axis() {
            let [a, b, c] = &block.vectors;
            let depth =
                |corner: &[[f32; BLOCK]; 3]| (corner[line.axes[2]][lane] - line.origin.z) * line.shear.z;
            let (u, v, w) = (depth(a), depth(b), depth(c));
            let plane = (a[axis][lane] - origin[axis]) * rcp[axis];
            // There is no NaN here.
            let min = |x: f32, y: f32| if x < y { x } else { y };
            let max = |x: f32, y: f32| if x > y { x } else { y };
            distances[lane] = min(max(plane, min(min(u, v), w)), max(max(u, v), w));
        }
    }
    distances
}

/// A corner of four triangles for each of two rays, by their axes.
#[inline(always)]
fn join<S: Simd>(simd: S, corner: &[[f32; BLOCK]; 3], a: [usize; 3], b: [usize; 3]) -> [S::F8; 3] {
    [
        simd.join8(&corner[a[0]], &corner[b[0]]),
        simd.join8(&corner[a[1]], &corner[b[1]]),
        simd.join8(&corner[a[2]], &corner[b[2]]),
    ]
}

/// The same as `with_flat_distances` for two rays and four triangles each.
#[inline(never)]
fn with_flat_distances_of_pair(
    rows: &Rows,
    rays: [usize; 2],
    block: &TriangleBlock,
    lanes: u32,
    mut distances: [f32; 2 * BLOCK],
) -> [f32; 2 * BLOCK] {
    let (halves, _) = distances.as_chunks_mut::<BLOCK>();
    for (k, (half, ray)) in halves.iter_mut().zip(rays).enumerate() {
        let triple = |rows: [&Row; 3]| Vec3A::from_array(rows.map(|row| row[ray]));
        let [ox, oy, oz, sx, sy, sz] = &rows.lines;
        let axes = AXES[usize::from(rows.axes[ray]).min(2)];
        let line = Line { axes, origin: triple([ox, oy, oz]), shear: triple([sx, sy, sz]) };
        let given = [triple(rows.origin.each_ref()), triple(rows.rcp.each_ref())];
        *half = with_flat_distances(&line, given, block, lanes >> (k * BLOCK) & 0xf, *half);
    }
    distances
}

/// One ray and one triangle, in vectors of one lane.
#[inline(always)]
fn scalar(
    ray: &Prepared<Watertight>,
    block: &TriangleBlock,
    lane: usize,
) -> (Shear<Array<1>>, Corners<Array<1>>) {
    let corners =
        block.vectors.each_ref().map(|corner| ray.line.axes.map(|axis| Array([corner[axis][lane]])));
    let splat3 = |v: Vec3A| v.to_array().map(|x| Array([x]));
    (Shear { origin: splat3(ray.line.origin), shear: splat3(ray.line.shear) }, corners)
}

impl<F: Copy, M: Mask> Crossing<F, M> {
    /// Ray parameters: the corners' depths weighted by the edge functions.
    #[inline(always)]
    fn distance<const N: usize>(&self, ray: &Shear<F>) -> F
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
    fn is_blurred<const N: usize>(&self, ray: &Shear<F>, t: F) -> M
    where
        F: Lanes<N, Mask = M>,
    {
        let [a, b, c] = self.depths;
        let [a, b, c] = [a * ray.shear[2], b * ray.shear[2], c * ray.shear[2]];
        let farthest = a.max(b).max(c).max(t.splat(0.0) - a.min(b).min(c));
        (t * t.splat(BLURRED)).le(farthest)
    }

    /// Ray parameters for triangles at one coordinate of an axis, right to three roundings: that of their plane, but not
    /// before their nearest and after their farthest corner.
    #[inline(always)]
    fn flat_distance<const N: usize>(&self, ray: &Shear<F>, origin: F, plane: F, rcp: F) -> F
    where
        F: Lanes<N, Mask = M>,
    {
        let [a, b, c] = self.depths;
        let [a, b, c] = [a * ray.shear[2], b * ray.shear[2], c * ray.shear[2]];
        ((plane - origin) * rcp).max(a.min(b).min(c)).min(a.max(b).max(c))
    }

    /// What counts in the interval.
    #[inline(always)]
    fn within<const N: usize>(&self, t: F, [t_min, t_max]: [F; 2]) -> mode::Crossing<F, M>
    where
        F: Lanes<N, Mask = M>,
    {
        let solid = self.det.ne(t.splat(0.0));
        mode::Crossing {
            hits: self.inside & solid & t_min.le(t) & t.le(t_max),
            t,
            weights: [self.v, self.w, self.det],
            edge_on: self.inside.bits() & !solid.bits(),
        }
    }
}
