//! What the lobes should be, computed in f64 by ways that the library does not use.

use std::f64::consts::{FRAC_PI_2, PI};

/// `oracles.json`: closed forms confirmed by Monte Carlo and quadrature.
pub(crate) fn file() -> serde_json::Value {
    serde_json::from_str(include_str!("../oracles.json")).expect("oracles.json is JSON")
}

/// A table of `oracles.json` with two keys, as `(outer, inner, value)`.
pub(crate) fn table(name: &str) -> Vec<(f64, f64, f64)> {
    let number = |s: &str| s.parse::<f64>().expect("keys are numbers");
    let file = file();
    let rows = file[name].as_object().expect("a table");
    rows.iter()
        .flat_map(|(outer, row)| {
            let row = row.as_object().expect("a row");
            row.iter().map(move |(inner, v)| (number(outer), number(inner), v.as_f64().expect("a value")))
        })
        .collect()
}

/// The integral of `f` over `[a, b]` by Simpson's rule.
pub(crate) fn simpson(a: f64, b: f64, f: impl Fn(f64) -> f64) -> f64 {
    let n = 4000;
    let h = (b - a) / f64::from(n);
    let weight = |i: i32| {
        if i == 0 || i == n {
            1.0
        } else if i % 2 == 1 {
            4.0
        } else {
            2.0
        }
    };
    (0..=n).map(|i| weight(i) * f(a + f64::from(i) * h)).sum::<f64>() * h / 3.0
}

/// The integral of `cos^e` from `from` to pi/2.
fn cosine_power(e: f64, from: f64) -> f64 {
    // cos^e is below 1e-30 beyond 12 of its widths.
    let to = FRAC_PI_2.min(from + 12.0 / (e + 1.0).sqrt());
    // t = to - s^2 takes the kink of a small power away from the end.
    simpson(0.0, (to - from).sqrt(), |s| 2.0 * s * (to - s * s).cos().max(0.0).powf(e))
}

/// The mass of the lobe above the surface at the incidence `theta_deg`.
pub(crate) fn mass_above(e: f64, theta_deg: f64) -> f64 {
    1.0 - 0.5 * cosine_power(e, (90.0 - theta_deg).to_radians()) / cosine_power(e, 0.0)
}

/// Moments of the lobe `(e + 2) / (2 pi) cos^e` along the normal, at the incidence `theta_deg`.
pub(crate) struct PhongEnergy {
    /// Over the directions above the surface: the modified Phong lobe's albedo.
    pub(crate) above: f64,
    /// Over those below, where they are folded to.
    pub(crate) folded: f64,
}

pub(crate) fn phong_energy(e: f64, theta_deg: f64) -> PhongEnergy {
    // With w = sin(psi) y + cos(psi) (cos(t) r + sin(t) s), y perpendicular to the plane of n and r: the solid angle
    // is cos(psi) dpsi dt, cos(alpha) = cos(psi) cos(t) and n . w = cos(psi) cos(theta - t).
    let theta = theta_deg.to_radians();
    let across = (e + 2.0) / PI * cosine_power(e + 2.0, 0.0);
    let within = 12.0 / (e + 1.0).sqrt();
    let (from, to) = ((-FRAC_PI_2).max(-within), FRAC_PI_2.min(within));
    let plane = (theta - FRAC_PI_2).clamp(from, to);
    let slice = |t: f64, height: f64| t.cos().max(0.0).powf(e) * height;
    // As in `cosine_power`, squares take the kink of a small power away from both ends.
    let above =
        simpson(0.0, (to - plane).sqrt(), |s| 2.0 * s * slice(to - s * s, (theta - to + s * s).cos()));
    let folded =
        simpson(0.0, (plane - from).sqrt(), |s| 2.0 * s * slice(from + s * s, (theta + from + s * s).cos()));
    PhongEnergy { above: across * above, folded: across * folded }
}

/// The angle of f32 rounding below a right angle, in degrees.
pub(crate) fn just_below_90() -> f64 {
    f64::from(90f32.next_down())
}
