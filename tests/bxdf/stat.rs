//! Statistics: means at five standard errors, chi-square and Kolmogorov-Smirnov tests.

use gloss::core::special::erfc;
use gloss::core::{Sampler, SamplerKind};

/// `count` independent pairs, the same for the same `seed`.
pub(crate) fn pairs(seed: u32, count: u32) -> impl Iterator<Item = [f32; 2]> {
    let sampler = Sampler::new(SamplerKind::Independent, seed, 17, 4);
    (0..count).map(move |i| sampler.pair(i, 0))
}

/// The mean of a sequence and its standard error.
pub(crate) struct Mean {
    pub(crate) mean: f64,
    pub(crate) error: f64,
    count: f64,
}

pub(crate) fn mean(values: impl Iterator<Item = f64>) -> Mean {
    let (mut n, mut mean, mut m2) = (0.0, 0.0, 0.0);
    for x in values {
        n += 1.0;
        let d = x - mean;
        mean += d / n;
        m2 += d * (x - mean);
    }
    Mean { mean, error: (m2 / (n - 1.0) / n).sqrt(), count: n }
}

impl Mean {
    /// With the exact variance of one value in place of the estimate, which a rare event that did not happen fools.
    pub(crate) fn with_variance(self, variance: f64) -> Self {
        Self { error: (variance.max(0.0) / self.count).sqrt(), ..self }
    }

    /// Of ones and zeros: whether the share of ones is within five standard errors.
    #[track_caller]
    pub(crate) fn assert_share(self, exact: f64, what: &str) {
        self.with_variance(exact * (1.0 - exact)).assert_is(exact, what);
    }

    /// Whether the exact mean is within five standard errors, and the rounding of f32 weights.
    #[track_caller]
    pub(crate) fn assert_is(&self, exact: f64, what: &str) {
        let tolerance = 5.0 * self.error + 1e-6 * exact.abs();
        let Self { mean, error, .. } = self;
        assert!((mean - exact).abs() <= tolerance, "{what}: {mean} +- {error}, exact {exact}");
    }
}

/// The probability of a chi-square statistic of at least `x`.
///
/// Source: Wilson and Hilferty 1931; good to a few percent of the probability from 14 degrees of freedom on.
fn chi_square_survival(x: f64, dof: f64) -> f64 {
    let v = 2.0 / (9.0 * dof);
    let z = ((x / dof).cbrt() - (1.0 - v)) / v.sqrt();
    if z >= 0.0 { 0.5 * erfc(z / 2f64.sqrt()) } else { 1.0 - 0.5 * erfc(-z / 2f64.sqrt()) }
}

/// Pearson's test of counts against expected counts, one of `tests` tests which together fail by chance once in a
/// hundred times (Sidak). Bins that expect fewer than 5 are pooled, as in nori.
#[track_caller]
pub(crate) fn assert_chi_square(observed: &[f64], expected: &[f64], tests: u32, what: &str) {
    let mut bins: Vec<_> = expected.iter().zip(observed).collect();
    bins.sort_by(|a, b| a.0.total_cmp(b.0));
    let (mut statistic, mut count) = (0.0, 0);
    let (mut pooled_expected, mut pooled_observed) = (0.0, 0.0);
    for (i, (expected, observed)) in bins.iter().enumerate() {
        pooled_expected += *expected;
        pooled_observed += *observed;
        if pooled_expected >= 5.0 || i + 1 == bins.len() {
            statistic += (pooled_observed - pooled_expected).powi(2) / pooled_expected.max(1e-9);
            count += 1;
            (pooled_expected, pooled_observed) = (0.0, 0.0);
        }
    }
    assert!(count >= 15, "{what}: only {count} bins are worth anything");
    let p = chi_square_survival(statistic, f64::from(count - 1));
    let alpha = 1.0 - 0.99f64.powf(1.0 / f64::from(tests));
    assert!(p > alpha, "{what}: chi-square {statistic} in {count} bins, p = {p}");
}

/// Kolmogorov and Smirnov's test that `values` are uniform over [0, 1], at the probability of five sigma.
#[track_caller]
pub(crate) fn assert_uniform(mut values: Vec<f64>, what: &str) {
    values.sort_by(f64::total_cmp);
    let n = values.len() as f64;
    let distance = values
        .iter()
        .enumerate()
        .map(|(i, x)| (x - i as f64 / n).max((i as f64 + 1.0) / n - x))
        .fold(0.0, f64::max);
    let limit = (0.5 * (2.0 / 5.7e-7f64).ln() / n).sqrt();
    assert!(distance < limit, "{what}: distance {distance}, limit {limit}");
}

#[test]
fn the_chi_square_test_accepts_its_own_law_and_rejects_a_bias_of_two_percent() {
    let uniform = |bias: f64| {
        let mut counts = vec![0.0; 100];
        for [a, _] in pairs(5, 1_000_000) {
            counts[((f64::from(a) * (1.0 + bias)).min(0.999) * 100.0) as usize] += 1.0;
        }
        counts
    };
    assert_chi_square(&uniform(0.0), &[1e4; 100], 1, "uniform");
    let biased = std::panic::catch_unwind(|| assert_chi_square(&uniform(0.02), &[1e4; 100], 1, "biased"));
    assert!(biased.is_err());
    // Values from tables: the 5 % and 0.1 % points of 50 degrees of freedom.
    assert!((chi_square_survival(67.505, 50.0) - 0.05).abs() < 5e-4);
    assert!((chi_square_survival(86.661, 50.0) - 0.001).abs() < 5e-5);
}
