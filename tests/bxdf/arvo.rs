//! Arvo's closed form for a cosine power over a polygon.
//!
//! Source: Arvo 1995, *Applications of Irradiance Tensors to the Simulation of Non-Lambertian Phenomena*, section 5.

use super::lobes::HORIZONS;
use super::oracle;
use super::stat::{Mean, mean, pairs};
use glam::DVec3;
use gloss::bxdf::{Bxdf, Horizon, Incidence};
use gloss::core::{Rgb, Vec3};
use std::f64::consts::{PI, TAU};

/// A polygon about directions from the origin: its vertices in order, clockwise as seen from the origin.
type Polygon = Vec<DVec3>;

/// The part of the polygon with `n . x > 0`.
fn clipped(polygon: &Polygon, n: DVec3) -> Polygon {
    let next = polygon.iter().cycle().skip(1);
    let mut out = Vec::new();
    for (&a, &b) in polygon.iter().zip(next) {
        let (ha, hb) = (n.dot(a), n.dot(b));
        if ha > 0.0 {
            out.push(a);
        }
        if (ha > 0.0) != (hb > 0.0) {
            out.push(a + (b - a) * (ha / (ha - hb)));
        }
    }
    out
}

/// The sum over edges of `nu . v` times the line integral of powers `m, m + 2, ... n` of `w . u`.
fn boundary(polygon: &Polygon, w: DVec3, v: DVec3, m: i32, n: i32) -> f64 {
    let next = polygon.iter().cycle().skip(1);
    let edge = |(&a, &b): (&DVec3, &DVec3)| {
        let outward = b.cross(a).normalize();
        outward.dot(v) * line_integral(a, b, w, m, n)
    };
    polygon.iter().zip(next).map(edge).sum()
}

fn line_integral(a: DVec3, b: DVec3, w: DVec3, m: i32, n: i32) -> f64 {
    if n < 0 {
        return 0.0;
    }
    let s = a.normalize();
    let t = (b - s * s.dot(b)).normalize();
    let (x, y) = (w.dot(s), w.dot(t));
    let length = s.dot(b.normalize()).clamp(-1.0, 1.0).acos();
    let phi = y.atan2(x);
    cosine_sum(-phi, length - phi, x.hypot(y), m, n)
}

/// The sum of `c^i` times the integral of `cos^i` over `[x, y]`, for i = n, n - 2, ... from m on.
fn cosine_sum(x: f64, y: f64, c: f64, m: i32, n: i32) -> f64 {
    let mut i = n % 2;
    let mut f = if i == 1 { y.sin() - x.sin() } else { y - x };
    let mut sum = 0.0;
    while i <= n {
        if i >= m {
            sum += c.powi(i) * f;
        }
        let t = y.cos().powi(i + 1) * y.sin() - x.cos().powi(i + 1) * x.sin();
        f = (t + f64::from(i + 1) * f) / f64::from(i + 2);
        i += 2;
    }
    sum
}

/// The solid angle by Girard's theorem: the angles at the corners less those of a plane polygon.
fn solid_angle(polygon: &Polygon) -> f64 {
    let n = polygon.len();
    let normal = |i: usize| polygon[i % n].cross(polygon[(i + 1) % n]).normalize();
    let turns: f64 = (0..n).map(|i| normal(i).dot(normal(i + 1)).clamp(-1.0, 1.0).acos()).sum();
    TAU - turns
}

/// The integral of `(w . u)^n` over the polygon.
fn axial_moment(polygon: &Polygon, w: DVec3, n: i32) -> f64 {
    let whole = if n % 2 == 0 { solid_angle(polygon) } else { 0.0 };
    (whole - boundary(polygon, w, w, 0, n - 1)) / f64::from(n + 1)
}

/// The integral of `(w . u)^n (v . u)` over the polygon.
fn double_moment(polygon: &Polygon, w: DVec3, v: DVec3, n: i32) -> f64 {
    let axial = if n == 0 { 0.0 } else { f64::from(n) * w.dot(v) * axial_moment(polygon, w, n - 1) };
    (axial - boundary(polygon, w, v, n, n)) / f64::from(n + 2)
}

fn lobe_fraction(polygon: &Polygon, r: DVec3, n: DVec3, e: i32) -> f64 {
    let seen = clipped(&clipped(polygon, r), n);
    if seen.len() < 3 { 0.0 } else { f64::from(e + 1) / TAU * axial_moment(&seen, r, e) }
}

fn modified_phong(polygon: &Polygon, r: DVec3, n: DVec3, e: i32) -> f64 {
    let seen = clipped(&clipped(polygon, r), n);
    if seen.len() < 3 { 0.0 } else { f64::from(e + 2) / TAU * double_moment(&seen, r, n, e) }
}

/// A rectangle `corner + s a + t b`.
struct Rectangle {
    corner: Vec3,
    a: Vec3,
    b: Vec3,
}

impl Rectangle {
    fn polygon(&self) -> Polygon {
        let c = [Vec3::ZERO, self.a, self.a + self.b, self.b].map(|d| (self.corner + d).as_dvec3());
        if self.a.cross(self.b).dot(self.corner) > 0.0 { c.to_vec() } else { c.into_iter().rev().collect() }
    }

