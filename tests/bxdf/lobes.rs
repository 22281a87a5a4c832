//! The list of lobes that the sweeps run over, and the incidences at which they do.

use super::oracle;
use gloss::bxdf::{
    Bxdf, Coat, ComplexIor, Conductor, Dielectric, DielectricWay, Diffuse, Horizon, Incidence, Mirror,
    Plastic,
};
use gloss::core::{Frame, Rgb, Vec3};

/// Every policy.
pub(crate) const HORIZONS: [Horizon; 5] =
    [Horizon::Fold, Horizon::FoldWeighted, Horizon::Clip, Horizon::Reject, Horizon::ModifiedPhong];

/// The directional albedo per unit of reflectance, as a function of the incidence in degrees.
pub(crate) enum Furnace {
    Exact(Box<dyn Fn(f64) -> f64>),
    AtMost(f64),
}

/// One lobe and what it promises.
pub(crate) struct Case {
    pub(crate) name: String,
    pub(crate) bxdf: Bxdf,
    pub(crate) furnace: Furnace,
    pub(crate) reciprocal: bool,
    /// Whether a lattice of some thousand directions resolves it.
    pub(crate) broad: bool,
}

/// The furnace value of a policy at reflectance 1.
pub(crate) fn policy_furnace(horizon: Horizon, e: f64, theta_deg: f64) -> f64 {
    match horizon {
        Horizon::Fold | Horizon::Reject => 1.0,
        Horizon::FoldWeighted | Horizon::Clip => oracle::mass_above(e, theta_deg),
        Horizon::ModifiedPhong => oracle::phong_energy(e, theta_deg).above,
    }
}

/// Reflectance of the test lobes; the red channel is what a furnace returns times.
pub(crate) const REFLECTANCE: Rgb = Rgb::new(1.0, 0.5, 0.25);

fn cosine_power(exponent: f32, horizon: Horizon) -> Case {
    Case {
        name: format!("{horizon:?} e = {exponent}"),
        bxdf: Bxdf::cosine_power(REFLECTANCE, exponent, horizon),
        furnace: Furnace::Exact(Box::new(move |theta| policy_furnace(horizon, f64::from(exponent), theta))),
        reciprocal: horizon == Horizon::ModifiedPhong,
        broad: exponent <= 100.0,
    }
}

fn conductor(alpha: f32, ior: Option<ComplexIor>) -> Case {
    Case {
        name: format!("conductor alpha = {alpha}{}", if ior.is_some() { " copper" } else { "" }),
        bxdf: Bxdf::Conductor(Conductor { reflectance: REFLECTANCE, ior, alpha }),
        furnace: Furnace::AtMost(1.0),
        reciprocal: true,
        broad: alpha >= 0.15,
    }
}

fn plastic(alpha: f32, eta: f32) -> Case {
    Case {
        name: format!("plastic alpha = {alpha} eta = {eta}"),
        bxdf: Bxdf::Plastic(Plastic::new(REFLECTANCE, Coat::new(eta, alpha))),
        furnace: Furnace::AtMost(1.0),
        reciprocal: true,
        broad: alpha >= 0.15,
    }
}

/// Copper, from the reference values of Fresnel's equations.
pub(crate) const COPPER: ComplexIor =
    ComplexIor { eta: Rgb::new(0.200438, 0.924033, 1.102212), k: Rgb::new(3.912949, 2.452848, 2.142188) };

/// Every lobe with a density.
pub(crate) fn spread() -> Vec<Case> {
    let mut cases = vec![Case {
        name: "diffuse".into(),
        bxdf: Bxdf::Diffuse(Diffuse { reflectance: REFLECTANCE }),
        furnace: Furnace::Exact(Box::new(|_| 1.0)),
        reciprocal: true,
        broad: true,
    }];
    for e in [0.0, 0.4, 1.0, 10.0, 37.5, 100.0, 2500.0, 1e5] {
        cases.extend(HORIZONS.map(|horizon| cosine_power(e, horizon)));
    }
    cases.extend([1e-3, 0.05, 0.15, 0.5, 1.0].map(|alpha| conductor(alpha, None)));
    cases.extend([0.05, 0.3].map(|alpha| conductor(alpha, Some(COPPER))));
    cases.extend(
        [(1e-3, 1.5), (0.1, 1.5), (0.4, 1.5), (1.0, 1.5), (0.3, 1.0), (0.3, 2.4)].map(|(a, n)| plastic(a, n)),
    );
    cases
}

/// Every kind of delta lobe.
pub(crate) fn deltas() -> Vec<(&'static str, Bxdf)> {
    let glass = |way, eta| Bxdf::Dielectric(Dielectric { way, colour: Rgb::WHITE, eta });
    let [back, through] = [DielectricWay::Reflection, DielectricWay::Transmission];
    vec![
        ("mirror", Bxdf::Mirror(Mirror { reflectance: REFLECTANCE })),
        ("e = inf", Bxdf::cosine_power(REFLECTANCE, f32::INFINITY, Horizon::Fold)),
        (
            "smooth copper",
            Bxdf::Conductor(Conductor { reflectance: Rgb::WHITE, ior: Some(COPPER), alpha: 0.0 }),
        ),
        ("reflection of glass", glass(back, 1.5)),
        ("transmission of glass", glass(through, 1.5)),
        ("reflection of air in glass", glass(back, 1.0 / 1.5)),
        ("transmission of air in glass", glass(through, 1.0 / 1.5)),
        ("reflection of nothing", glass(back, 1.0)),
        ("transmission of nothing", glass(through, 1.0)),
    ]
}

/// A surface whose normals are not along an axis, seen at `theta_deg` from its normal.
pub(crate) fn incidence(theta_deg: f64) -> Incidence {
    about(Vec3::new(0.36, -0.48, 0.8), theta_deg)
}

/// A surface with the normal `n`, seen at `theta_deg` from it.
pub(crate) fn about(n: Vec3, theta_deg: f64) -> Incidence {
    let frame = Frame::new(n);
    let (sin, cos) = theta_deg.to_radians().sin_cos();
    let side = (frame.s * 0.6 + frame.t * 0.8).as_dvec3();
    let wo = (side * sin + n.as_dvec3() * cos).as_vec3();
    Incidence { wo, n, ng: n, front: true }
}

/// A surface whose shading normal leans from its geometric one by `lean_deg`, away from the viewer.
pub(crate) fn leaning(theta_deg: f64, lean_deg: f64) -> Incidence {
    let upright = about(Vec3::Z, theta_deg);
    let (sin, cos) = (lean_deg.to_radians() as f32).sin_cos();
    let away = -upright.wo.with_z(0.0).try_normalize().unwrap_or(Vec3::X);
    Incidence { ng: Vec3::Z, n: (Vec3::Z * cos + away * sin).normalize(), ..upright }
}
