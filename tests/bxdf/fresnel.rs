//! Fresnel's equations against tables and against complex arithmetic, and glass.

use super::lobes::{COPPER, incidence};
use super::oracle::simpson;
use gloss::bxdf::fresnel::{conductor, dielectric, diffuse_average};
use gloss::bxdf::{Bxdf, Conductor, Dielectric, DielectricWay, Incidence};
use gloss::core::Rgb;

fn cos_deg(theta: f64) -> f32 {
    theta.to_radians().cos() as f32
}

fn close(a: f32, b: f64, relative: f64) {
    assert!((f64::from(a) - b).abs() <= relative * b, "{a} is not {b}");
}

#[test]
fn dielectrics_have_the_tabulated_reflectance() {
    for (theta, exact) in [
        (0.0, 0.04),
        (30.0, 0.041_522_63),
        (45.0, 0.050_239_91),
        (56.309_932, 0.073_964_50),
        (60.0, 0.089_186_71),
        (75.0, 0.253_060_56),
        (80.0, 0.387_704_35),
        (85.0, 0.612_799_65),
        (89.0, 0.904_184_95),
    ] {
        close(dielectric(cos_deg(theta), 1.5).0, exact, 2e-6);
    }
    close(dielectric(cos_deg(40.0), 1.0 / 1.5).0, 0.245_291_20, 3e-6);
    for (theta, exact) in [(20.0, 0.049_078_10), (60.0, 0.100_056_03), (85.0, 0.619_148_21)] {
        close(dielectric(cos_deg(theta), 1.567).0, exact, 2e-6);
    }
    assert!(dielectric(cos_deg(41.80), 1.0 / 1.5).0 < 1.0);
    for theta in [41.82, 60.0, 90.0] {
        assert_eq!(dielectric(cos_deg(theta), 1.0 / 1.5), (1.0, 0.0));
    }
    assert_eq!(dielectric(0.0, 1.5).0, 1.0);
    assert_eq!(dielectric(0.3, 1.0), (0.0, 0.3));
}

#[test]
fn both_sides_of_a_boundary_reflect_alike() {
    for theta in [0.0, 12.0, 34.0, 56.0, 78.0, 89.0] {
        for eta in [1.01, 1.33, 1.5, 2.4] {
            let (there, cos_far) = dielectric(cos_deg(theta), eta);
            let (back, cos) = dielectric(cos_far, 1.0 / eta);
            assert!(
                (there - back).abs() < 2e-5 && (cos - cos_deg(theta)).abs() < 1e-5,
                "{theta} {eta}: {there} {back}"
            );
        }
    }
}

/// Fresnel's reflectance by complex numbers `(re, im)`, in the form of pbrt-v4.
fn complex_fresnel(cos: f64, eta: f64, k: f64) -> f64 {
    type C = (f64, f64);
    let mul = |a: C, b: C| (a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0);
    let div = |a: C, b: C| {
        let n = b.0 * b.0 + b.1 * b.1;
        ((a.0 * b.0 + a.1 * b.1) / n, (a.1 * b.0 - a.0 * b.1) / n)
    };
    let sqrt = |a: C| {
        let r = a.0.hypot(a.1);
        (((r + a.0) / 2.0).max(0.0).sqrt(), ((r - a.0) / 2.0).max(0.0).sqrt().copysign(a.1))
    };
    let index = (eta, k);
    let ratio = div((1.0 - cos * cos, 0.0), mul(index, index));
    let inside = sqrt((1.0 - ratio.0, -ratio.1));
    let (a, b) = (mul(index, (cos, 0.0)), mul(index, inside));
    let p = div((a.0 - inside.0, a.1 - inside.1), (a.0 + inside.0, a.1 + inside.1));
    let s = div((cos - b.0, -b.1), (cos + b.0, b.1));
    0.5 * (p.0 * p.0 + p.1 * p.1 + s.0 * s.0 + s.1 * s.1)
}

