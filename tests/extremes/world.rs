//! Worlds of any size and place, and triangles of any shape.

use super::common::{picture_on, scene};
use super::{Place, backends, extremes};
use glam::DVec3;
use gloss::accel::Backend;
use gloss::compare::flip;
use gloss::film::Film;
use gloss::geometry::MeshSource;
use gloss::geometry::generate::{Generator, generate};
use gloss::image_io::Image;
use gloss::render::RenderOptions;
use std::path::Path;

/// A glossy knot from an OBJ file on a checkered floor, with a lamp, in a studio.
fn knot_scene(place: Place, folder: &Path) -> String {
    let knot = place.obj(&generate(Generator::Knot, 3000, 0), folder, "knot");
    format!(
        r#"
        [settings]
        spp = 4
        max_depth = 3
        at_max_depth = "black"
        [camera]
        eye = {eye}
        look_at = {middle}
        fov_deg = 40
        resolution = [48, 36]
        [environment]
        type = "studio"
        [materials.glossy]
        type = "cosine-power"
        kr = 0.8
        exponent = 100
        kd = 0.15
        [materials.floor]
        type = "diffuse"
        kd = 1
        cd = {{ checker = [0.2, 0.8], size = {square}, origin = {middle} }}
        [[shapes]]
        type = "obj"
        file = "{knot}"
        material = "glossy"
        [[shapes]]
        type = "rect"
        corner = {corner}
        u = {u}
        v = {v}
        material = "floor"
        [[lights]]
        type = "sphere"
        center = {lamp}
        radius = {radius}
        radiance = [20, 18, 15]
        "#,
        eye = place.point(1.0, 2.2, 2.5),
        middle = place.point(0.0, 0.0, 0.0),
        square = place.length(0.3),
        knot = knot.display(),
        corner = place.point(-2.0, -0.5, 2.0),
        u = place.vector(4.0, 0.0, 0.0),
        v = place.vector(0.0, 0.0, -4.0),
        lamp = place.point(-1.5, 1.5, 0.5),
        radius = place.length(0.2),
    )
}

fn image(film: &Film) -> Image {
    Image::new(film.rect.width(), film.rect.height(), film.image())
}

#[test]
fn a_world_of_any_size_and_place_gives_the_same_picture() {
    let folder = tempfile::tempdir().expect("a folder");
    for backend in backends() {
        let film = |place| {
            picture_on(&scene(&knot_scene(place, folder.path())), backend, &RenderOptions::default()).film
        };
        let unit = film(Place::UNIT);
        for scale in [2f64.powi(-20), 2f64.powi(20)] {
            assert_eq!(film(Place { scale, offset: 0.0 }).pixels, unit.pixels, "{scale:e} on {backend:?}");
        }
        for place in &Place::ALL[1..] {
            let (unit, other) = (image(&unit), image(&film(*place)));
            let flip = flip::mean(&flip::hdr(&unit, &other, 67.02).map);
            let far = |(a, b): (&gloss::core::Rgb, &gloss::core::Rgb)| (*a - *b).map(f32::abs).max_channel();
            let differences = unit.pixels.iter().zip(&other.pixels).map(far).collect::<Vec<_>>();
            let greatest = differences.iter().copied().fold(0.0, f32::max);
            let differ = differences.iter().filter(|d| **d > 1e-3).count();
            println!(
                "{place:?} on {backend:?}: FLIP {flip:.2e}, max {greatest:.2e}, {differ} pixels above 1e-3"
            );
            // A ray at the very edge of a triangle or of a square of the floor may fall to its other side.
            assert!(
                flip < 1e-3 && differ * 200 <= unit.pixels.len(),
                "{place:?} on {backend:?}: {flip}, {differ}"
            );
        }
    }
}

/// A white plate, of the given triangles, from above.
fn plate(file: &Path, place: Place, width: f64, material: &str) -> String {
    format!(
        r#"
        [settings]
        spp = 4
        max_depth = 1
        at_max_depth = "black"
        direct_light = "lobe"
        [camera]
        eye = {eye}
        look_at = {middle}
        up = [0, 0, 1]
        view_plane_distance = 1
        pixel_size = {pixel}
        resolution = [16, 16]
        [environment]
        type = "constant"
        radiance = [1, 1, 1]
        [materials.m]
        {material}
        [[shapes]]
        type = "obj"
        file = "{file}"
        material = "m"
        "#,
        eye = place.point(0.0, 1.0, 0.0),
        middle = place.point(0.0, 0.0, 0.0),
        pixel = width / 16.0,
        file = file.display(),
    )
}

const GLOSSY: &str = "type = \"cosine-power\"\nkr = 0.5\nexponent = 10";
const DIFFUSE: &str = "type = \"diffuse\"\nkd = 0.5";

