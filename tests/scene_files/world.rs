//! The size and the place of a scene change nothing in the unit world.

use super::scene;
use glam::{DVec3, Vec3};
use gloss::geometry::Shape;
use gloss::scene::{Light, Scene, Specular, Texture};

/// A scene of one of each, `scale` times as large and moved by `offset`.
fn at(scale: f64, offset: f64) -> Scene {
    let p = |x: f64, y: f64, z: f64| {
        let [x, y, z] = [x, y, z].map(|v| v * scale + offset);
        format!("[{x:e}, {y:e}, {z:e}]")
    };
    let s = |v: f64| format!("{:e}", v * scale);
    scene(&format!(
        r#"
        [camera]
        eye = {eye}
        look_at = {look_at}
        [materials.checker]
        type = "cosine-power"
        exponent = 100
        cr = {{ checker = [0, 1], size = {size}, origin = {origin} }}
        [[shapes]]
        type = "sphere"
        center = {center}
        radius = {radius}
        material = "checker"
        [[shapes]]
        type = "box"
        min = {min}
        max = {max}
        [[shapes]]
        type = "cylinder"
        base = {min}
        top = {max}
        radius = {radius}
        segments = 8
        [[shapes]]
        type = "plane"
        point = {min}
        [[lights]]
        type = "point"
        position = {light}
        intensity = {intensity:e}
        [[lights]]
        type = "point"
        position = {light}
        intensity = 2
        falloff = "none"
        "#,
        eye = p(1.0, 2.0, 6.0),
        look_at = p(0.0, 0.5, 0.0),
        size = s(0.25),
        origin = p(0.125, 0.0, 0.0),
        center = p(0.25, 0.5, -0.5),
        radius = s(0.375),
        min = p(-1.0, -0.5, -0.25),
        max = p(0.5, 1.0, 1.25),
        light = p(0.0, 4.0, 1.0),
        intensity = 3.0 * scale * scale,
    ))
}

/// The greatest difference of two scenes in the unit world.
fn difference(a: &Scene, b: &Scene) -> f32 {
    let mut worst = 0.0f32;
    let mut see = |a: Vec3, b: Vec3| worst = worst.max((a - b).abs().max_element() / (1.0 + a.length()));
    see(a.camera.eye, b.camera.eye);
    see(a.camera.forward, b.camera.forward);
    for (a, b) in a.shapes.iter().zip(&b.shapes) {
        match (a, b) {
            (Shape::Mesh(a), Shape::Mesh(b)) => {
                assert_eq!(a.indices(), b.indices());
                a.positions().iter().zip(b.positions()).for_each(|(a, b)| see(*a, *b));
                a.normals().iter().zip(b.normals()).for_each(|(a, b)| see(*a, *b));
            }
            (Shape::Spheres(a), Shape::Spheres(b)) => {
                see(a[0].center, b[0].center);
                see(Vec3::splat(a[0].radius), Vec3::splat(b[0].radius));
            }
            _ => panic!("other shapes"),
        }
    }
    for (a, b) in a.lights.lights.iter().zip(&b.lights.lights) {
        let (Light::Point(a), Light::Point(b)) = (a, b) else { panic!("other lights") };
        see(a.position, b.position);
        see(a.intensity.to_array().into(), b.intensity.to_array().into());
    }
    let texture = |s: &Scene| match s.materials[0].specular {
        Specular::CosinePower { reflectance, .. } => reflectance,
        _ => panic!("another material"),
    };
    let (Texture::Checker { frequency: fa, .. }, Texture::Checker { frequency: fb, .. }) =
        (texture(a), texture(b))
    else {
        panic!("other textures")
    };
    see(Vec3::splat(fa), Vec3::splat(fb));
    // Points off the edges of the checker's cubes.
    for i in 0..1000 {
        let cell = DVec3::new(f64::from(i % 10), f64::from(i / 10 % 10), f64::from(i / 100)) + 0.37;
        let p = (cell / f64::from(fa)).as_vec3() - 0.5;
        assert_eq!(texture(a).at(p), texture(b).at(p), "{p}");
    }
    worst
}

#[test]
fn a_scene_a_million_times_smaller_or_larger_is_the_same_to_the_bit() {
    let unit = at(1.0, 0.0);
    for exponent in [-20, 20] {
        assert_eq!(difference(&unit, &at(2f64.powi(exponent), 0.0)), 0.0, "2^{exponent}");
    }
}

#[test]
fn a_scene_ten_million_from_the_origin_is_the_same_but_for_the_rounding_of_its_numbers() {
    // The file's own numbers have 53 bits: at 1e7 they are 1e-9 apart.
    let moved = difference(&at(1.0, 0.0), &at(1.0, 1e7));
    assert!(moved < 4e-8, "{moved}");
}

#[test]
fn other_scales_change_the_unit_world_by_a_power_of_two_at_most() {
    let unit = at(1.0, 0.0);
    for scale in [1e-6, 1e6] {
        let other = at(scale, 0.0);
        let ratio = other.world.scale * scale / unit.world.scale;
        assert!((0.5..=2.0).contains(&ratio), "{ratio}");
        let size = |s: &Scene| s.shapes[1].bounds().size().max_element();
        assert!((size(&other) / size(&unit) / ratio as f32 - 1.0).abs() < 1e-6);
    }
}

#[test]
fn the_world_is_about_a_unit_box_and_endless_planes_do_not_count() {
    let scene = at(1.0, 0.0);
    let bounds = scene.shapes[..3].iter().fold(gloss::geometry::Aabb::EMPTY, |b, s| b.union(s.bounds()));
    assert!((0.5..=2.0).contains(&bounds.size().max_element()), "{bounds:?}");
    let plane = scene.shapes[3].bounds().size();
    assert!(plane.max_element() > 1e4 && plane.y == 0.0, "{plane}");
    // Triangles are small in the middle and share their corners all the way out.
    let Shape::Mesh(mesh) = &scene.shapes[3] else { panic!("a mesh") };
    let areas: f64 = (0..mesh.triangle_count() as u32)
        .map(|i| {
            let [a, b, c] = mesh.triangle(i).map(|p| p.as_dvec3());
            let cross = (b - a).cross(c - a);
            assert!(cross.y > 0.0, "each faces up");
            0.5 * cross.length()
        })
        .sum();
    let square = f64::from(plane.x) * f64::from(plane.z);
    assert!((areas / square - 1.0).abs() < 1e-6, "{areas} {square}");
}

#[test]
fn planes_alone_are_scaled_by_the_distance_of_the_eye() {
    for scale in [1e-6, 1.0, 1e6] {
        let scene =
            scene(&format!("[camera]\neye = [0, {scale:e}, {scale:e}]\n[[shapes]]\ntype = \"plane\""));
        let distance = scene.camera.eye.length();
        assert!((0.5..=2.0).contains(&distance), "{scale}: {distance}");
    }
}

#[test]
fn what_is_huge_or_far_away_is_still_seen() {
    let huge = scene("[[shapes]]\ntype = \"sphere\"\nradius = 1e300");
    let Shape::Spheres(spheres) = &huge.shapes[0] else { panic!("{:?}", huge.shapes) };
    assert!((0.25..=1.0).contains(&spheres[0].radius), "{spheres:?}");
    let far = scene("[camera]\nlook_at = [0, 0, -1e300]");
    assert_eq!(far.camera.forward, -glam::Vec3::Z);
}