#[test]
fn conductors_have_the_tabulated_reflectance_and_that_of_complex_arithmetic() {
    for (theta, exact) in [(0.0, 0.952_140_56), (60.0, 0.946_064_30), (80.0, 0.948_427_21)] {
        close(COPPER.reflectance(cos_deg(theta)).r, exact, 3e-7);
    }
    close(COPPER.reflectance(1.0).g, 0.619_675_58, 3e-7);
    close(COPPER.reflectance(1.0).b, 0.510_577_44, 3e-7);
    for (eta, k) in
        [(0.05f32, 4.0f32), (0.2, 3.9), (1.5, 0.0), (1.5, 1e-3), (1.0, 2.0), (7.0, 7.0), (0.01, 100.0)]
    {
        for theta in [0.0, 20.0, 45.0, 70.0, 85.0, 89.9] {
            let cos = cos_deg(theta);
            let exact = complex_fresnel(f64::from(cos), f64::from(eta), f64::from(k));
            let value = f64::from(conductor(cos, eta, k));
            assert!((value - exact).abs() < 2e-7, "{eta} + {k}i at {theta}: {value} {exact}");
            if k == 0.0 {
                close(dielectric(cos, eta).0, exact, 5e-6);
            }
        }
    }
}

#[test]
fn conductors_hold_at_the_ends_of_their_parameters() {
    for eta in [0.0, 1e-30, 1.0, 1e18, f32::MAX] {
        for k in [0.0, 1e-30, 1.0, 1e18, f32::MAX] {
            for cos in [0.0, 1e-20, 0.5, 1.0, 1.0f32.next_up()] {
                let value = conductor(cos, eta, k);
                assert!((0.0..=1.0).contains(&value), "{eta} + {k}i at {cos}: {value}");
            }
        }
    }
}

#[test]
fn the_diffuse_average_is_the_integral() {
    close(diffuse_average(1.5), 0.091_777_96, 1e-6);
    close(diffuse_average(1.567), 0.101_518_47, 1e-6);
    for eta in [1.0005f32, 1.001, 1.01, 1.33, 2.0, 4.0] {
        let exact = simpson(0.0, 1.0, |s| {
            // cos = s^2 takes the slope at grazing incidence away.
            let cos = s * s;
            4.0 * s * cos * complex_fresnel(cos, f64::from(eta), 0.0)
        });
        assert!(
            (f64::from(diffuse_average(eta)) - exact).abs() < 2e-5 * exact + 1e-6,
            "{eta}: {} {exact}",
            diffuse_average(eta)
        );
    }
    assert_eq!(diffuse_average(1.0), 0.0);
}

#[test]
fn glass_shares_power_by_reflectance_and_bends_by_snells_law() {
    let way = |way| Bxdf::Dielectric(Dielectric { way, colour: Rgb::WHITE, eta: 1.5 });
    let (reflection, transmission) = (way(DielectricWay::Reflection), way(DielectricWay::Transmission));
    for front in [true, false] {
        for theta in [0.0, 30.0, 41.0, 42.0, 60.0, 85.0] {
            let at = Incidence { front, ..incidence(theta) };
            let eta = if front { 1.5f32 } else { 1.0 / 1.5 };
            let (exact, _) = dielectric(at.n.dot(at.wo), eta);
            let side = |w: gloss::core::Vec3| w - at.n * at.n.dot(w);

            let back = reflection.sample(&at, [0.3, 0.7]).expect("every boundary reflects");
            close(back.weight.g, f64::from(exact), 1e-7);
            assert!(back.wi.dot(at.ng) > 0.0);
            assert!((side(back.wi) + side(at.wo)).length() < 1e-6, "{theta} {front}");
            assert_eq!(reflection.albedo(&at), back.weight);

            let Some(through) = transmission.sample(&at, [0.3, 0.7]) else {
                assert!(exact == 1.0 && transmission.albedo(&at).is_black(), "{theta} {front}");
                continue;
            };
            // Radiance gains the square of the index that it enters; power stays.
            close(through.weight.g * eta * eta, f64::from(1.0 - exact), 1e-6);
            close(transmission.albedo(&at).g, f64::from(1.0 - exact), 1e-7);
            assert!(through.wi.dot(at.ng) < 0.0);
            let snell = side(through.wi) * eta + side(at.wo);
            assert!(snell.length() < 1e-6, "{theta} {front}: {snell}");
        }
    }
}

#[test]
fn a_smooth_metal_is_a_mirror_of_fresnels_colour() {
    let bxdf = Bxdf::Conductor(Conductor { reflectance: Rgb::WHITE, ior: Some(COPPER), alpha: 9e-4 });
    let at = incidence(60.0);
    let s = bxdf.sample(&at, [0.3, 0.7]).expect("a mirror drops nothing");
    assert_eq!(s.wi, at.mirror_direction());
    close(s.weight.r, 0.946_064_30, 1e-6);
}
