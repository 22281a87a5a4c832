//! What every lobe must fulfil.

use super::lobes::{self, Case, Furnace, REFLECTANCE, incidence, leaning};
use super::stat::{assert_chi_square, mean, pairs};
use gloss::bxdf::{Incidence, LobeKind};
use gloss::core::{Frame, Vec3, warp};
use std::f64::consts::PI;

const ANGLES: [f64; 5] = [0.0, 30.0, 60.0, 80.0, 88.0];

/// Each lobe at upright and at leaning normals.
fn each(mut check: impl FnMut(&Case, &Incidence, &str)) {
    for case in lobes::spread() {
        for theta in ANGLES {
            check(&case, &incidence(theta), &format!("{} at {theta} degrees", case.name));
        }
        for (theta, lean) in [(20.0, 15.0), (70.0, 8.0)] {
            check(&case, &leaning(theta, lean), &format!("{} at {theta} leaning {lean}", case.name));
        }
    }
}

#[test]
fn furnaces_return_the_albedo() {
    for case in lobes::spread() {
        for theta in ANGLES {
            let at = incidence(theta);
            let weights = |u| case.bxdf.sample(&at, u).map_or(0.0, |s| f64::from(s.weight.r));
            let furnace = mean(pairs(1, 10_000).map(weights));
            let what = format!("{} at {theta} degrees", case.name);
            let albedo = f64::from(case.bxdf.albedo(&at).r);
            match &case.furnace {
                Furnace::Exact(exact) => {
                    furnace.assert_is(exact(theta), &what);
                    assert!((albedo - exact(theta)).abs() < 2e-6, "{what}: albedo {albedo}");
                }
                Furnace::AtMost(bound) => {
                    assert!(furnace.mean < bound + 5.0 * furnace.error + 1e-6, "{what}: {}", furnace.mean);
                    assert!((albedo / furnace.mean - 1.0).abs() < 0.1, "{what}: {albedo} {}", furnace.mean);
                }
            }
        }
    }
}

#[test]
fn samples_agree_with_value_and_density() {
    each(|case, at, what| {
        for u in pairs(2, 400) {
            let Some(s) = case.bxdf.sample(at, u) else { continue };
            let (f_cos, pdf) = case.bxdf.evaluate(at, s.wi);
            // What the rounding of the direction and of frames is worth, 5e-7 together.
            let sides = Frame::new(s.wi);
            let tolerance = [sides.s, -sides.s, sides.t, -sides.t, sides.n, -sides.n]
                .map(|d| (case.bxdf.pdf(at, s.wi + 1e-6 * d) / pdf).ln().abs())
                .into_iter()
                .fold(1e-5, |sum, d| sum + 0.5 * d);
            assert!((s.wi.length() - 1.0).abs() < 2e-7, "{what}: {u:?} {}", s.wi.length());
            assert!(at.ng.dot(s.wi) > 0.0, "{what}: {u:?}");
            let grazing = at.ng.dot(s.wi) < 1e-4 || at.n.dot(s.wi) < 1e-4;
            if !grazing {
                assert!((pdf / s.pdf).ln().abs() < tolerance, "{what}: {u:?} {pdf} {}", s.pdf);
            }
            let pdf = f64::from(pdf);
            for (f, weight) in f_cos.to_array().into_iter().zip(s.weight.to_array()) {
                let ratio = f64::from(f) / pdf;
                if pdf > 1e-30 && !grazing {
                    let relative = 2e-5 + f64::from(tolerance + 2e-7 / at.n.dot(s.wi));
                    assert!(
                        (ratio - f64::from(weight)).abs() < relative * f64::from(weight),
                        "{what}: {u:?} {ratio} {weight}"
                    );
                }
            }
        }
    });
}

#[test]
fn densities_integrate_to_the_mass_that_is_sampled() {
    each(|case, at, what| {
        if !case.broad {
            return;
        }
        let sampled = mean(pairs(3, 10_000).map(|u| f64::from(u8::from(case.bxdf.sample(at, u).is_some()))));
        let uniform =
            mean(pairs(4, 15_000).map(|u| 4.0 * PI * f64::from(case.bxdf.pdf(at, warp::uniform_sphere(u)))));
        let (difference, error) = (sampled.mean - uniform.mean, sampled.error.hypot(uniform.error));
        assert!(difference.abs() < 5.0 * error, "{what}: {} {} +- {error}", sampled.mean, uniform.mean);
    });
}

#[test]
fn values_integrate_to_the_furnace() {
    each(|case, at, what| {
        if !case.broad {
            return;
        }
        let sampled =
            mean(pairs(5, 10_000).map(|u| case.bxdf.sample(at, u).map_or(0.0, |s| f64::from(s.weight.g))));
        let uniform = mean(
            pairs(6, 15_000).map(|u| 4.0 * PI * f64::from(case.bxdf.f_cos(at, warp::uniform_sphere(u)).g)),
        );
        let (difference, error) = (sampled.mean - uniform.mean, sampled.error.hypot(uniform.error));
        assert!(
            difference.abs() < 5.0 * error + 1e-6,
            "{what}: {} {} +- {error}",
            sampled.mean,
            uniform.mean
        );
    });
}

/// Bins over the hemisphere about the shading normal: 10 in the cosine, 20 in azimuth, as in nori.
const BINS: (usize, usize) = (10, 20);

