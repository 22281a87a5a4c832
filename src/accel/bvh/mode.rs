//! What the two modes differ in: the test of triangles, and how much room boxes leave for rounding.

use super::data::{Hierarchy, TriangleBlock};
use super::ray::{Best, Prepared, Weights};
use super::rows::Rows;
use super::simd::{Lanes, Simd};
use core::fmt::Debug;
use glam::{Vec3, Vec3A};

/// A way of testing a ray: [`Watertight`](super::watertight::Watertight) or [`Fast`](super::moeller::Fast).
///
/// The traversal is written once, over this, and compiled for both.
pub(super) trait Mode: Copy + Debug {
    /// Whether boxes are entered with room for the roundings of the origin and of the triangle test.
    const WATERTIGHT: bool;

    /// What the test needs of a ray beside its origin and direction.
    type Line: Copy + Debug;
    /// One ray in each four lanes.
    type Lanes<F: Copy>: Copy;
    /// Eight rays.
    type Bundle<F: Copy>: Copy;

    /// The three vectors by which a block keeps a triangle.
    fn kept(corners: [Vec3; 3]) -> [Vec3; 3];

    /// What the test needs of a ray, from its origin, its direction and the finite reciprocal of that.
    fn line(origin: Vec3A, dir: Vec3A, rcp: Vec3A) -> Self::Line;

    /// The ray in all of four lanes.
    fn lanes<S: Simd>(simd: S, ray: &Prepared<Self>) -> Self::Lanes<S::F4>;

    /// Eight rays that are all fastest along `axes[2]`.
    fn bundle<F: Lanes<8>>(axes: [usize; 3], origin: [F; 3], dir: [F; 3], rcp: [F; 3]) -> Self::Bundle<F>;

    /// What the test needs of eight rays, from their origins, their directions and the finite reciprocals of these: the
    /// rows of [`Rows::lines`] and of [`Rows::axes`].
    fn lines<F: Lanes<8>>(origin: [F; 3], dir: [F; 3], rcp: [F; 3]) -> ([F; 6], [u8; 8]);

    /// Two rays, the first in lanes 0 to 3 and the second in 4 to 7.
    fn pair<S: Simd>(simd: S, rows: &Rows, rays: [usize; 2]) -> Self::Lanes<S::F8>;

    /// One ray against the triangles of a block; `None` if its line passes by all of them.
    fn test_block<S: Simd>(
        simd: S,
        ray: &Prepared<Self>,
        lanes: &Self::Lanes<S::F4>,
        block: &TriangleBlock,
        t_max: f32,
    ) -> Option<Crossing<S::F4, <S::F4 as Lanes<4>>::Mask>>;

    /// Two rays, each against the triangles of a block; `None` if their lines pass by all of them.
    fn test_pair<S: Simd>(
        simd: S,
        rows: &Rows,
        rays: [usize; 2],
        pair: &Self::Lanes<S::F8>,
        block: &TriangleBlock,
        interval: [S::F8; 2],
    ) -> Option<Crossing<S::F8, <S::F8 as Lanes<8>>::Mask>>;

    /// Eight rays against one triangle; `None` if their lines pass by it.
    fn test_bundle<S: Simd, const EARLY: bool>(
        simd: S,
        bundle: &Self::Bundle<S::F8>,
        triangle: impl Triangle,
        interval: [S::F8; 2],
    ) -> Option<Crossing<S::F8, <S::F8 as Lanes<8>>::Mask>>;

    /// The best of `best` and those triangles of a block that only f64 can tell.
    fn edge_on_lanes(
        data: &Hierarchy,
        ray: &Prepared<Self>,
        index: usize,
        lanes: u32,
        best: Best,
        weights: &mut Weights,
    ) -> Best;
}

/// A triangle by the vectors that a mode [keeps](Mode::kept).
pub(super) trait Triangle: Copy {
    /// A coordinate of one of the three vectors.
    fn vector(self, which: usize, axis: usize) -> f32;

    /// The axis of which all corners have the same coordinate, if there is one and the vectors are the corners.
    fn flat_axis(self) -> Option<usize>;
}

/// A triangle of a block.
#[derive(Clone, Copy)]
pub(super) struct OfBlock<'a> {
    pub(super) block: &'a TriangleBlock,
    pub(super) lane: usize,
}

impl Triangle for OfBlock<'_> {
    #[inline(always)]
    fn vector(self, which: usize, axis: usize) -> f32 {
        self.block.vectors[which][axis][self.lane]
    }

    #[inline(always)]
    fn flat_axis(self) -> Option<usize> {
        let lane = self.lane;
        let [a, b, c] = &self.block.vectors;
        (0..3).find(|&axis| a[axis][lane] == b[axis][lane] && a[axis][lane] == c[axis][lane])
    }
}

/// Where lines cross triangles.
#[derive(Clone, Copy)]
pub(super) struct Crossing<F, M> {
    /// The lanes that cross within the interval.
    pub(super) hits: M,
    /// Ray parameters; they mean something in those lanes.
    pub(super) t: F,
    /// Weights of the second and the third corner, and the sum of all three.
    pub(super) weights: [F; 3],
    /// The lanes that only f64 can tell, one bit each: for [`Mode::edge_on_lanes`].
    pub(super) edge_on: u32,
}
