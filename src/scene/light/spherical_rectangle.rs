//! A rectangle as it is seen from one point.

use glam::DVec3;
use std::f64::consts::TAU;

/// The part of the unit sphere about the origin onto which the rectangle `[x0, x1] x [y0, y1]` at height `z < 0`
/// projects.
///
/// In f64, and with angles from `atan2`, so that neither a thin nor a far rectangle's solid angle cancels: its
/// absolute error is about 1e-15.
///
/// Source: Urena, Fajardo and King 2013, *An Area-Preserving Parametrization for Spherical Rectangles*.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SphericalRectangle {
    x: [f64; 2],
    y: [f64; 2],
    z: f64,
    /// z components of the normals of the planes through the origin and the edges at `y0` and `y1`.
    b: [f64; 2],
    k: f64,
    solid_angle: f64,
}

impl SphericalRectangle {
    /// As seen from the origin; `z` is negative (or zero, for a rectangle seen edge-on).
    #[inline]
    pub(super) fn new(x: [f64; 2], y: [f64; 2], z: f64) -> Self {
        // The angle between the planes through the edges at x[i] and y[j], whose cosine is c / (lengths).
        let zz = z * z;
        let corner = |x: f64, y: f64, c: f64| (-z * (zz + x * x + y * y).sqrt()).atan2(c);
        let g0 = corner(x[1], y[0], y[0] * x[1]);
        let g1 = corner(x[1], y[1], -x[1] * y[1]);
        let g2 = corner(x[0], y[1], x[0] * y[1]);
        let g3 = corner(x[0], y[0], -x[0] * y[0]);
        let k = TAU - g2 - g3;
        let b = [-y[0] / (zz + y[0] * y[0]).sqrt(), y[1] / (zz + y[1] * y[1]).sqrt()];
        Self { x, y, z, b, k, solid_angle: g0 + g1 - k }
    }

    /// In steradians.
    #[inline]
    pub(super) fn solid_angle(&self) -> f64 {
        self.solid_angle
    }

    /// The point of the rectangle in the direction that `u` stands for: uniform by solid angle.
    #[inline]
    pub(super) fn sample(&self, u: [f64; 2]) -> DVec3 {
        // The x that cuts u[0] of the solid angle off.
        let angle = u[0] * self.solid_angle + self.k;
        let (sin, cos) = angle.sin_cos();
        let f = (cos * self.b[0] - self.b[1]) / sin;
        let cu = ((f * f + self.b[0] * self.b[0]).sqrt().recip().copysign(f)).clamp(-1.0, 1.0);
        let x = -cu * self.z / (1.0 - cu * cu).max(1e-300).sqrt();
        let x = x.clamp(self.x[0], self.x[1]);

        // Along the strip at this x the sine of the elevation is uniform.
        let distance = (x * x + self.z * self.z).sqrt();
        let [h0, h1] = self.y.map(|y| y / (distance * distance + y * y).sqrt());
        let h = h0 + u[1] * (h1 - h0);
        let y = h * distance / (1.0 - h * h).max(1e-300).sqrt();
        DVec3::new(x, y.clamp(self.y[0], self.y[1]), self.z)
    }
}
