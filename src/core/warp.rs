//! Warps from the unit square to directions and points, each beside its pdf.
//!
//! Every `u` is in `[0, 1)`.

use glam::{Vec2, Vec2Swizzles, Vec3};
use std::f32::consts::{FRAC_1_PI, FRAC_PI_2, FRAC_PI_4};

/// The part of a number in `[low, low + width)` that it is in, in `[0, 1)`.
#[inline(always)]
pub fn within(u: f32, low: f32, width: f32) -> f32 {
    ((u - low) / width).min(1.0 - 0.5 * f32::EPSILON)
}

/// Cosine and sine of an eighth of a turn at most, `|x| <= pi / 4`, to 1e-7: two roundings.
///
/// Taylor's polynomials, whose next terms are below 3e-8.
#[inline(always)]
fn unit_vector_near_x(x: f32) -> Vec2 {
    let xx = x * x;
    let cos = 1.0 + xx * (-1.0 / 2.0 + xx * (1.0 / 24.0 + xx * (-1.0 / 720.0 + xx * (1.0 / 40_320.0))));
    let sin = x + x * xx * (-1.0 / 6.0 + xx * (1.0 / 120.0 + xx * (-1.0 / 5040.0 + xx * (1.0 / 362_880.0))));
    Vec2::new(cos, sin)
}

/// The unit vector at the angle `2 pi turns`, for `turns` in `[0, 1]`, to 2e-7.
#[inline(always)]
pub fn unit_vector(turns: f32) -> Vec2 {
    // The nearest quarter turn, from which the angle differs by an eighth at most: both without rounding.
    let quarter = (4.0 * turns + 0.5) as i32;
    let v = unit_vector_near_x((4.0 * turns - quarter as f32) * FRAC_PI_2);
    let v = if quarter & 1 == 0 { v } else { v.perp() };
    if quarter & 2 == 0 { v } else { -v }
}

/// The angle of a vector of any length, in turns from x over y: in `[0, 1]`, to 6e-8; 0 of no length.
///
/// The polynomial is that of `atanf` in Moshier's *Cephes Mathematical Library*.
#[inline(always)]
pub fn turns(v: Vec2) -> f32 {
    let (x, y) = (v.x.abs(), v.y.abs());
    let (far, near) = if y > x { (y, x) } else { (x, y) };
    // Within an eighth of a turn of the axis, of which the outer half is seen from the diagonal.
    let is_outer = near > far * TAN_PI_8;
    let (rise, run) = if is_outer { (near - far, near + far) } else { (near, far) };
    let t = rise / if run > 0.0 { run } else { 1.0 };
    let tt = t * t;
    let arc = t + t * tt * (-0.333_329_5 + tt * (0.199_777_1 + tt * (-0.138_776_86 + tt * 0.080_537_446)));
    let eighth = arc * (0.5 * FRAC_1_PI) + if is_outer { 0.125 } else { 0.0 };
    let quarter = if y > x { 0.25 - eighth } else { eighth };
    let half = if v.x < 0.0 { 0.5 - quarter } else { quarter };
    if v.y < 0.0 { 1.0 - half } else { half }
}

/// Tangent of a sixteenth of a turn.
const TAN_PI_8: f32 = 0.414_213_57;

/// A point of the unit disk, uniform by area, with little distortion.
///
/// Source: Shirley and Chiu 1997, *A Low Distortion Map Between Disk and Square*.
#[inline(always)]
pub fn concentric_disk(u: [f32; 2]) -> Vec2 {
    let (x, y) = (2.0 * u[0] - 1.0, 2.0 * u[1] - 1.0);
    // Choices and no branches: which it is can be told of no point before.
    let about_x = x.abs() > y.abs();
    let (far, near) = if about_x { (x, y) } else { (y, x) };
    let middle = far == 0.0;
    let v = far * unit_vector_near_x(FRAC_PI_4 * (near / if middle { 1.0 } else { far }));
    if about_x { v } else { v.yx() }
}

/// A direction of the hemisphere about +z with density `cos / pi`.
#[inline(always)]
pub fn cosine_hemisphere(u: [f32; 2]) -> Vec3 {
    let d = concentric_disk(u);
    d.extend((1.0 - d.length_squared()).max(0.0).sqrt())
}

/// The density of [`cosine_hemisphere`], in 1/sr.
#[inline(always)]
pub fn cosine_hemisphere_pdf(cos: f32) -> f32 {
    cos.max(0.0) * FRAC_1_PI
}

/// A direction, uniform over the sphere: density 1/(4 pi).
#[inline(always)]
pub fn uniform_sphere(u: [f32; 2]) -> Vec3 {
    let z = 1.0 - 2.0 * u[0];
    let r = (1.0 - z * z).max(0.0).sqrt();
    (r * unit_vector(u[1])).extend(z)
}

/// Barycentric coordinates `(u, v)` of a point of a triangle, uniform by area.
///
/// Source: Heitz 2019, *A Low-Distortion Map Between Triangle and Square*.
#[inline(always)]
pub fn uniform_triangle(u: [f32; 2]) -> [f32; 2] {
    if u[0] < u[1] {
        let b0 = 0.5 * u[0];
        [b0, u[1] - b0]
    } else {
        let b1 = 0.5 * u[1];
        [u[0] - b1, b1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_are_those_of_the_arc_tangent_to_the_last_bit_but_one() {
        for i in 0..1 << 20 {
            let angle = f64::from(i) * std::f64::consts::TAU / f64::from(1 << 20);
            let v = Vec2::new(angle.cos() as f32, angle.sin() as f32);
            let expected = f64::from(v.y).atan2(f64::from(v.x)) / std::f64::consts::TAU;
            let error = (f64::from(turns(v)) - expected).rem_euclid(1.0);
            assert!(error.min(1.0 - error) < 6e-8, "{v}: {error}");
        }
        let along = [(0.0, 0.0), (1.0, -0.0), (0.0, 3.0), (-1e-30, 0.0), (-0.0, -1.0), (1e30, 1e30)];
        assert_eq!(along.map(|(x, y)| turns(Vec2::new(x, y))), [0.0, 0.0, 0.25, 0.5, 0.75, 0.125]);
    }

    #[test]
    fn unit_vectors_have_the_angle_to_two_roundings() {
        for i in 0..=1 << 20 {
            let turns = i as f32 / (1 << 20) as f32;
            let (sin, cos) = (std::f64::consts::TAU * f64::from(turns)).sin_cos();
            let v = unit_vector(turns).as_dvec2();
            assert!((v.x - cos).abs() < 2e-7 && (v.y - sin).abs() < 2e-7, "{turns}: {v}");
        }
    }
}
