//! Every light that a ray can hit: its sampling against its density, its solid angle and closed forms.

use glam::Vec3;
use gloss::accel::{Accelerator, Coherence, brute::Brute};
use gloss::core::{Hit, Ray, Rgb, Sampler, SamplerKind, warp};
use gloss::geometry::{Shape, Sphere, TriangleMesh};
use gloss::scene::{EmitterHit, Light, LightSample, Lights, Receiver, Rivals};
use std::f64::consts::PI;
use std::sync::Arc;

/// Mean and standard error of what was added.
#[derive(Default)]
struct Mean {
    n: f64,
    sum: f64,
    squares: f64,
}

impl Mean {
    fn add(&mut self, x: f64) {
        self.n += 1.0;
        self.sum += x;
        self.squares += x * x;
    }

    fn mean(&self) -> f64 {
        self.sum / self.n
    }

    fn standard_error(&self) -> f64 {
        ((self.squares / self.n - self.mean().powi(2)).max(0.0) / self.n).sqrt()
    }

    #[track_caller]
    fn assert_is(&self, exact: f64, error: f64, what: &str) {
        let bound = 5.0 * self.standard_error().hypot(error) + 2e-6 * exact.abs();
        assert!((self.mean() - exact).abs() <= bound, "{what}: {} is not {exact} +- {bound}", self.mean());
    }
}

/// Independent numbers `(choice, u)` in a fixed order.
fn numbers(seed: u32, i: u32) -> (f32, [f32; 2]) {
    let sampler = Sampler::new(SamplerKind::Independent, seed, 0, 0);
    (sampler.single(i, 0), sampler.pair(i, 1))
}

fn direction(seed: u32, i: u32) -> Vec3 {
    warp::uniform_sphere(numbers(seed, i).1)
}

fn mesh(positions: &[Vec3], indices: &[[u32; 3]]) -> Arc<TriangleMesh> {
    Arc::new(TriangleMesh::new(positions.to_vec(), indices.to_vec(), vec![], vec![]).unwrap())
}

/// A regular polygon about the origin whose front is +y.
fn disk(radius: f32, corners: u32) -> Arc<TriangleMesh> {
    let rim = |i: u32| {
        let angle = i as f32 / corners as f32 * std::f32::consts::TAU;
        radius * Vec3::new(angle.sin(), 0.0, angle.cos())
    };
    let positions: Vec<_> = (0..corners).map(rim).chain([Vec3::ZERO]).collect();
    let indices: Vec<_> = (0..corners).map(|i| [corners, i, (i + 1) % corners]).collect();
    mesh(&positions, &indices)
}

/// A tube that is bent to a ring about the axis y; its front is the outside.
fn ring(radius: f32, tube: f32, around: u32) -> Arc<TriangleMesh> {
    const ACROSS: u32 = 5;
    let turn = |i: u32, of: u32| (i as f32 / of as f32 * std::f32::consts::TAU).sin_cos();
    let corner = |i: u32| {
        let ((sin, cos), (up, out)) = (turn(i / ACROSS, around), turn(i % ACROSS, ACROSS));
        let r = radius + tube * out;
        Vec3::new(r * sin, tube * up, r * cos)
    };
    let positions: Vec<_> = (0..around * ACROSS).map(corner).collect();
    let at = |i: u32, j: u32| i % around * ACROSS + j % ACROSS;
    let sides = (0..around * ACROSS).map(|k| (k / ACROSS, k % ACROSS));
    let indices: Vec<_> = sides
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    mesh(&positions, &indices)
}

/// A light of radiance 1 about the origin, with the geometry that rays hit.
struct Stage {
    name: &'static str,
    lights: Lights,
    shape: Shape,
    brute: Brute,
    both_sides: bool,
}

impl Stage {
    fn new(name: &'static str, light: Light, shape: Shape, both_sides: bool) -> Self {
        let brute = Brute::new(std::slice::from_ref(&shape));
        Self { name, lights: Lights::new(vec![light], None), shape, brute, both_sides }
    }

    fn parallelogram(name: &'static str, u: Vec3, v: Vec3, both_sides: bool) -> Self {
        let corner = -0.5 * (u + v);
        let corners = [corner, corner + u, corner + u + v, corner + v];
        let shape = Shape::Mesh(mesh(&corners, &[[0, 1, 2], [0, 2, 3]]));
        Self::new(name, Light::rectangle(corner, u, v, Rgb::WHITE, both_sides), shape, both_sides)
    }

