//! Pictures in miniature: what the glossy lobe shows of a world whose reflection has a closed form.

use super::lobes::{HORIZONS, incidence, policy_furnace};
use super::oracle;
use super::stat::{Mean, mean, pairs};
use gloss::bxdf::cosine_power::{mass_above, modified_phong_albedo};
use gloss::bxdf::{Bxdf, Horizon, Incidence};
use gloss::core::{Rgb, Vec3};

const EXPONENTS: [f32; 7] = [0.0, 0.5, 1.0, 10.0, 33.3, 100.0, 1000.0];

fn lobe(e: f32, horizon: Horizon) -> Bxdf {
    Bxdf::cosine_power(Rgb::WHITE, e, horizon)
}

/// What the lobe reflects of the radiance `sky`.
fn reflected(bxdf: &Bxdf, at: &Incidence, seed: u32, sky: impl Fn(Vec3) -> f32) -> Mean {
    mean(pairs(seed, 20_000).map(|u| bxdf.sample(at, u).map_or(0.0, |s| f64::from(s.weight.r * sky(s.wi)))))
}

#[test]
fn energies_have_the_values_of_the_oracles_and_of_quadrature() {
    type Energy = fn(f32, f32) -> f32;
    for (name, energy) in
        [("P_above", mass_above as Energy), ("albedo_modified_phong", modified_phong_albedo)]
    {
        for (e, theta, exact) in oracle::table(name) {
            let value = f64::from(energy(e as f32, theta.to_radians().cos() as f32));
            assert!((value - exact).abs() < 1e-6, "{name} e = {e} at {theta}: {value} {exact}");
        }
    }
    for e in [0.0f32, 0.01, 0.3, 2.7, 9.99, 47.11, 314.0, 5e3, 3e5, 2e7] {
        for theta in [0.0f64, 3.0, 20.0, 47.0, 66.0, 78.0, 87.0, 89.5, 89.99] {
            let cos = theta.to_radians().cos() as f32;
            let (mass, exact) = (f64::from(mass_above(e, cos)), oracle::mass_above(f64::from(e), theta));
            // The cosine is rounded to f32, and a lobe near the horizon moves by sqrt(e) times that.
            let tolerance = 2e-6 + 1e-8 * f64::from(e).sqrt();
            assert!((mass - exact).abs() < tolerance, "mass e = {e} at {theta}: {mass} {exact}");
            let albedo = f64::from(modified_phong_albedo(e, cos));
            let exact = oracle::phong_energy(f64::from(e), theta).above;
            assert!((albedo - exact).abs() < 1e-5, "albedo e = {e} at {theta}: {albedo} {exact}");
        }
    }
}

#[test]
fn furnaces_have_their_closed_form() {
    for e in EXPONENTS {
        for theta in [0.0, 25.0, 45.0, 60.0, 75.0, 85.0, 88.0, 89.9] {
            for horizon in HORIZONS {
                let furnace = reflected(&lobe(e, horizon), &incidence(theta), 31, |_| 1.0);
                let exact = policy_furnace(horizon, f64::from(e), theta);
                let furnace = match horizon {
                    Horizon::Fold | Horizon::Reject => furnace.with_variance(0.0),
                    Horizon::Clip => furnace.with_variance(exact * (1.0 - exact)),
                    // The weight is 1/2 where two directions end, and that is twice the mass below.
                    Horizon::FoldWeighted => furnace.with_variance(1.5 * exact - 0.5 - exact * exact),
                    Horizon::ModifiedPhong => furnace,
                };
                furnace.assert_is(exact, &format!("{horizon:?} e = {e} at {theta}"));
            }
        }
    }
}

#[test]
fn a_gradient_sky_tells_the_policies_apart() {
    for e in EXPONENTS {
        for theta in [15.0, 45.0, 70.0, 85.0] {
            let (at, energy) = (incidence(theta), oracle::phong_energy(f64::from(e), theta));
            let scale = (f64::from(e) + 1.0) / (f64::from(e) + 2.0);
            let clip = scale * energy.above;
            let folded = scale * (energy.above + energy.folded);
            let mass = oracle::mass_above(f64::from(e), theta);
            for (horizon, exact) in [
                (Horizon::Clip, clip),
                (Horizon::FoldWeighted, clip),
                (Horizon::Fold, folded),
                (Horizon::Reject, clip / mass),
            ] {
                let sky = reflected(&lobe(e, horizon), &at, 32, |wi| at.n.dot(wi).max(0.0));
                sky.assert_is(exact, &format!("{horizon:?} e = {e} at {theta}"));
            }
        }
    }
    for (name, folds) in [("gradient_sky_clip", 0.0), ("gradient_sky_fold", 1.0)] {
        for (e, theta, exact) in oracle::table(name) {
            let energy = oracle::phong_energy(e, theta);
            let value = (e + 1.0) / (e + 2.0) * (energy.above + folds * energy.folded);
            assert!((value - exact).abs() < 1e-7, "{name} e = {e} at {theta}: {value} {exact}");
        }
    }
}

#[test]
fn a_cone_about_the_mirror_direction_holds_its_fraction() {
    for (e, half_angle, exact) in oracle::table("cone_fraction") {
        let bxdf = lobe(e as f32, Horizon::Fold);
        for theta in [0.0, 20.0] {
            // The cone and its turned image are above the surface.
            if half_angle + theta > 90.0 || (e < 5.0 && theta > 0.0) {
                continue;
            }
            let at = incidence(theta);
            let r = at.mirror_direction();
            let fall = 2.0 * (0.5 * half_angle.to_radians()).sin().powi(2);
            let inside = |wi: Vec3| f32::from(u8::from(0.5 * f64::from((wi - r).length_squared()) < fall));
            let fraction = reflected(&bxdf, &at, 33, inside);
            let what = format!("e = {e}, {half_angle} degrees at {theta}");
            fraction.assert_share(exact, &what);
        }
    }
}

#[test]
fn a_straight_edge_is_spread_by_the_lobes_profile() {
    for (e, offset, exact) in oracle::table("edge_spread") {
        let at = incidence(0.0);
        let r = at.mirror_direction();
        let side = r.any_orthonormal_vector();
        let (sin, cos) = offset.to_radians().sin_cos();
        // The half-space that holds r, its plane `offset` degrees away.
        let plane = side * cos as f32 + r * sin as f32;
        let lit =
            reflected(&lobe(e as f32, Horizon::Fold), &at, 34, |wi| f32::from(u8::from(plane.dot(wi) > 0.0)));
        let what = format!("e = {e}, {offset} degrees");
        lit.assert_share(exact, &what);
    }
}

#[test]
fn a_light_of_a_known_share_has_the_variance_of_a_coin() {
    // The half-space behind the plane of incidence has share one half: variance 1/4, and 1/(4 m) over m samples.
    let (at, m) = (incidence(50.0), 8);
    let side = at.wo.cross(at.n);
    let bxdf = lobe(200.0, Horizon::Fold);
    let us: Vec<_> = pairs(35, 80_000).collect();
    let mut samples = vec![None; m];
    let means: Vec<f64> = us
        .chunks(m)
        .map(|us| {
            bxdf.sample_many(&at, us, &mut samples);
            samples.iter().flatten().filter(|s| side.dot(s.wi) > 0.0).count() as f64 / m as f64
        })
        .collect();
    mean(means.iter().map(|x| (x - 0.5).powi(2))).assert_is(0.25 / m as f64, "variance of the mean of m");
}
