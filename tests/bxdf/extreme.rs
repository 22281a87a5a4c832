//! Exponents, incidences and random numbers at the ends of their ranges.

use super::lobes::{self, HORIZONS, about, incidence, leaning};
use super::oracle::just_below_90;
use super::stat::pairs;
use gloss::bxdf::{Bxdf, CosinePower, DielectricWay, Incidence, LobeKind};
use gloss::core::{Rgb, Vec3, warp};

const EXPONENTS: [f32; 9] = [0.0, 1e-3, 1.0, 1e2, 1e5, 1e7, 1e9, 1e13, f32::INFINITY];

/// Both ends of the unit interval and what lies between.
fn numbers() -> Vec<[f32; 2]> {
    let ends =
        [0.0, f32::MIN_POSITIVE, 1.0 / (1 << 24) as f32, 0.25, 0.5, 0.75, 1.0 - 1.0 / (1 << 24) as f32];
    let corners = ends.iter().flat_map(|&a| ends.iter().map(move |&b| [a, b]));
    corners.chain(pairs(51, 200)).collect()
}

fn incidences() -> Vec<Incidence> {
    let mut all = Vec::new();
    for theta in [0.0, 45.0, 89.0, 89.99, just_below_90()] {
        all.extend([Vec3::Z, -Vec3::Z, Vec3::X, -Vec3::Y].map(|n| about(n, theta)));
        all.push(incidence(theta));
        all.push(leaning(theta, 0.004));
    }
    // A view along the surface to the last bit.
    all.push(Incidence { wo: Vec3::new(-1.0, 0.0, 1e-30), n: Vec3::Z, ng: Vec3::Z, front: true });
    // Only what callers promise: the viewer is on the normals' side, and so is the mirror direction.
    all.retain(|at| at.n.dot(at.wo) > 0.0);
    all
}

fn check(bxdf: &Bxdf, at: &Incidence, what: &str) {
    let fine = |x: f32| x.is_finite() && x >= 0.0;
    let fine_rgb = |c: Rgb| c.to_array().into_iter().all(fine);
    let mut directions: Vec<Vec3> = pairs(52, 20).map(warp::uniform_sphere).collect();
    directions.extend([at.wo, -at.wo, at.n, -at.n, at.mirror_direction(), -at.mirror_direction()]);
    directions.push(Vec3::new(1.0, 0.0, 1e-40));
    for u in numbers() {
        let Some(s) = bxdf.sample(at, u) else { continue };
        let delta = bxdf.kind() == LobeKind::Delta;
        let bound = if matches!(bxdf, Bxdf::Plastic(_)) { 64.0 } else { 2.3 };
        assert!(fine_rgb(s.weight) && s.weight.max_channel() < bound, "{what} {u:?}: {s:?}");
        assert!(if delta { s.pdf == f32::INFINITY } else { s.pdf.is_finite() }, "{what} {u:?}: {s:?}");
        assert!((s.wi.length() - 1.0).abs() < 2e-7, "{what} {u:?}: {s:?}");
        let transmits = matches!(bxdf, Bxdf::Dielectric(lobe) if lobe.way == DielectricWay::Transmission);
        let height = if transmits { -at.ng.dot(s.wi) } else { at.ng.dot(s.wi) };
        assert!(height > 0.0, "{what} {u:?}: {s:?}");
        directions.push(s.wi);
    }
    for wi in directions {
        let (f, f_cos) = (bxdf.f(at, wi), bxdf.f_cos(at, wi));
        let pdf = bxdf.pdf(at, wi);
        assert!(fine_rgb(f) && fine_rgb(f_cos), "{what} {wi}: {f:?} {f_cos:?}");
        assert!(fine(pdf), "{what} {wi}: {pdf}");
        if at.ng.dot(wi) <= 0.0 {
            assert!(f_cos.is_black() && pdf == 0.0, "{what} {wi}: {f_cos:?} {pdf}");
        }
    }
    assert!(fine_rgb(bxdf.albedo(at)) && bxdf.albedo(at).max_channel() <= 1.0 + 1e-5, "{what}");
}

#[test]
fn the_glossy_lobe_holds_at_every_extreme() {
    for e in EXPONENTS {
        for horizon in HORIZONS {
            // The struct itself must hold with an infinite exponent as well.
            let raw = Bxdf::CosinePower(CosinePower { reflectance: Rgb::WHITE, exponent: e, horizon });
            for at in incidences() {
                for bxdf in [Bxdf::cosine_power(Rgb::WHITE, e, horizon), raw] {
                    check(&bxdf, &at, &format!("{horizon:?} e = {e}, {at:?}"));
                }
            }
        }
    }
}

#[test]
fn every_other_lobe_holds_at_grazing_incidence_too() {
    for at in incidences() {
        for case in lobes::spread() {
            check(&case.bxdf, &at, &format!("{}, {at:?}", case.name));
        }
        for (name, bxdf) in lobes::deltas() {
            check(&bxdf, &at, &format!("{name}, {at:?}"));
            check(&bxdf, &Incidence { front: false, ..at }, &format!("{name} from inside, {at:?}"));
        }
    }
}

#[test]
fn a_thousand_reflections_do_not_lengthen_a_ray() {
    let n = Vec3::new(0.36, -0.48, 0.8) * (1.0 + 1e-7);
    let mut at = Incidence { n, ng: n, ..incidence(33.0) };
    for _ in 0..1000 {
        at.wo = at.mirror_direction();
    }
    assert!((at.wo.length() - 1.0).abs() < 2e-7, "{}", at.wo.length());
}
