//! The glossy lobe's distribution, precision and limits.

use super::lobes::{HORIZONS, REFLECTANCE, incidence};
use super::oracle;
use super::stat::{assert_chi_square, assert_uniform, mean, pairs};
use gloss::bxdf::{Bxdf, Horizon, Incidence, LobeKind, Mirror};
use gloss::core::{Frame, Rgb, Vec3};
use std::f64::consts::TAU;

fn fold(e: f32) -> Bxdf {
    Bxdf::cosine_power(Rgb::WHITE, e, Horizon::Fold)
}

/// `1 - cos alpha` between two f32 directions, free of their lengths' rounding.
fn fall(a: Vec3, b: Vec3) -> f64 {
    let (a, b) = (a.as_dvec3().normalize(), b.as_dvec3().normalize());
    0.5 * (a - b).length_squared()
}

/// The falls of samples at normal incidence, where nothing is below the horizon.
fn falls(e: f32, seed: u32, count: u32) -> impl Iterator<Item = f64> {
    let (bxdf, at) = (fold(e), incidence(0.0));
    let r = at.mirror_direction();
    pairs(seed, count).map(move |u| fall(bxdf.sample(&at, u).expect("fold drops nothing").wi, r))
}

#[test]
fn the_power_of_the_cosine_is_uniform() {
    for e in [0.0, 0.01, 1.0, 7.3, 100.0, 1e4, 1e6, 1e8] {
        let power = |fall: f64| ((f64::from(e) + 1.0) * (-fall).ln_1p()).exp();
        assert_uniform(falls(e, 41, 20_000).map(power).collect(), &format!("e = {e}"));
    }
}

#[test]
fn moments_have_their_closed_forms() {
    for e in [0.0, 0.3, 1.0, 2.0, 5.0, 10.0, 50.0, 100.0, 1000.0, 1e4, 1e5] {
        let ef = f64::from(e);
        let (mean_fall, variance) = (1.0 / (ef + 2.0), (ef + 1.0) / ((ef + 3.0) * (ef + 2.0).powi(2)));
        let what = |moment: &str| format!("{moment} at e = {e}");
        mean(falls(e, 42, 40_000)).assert_is(mean_fall, &what("mean of 1 - cos"));
        mean(falls(e, 42, 40_000).map(|f| (f - mean_fall).powi(2)))
            .assert_is(variance, &what("variance of cos"));
        mean(falls(e, 42, 40_000).map(|f| f * (2.0 - f))).assert_is(2.0 / (ef + 3.0), &what("mean of sin^2"));
    }
    for (e, row) in oracle::file()["moments"].as_object().expect("a table") {
        let e: f32 = e.parse().expect("an exponent");
        let value = |key: &str| row[key].as_f64().expect("a value");
        let angle = |f: f64| (2.0 * (0.5 * f).sqrt().asin()).to_degrees();
        mean(falls(e, 43, 40_000).map(angle))
            .assert_is(value("mean_angle_deg"), &format!("mean angle at e = {e}"));
        let nearer = |f: f64| f64::from(u8::from(angle(f) < value("median_deg")));
        mean(falls(e, 43, 40_000).map(nearer)).assert_is(0.5, &format!("median at e = {e}"));
    }
}

/// Bins of equal mass of the whole lobe: `BINS.0` in `cos^(e + 1)`, `BINS.1` in azimuth about the axis.
const BINS: (usize, usize) = (12, 16);

/// What each bin expects: the whole lobe is uniform over `v = cos^(e + 1)` and azimuth, and the policy multiplies it by
/// the number of directions (0, 1 or 2) that end there.
fn expected(horizon: Horizon, e: f64, at: &Incidence, frame: &Frame, samples: f64) -> Vec<f64> {
    const FINE: usize = 256;
    let mut bins = vec![0.0; BINS.0 * BINS.1];
    let (ng, r, s, t) = (at.ng.as_dvec3(), frame.n.as_dvec3(), frame.s.as_dvec3(), frame.t.as_dvec3());
    for j in 0..BINS.1 * FINE {
        // At each azimuth, one of a direction and its turned one is above the horizon always, and the other if the
        // angle to the axis is small: if v is above `limit`.
        let (y, x) = (TAU * (j as f64 + 0.5) / (BINS.1 * FINE) as f64).sin_cos();
        let across = x * ng.dot(s) + y * ng.dot(t);
        let limit = (1.0 + (ng.dot(r) / across).powi(2)).powf(-0.5 * (e + 1.0));
        for i in 0..BINS.0 {
            let (from, to) = (i as f64 / BINS.0 as f64, (i + 1) as f64 / BINS.0 as f64);
            let beyond = to - limit.clamp(from, to);
            let folds = !matches!(horizon, Horizon::Clip | Horizon::Reject);
            let mass = match (across >= 0.0, folds) {
                (false, _) => beyond,
                (true, false) => to - from,
                (true, true) => 2.0 * (to - from) - beyond,
            };
            bins[i * BINS.1 + j / FINE] += mass / (BINS.1 * FINE) as f64;
        }
    }
    let drawn = if horizon == Horizon::Reject { bins.iter().sum() } else { 1.0 };
    bins.iter().map(|mass| mass * samples / drawn).collect()
}

