//! Warps from the unit square to directions and points, each beside its pdf.
//!
//! Every `u` is in `[0, 1)`.

use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, FRAC_PI_2, FRAC_PI_4, TAU};

/// A point of the unit disk, uniform by area, with little distortion.
///
/// Source: Shirley and Chiu 1997, *A Low Distortion Map Between Disk and Square*.
#[inline]
pub fn concentric_disk(u: [f32; 2]) -> Vec2 {
    let (x, y) = (2.0 * u[0] - 1.0, 2.0 * u[1] - 1.0);
    if x == 0.0 && y == 0.0 {
        return Vec2::ZERO;
    }
    let (r, phi) =
        if x.abs() > y.abs() { (x, FRAC_PI_4 * (y / x)) } else { (y, FRAC_PI_2 - FRAC_PI_4 * (x / y)) };
    r * Vec2::from_angle(phi)
}

/// A direction of the hemisphere about +z with density `cos / pi`.
#[inline]
pub fn cosine_hemisphere(u: [f32; 2]) -> Vec3 {
    let d = concentric_disk(u);
    d.extend((1.0 - d.length_squared()).max(0.0).sqrt())
}

/// The density of [`cosine_hemisphere`], in 1/sr.
#[inline]
pub fn cosine_hemisphere_pdf(cos: f32) -> f32 {
    cos.max(0.0) * FRAC_1_PI
}

/// A direction, uniform over the sphere: density 1/(4 pi).
#[inline]
pub fn uniform_sphere(u: [f32; 2]) -> Vec3 {
    let z = 1.0 - 2.0 * u[0];
    let r = (1.0 - z * z).max(0.0).sqrt();
    (r * Vec2::from_angle(TAU * u[1])).extend(z)
}

/// Barycentric coordinates `(u, v)` of a point of a triangle, uniform by area.
///
/// Source: Heitz 2019, *A Low-Distortion Map Between Triangle and Square*.
#[inline]
pub fn uniform_triangle(u: [f32; 2]) -> [f32; 2] {
    if u[0] < u[1] {
        let b0 = 0.5 * u[0];
        [b0, u[1] - b0]
    } else {
        let b1 = 0.5 * u[1];
        [u[0] - b1, b1]
    }
}