    fn sphere(name: &'static str, radius: f32, both_sides: bool) -> Self {
        let sphere = Sphere { center: Vec3::ZERO, radius };
        let shape = Shape::Spheres(Arc::from([sphere]));
        Self::new(name, Light::sphere(sphere, Rgb::WHITE, both_sides), shape, both_sides)
    }

    fn mesh(name: &'static str, mesh: Arc<TriangleMesh>, both_sides: bool) -> Self {
        let light = Light::mesh(Arc::clone(&mesh), Rgb::WHITE, both_sides);
        Self::new(name, light, Shape::Mesh(mesh), both_sides)
    }

    fn all() -> Vec<Self> {
        let tetrahedron = mesh(
            &[Vec3::ONE, Vec3::new(1.0, -1.0, -1.0), Vec3::new(-1.0, 1.0, -1.0), Vec3::new(-1.0, -1.0, 1.0)]
                .map(|p| 0.4 * p),
            &[[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]],
        );
        vec![
            Self::parallelogram("rectangle", Vec3::Z, 0.6 * Vec3::X, false),
            Self::parallelogram("rectangle with two sides", Vec3::new(0.3, 0.5, 0.0), 2.0 * Vec3::Z, true),
            Self::parallelogram("strip", 3.0 * Vec3::Z, 1e-3 * Vec3::X, false),
            Self::parallelogram("parallelogram", Vec3::Z, Vec3::new(0.5, 0.0, 0.5), false),
            Self::sphere("sphere", 0.5, false),
            Self::sphere("sphere with two sides", 0.9, true),
            Self::mesh("disk", disk(0.5, 32), false),
            Self::mesh("tetrahedron", tetrahedron, false),
        ]
    }

    fn sample(&self, to: &Receiver, seed: u32, i: u32) -> Option<LightSample> {
        let (choice, u) = numbers(seed, i);
        self.lights.sample(to, choice, u)
    }

    /// The light along a ray, if its shining side is there.
    fn hit(&self, p: Vec3, wi: Vec3) -> Option<EmitterHit> {
        let mut hit: [Option<Hit>; 1] = [None];
        self.brute.intersect(&[Ray::new(p, wi)], Coherence::Incoherent, &mut hit);
        let Hit { t, prim_id, .. } = hit[0]?;
        let ng = self.normal(p + t * wi, prim_id);
        let shines = self.both_sides || ng.dot(wi) < 0.0;
        shines.then_some(EmitterHit { light: 0, prim_id, wi, t, ng: -ng * ng.dot(wi).signum() })
    }

    fn normal(&self, p: Vec3, prim_id: u32) -> Vec3 {
        match &self.shape {
            Shape::Spheres(_) => p.normalize(),
            Shape::Mesh(mesh) => {
                let [a, b, c] = mesh.triangle(prim_id);
                (b - a).cross(c - a).normalize()
            }
        }
    }
}

/// Receivers near and far, before, behind and beside a light at the origin.
fn receivers(seed: u32, count: u32) -> impl Iterator<Item = Receiver> {
    (0..count).map(move |i| {
        let distance = 0.05 * (120.0f32).powf(numbers(seed + 1, i).0);
        Receiver { p: distance * direction(seed, i), n: direction(seed + 2, i), rivals: Rivals::None }
    })
}

#[test]
fn the_inverse_density_averages_to_the_solid_angle() {
    for stage in Stage::all() {
        // Right before a light that is sampled by area, a few samples have it all: more than were needed here.
        for (i, to) in receivers(10, 12).filter(|to| to.p.y.abs() > 0.01).enumerate() {
            let (mut sampled, mut seen) = (Mean::default(), Mean::default());
            for i in 0..4000 {
                sampled.add(stage.sample(&to, 1, i).map_or(0.0, |s| f64::from(s.pdf).recip()));
                let lit = stage.hit(to.p, direction(2, i)).is_some();
                seen.add(if lit { 4.0 * PI } else { 0.0 });
            }
            // At least one hit's worth of doubt where uniform rays find nothing.
            let doubt = seen.standard_error().max(4.0 * PI / seen.n);
            sampled.assert_is(seen.mean(), doubt, &format!("{} from receiver {i} at {}", stage.name, to.p));
        }
    }
}

