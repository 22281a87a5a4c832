//! Up to 32 rays side by side, as rows of numbers: what rays that want any hit are turned into, eight at a time.
//!
//! The numbers are those of [`Prepared`](super::ray::Prepared), by the same arithmetic.

use super::mode::Mode;
use super::ray::{CULL_INFLATION, GREATEST_LENGTH, GREATEST_RECIPROCAL, LEAST_LENGTH, SLACK, unusual};
use super::simd::{Lanes, Mask, Simd};
use super::stream::STREAM;
use crate::core::Ray;

/// Rays that are prepared together.
pub(super) const EIGHT: usize = 8;

/// A number of each ray.
pub(super) type Row = [f32; STREAM];

/// The rays; a triple has a row for each axis.
#[derive(Clone, Debug)]
pub(super) struct Rows {
    pub(super) origin: [Row; 3],
    pub(super) dir: [Row; 3],
    /// See [`Slabs`](super::ray::Slabs) for these three. The fast mode has `near` for `far`.
    pub(super) rcp: [Row; 3],
    pub(super) near: [Row; 3],
    pub(super) far: [Row; 3],
    pub(super) t_min: Row,
    /// Finite.
    pub(super) t_max: Row,
    /// Boxes that start behind this are not entered.
    pub(super) limit: Row,
    /// What the triangle test needs: see [`Mode::lines`].
    pub(super) lines: [Row; 6],
    /// The same.
    pub(super) axes: [u8; STREAM],
}

impl Rows {
    /// No rays.
    pub(super) const EMPTY: Self = Self {
        origin: [[0.0; STREAM]; 3],
        dir: [[0.0; STREAM]; 3],
        rcp: [[0.0; STREAM]; 3],
        near: [[0.0; STREAM]; 3],
        far: [[0.0; STREAM]; 3],
        t_min: [0.0; STREAM],
        t_max: [0.0; STREAM],
        limit: [0.0; STREAM],
        lines: [[0.0; STREAM]; 6],
        axes: [0; STREAM],
    };

    /// Sets the eight rays from `first` on. An inactive one ends before it starts.
    #[inline(always)]
    pub(super) fn set<S: Simd, M: Mode>(&mut self, simd: S, first: usize, rays: [&Ray; EIGHT]) {
        let mut eight = Eight::new(simd, rays);
        let usual = eight.usual();
        if usual != 0xff {
            eight = Eight::new(simd, tamed(rays, usual).each_ref());
        }
        let Ready { origin, dir, rcp, near, far, t_min, t_max } = Ready::new::<S, M>(simd, eight);
        let (lines, axes) = M::lines(origin, dir, rcp);

        let store = |row: &mut Row, v: S::F8| row[first..first + EIGHT].copy_from_slice(&v.to_array());
        for k in 0..3 {
            store(&mut self.origin[k], origin[k]);
            store(&mut self.dir[k], dir[k]);
            store(&mut self.rcp[k], rcp[k]);
            store(&mut self.near[k], near[k]);
            if M::WATERTIGHT {
                store(&mut self.far[k], far[k]);
            }
        }
        store(&mut self.t_min, t_min);
        store(&mut self.t_max, t_max);
        store(&mut self.limit, t_max * simd.splat8(CULL_INFLATION));
        for (row, line) in self.lines.iter_mut().zip(lines) {
            store(row, line);
        }
        self.axes[first..first + EIGHT].copy_from_slice(&axes);
    }
}

/// Eight rays in the form that the inner loops read: see [`Prepared`](super::ray::Prepared).
pub(super) struct Ready<F> {
    pub(super) origin: [F; 3],
    pub(super) dir: [F; 3],
    pub(super) rcp: [F; 3],
    pub(super) near: [F; 3],
    pub(super) far: [F; 3],
    pub(super) t_min: F,
    pub(super) t_max: F,
}

impl<F: Lanes<EIGHT>> Ready<F> {
    #[inline(always)]
    pub(super) fn new<S: Simd<F8 = F>, M: Mode>(simd: S, eight: Eight<F>) -> Self {
        let Eight { origin, dir, t_min, t_max } = eight;
        let greatest = simd.splat8(GREATEST_RECIPROCAL);
        let (one, least) = (simd.splat8(1.0), simd.splat8(-GREATEST_RECIPROCAL));
        let mut rcp = dir;
        for rcp in &mut rcp {
            *rcp = (one / *rcp).max(least).min(greatest);
        }
        let slack = simd.splat8(SLACK) * length(origin);
        let middle = [origin[0] * rcp[0], origin[1] * rcp[1], origin[2] * rcp[2]];
        let (mut near, mut far) = (middle, middle);
        if M::WATERTIGHT {
            for k in 0..3 {
                let slack = slack * magnitude(rcp[k]);
                (near[k], far[k]) = (middle[k] + slack, middle[k] - slack);
            }
        }
        Self { origin, dir, rcp, near, far, t_min, t_max: t_max.min(simd.splat8(f32::MAX)) }
    }
}