fn triangle() -> MeshSource {
    let corners = [[-0.5, 0.0, -0.5], [0.0, 0.0, 1.0], [0.5, 0.0, -0.5]];
    MeshSource {
        positions: corners.map(DVec3::from).to_vec(),
        indices: vec![[0, 1, 2]],
        ..MeshSource::default()
    }
}

#[test]
fn a_world_of_one_triangle_of_area_1e_30_is_seen() {
    let folder = tempfile::tempdir().expect("a folder");
    // The unit triangle has the area 0.75.
    let tiny = Place { scale: (1e-30f64 / 0.75).sqrt(), offset: 0.0 };
    for backend in backends() {
        for material in [GLOSSY, DIFFUSE] {
            let half = |place: Place| {
                let file = place.obj(&triangle(), folder.path(), "triangle");
                let film = picture_on(
                    &scene(&plate(&file, place, 0.5, material)),
                    backend,
                    &RenderOptions::default(),
                )
                .film;
                extremes(&film)
            };
            for (least, most) in [half(Place::UNIT), half(tiny)] {
                assert!(
                    (least - 0.5).abs() < 2e-6 && (most - 0.5).abs() < 2e-6,
                    "{least} {most} on {backend:?}"
                );
            }
        }
    }
}

#[test]
fn triangles_of_area_1e_30_in_a_larger_world_do_no_harm() {
    let folder = tempfile::tempdir().expect("a folder");
    // At the middle, where an f32 tells their corners apart, and at the side, where it does not.
    let mut mesh = triangle();
    for middle in [DVec3::ZERO, DVec3::new(0.1, 0.0, 0.1)] {
        for i in 0..20 {
            let at = middle + DVec3::new(f64::from(i) * 1e-3, 1e-3, 0.0);
            let first = mesh.positions.len() as u32;
            mesh.positions.extend([at, at + 1.4e-15 * DVec3::Z, at + 1.4e-15 * DVec3::X]);
            mesh.indices.push([first, first + 1, first + 2]);
        }
    }
    let file = Place::UNIT.obj(&mesh, folder.path(), "dust");
    for backend in backends() {
        for material in [GLOSSY, DIFFUSE] {
            let film = picture_on(
                &scene(&plate(&file, Place::UNIT, 0.5, material)),
                backend,
                &RenderOptions::default(),
            )
            .film;
            let (least, most) = extremes(&film);
            assert!((least - 0.5).abs() < 2e-6 && (most - 0.5).abs() < 2e-6, "{least} {most} on {backend:?}");
        }
    }
}

/// A strip of the given width and of length 2 about the origin, cut across into slivers of aspect 1e6.
fn slivers(count: u32) -> MeshSource {
    let width = 2e-6;
    let x = |i: u32| (f64::from(i) - 0.5 * f64::from(count)) * width;
    let positions =
        (0..=count).flat_map(|i| [DVec3::new(x(i), 0.0, -1.0), DVec3::new(x(i), 0.0, 1.0)]).collect();
    let indices =
        (0..count).flat_map(|i| [[2 * i, 2 * i + 1, 2 * i + 3], [2 * i, 2 * i + 3, 2 * i + 2]]).collect();
    MeshSource { positions, indices, ..MeshSource::default() }
}

#[test]
fn slivers_of_aspect_1e6_are_as_even_as_a_plate() {
    let folder = tempfile::tempdir().expect("a folder");
    for place in Place::ALL {
        let file = place.obj(&slivers(500), folder.path(), "slivers");
        for backend in backends() {
            for material in [GLOSSY, DIFFUSE] {
                // From above, and at 89 degrees along and across the slivers.
                for eye in [[0.0, 1.0, 0.0], [0.0, 0.0175, 1.0], [1.0, 0.0175, 0.0]] {
                    if eye[0] == 1.0 && backend == Backend::Embree {
                        // Embree 3.13.5 lets rays through between slivers that it sees so, in its robust mode too.
                        continue;
                    }
                    let text = plate(&file, place, 1e-5, material)
                        .replace(&place.point(0.0, 1.0, 0.0), &place.point(eye[0], eye[1], eye[2]))
                        .replace("up = [0, 0, 1]", "up = [0.3, 1, 0.2]");
                    let (least, most) =
                        extremes(&picture_on(&scene(&text), backend, &RenderOptions::default()).film);
                    assert!(
                        (least - 0.5).abs() < 2e-6 && (most - 0.5).abs() < 2e-6,
                        "{least} to {most} from {eye:?} at {place:?} on {backend:?}, {material}"
                    );
                }
            }
        }
    }
}
