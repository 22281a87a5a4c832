//! Logarithm, exponential and sine in f32, by polynomials: inlined, and the same bits on every machine.
//!
//! Each has the narrow domain that sampling needs and an error of a few units in the last place. The coefficients are
//! those of the Cephes library (Moshier 1989, single precision).

use std::f32::consts::{LOG2_E, SQRT_2, TAU};

/// `ln 2` in two parts, the first of which has few enough bits that a multiple of it is exact.
const LN_2: [f32; 2] = [0.693_359_375, -2.121_944_4e-4];

/// The natural logarithm of a positive normal `x`.
#[inline]
pub fn ln(x: f32) -> f32 {
    // x = 2^k (1 + f) with 1 + f between the roots of 1/2 and 2.
    const HALF_ROOT: u32 = (0.5 * SQRT_2).to_bits();
    let k = (x.to_bits().wrapping_sub(HALF_ROOT) as i32) >> 23;
    let f = f32::from_bits(x.to_bits().wrapping_sub((k as u32) << 23)) - 1.0;
    let k = k as f32;

    let p = polynomial(
        f,
        [
            7.037_683_6e-2,
            -0.115_146_1,
            0.116_769_99,
            -0.124_201_41,
            0.142_493_23,
            -0.166_680_58,
            0.200_007_14,
            -0.249_999_94,
            0.333_333_3,
        ],
    );
    let z = f * f;
    f + (f * z * p + k * LN_2[1] - 0.5 * z) + k * LN_2[0]
}

/// `ln(1 + x)` for `x` in `(-1, 0]`, relatively exact near 0.
///
/// Source: Goldberg 1991, *What Every Computer Scientist Should Know About Floating-Point Arithmetic*, theorem 4.
#[inline]
pub fn ln_1p(x: f32) -> f32 {
    let w = 1.0 + x;
    if w == 1.0 { x } else { ln(w) * (x / (w - 1.0)) }
}

/// `2^n` and `exp(x) / 2^n - 1` for `x` in `[-87, 88]`.
#[inline]
fn split_exp(x: f32) -> (f32, f32) {
    // Adding and subtracting 1.5 2^23 rounds to an integer without a call.
    const ROUND: f32 = 12_582_912.0;
    let n = (x * LOG2_E + ROUND) - ROUND;
    let r = (x - n * LN_2[0]) - n * LN_2[1];
    let p = polynomial(r, [1.987_569_1e-4, 1.398_199_9e-3, 8.333_452e-3, 4.166_579_6e-2, 0.166_666_66, 0.5]);
    (f32::from_bits(((n as i32 + 127) as u32) << 23), r * r * p + r)
}

/// `exp(x)` for `x <= 88`; 0 below -87.
#[inline]
pub fn exp(x: f32) -> f32 {
    let (scale, p) = split_exp(x.max(-87.0));
    if x < -87.0 { 0.0 } else { scale * p + scale }
}

/// `exp(x) - 1` for `x <= 0`, relatively exact near 0.
#[inline]
pub fn exp_m1(x: f32) -> f32 {
    let (scale, p) = split_exp(x.max(-87.0));
    scale * p + (scale - 1.0)
}

/// Sine and cosine of `2 pi u` for `u` in `[0, 1]`.
#[inline]
pub fn sin_cos_turns(u: f32) -> (f32, f32) {
    // The nearest quarter turn, and the rest of at most an eighth.
    let quarter = (4.0 * u + 0.5) as u32;
    let x = (u - 0.25 * quarter as f32) * TAU;
    let z = x * x;
    let sin = polynomial(z, [-1.951_529_6e-4, 8.332_161e-3, -0.166_666_55]) * z * x + x;
    let cos = polynomial(z, [2.443_315_7e-5, -1.388_731_6e-3, 4.166_664_6e-2]) * z * z - 0.5 * z + 1.0;
    match quarter & 3 {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

/// Horner's rule, the highest power first.
#[inline]
fn polynomial<const N: usize>(x: f32, coefficients: [f32; N]) -> f32 {
    coefficients.into_iter().fold(0.0, |sum, c| sum * x + c)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The largest error over `xs` in units of the last place of f32, relative or (with `absolute`) of 1.
    fn ulps(xs: impl Iterator<Item = f32>, f: impl Fn(f32) -> f32, exact: impl Fn(f64) -> f64) -> f64 {
        xs.map(|x| {
            let exact = exact(f64::from(x));
            let error = (f64::from(f(x)) - exact).abs();
            if error == 0.0 { 0.0 } else { error / (exact.abs() * f64::from(f32::EPSILON)) }
        })
        .fold(0.0, f64::max)
    }

    /// Numbers of every magnitude in `(0, 1]`, and a fine lattice.
    fn unit() -> impl Iterator<Item = f32> {
        let lattice = (1..=1_000_000).map(|i| i as f32 / 1e6);
        lattice.chain((0..100_000).map(|i| (-(i as f32) * 8e-4).exp()))
    }

    #[test]
    fn logarithms_are_exact_to_two_units_in_the_last_place() {
        assert!(ulps(unit().filter(|&x| x != 1.0), ln, f64::ln) < 2.0);
        assert!(ulps(unit().map(|x| x * 1e13), ln, f64::ln) < 2.0);
        assert_eq!(ln(1.0), 0.0);
        assert!(ulps(unit().map(|x| -x).filter(|&x| x > -1.0), ln_1p, f64::ln_1p) < 3.0);
        assert_eq!(ln_1p(0.0), 0.0);
    }

    #[test]
    fn exponentials_are_exact_to_two_units_in_the_last_place() {
        for scale in [1.0, 20.0, 86.9] {
            assert!(ulps(unit().map(|x| -scale * x), exp, f64::exp) < 2.0, "{scale}");
            assert!(ulps(unit().map(|x| -scale * x), exp_m1, f64::exp_m1) < 2.0, "{scale}");
        }
        assert_eq!((exp(0.0), exp_m1(0.0)), (1.0, 0.0));
        assert_eq!((exp(-1e30), exp_m1(-1e30)), (0.0, -1.0));
        assert_eq!((exp(f32::NEG_INFINITY), exp_m1(f32::NEG_INFINITY)), (0.0, -1.0));
    }

    #[test]
    fn circles_are_round_to_f32_rounding() {
        for u in unit().chain([0.0]) {
            let (sin, cos) = sin_cos_turns(u);
            let exact = (f64::from(u) * std::f64::consts::TAU).sin_cos();
            let error = (f64::from(sin) - exact.0).abs().max((f64::from(cos) - exact.1).abs());
            assert!(error < 1.2e-7, "{u}: {error}");
        }
        assert_eq!(
            [0.0, 0.25, 0.5, 0.75].map(sin_cos_turns),
            [(0.0, 1.0), (1.0, -0.0), (-0.0, -1.0), (-1.0, 0.0)]
        );
    }
}
