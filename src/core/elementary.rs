//! Logarithm and exponential in a few operations on f32, to be compiled into the loops that need them.
//!
//! As good as a library's to two units in the last place, and several times as fast where a call would part a loop.
//! Polynomials: Moshier 1992, *Cephes Mathematical Library*, `logf` and `expf`.

use std::f32::consts::{LOG2_E, SQRT_2};

/// Natural logarithm, to two units in the last place; `-inf` of zero, NaN below it.
#[inline(always)]
pub fn ln(x: f32) -> f32 {
    // x = 2^exponent m with m in [1/sqrt(2), sqrt(2)); numbers without a leading one are scaled up first.
    let small = x < f32::MIN_POSITIVE;
    let bits = if small { x * (1 << 24) as f32 } else { x }.to_bits();
    let m = f32::from_bits(bits & 0x007f_ffff | 1f32.to_bits());
    let exponent = (bits >> 23) as i32 - if small { 127 + 24 } else { 127 };
    let upper = m >= SQRT_2;
    let (m, exponent) = (if upper { 0.5 * m } else { m }, (exponent + i32::from(upper)) as f32);

    let r = m - 1.0;
    let rr = r * r;
    let mut p = 7.037_683_6e-2;
    for c in [
        -1.151_461e-1,
        1.167_699_87e-1,
        -1.242_014_1e-1,
        1.424_932_3e-1,
        -1.666_805_7e-1,
        2.000_071_5e-1,
        -2.499_999_4e-1,
        3.333_333_1e-1,
    ] {
        p = p * r + c;
    }
    // ln 2 in two parts, of which the product with the first is exact.
    let tail = r * rr * p + exponent * -2.121_944_4e-4 - 0.5 * rr;
    let ln = r + tail + exponent * 0.693_359_4;
    if x > 0.0 && x < f32::INFINITY { ln } else { outside_ln(x) }
}

/// The logarithm of what is no positive number.
#[inline(always)]
fn outside_ln(x: f32) -> f32 {
    if x == 0.0 {
        f32::NEG_INFINITY
    } else if x == f32::INFINITY {
        x
    } else {
        f32::NAN
    }
}

/// `e^x`, to two units in the last place; zero where the result would be below the least normal number.
#[inline(always)]
pub fn exp(x: f32) -> f32 {
    // The nearest whole number, by the rounding of a sum that has no digits behind the point.
    let n = ((x * LOG2_E).clamp(-126.0, 128.0) + WHOLE) - WHOLE;
    // ln 2 in two parts, of which the product with the first is exact.
    let r = x - n * 0.693_359_4 - n * -2.121_944_4e-4;
    let mut p = 1.987_569_2e-4;
    for c in [1.398_199_9e-3, 8.333_452e-3, 4.166_579_6e-2, 1.666_666_5e-1, 5.000_000_1e-1] {
        p = p * r + c;
    }
    let p = p * r * r + r + 1.0;
    // 2^n in two factors, since 2^128 is none.
    let n = n as i32;
    let power = |n: i32| f32::from_bits(((n + 127) << 23) as u32);
    let value = p * power(n >> 1) * power(n - (n >> 1));
    if x < LEAST {
        0.0
    } else if x > GREATEST {
        f32::INFINITY
    } else {
        value
    }
}

/// 1.5 times 2^23: from here on, neighbouring numbers are 1 apart.
const WHOLE: f32 = 12_582_912.0;

/// Logarithms of the least normal and of the greatest number.
const LEAST: f32 = -87.336_54;
const GREATEST: f32 = 88.722_84;

#[cfg(test)]
mod tests {
    use super::*;

    /// Difference in units in the last place of the exact value.
    fn ulps(value: f32, exact: f64) -> f64 {
        let ulp = f64::from((exact as f32).abs().next_up() - (exact as f32).abs());
        (f64::from(value) - exact).abs() / ulp
    }

    #[test]
    fn logarithms_are_right_to_two_units() {
        let mut worst = 0.0f64;
        for bits in (1..f32::INFINITY.to_bits()).step_by(9973) {
            let x = f32::from_bits(bits);
            worst = worst.max(ulps(ln(x), f64::from(x).ln()));
        }
        for i in -100_000..100_000 {
            let x = 1.0 + i as f32 * 1e-6;
            worst = worst.max(ulps(ln(x), f64::from(x).ln()));
        }
        assert!(worst < 2.0, "{worst}");
        assert_eq!((ln(0.0), ln(1.0), ln(f32::INFINITY)), (f32::NEG_INFINITY, 0.0, f32::INFINITY));
        assert!(ln(-1.0).is_nan() && ln(f32::NAN).is_nan());
    }

    #[test]
    fn exponentials_are_right_to_two_units() {
        let mut worst = 0.0f64;
        for i in -1_000_000..1_000_000 {
            let x = i as f32 * 9e-5;
            if x > LEAST && x < GREATEST {
                worst = worst.max(ulps(exp(x), f64::from(x).exp()));
            }
        }
        assert!(worst < 2.0, "{worst}");
        assert_eq!((exp(0.0), exp(f32::NEG_INFINITY), exp(f32::INFINITY)), (1.0, 0.0, f32::INFINITY));
        assert_eq!((exp(-87.4), exp(88.8)), (0.0, f32::INFINITY));
        assert!(exp(f32::NAN).is_nan() && exp(88.722).is_finite() && exp(-87.336) > 0.0);
    }
}