fn expected_counts(case: &Case, at: &Incidence, frame: &Frame, samples: f64) -> Vec<f64> {
    const FINE: usize = 20;
    let mut expected = vec![0.0; BINS.0 * BINS.1];
    let cell = 2.0 * PI / (BINS.0 * BINS.1 * FINE * FINE) as f64;
    for i in 0..BINS.0 * FINE {
        for j in 0..BINS.1 * FINE {
            let z = (i as f32 + 0.5) / (BINS.0 * FINE) as f32;
            let phi = (j as f32 + 0.5) / (BINS.1 * FINE) as f32 * std::f32::consts::TAU;
            let side = (1.0 - z * z).sqrt();
            let wi = frame.to_world(Vec3::new(side * phi.cos(), side * phi.sin(), z));
            expected[i / FINE * BINS.1 + j / FINE] += samples * cell * f64::from(case.bxdf.pdf(at, wi));
        }
    }
    expected
}

#[test]
fn samples_have_their_density() {
    let cases: Vec<_> = lobes::spread().into_iter().filter(|case| case.broad).collect();
    let angles = [0.0, 50.0, 82.0];
    for case in &cases {
        for theta in angles {
            let (at, samples) = (incidence(theta), 40_000);
            let frame = Frame::new(at.n);
            let expected = expected_counts(case, &at, &frame, f64::from(samples));
            let mut observed = vec![0.0; expected.len()];
            for u in pairs(7, samples) {
                let Some(s) = case.bxdf.sample(&at, u) else { continue };
                let local = frame.to_local(s.wi);
                let turn = (local.y.atan2(local.x) / std::f32::consts::TAU).rem_euclid(1.0);
                let row = ((local.z * BINS.0 as f32) as usize).min(BINS.0 - 1);
                observed[row * BINS.1 + ((turn * BINS.1 as f32) as usize).min(BINS.1 - 1)] += 1.0;
            }
            let what = format!("{} at {theta} degrees", case.name);
            assert_chi_square(&observed, &expected, (cases.len() * angles.len()) as u32, &what);
        }
    }
}

/// The largest relative difference between `f(wo, wi)` and `f(wi, wo)`.
fn irreciprocity(case: &Case) -> f32 {
    let n = Vec3::new(0.36, -0.48, 0.8);
    let frame = Frame::new(n);
    let mut worst = 0.0f32;
    for (a, b) in pairs(8, 300).zip(pairs(9, 300)) {
        let [wo, wi] = [a, b].map(|u| frame.to_world(warp::cosine_hemisphere(u)).normalize());
        let at = |wo| Incidence { wo, n, ng: n, front: true };
        let (there, back) = (case.bxdf.f(&at(wo), wi), case.bxdf.f(&at(wi), wo));
        if wo.dot(n) > 0.01 && wi.dot(n) > 0.01 && there.r > 1e-3 {
            worst = worst.max((there.r - back.r).abs() / there.r);
        }
    }
    worst
}

#[test]
fn reciprocal_lobes_are_and_the_others_are_not() {
    for case in lobes::spread() {
        if case.broad {
            let worst = irreciprocity(&case);
            assert_eq!(worst < 1e-3, case.reciprocal, "{}: {worst}", case.name);
        }
    }
}

#[test]
fn weights_are_proportional_to_the_reflectance_and_kinds_are_right() {
    for case in lobes::spread() {
        assert_ne!(case.bxdf.kind(), LobeKind::Delta, "{}", case.name);
        let coloured = !case.name.contains("copper") && !case.name.contains("plastic");
        for u in pairs(10, 100).filter(|_| coloured) {
            let Some(s) = case.bxdf.sample(&incidence(40.0), u) else { continue };
            assert!((s.weight.g - s.weight.r * REFLECTANCE.g).abs() < 1e-6, "{}", case.name);
            assert!((s.weight.b - s.weight.r * REFLECTANCE.b).abs() < 1e-6, "{}", case.name);
        }
    }
}

#[test]
fn many_samples_are_the_single_samples() {
    each(|case, at, what| {
        let us: Vec<_> = pairs(11, 9).collect();
        let mut many = [None; 9];
        case.bxdf.sample_many(at, &us, &mut many);
        for (u, sample) in us.iter().zip(many) {
            assert_eq!(sample, case.bxdf.sample(at, *u), "{what}");
        }
    });
}

#[test]
fn delta_lobes_have_no_value_and_conserve_what_they_should() {
    for (name, bxdf) in lobes::deltas() {
        assert_eq!(bxdf.kind(), LobeKind::Delta, "{name}");
        for theta in ANGLES {
            let at = incidence(theta);
            for u in pairs(12, 50) {
                let Some(s) = bxdf.sample(&at, u) else {
                    // Nothing goes where nothing is reflected.
                    assert!(bxdf.albedo(&at).is_black(), "{name} at {theta}");
                    continue;
                };
                assert_eq!(s.pdf, f32::INFINITY, "{name}");
                assert!((s.wi.length() - 1.0).abs() < 2e-7 && at.ng.dot(s.wi) != 0.0, "{name}");
                assert!(bxdf.f_cos(&at, s.wi).is_black() && bxdf.pdf(&at, s.wi) == 0.0, "{name}");
            }
        }
    }
}