/// Eight rays as they were given.
pub(super) struct Eight<F> {
    origin: [F; 3],
    dir: [F; 3],
    t_min: F,
    t_max: F,
}

impl<F: Lanes<EIGHT>> Eight<F> {
    #[inline(always)]
    pub(super) fn new<S: Simd<F8 = F>>(simd: S, rays: [&Ray; EIGHT]) -> Self {
        let load = |component: fn(&Ray) -> f32| simd.load8(&rays.map(component));
        Self {
            origin: [load(|r| r.origin.x), load(|r| r.origin.y), load(|r| r.origin.z)],
            dir: [load(|r| r.dir.x), load(|r| r.dir.y), load(|r| r.dir.z)],
            t_min: load(|r| r.t_min),
            t_max: load(|r| r.t_max),
        }
    }

    /// Those that need no [`tamed`].
    #[inline(always)]
    pub(super) fn usual(&self) -> u32 {
        let (from, along) = (length(self.origin), length(self.dir));
        let usual = from.le(from.splat(f32::MAX))
            & along.splat(LEAST_LENGTH).le(along)
            & along.le(along.splat(GREATEST_LENGTH))
            & self.t_min.le(self.t_max);
        usual.bits()
    }
}

#[inline(always)]
fn magnitude<F: Lanes<EIGHT>>(v: F) -> F {
    v.flip_sign(v)
}

/// Sum of the components.
#[inline(always)]
fn length<F: Lanes<EIGHT>>([x, y, z]: [F; 3]) -> F {
    magnitude(x) + magnitude(y) + magnitude(z)
}

/// The rays with the unusual ones in usual numbers.
#[cold]
#[inline(never)]
fn tamed(rays: [&Ray; EIGHT], usual: u32) -> [Ray; EIGHT] {
    core::array::from_fn(|i| if usual >> i & 1 == 1 { *rays[i] } else { unusual(rays[i]).0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::bvh::ray::Prepared;
    use crate::accel::bvh::simd::Portable;
    use crate::accel::bvh::watertight::{AXES, Watertight};
    use glam::{Vec3, Vec3A};

    fn rays() -> Vec<Ray> {
        let mut state = 1u32;
        let mut unit = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 23) as f32 - 1.0
        };
        let mut vec3 = || Vec3::new(unit(), unit(), unit());
        let mut rays: Vec<Ray> = (0..24).map(|_| Ray { t_max: 2.0, ..Ray::new(vec3(), vec3()) }).collect();
        rays[3] = Ray::inactive();
        for (ray, dir) in rays[8..].iter_mut().zip([
            Vec3::new(1.0, 1.0, 1.0),
            Vec3::new(-0.0, 0.5, -0.5),
            Vec3::new(0.5, -0.0, 0.5),
            Vec3::new(1.0, -1.0, 0.25),
            Vec3::new(1e-30, 2e-30, 0.0),
            Vec3::new(1e30, 0.0, 1e30),
            Vec3::new(f32::NAN, 1.0, 1.0),
            Vec3::NEG_Z,
        ]) {
            (ray.dir, ray.t_max) = (dir, f32::INFINITY);
        }
        rays
    }

    #[test]
    fn rows_hold_the_numbers_of_a_single_ray() {
        let (rays, mut rows) = (rays(), Rows::EMPTY);
        for (k, eight) in rays.chunks(EIGHT).enumerate() {
            rows.set::<_, Watertight>(Portable, k * EIGHT, core::array::from_fn(|i| &eight[i]));
        }
        for (i, ray) in rays.iter().enumerate() {
            let single = Prepared::<Watertight>::new(ray);
            let bits = |v: [f32; 3]| v.map(f32::to_bits);
            let row = |rows: &[Row; 3]| bits(rows.map(|row| row[i]));
            let line = |from: usize| bits([0, 1, 2].map(|k| rows.lines[from + k][i]));
            let vector = |v: Vec3A| bits(v.to_array());
            assert_eq!(row(&rows.origin), vector(single.origin), "origin of {ray:?}");
            assert_eq!(row(&rows.dir), vector(single.dir), "direction of {ray:?}");
            assert_eq!(row(&rows.rcp), vector(single.slabs.rcp), "reciprocal of {ray:?}");
            assert_eq!(AXES[usize::from(rows.axes[i])], single.line.axes, "axes of {ray:?}");
            assert_eq!(line(0), vector(single.line.origin), "sorted origin of {ray:?}");
            assert_eq!(line(3), vector(single.line.shear), "shear of {ray:?}");
            assert_eq!([rows.t_min[i], rows.t_max[i]], [single.t_min, single.t_max], "interval of {ray:?}");
        }
    }
}
