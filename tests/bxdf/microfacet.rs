//! Rough metal and plastic: energies, and agreement with the lobes that they become.

use super::lobes::incidence;
use super::stat::{Mean, mean, pairs};
use gloss::bxdf::energy::{CoatEnergy, mirror_albedo};
use gloss::bxdf::fresnel::{dielectric, diffuse_average};
use gloss::bxdf::microfacet::Ggx;
use gloss::bxdf::{Bxdf, Coat, Conductor, Plastic};
use gloss::core::{Rgb, Vec3, warp};
use std::f64::consts::PI;

fn furnace(bxdf: &Bxdf, theta: f64) -> Mean {
    let at = incidence(theta);
    mean(pairs(71, 60_000).map(|u| bxdf.sample(&at, u).map_or(0.0, |s| f64::from(s.weight.r))))
}

fn metal(alpha: f32) -> Bxdf {
    Bxdf::Conductor(Conductor { reflectance: Rgb::WHITE, ior: None, alpha })
}

#[test]
fn rough_mirrors_keep_the_energy_of_single_scattering() {
    // At normal incidence and alpha = 1 it is 1 - ln 2 exactly.
    for (alpha, theta, exact) in [
        (1.0f32, 0.0f64, 1.0 - std::f64::consts::LN_2),
        (1.0, 60.0, 0.450_694),
        (0.5, 0.0, 0.687_849),
        (0.5, 60.0, 0.698_251),
        (0.25, 0.0, 0.915_814),
        (0.25, 60.0, 0.857_264),
        (0.1, 0.0, 0.988_307),
        (0.1, 60.0, 0.969_205),
    ] {
        furnace(&metal(alpha), theta).assert_is(exact, &format!("alpha = {alpha} at {theta}"));
        let table = f64::from(mirror_albedo(Ggx { alpha }, cos(theta)));
        assert!((table - exact).abs() < 3e-3, "table: alpha = {alpha} at {theta}: {table} {exact}");
    }
}

#[test]
fn the_albedo_table_is_the_furnace_between_its_nodes() {
    for alpha in [0.02, 0.13, 0.37, 0.77] {
        for theta in [10.0, 50.0, 75.0, 86.0] {
            let (exact, table) = (furnace(&metal(alpha), theta), mirror_albedo(Ggx { alpha }, cos(theta)));
            let difference = (exact.mean - f64::from(table)).abs();
            assert!(
                difference < 0.01 + 5.0 * exact.error,
                "alpha = {alpha} at {theta}: {table} {}",
                exact.mean
            );
        }
    }
}

fn cos(theta: f64) -> f32 {
    theta.to_radians().cos() as f32
}

#[test]
fn microfacets_cover_the_surface_once() {
    // The projected area of all microfacets is that of the surface: the mean of 4 pi D max(0, cos) is 1.
    for alpha in [0.2, 0.5, 1.0] {
        let ggx = Ggx { alpha };
        let area = mean(pairs(72, 200_000).map(|u| {
            let h = warp::uniform_sphere(u);
            4.0 * PI * f64::from(ggx.density(Vec3::Z, h) * h.z.max(0.0))
        }));
        area.assert_is(1.0, &format!("alpha = {alpha}"));
        let h = Vec3::new(0.1, 0.2, 0.9);
        assert!((ggx.density(Vec3::Z, h * 3.0) / ggx.density(Vec3::Z, h) - 1.0).abs() < 1e-6);
    }
}

#[test]
fn a_smooth_rough_mirror_reflects_about_the_mirror_direction() {
    let at = incidence(50.0);
    for u in pairs(73, 2_000) {
        if let Some(s) = metal(1e-3).sample(&at, u) {
            // Half of the directions are within 2 alpha, and the tail of GGX falls with the square.
            assert!((s.wi - at.mirror_direction()).length() < 0.004 / (1.0 - u[1]).min(u[1]).max(1e-6));
        }
    }
}

#[test]
fn the_coat_table_is_the_furnace_of_black_plastic() {
    for eta in [1.1, 1.5, 2.4, 20.0] {
        for alpha in [1e-3, 0.03, 0.12, 0.45, 0.9] {
            let (black, ggx) =
                (Bxdf::Plastic(Plastic::new(Rgb::BLACK, Coat::new(eta, alpha))), Ggx { alpha });
            for theta in [0.0, 40.0, 70.0, 85.0, 89.0] {
                let (coat, table) =
                    (furnace(&black, theta), f64::from(CoatEnergy::of(ggx, eta).albedo(cos(theta))));
                let what = format!("eta = {eta}, alpha = {alpha} at {theta}");
                assert!(
                    (coat.mean - table).abs() < 0.003 + 5.0 * coat.error,
                    "{what}: {} {table}",
                    coat.mean
                );
            }
        }
        let smooth = CoatEnergy::of(Ggx { alpha: 1e-3 }, eta).average();
        assert!((smooth - diffuse_average(eta)).abs() < 5e-3, "{eta}: {smooth} {}", diffuse_average(eta));
    }
    let smooth = CoatEnergy::of(Ggx { alpha: 1e-3 }, 1.5).albedo(0.5);
    assert!((smooth - dielectric(0.5, 1.5).0).abs() < 2e-3);
}

#[test]
fn white_plastic_returns_everything_at_every_roughness() {
    for eta in [1.0, 1.2, 1.5, 2.4] {
        for alpha in [1e-3, 0.05, 0.2, 0.5, 1.0] {
            let white = Bxdf::Plastic(Plastic::new(Rgb::WHITE, Coat::new(eta, alpha)));
            for theta in [0.0, 30.0, 60.0, 75.0, 85.0, 89.0] {
                let all = furnace(&white, theta);
                let what = format!("eta = {eta}, alpha = {alpha} at {theta}");
                assert!((all.mean - 1.0).abs() < 0.003 + 5.0 * all.error, "{what}: {}", all.mean);
            }
        }
    }
}
