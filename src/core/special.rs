//! Integrals of powers of the cosine: the closed forms behind the glossy lobe's energy.
//!
//! Everything is in f64 and O(1) for real exponents from 0 to beyond 1e13, with a relative error below 1e-8.

use std::f64::consts::{FRAC_2_SQRT_PI, PI};

/// From this exponent on, the expansion in `1 / n` is exact to 1e-8.
const ASYMPTOTIC: f64 = 16.0;

/// The complementary error function of `z >= 0`.
///
/// Sources: Abramowitz and Stegun 1964, 7.1.6 (the series of positive terms) and 7.1.14 (the continued fraction).
pub fn erfc(z: f64) -> f64 {
    let gauss = (-z * z).exp();
    if z < 2.5 {
        let (mut term, mut sum, mut n) = (z, z, 0.5);
        while term > 1e-17 * sum {
            n += 1.0;
            term *= z * z / n;
            sum += term;
        }
        // The terms are (2 z^2)^n z / (1 3 ... (2n + 1)).
        return 1.0 - FRAC_2_SQRT_PI * gauss * sum;
    }
    let tail = (1..=40).rev().fold(z, |tail, k| z + 0.5 * f64::from(k) / tail);
    0.5 * FRAC_2_SQRT_PI * gauss / tail
}

/// Wallis' integral of `cos^n t` over `[0, pi/2]`, for real `n > -1`.
pub fn wallis(n: f64) -> f64 {
    cosine_power_tail(n, 0.0)
}

/// The integral of `cos^n t` from `asin(sin_from)` to `pi/2`, for real `n > -1` and `sin_from` in `[0, 1]`.
///
/// With `cos t = exp(-v^2 / 2)` the integrand is `exp(-(n + 1/2) v^2 / 2) sqrt(x / sinh x)`, `x = v^2 / 2`: a
/// Gaussian times `1 - x^2/12 + x^4/160 - ...`. A small `n` is first raised by the reduction formula, whose terms
/// are all positive in this direction.
pub fn cosine_power_tail(n: f64, sin_from: f64) -> f64 {
    let ln_cos2 = (-sin_from * sin_from).ln_1p();
    raised_tail(n, sin_from, ln_cos2, (0.5 * (n + 1.0) * ln_cos2).exp())
}

/// [`cosine_power_tail`], given `ln cos^2` and `cos^(n + 1)` at the lower end.
fn raised_tail(n: f64, sin: f64, ln_cos2: f64, cos_pow: f64) -> f64 {
    if n >= ASYMPTOTIC {
        return gaussian_tail(n + 0.5, -ln_cos2);
    }
    let above = raised_tail(n + 2.0, sin, ln_cos2, cos_pow * (1.0 - sin * sin));
    ((n + 2.0) * above + cos_pow * sin) / (n + 1.0)
}

/// The integral of `exp(-lambda v^2 / 2) (1 - v^4/48 + v^8/2560)` over `v^2 > v2`.
fn gaussian_tail(lambda: f64, v2: f64) -> f64 {
    let z2 = 0.5 * lambda * v2;
    if z2 > 700.0 {
        return 0.0;
    }
    let (v, gauss) = (v2.sqrt(), (-z2).exp());
    let i0 = (PI / (2.0 * lambda)).sqrt() * erfc(z2.sqrt());
    let i2 = (v * gauss + i0) / lambda;
    let i4 = (v * v2 * gauss + 3.0 * i2) / lambda;
    let i6 = (v * v2 * v2 * gauss + 5.0 * i4) / lambda;
    let i8 = (v * v2 * v2 * v2 * gauss + 7.0 * i6) / lambda;
    i0 - i4 / 48.0 + i8 / 2560.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: f64, b: f64, relative: f64) {
        assert!((a - b).abs() <= relative * b.abs(), "{a} is not {b}");
    }

    #[test]
    fn erfc_has_the_tabulated_values_and_no_step_between_its_forms() {
        close(erfc(0.0), 1.0, 0.0);
        close(erfc(0.5), 0.479_500_122_186_953_5, 1e-14);
        close(erfc(1.0), 0.157_299_207_050_285_13, 1e-14);
        close(erfc(2.0), 4.677_734_981_047_266e-3, 1e-12);
        close(erfc(4.0), 1.541_725_790_028_002e-8, 1e-14);
        close(erfc(2.5), erfc(2.5 - 1e-13), 1e-9);
    }

    #[test]
    fn wallis_has_its_product_form() {
        let (mut even, mut odd) = (PI / 2.0, 1.0);
        for n in (0..400).step_by(2) {
            let n = f64::from(n);
            close(wallis(n), even, 1e-8);
            close(wallis(n + 1.0), odd, 1e-8);
            even *= (n + 1.0) / (n + 2.0);
            odd *= (n + 2.0) / (n + 3.0);
        }
        // The duplication of the gamma function gives W(n) W(n + 1) = pi / (2 (n + 1)) for every real n.
        for n in [0.3, 7.7, 15.9, 16.1, 123.4, 1e6, 1e13] {
            close(wallis(n) * wallis(n + 1.0), PI / (2.0 * (n + 1.0)), 1e-8);
        }
    }

    #[test]
    fn tails_match_midpoint_quadrature() {
        for n in [0.0, 1e-3, 0.7, 1.0, 5.3, 15.99, 16.0, 40.0, 1000.0] {
            for from in [0.0, 1e-3, 0.03, 0.2, 0.7, 1.2, 1.57] {
                let (count, range) = (20_000, PI / 2.0 - from);
                let quadrature: f64 = (0..count)
                    .map(|i| (from + (f64::from(i) + 0.5) / f64::from(count) * range).cos().powf(n))
                    .sum::<f64>()
                    * range
                    / f64::from(count);
                let tail = cosine_power_tail(n, from.sin());
                assert!(
                    (tail - quadrature).abs() < 2e-8 * wallis(n) + 1e-8 * range.powi(3),
                    "{n} {from}: {tail} {quadrature}"
                );
            }
        }
    }
}
