//! A rectangle as it is seen from one point.

use glam::DVec3;
use std::f64::consts::TAU;

/// An angle as a complex number of any length.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Turn {
    cos: f64,
    sin: f64,
}

impl Turn {
    /// The sum of two angles.
    #[inline]
    fn then(self, o: Self) -> Self {
        Self { cos: self.cos * o.cos - self.sin * o.sin, sin: self.sin * o.cos + self.cos * o.sin }
    }

    /// In `[0, 2 pi)`; what is below a full turn by rounding only is 0.
    #[inline]
    fn angle(self) -> f64 {
        let angle = self.sin.atan2(self.cos);
        if angle < -1e-12 { angle + TAU } else { angle.max(0.0) }
    }
}

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
    /// The sum of the angles at `x0`.
    g23: Turn,
    solid_angle: f64,
}

impl SphericalRectangle {
    /// As seen from the origin; `z` is negative (or zero, for a rectangle seen edge-on).
    #[inline]
    pub(super) fn new(x: [f64; 2], y: [f64; 2], z: f64) -> Self {
        // The angles g0 to g3 between neighbouring planes through the edges as complex numbers: their product has the
        // sum of the angles as its argument, which takes one arc tangent instead of four.
        let zz = z * z;
        let corner = |x: f64, y: f64, cos: f64| Turn { cos, sin: -z * (zz + x * x + y * y).sqrt() };
        let g01 = corner(x[1], y[0], y[0] * x[1]).then(corner(x[1], y[1], -x[1] * y[1]));
        let g23 = corner(x[0], y[1], x[0] * y[1]).then(corner(x[0], y[0], -x[0] * y[0]));
        let b = [-y[0] / (zz + y[0] * y[0]).sqrt(), y[1] / (zz + y[1] * y[1]).sqrt()];
        Self { x, y, z, b, g23, solid_angle: g01.then(g23).angle() }
    }

    /// In steradians.
    #[inline]
    pub(super) fn solid_angle(&self) -> f64 {
        self.solid_angle
    }

    /// The point of the rectangle in the direction that `u` stands for: uniform by solid angle.
    #[inline]
    pub(super) fn sample(&self, u: [f64; 2]) -> DVec3 {
        // The x that cuts u[0] of the solid angle off: at the angle u[0] solid_angle - g23. Only the ratio of its sine
        // and cosine to the length of g23 counts, so that g23 itself need not be measured.
        let (sin, cos) = (u[0] * self.solid_angle).sin_cos();
        let angle = Turn { cos, sin }.then(Turn { cos: self.g23.cos, sin: -self.g23.sin });
        let length = (self.g23.cos * self.g23.cos + self.g23.sin * self.g23.sin).sqrt();
        let f = (angle.cos * self.b[0] - length * self.b[1]) / angle.sin;
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