#[test]
fn a_ray_along_a_sample_finds_the_light_with_the_same_density_and_no_shadow() {
    for stage in Stage::all() {
        let (mut found, mut lost) = (0, 0);
        for to in receivers(20, 300) {
            for i in 0..10 {
                let Some(sample) = stage.sample(&to, 3, i) else { continue };
                assert!((sample.wi.length() - 1.0).abs() < 1e-6);
                let Some(hit) = stage.hit(to.p, sample.wi) else {
                    // Only rounding at an edge takes a ray past the light.
                    lost += 1;
                    continue;
                };
                found += 1;
                assert!(sample.t_max < hit.t, "{}: {} {}", stage.name, sample.t_max, hit.t);
                let gap = 1e-3 * hit.t + 2e-6 * to.p.abs().max_element();
                assert!(sample.t_max > hit.t - gap, "{}: {} {}", stage.name, sample.t_max, hit.t);
                let pdf = stage.lights.pdf(&to, &hit);
                let error = (pdf / sample.pdf).ln().abs();
                // Grazing rays find another point of the surface than the sampled one.
                let grazing = hit.ng.dot(hit.wi).abs() < 0.02;
                assert!(error < if grazing { 0.05 } else { 1e-3 }, "{}: {error} at {}", stage.name, to.p);
                let weight = sample.le_over_pdf.g.ln() + sample.pdf.ln();
                assert!(weight.abs() < 1e-4, "{}: radiance is 1, not exp {weight}", stage.name);
            }
        }
        assert!(found > 500 && lost < found / 100, "{}: {found} found, {lost} lost", stage.name);
    }
}

/// Irradiance on a receiver by sampling.
fn irradiance(lights: &Lights, to: &Receiver, seed: u32, n: u32) -> Mean {
    let mut mean = Mean::default();
    for i in 0..n {
        let (choice, u) = numbers(seed, i);
        let sample = lights.sample(to, choice, u);
        mean.add(sample.map_or(0.0, |s| f64::from(s.le_over_pdf.g * s.wi.dot(to.n).max(0.0))));
    }
    mean
}

#[test]
fn a_sphere_gives_the_irradiance_of_a_disk() {
    for (distance, tilt) in [(0.51f32, 0.0f32), (0.8, 0.5), (3.0, 1.2), (40.0, 0.3), (1e6, 0.7)] {
        let stage = Stage::sphere("sphere", 0.5, false);
        let n = Vec3::new(tilt.sin(), 0.0, tilt.cos());
        let to = Receiver { p: -distance * Vec3::Z, n, rivals: Rivals::None };
        let sin = 0.5 / f64::from(distance);
        assert!(f64::from(tilt) + sin.asin() < PI / 2.0 || tilt == 0.0);
        let exact = PI * sin * sin * f64::from(tilt).cos();
        irradiance(&stage.lights, &to, 5, 40_000).assert_is(exact, 0.0, &format!("sphere at {distance}"));
    }
}

#[test]
fn a_polygon_gives_lamberts_irradiance() {
    // Lambert 1760: half the sum over the edges of their angle times the cosine to the plane through the eye.
    let lambert = |corners: &[Vec3], to: &Receiver| {
        let mut sum = 0.0;
        for (i, &a) in corners.iter().enumerate() {
            let b = corners[(i + 1) % corners.len()];
            let [a, b] = [a, b].map(|q| (q - to.p).as_dvec3());
            sum += a.angle_between(b) * b.cross(a).normalize().dot(to.n.as_dvec3());
        }
        0.5 * sum
    };
    let (u, v) = (1.5 * Vec3::Z, 0.6 * Vec3::X);
    let corner = -0.5 * (u + v);
    let rectangle = Stage::parallelogram("rectangle", u, v, false);
    let polygon = disk(0.7, 7);
    let polygon_corners = polygon.positions()[..7].to_vec();
    let polygon = Stage::mesh("polygon", polygon, false);
    let rectangle_corners = [corner, corner + u, corner + u + v, corner + v];
    for (p, n) in [
        (Vec3::new(0.0, 0.01, 0.0), Vec3::NEG_Y),
        (Vec3::new(0.3, 0.4, -0.2), Vec3::NEG_Y),
        (Vec3::new(0.2, 2.0, 3.0), Vec3::new(0.0, -1.0, -0.8).normalize()),
        (Vec3::new(-90.0, 120.0, 15.0), Vec3::new(0.2, -0.8, 0.1).normalize()),
    ] {
        let to = Receiver { p, n, rivals: Rivals::None };
        let exact = lambert(&rectangle_corners, &to);
        irradiance(&rectangle.lights, &to, 6, 40_000).assert_is(exact, 0.0, &format!("rectangle from {p}"));
        if p.y > 0.1 {
            let exact = lambert(&polygon_corners, &to);
            irradiance(&polygon.lights, &to, 6, 40_000).assert_is(exact, 0.0, &format!("polygon from {p}"));
        }
    }
}

