//! The fast mode's triangle test: Moeller and Trumbore 1997, "Fast, Minimum Storage Ray/Triangle Intersection", with
//! two kept edges and fused multiply-adds, as Embree has it where it is not robust.
//!
//! Rounding decides whether a ray through a shared edge meets one of the triangles, both or none.

use super::data::{BLOCK, Hierarchy, TriangleBlock};
use super::mode::{Crossing, Mode, Triangle};
use super::ray::{Best, Prepared, Weights};
use super::rows::Rows;
use super::simd::{Lanes, Mask, Simd};
use glam::{Vec3, Vec3A};

/// Speed before tightness. A block keeps a corner, the edge towards it and the edge from it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fast;

/// Rays over lanes.
#[derive(Clone, Copy)]
pub(super) struct Line<F> {
    origin: [F; 3],
    dir: [F; 3],
}

impl Mode for Fast {
    const WATERTIGHT: bool = false;
    type Line = ();
    type Lanes<F: Copy> = Line<F>;
    type Bundle<F: Copy> = Line<F>;

    fn kept([a, b, c]: [Vec3; 3]) -> [Vec3; 3] {
        [a, a - b, c - a]
    }

    #[inline(always)]
    fn line(_: Vec3A, _: Vec3A, _: Vec3A) -> Self::Line {}

    #[inline(always)]
    fn lanes<S: Simd>(simd: S, ray: &Prepared<Self>) -> Line<S::F4> {
        let splat3 = |v: Vec3A| [simd.splat4(v.x), simd.splat4(v.y), simd.splat4(v.z)];
        Line { origin: splat3(ray.origin), dir: splat3(ray.dir) }
    }

    #[inline(always)]
    fn bundle<F: Lanes<8>>(_: [usize; 3], origin: [F; 3], dir: [F; 3], _: [F; 3]) -> Line<F> {
        Line { origin, dir }
    }

    #[inline(always)]
    fn lines<F: Lanes<8>>([ox, oy, oz]: [F; 3], [dx, dy, dz]: [F; 3], _: [F; 3]) -> ([F; 6], [u8; 8]) {
        ([ox, oy, oz, dx, dy, dz], [0; 8])
    }

    #[inline(always)]
    fn pair<S: Simd>(simd: S, rows: &Rows, [a, b]: [usize; 2]) -> Line<S::F8> {
        let [ox, oy, oz, dx, dy, dz] = rows.lines.each_ref().map(|row| simd.pair8(row[a], row[b]));
        Line { origin: [ox, oy, oz], dir: [dx, dy, dz] }
    }

    #[inline(always)]
    fn test_block<S: Simd>(
        simd: S,
        ray: &Prepared<Self>,
        line: &Line<S::F4>,
        block: &TriangleBlock,
        t_max: f32,
    ) -> Option<Crossing<S::F4, <S::F4 as Lanes<4>>::Mask>> {
        let triangle = block.vectors.each_ref().map(|v| v.each_ref().map(|lanes| simd.load4(lanes)));
        cross(line, triangle, [simd.splat4(ray.t_min), simd.splat4(t_max)])
    }

    #[inline(always)]
    fn test_pair<S: Simd>(
        simd: S,
        _: &Rows,
        _: [usize; 2],
        line: &Line<S::F8>,
        block: &TriangleBlock,
        interval: [S::F8; 2],
    ) -> Option<Crossing<S::F8, <S::F8 as Lanes<8>>::Mask>> {
        let twice = |[x, y, z]: &[[f32; BLOCK]; 3]| [simd.join8(x, x), simd.join8(y, y), simd.join8(z, z)];
        let [corner, to, from] = &block.vectors;
        cross(line, [twice(corner), twice(to), twice(from)], interval)
    }

    #[inline(always)]
    fn test_bundle<S: Simd, const EARLY: bool>(
        simd: S,
        line: &Line<S::F8>,
        triangle: impl Triangle,
        interval: [S::F8; 2],
    ) -> Option<Crossing<S::F8, <S::F8 as Lanes<8>>::Mask>> {
        let vector = |k: usize| [0, 1, 2].map(|axis| simd.splat8(triangle.vector(k, axis)));
        cross(line, [vector(0), vector(1), vector(2)], interval)
    }

    #[inline(always)]
    fn edge_on_lanes(
        _: &Hierarchy,
        _: &Prepared<Self>,
        _: usize,
        _: u32,
        best: Best,
        _: &mut Weights,
    ) -> Best {
        best
    }
}

/// The test; a determinant of zero makes `t` infinite or no number, which no interval holds.
#[inline(always)]
fn cross<const N: usize, F: Lanes<N>>(
    line: &Line<F>,
    [corner, to, from]: [[F; 3]; 3],
    [t_min, t_max]: [F; 2],
) -> Option<Crossing<F, F::Mask>> {
    let normal = cross_product(from, to);
    let away: [F; 3] = core::array::from_fn(|i| corner[i] - line.origin[i]);
    let moment = cross_product(away, line.dir);
    let signed_det = dot(normal, line.dir);
    let zero = signed_det.splat(0.0);
    let det = signed_det.flip_sign(signed_det);
    let u = dot(moment, from).flip_sign(signed_det);
    let v = dot(moment, to).flip_sign(signed_det);
    let inside = zero.le(u) & zero.le(v) & (u + v).le(det);
    if inside.bits() == 0 {
        return None;
    }
    let t = dot(normal, away).flip_sign(signed_det) / det;
    Some(Crossing { hits: inside & t_min.le(t) & t.le(t_max), t, weights: [u, v, det], edge_on: 0 })
}

#[inline(always)]
fn cross_product<const N: usize, F: Lanes<N>>(a: [F; 3], b: [F; 3]) -> [F; 3] {
    core::array::from_fn(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        a[j].mul_sub(b[k], a[k] * b[j])
    })
}

#[inline(always)]
fn dot<const N: usize, F: Lanes<N>>(a: [F; 3], b: [F; 3]) -> F {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]))
}
