//! Numbers of the unit interval.

/// The greatest number below 1 for what rounding made 1.
#[inline]
pub(super) fn below_one(x: f64) -> f64 {
    x.clamp(0.0, 1.0 - 0.5 * f64::EPSILON)
}

/// Two numbers as the warps of `core` take them.
#[inline]
pub(super) fn narrow(u: [f64; 2]) -> [f32; 2] {
    u.map(|u| (u as f32).min(1.0 - 0.5 * f32::EPSILON))
}
