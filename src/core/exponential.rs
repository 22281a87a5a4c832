//! Exponential and logarithm without a branch or a table, so that a loop over lanes compiles to wide instructions.
//!
//! To about two roundings each, and the same bits on every machine, which a C library's do not promise.
//!
//! Sources: the logarithm is that of FreeBSD's `e_logf.c` (polynomial by Gladman); the exponential takes Taylor's polynomial
//! on `|r| <= ln 2 / 2`, whose next term is below 6e-9.

use std::f32::consts::LOG2_E;

/// `ln 2` in two parts: products of the upper one with whole numbers up to 127 are exact.
const LN_2: [f32; 2] = [0.693_138_1, 9.058_001e-6];

/// The logarithm of `x`, a positive normal number, to 1.5e-7 of itself.
#[inline(always)]
pub fn ln(x: f32) -> f32 {
    // x = 2^k m with m between the roots of 1/2 and of 2.
    let above = x.to_bits().wrapping_sub(0x3f35_04f3) as i32;
    let k = above >> 23;
    let m = f32::from_bits(x.to_bits().wrapping_sub((k << 23) as u32));
    let f = m - 1.0;
    let s = f / (2.0 + f);
    let (z, half_square) = (s * s, 0.5 * f * f);
    let rest = z * (0.666_666_6 + z * (0.400_009_72 + z * (0.284_987_87 + z * 0.242_790_79)));
    let k = k as f32;
    s * (half_square + rest) + k * LN_2[1] - half_square + f + k * LN_2[0]
}

/// `ln (1 + x)` for `x` in `(-1, 0]`, to 2e-7 of itself.
#[inline(always)]
pub fn ln_1p(x: f32) -> f32 {
    let sum = (1.0 + x).max(f32::MIN_POSITIVE);
    // What the sum has lost.
    ln(sum) + (x - (sum - 1.0)) / sum
}

/// `x = n ln 2 + r`: `2^n`, and `e^r - 1`. Below -87 it is as at -87.
#[inline(always)]
fn parts(x: f32) -> (f32, f32) {
    let x = x.max(-87.0);
    // Whole numbers in the lowest bits of the sum.
    const ROUND: f32 = 12_582_912.0;
    let shifted = x * LOG2_E + ROUND;
    let n = shifted - ROUND;
    let r = (x - n * LN_2[0]) - n * LN_2[1];
    let rest = 1.0 / 6.0 + r * (1.0 / 24.0 + r * (1.0 / 120.0 + r * (1.0 / 720.0 + r * (1.0 / 5040.0))));
    let scale = f32::from_bits((shifted.to_bits() << 23).wrapping_add(1.0f32.to_bits()));
    (scale, r + r * r * (0.5 + r * rest))
}

/// `e^x` for `x <= 0`, to 2e-7 of itself; 0 below -87.
#[inline(always)]
pub fn exp(x: f32) -> f32 {
    let (scale, rest) = parts(x);
    let y = scale * rest + scale;
    if x < -87.0 { 0.0 } else { y }
}

/// `e^x - 1` for `x <= 0`, to 3e-7 of itself.
#[inline(always)]
pub fn exp_m1(x: f32) -> f32 {
    let (scale, rest) = parts(x);
    scale * rest + (scale - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The greatest relative error of `f` against `expected`, over numbers of all sizes from `least` to `most`.
    fn error(least: f64, most: f64, f: impl Fn(f32) -> f32, expected: impl Fn(f64) -> f64) -> f64 {
        let steps = 1_000_000;
        let size = |i: i32| least * (most / least).powf(f64::from(i) / f64::from(steps));
        let relative = |x: f32| {
            let expected = expected(f64::from(x));
            if expected == 0.0 { f64::from(f(x)) } else { (f64::from(f(x)) / expected - 1.0).abs() }
        };
        (0..=steps).map(|i| relative(size(i) as f32)).fold(0.0, f64::max)
    }

    #[test]
    fn logarithms_are_exact_to_about_a_rounding() {
        assert!(error(1.2e-38, 1e38, ln, f64::ln) < 1.5e-7);
        assert!(error(0.5, 2.0, ln, f64::ln) < 1.5e-7);
        assert!(error(1e-30, 0.999_999, |x| ln_1p(-x), |x| (-x).ln_1p()) < 2e-7);
        assert_eq!([ln(1.0), ln_1p(0.0)], [0.0; 2]);
    }

    #[test]
    fn exponentials_are_exact_to_two_roundings() {
        assert!(error(1e-30, 86.9, |x| exp(-x), |x| (-x).exp()) < 2e-7);
        assert!(error(1e-30, 1e30, |x| exp_m1(-x), |x| (-x).exp_m1()) < 3e-7);
        assert_eq!([exp(0.0), exp_m1(0.0), exp(-88.0), exp(f32::NEG_INFINITY)], [1.0, 0.0, 0.0, 0.0]);
    }
}