    fn is_hit(&self, d: Vec3) -> bool {
        let n = self.a.cross(self.b);
        let t = n.dot(self.corner) / n.dot(d);
        let q = d * t - self.corner;
        let (s, u) = (q.dot(self.a) / self.a.length_squared(), q.dot(self.b) / self.b.length_squared());
        t > 0.0 && (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&u)
    }

    /// The reflected radiance by points of the rectangle, uniform by area.
    fn by_area(&self, bxdf: &Bxdf, at: &Incidence, seed: u32) -> Mean {
        let n = self.a.cross(self.b);
        mean(pairs(seed, 20_000).map(|u| {
            let q = self.corner + self.a * u[0] + self.b * u[1];
            let wi = q.normalize();
            f64::from(bxdf.f_cos(at, wi).r * n.dot(wi).abs() / q.length_squared())
        }))
    }

    /// The reflected radiance by directions of the lobe.
    fn by_lobe(&self, bxdf: &Bxdf, at: &Incidence, seed: u32) -> Mean {
        mean(pairs(seed, 20_000).map(|u| {
            let sample = bxdf.sample(at, u).filter(|s| self.is_hit(s.wi));
            sample.map_or(0.0, |s| f64::from(s.weight.r))
        }))
    }
}

fn seen_at(theta_deg: f64) -> Incidence {
    let (sin, cos) = theta_deg.to_radians().sin_cos();
    Incidence { wo: Vec3::new(sin as f32, 0.0, cos as f32), n: Vec3::Z, ng: Vec3::Z, front: true }
}

fn mirrored(theta_deg: f64) -> DVec3 {
    let (sin, cos) = theta_deg.to_radians().sin_cos();
    DVec3::new(-sin, 0.0, cos)
}

/// The square of half-size 1 at height 1, and the tilted rectangle of the oracles.
fn above() -> Rectangle {
    Rectangle { corner: Vec3::new(-1.0, -1.0, 1.0), a: Vec3::X * 2.0, b: Vec3::Y * 2.0 }
}

fn aside() -> Rectangle {
    Rectangle { corner: Vec3::new(-1.5, -0.5, 1.0), a: Vec3::X, b: Vec3::Y }
}

/// A rectangle that stands on the surface: the lobe's part below it is folded into its view.
fn upright() -> Rectangle {
    Rectangle { corner: Vec3::new(-1.0, -2.0, -1.0), a: Vec3::Y * 4.0, b: Vec3::Z * 2.5 }
}

#[test]
fn the_recurrence_has_the_values_of_the_oracles() {
    let file = oracle::file();
    for (e, value) in file["arvo_square_halfsize1_h1_onaxis_lobe_fraction"].as_object().expect("a table") {
        let exact = value.as_f64().expect("a value");
        let e = e.parse().expect("an exponent");
        let fraction = lobe_fraction(&above().polygon(), DVec3::Z, DVec3::Z, e);
        assert!((fraction - exact).abs() < 1e-11, "{e}: {fraction} {exact}");
    }
    for (key, moment) in [
        ("lobe_fraction", lobe_fraction as fn(&Polygon, DVec3, DVec3, i32) -> f64),
        ("modified_phong", modified_phong),
    ] {
        for e in [1, 10, 100] {
            let exact = file["arvo_tilted"][key][e.to_string()].as_f64().expect("a value");
            let value = moment(&aside().polygon(), mirrored(40.0), DVec3::Z, e);
            assert!((value - exact).abs() < 1e-11, "{key} {e}: {value} {exact}");
        }
    }
    // Lambert's law is the double moment of power 0 about the normal: the square's form factor.
    assert!((axial_moment(&above().polygon(), DVec3::Z, 1) / PI - 0.554_126_424).abs() < 1e-9);
}

#[test]
fn polygon_lights_reflect_as_the_closed_form_says() {
    for (rectangle, theta) in [(above(), 0.0), (aside(), 40.0), (upright(), 55.0), (upright(), 83.0)] {
        for e in [0, 1, 2, 7, 10, 64, 100] {
            for horizon in HORIZONS {
                let (at, r) = (seen_at(theta), mirrored(theta));
                let bxdf = Bxdf::cosine_power(Rgb::WHITE, e as f32, horizon);
                let polygon = rectangle.polygon();
                let clip = lobe_fraction(&polygon, r, DVec3::Z, e);
                let exact = match horizon {
                    Horizon::FoldWeighted | Horizon::Clip => clip,
                    Horizon::Reject => clip / oracle::mass_above(f64::from(e), theta),
                    Horizon::ModifiedPhong => modified_phong(&polygon, r, DVec3::Z, e),
                    Horizon::Fold => {
                        // What is folded into the polygon comes from below, out of the polygon turned by pi about r.
                        let above = clipped(&polygon, DVec3::Z);
                        let turned: Polygon = above.iter().map(|&q| 2.0 * r.dot(q) * r - q).collect();
                        clip + lobe_fraction(&turned, r, -DVec3::Z, e)
                    }
                };
                let what = format!("{horizon:?} e = {e} at {theta} degrees");
                rectangle.by_lobe(&bxdf, &at, 20).assert_is(exact, &format!("{what} by lobe"));
                rectangle.by_area(&bxdf, &at, 21).assert_is(exact, &format!("{what} by area"));
            }
        }
    }
}