#[test]
fn every_policy_samples_its_folded_density_at_every_exponent() {
    let (exponents, angles) = ([0.0, 1.0, 10.0, 300.0, 1e4, 1e6], [0.0, 60.0, 84.0, 89.3]);
    let tests = (exponents.len() * angles.len() * HORIZONS.len()) as u32;
    for e in exponents {
        for theta in angles {
            for horizon in HORIZONS {
                let (bxdf, at, samples) =
                    (Bxdf::cosine_power(Rgb::WHITE, e, horizon), incidence(theta), 40_000);
                let frame = Frame::new(at.mirror_direction());
                let mut observed = vec![0.0; BINS.0 * BINS.1];
                for u in pairs(44, samples) {
                    let Some(s) = bxdf.sample(&at, u) else { continue };
                    let power = ((f64::from(e) + 1.0) * (-fall(s.wi, frame.n)).ln_1p()).exp();
                    let turn = f64::from(s.wi.dot(frame.t).atan2(s.wi.dot(frame.s))) / TAU;
                    let row = ((power * BINS.0 as f64) as usize).min(BINS.0 - 1);
                    observed[row * BINS.1 + (turn.rem_euclid(1.0) * BINS.1 as f64) as usize % BINS.1] += 1.0;
                }
                let expected = expected(horizon, f64::from(e), &at, &frame, f64::from(samples));
                assert_chi_square(&observed, &expected, tests, &format!("{horizon:?} e = {e} at {theta}"));
            }
        }
    }
}

#[test]
fn sampled_angles_are_those_of_f64_to_the_resolution_of_f32_directions() {
    for e in [0.0, 1e-3, 1.0, 100.0, 1e5, 1e7, 1e9, 1e13] {
        let (bxdf, at) = (fold(e), incidence(0.0));
        for u in pairs(45, 5_000) {
            let s = bxdf.sample(&at, u).expect("fold drops nothing");
            let ln_cos = (1.0 - f64::from(u[0])).ln() / (f64::from(e) + 1.0);
            let exact = (-(2.0 * ln_cos).exp_m1()).sqrt();
            let sin = s.wi.as_dvec3().cross(at.mirror_direction().as_dvec3()).length();
            assert!((sin - exact).abs() < 4e-7, "e = {e}, {u:?}: {sin} {exact}");
            let ln_pdf = ((f64::from(e) + 1.0) / TAU).ln() + f64::from(e) * ln_cos;
            let error = (f64::from(s.pdf).ln() - ln_pdf).abs();
            assert!(
                error < 3e-7 * (2.0 + ln_pdf.abs() + (f64::from(e) * ln_cos).abs()),
                "e = {e}: {} {ln_pdf}",
                s.pdf.ln()
            );
        }
    }
}

#[test]
fn values_are_those_of_f64_at_the_same_f32_directions() {
    for e in [0.0, 1e-3, 1.0, 100.0, 1e5, 1e7, 1e9] {
        let (bxdf, at) = (fold(e), incidence(0.0));
        for u in pairs(46, 5_000) {
            let wi = bxdf.sample(&at, u).expect("fold drops nothing").wi;
            let fall = fall(wi, at.mirror_direction());
            let power = f64::from(e) * (-fall).ln_1p();
            let exact = (f64::from(e) + 1.0) / TAU * power.exp();
            // The length of an f32 direction is uncertain by 1e-7, and its square enters times e. A rounding of the
            // fall counts e / (1 - fall) times: far from the lobe's axis the cosine is what is left of 1.
            let roundings = 2e-7 * f64::from(e) * fall / (1.0 - fall);
            let relative = 1e-6 * (1.0 + power.abs()) + 2e-14 * f64::from(e) + roundings;
            let (f_cos, pdf) = (f64::from(bxdf.f_cos(&at, wi).r), f64::from(bxdf.pdf(&at, wi)));
            if at.ng.dot(wi) > 1e-3 && exact > 1e-30 {
                assert!((f_cos / exact - 1.0).abs() < relative, "e = {e}: {f_cos} {exact}");
                assert!((pdf / exact - 1.0).abs() < relative + 2e-6, "e = {e}: {pdf} {exact}");
            }
        }
    }
}

#[test]
fn an_infinite_exponent_is_the_mirror_bit_by_bit() {
    let mirror = Bxdf::Mirror(Mirror { reflectance: REFLECTANCE });
    for e in [f32::INFINITY, f32::MAX, 1e13f32.next_up()] {
        for horizon in HORIZONS {
            let bxdf = Bxdf::cosine_power(REFLECTANCE, e, horizon);
            assert_eq!(bxdf, mirror);
            assert_eq!(bxdf.kind(), LobeKind::Delta);
        }
    }
    assert_eq!(fold(1e13).kind(), LobeKind::Glossy);
}

#[test]
fn a_large_exponent_is_nearly_the_mirror() {
    for theta in [0.0, 45.0, 89.0] {
        let at = incidence(theta);
        for u in pairs(47, 2_000) {
            let wi = fold(1e9).sample(&at, u).expect("fold drops nothing").wi;
            assert!((wi - at.mirror_direction()).length() < 3e-4);
        }
    }
}

#[test]
fn at_normal_incidence_every_unit_furnace_policy_draws_the_same() {
    let at = incidence(0.0);
    for e in [0.0, 3.0, 1e4] {
        for u in pairs(48, 500) {
            let fold = fold(e).sample(&at, u).expect("fold drops nothing");
            for horizon in [Horizon::FoldWeighted, Horizon::Clip, Horizon::Reject] {
                let other = Bxdf::cosine_power(Rgb::WHITE, e, horizon).sample(&at, u);
                // The rim itself may round to either side of the horizon.
                if fold.wi.dot(at.ng) > 1e-6 {
                    assert_eq!(
                        other.map(|s| (s.wi, s.weight)),
                        Some((fold.wi, fold.weight)),
                        "{horizon:?} {e}"
                    );
                }
            }
        }
    }
}