#[test]
fn a_coaxial_disk_gives_its_form_factor() {
    let (radius, corners) = (0.5f64, 256);
    let stage = Stage::mesh("disk", disk(radius as f32, corners), false);
    for height in [0.2f32, 0.5, 3.0] {
        let to = Receiver { p: height * Vec3::Y, n: Vec3::NEG_Y, rivals: Rivals::None };
        let exact = PI * radius.powi(2) / (radius.powi(2) + f64::from(height).powi(2));
        // 256 corners leave 1e-4 of the disk's area out.
        irradiance(&stage.lights, &to, 7, 40_000).assert_is(exact, 2e-5 * exact, &format!("from {height}"));
    }
}

#[test]
fn a_mesh_is_asked_for_light_where_it_is_near_and_shines() {
    let mesh = ring(1.0, 0.02, 200);
    let stage = Stage::mesh("ring", Arc::clone(&mesh), false);
    let triangles: Vec<[Vec3; 3]> = (0..mesh.triangle_count() as u32).map(|i| mesh.triangle(i)).collect();
    // All triangles are about the same size: to choose one evenly is to choose by area.
    let evenly = |to: &Receiver, i: u32| {
        let (choice, u) = numbers(12, i);
        let [a, b, c] = triangles[(choice * triangles.len() as f32) as usize];
        let [u, v] = warp::uniform_triangle(u);
        let way = a + u * (b - a) + v * (c - a) - to.p;
        let facing = (-(b - a).cross(c - a).dot(way)).max(0.0) * to.n.dot(way).max(0.0);
        0.5 * f64::from(facing / way.length_squared().powi(2)) * triangles.len() as f64
    };
    for (p, n) in [
        (Vec3::new(0.9, 0.1, 0.0), Vec3::new(0.7, -0.7, 0.1).normalize()),
        (Vec3::new(0.0, -0.5, 0.5), Vec3::Y),
        (Vec3::new(0.0, 0.0, -1.3), Vec3::Z),
    ] {
        let to = Receiver { p, n, rivals: Rivals::None };
        let by_place = irradiance(&stage.lights, &to, 11, 20_000);
        let mut by_area = Mean::default();
        (0..20_000).for_each(|i| by_area.add(evenly(&to, i)));
        by_place.assert_is(by_area.mean(), by_area.standard_error(), &format!("ring from {p}"));
        let mut met = 0;
        for sample in (0..2000).filter_map(|i| stage.sample(&to, 13, i)) {
            // The ring is before itself: of a sample on its far side, the ray finds the near one.
            let Some(hit) = stage.hit(p, sample.wi) else { continue };
            if (hit.t / sample.t_max - 1.0).abs() > 1e-3 {
                continue;
            }
            let grazing = hit.ng.dot(hit.wi).abs() < 0.02;
            let error = (stage.lights.pdf(&to, &hit) / sample.pdf).ln().abs();
            assert!(grazing || error < 1e-3, "from {p}: {error}");
            met += 1;
        }
        assert!(met > 1000, "from {p}: {met}");
        let [by_place, by_area] = [by_place, by_area].map(|mean| mean.standard_error().powi(2));
        assert!(4.0 * by_place < by_area, "from {p}: variance {by_place}, by area {by_area}");
    }
}

#[test]
fn the_back_of_a_light_is_dark_unless_both_sides_shine() {
    for (stage, behind) in [
        (Stage::parallelogram("rectangle", Vec3::Z, Vec3::X, false), Vec3::new(0.1, -0.5, 0.2)),
        (Stage::sphere("sphere", 1.0, false), Vec3::new(0.2, 0.1, 0.0)),
        (Stage::mesh("disk", disk(1.0, 16), false), Vec3::new(0.1, -0.5, 0.2)),
    ] {
        let to = Receiver { p: behind, n: Vec3::Y, rivals: Rivals::None };
        assert!((0..100).all(|i| stage.sample(&to, 8, i).is_none()), "{}", stage.name);
        let hit = EmitterHit { light: 0, prim_id: 0, wi: Vec3::Y, t: 0.5, ng: Vec3::NEG_Y };
        assert_eq!(stage.lights.pdf(&to, &hit), 0.0, "{}", stage.name);
    }
    for (stage, behind) in [
        (Stage::parallelogram("rectangle", Vec3::Z, Vec3::X, true), Vec3::new(0.1, -0.5, 0.2)),
        (Stage::sphere("sphere", 1.0, true), Vec3::new(0.2, 0.1, 0.0)),
        (Stage::mesh("disk", disk(1.0, 16), true), Vec3::new(0.1, -0.5, 0.2)),
    ] {
        let to = Receiver { p: behind, n: Vec3::Y, rivals: Rivals::None };
        assert!((0..100).all(|i| stage.sample(&to, 8, i).is_some()), "{}", stage.name);
    }
}

#[test]
fn lights_that_no_ray_can_hit_have_an_infinite_density() {
    let to = Receiver { p: Vec3::new(1.0, 2.0, 3.0), n: Vec3::Y, rivals: Rivals::None };
    let position = Vec3::new(1.0, 6.0, 3.0);
    let only = |light| Lights::new(vec![light], None).sample(&to, 0.3, [0.5; 2]).unwrap();
    let cases = [
        (only(Light::point(position, Rgb::WHITE, true, true)), 1.0 / 16.0, 4.0),
        (only(Light::point(position, Rgb::WHITE, false, false)), 1.0, 4.0),
        (only(Light::directional(-3.0 * Vec3::Y, Rgb::WHITE, true)), 1.0, f32::INFINITY),
    ];
    for (sample, le, t) in cases {
        assert_eq!((sample.wi, sample.pdf, sample.le_over_pdf), (Vec3::Y, f32::INFINITY, Rgb::grey(le)));
        assert!(sample.t_max == t || (sample.t_max < t && sample.t_max > 0.999 * t));
    }
    assert!(cases[0].0.shadow && !cases[1].0.shadow);
}

#[test]
fn nothing_is_nan_or_infinite_on_at_or_very_far_from_a_light() {
    let flat = mesh(&[Vec3::ZERO, Vec3::X, 2.0 * Vec3::X], &[[0, 1, 2]]);
    let mut stages = Stage::all();
    stages.push(Stage::mesh("no area", flat, true));
    stages.push(Stage::mesh("no triangle", mesh(&[], &[]), true));
    stages.push(Stage::parallelogram("no width", Vec3::Z, Vec3::ZERO, true));
    stages.push(Stage::sphere("a grain", 1e-20, false));
    stages.push(Stage::sphere("tiny", 1e-6, false));
    let unhittable = [Light::point(Vec3::ZERO, Rgb::WHITE, true, true)];
    let mut all: Vec<_> = stages.into_iter().map(|s| (s.name, s.lights)).collect();
    all.extend(unhittable.map(|l| ("point", Lights::new(vec![l], None))));
    let mut places = vec![Vec3::ZERO, Vec3::splat(1e-30), 0.5 * Vec3::X, 0.5 * Vec3::Y, 0.3 * Vec3::X];
    places.extend([0.9, 0.900_000_1, 0.5, 0.500_000_06, 0.499_999_97].map(|y| y * Vec3::Z));
    places.extend([1e3, 1e6, 1e12, 1e19].map(|d| d * Vec3::new(0.6, 0.48, 0.64)));
    for (name, lights) in &all {
        for &p in &places {
            let to = Receiver { p, n: Vec3::Y, rivals: Rivals::None };
            for i in 0..50 {
                let (choice, u) = numbers(9, i);
                let u = if i == 0 { [0.0; 2] } else { u };
                let Some(sample) = lights.sample(&to, choice, u) else { continue };
                let finite = sample.le_over_pdf.is_finite() && sample.wi.is_finite();
                assert!(finite && sample.t_max >= 0.0 && !sample.pdf.is_nan(), "{name} {p} {sample:?}");
                assert!((sample.wi.length() - 1.0).abs() < 1e-5, "{name} {p} {sample:?}");
            }
            for t in [0.0, 1e-30, 1.0, 1e19] {
                let hit = EmitterHit { light: 0, prim_id: 0, wi: Vec3::Y, t, ng: Vec3::NEG_Y };
                if *name != "no triangle" {
                    assert!(!lights.pdf(&to, &hit).is_nan(), "{name} {p} {t}");
                }
            }
        }
    }
}
