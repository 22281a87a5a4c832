//! Surfaces do not hide from themselves, and closed rooms are dark.

use super::common::{picture_on, scene, scene_with};
use super::{Place, backends, extremes, smooth_and_flat};
use gloss::accel::{self, BuildOptions, Coherence};
use gloss::core::{Ray, Sampler, SamplerKind, warp};
use gloss::geometry::generate::Generator;
use gloss::render::RenderOptions;
use gloss::scene::SelfHit;

/// A thing under a point light from the side, so that half of it is beyond the terminator.
fn lit_thing(place: Place, shape: &str, shadows: bool) -> String {
    format!(
        r#"
        [settings]
        spp = 4
        max_depth = 0
        at_max_depth = "black"
        [camera]
        eye = {eye}
        look_at = {middle}
        fov_deg = 30
        resolution = [32, 32]
        [materials.m]
        type = "cosine-power"
        kr = 0.5
        exponent = 10
        kd = 0.5
        [[shapes]]
        material = "m"
        {shape}
        [[lights]]
        type = "point"
        position = {light}
        intensity = 3
        falloff = "none"
        shadows = {shadows}
        "#,
        eye = place.point(1.0, 2.0, 4.0),
        middle = place.point(0.0, 0.0, 0.0),
        light = place.point(6.0, 1.0, -2.0),
    )
}

#[test]
fn no_convex_thing_of_any_size_and_place_casts_a_shadow_on_itself() {
    let folder = tempfile::tempdir().expect("a folder");
    let [smooth, flat] = smooth_and_flat(Generator::Sphere, 400);
    for place in Place::ALL {
        let file = |mesh, name| {
            format!("type = \"obj\"\nfile = \"{}\"", place.obj(mesh, folder.path(), name).display())
        };
        let ball = format!(
            "type = \"sphere\"\ncenter = {}\nradius = {}",
            place.point(0.0, 0.0, 0.0),
            place.length(1.0)
        );
        for shape in [file(&flat, "flat"), file(&smooth, "smooth"), ball] {
            for self_hit in ["primitive", "offset"] {
                for backend in backends() {
                    let film = |shadows| {
                        let text = lit_thing(place, &shape, shadows);
                        let scene = scene_with(&text, &[("settings.self_hit", self_hit)]);
                        picture_on(&scene, backend, &RenderOptions::default()).film
                    };
                    let (with, without) = (film(true), film(false));
                    let dark = with.pixels.iter().zip(&without.pixels).filter(|(a, b)| a != b).count();
                    assert_eq!(dark, 0, "{shape} with {self_hit} on {backend:?}");
                    assert!(extremes(&with).1 > 0.1, "it is lit");
                }
            }
        }
    }
}

#[test]
fn a_concave_mesh_is_shaded_alike_by_the_offset_alone() {
    // A speckle would be a triangle that hides itself, which the skip rule forbids and the offset must prevent.
    let folder = tempfile::tempdir().expect("a folder");
    for mesh in smooth_and_flat(Generator::Knot, 4000) {
        for place in Place::ALL {
            let file = place.obj(&mesh, folder.path(), "knot");
            let shape = format!("type = \"obj\"\nfile = \"{}\"", file.display());
            let text = lit_thing(place, &shape, true);
            for backend in backends() {
                let film = |self_hit| {
                    let scene = scene_with(&text, &[("settings.self_hit", self_hit)]);
                    picture_on(&scene, backend, &RenderOptions::default()).film
                };
                let (primitive, offset) = (film("primitive"), film("offset"));
                let differ = primitive.pixels.iter().zip(&offset.pixels).filter(|(a, b)| a != b).count();
                assert_eq!(differ, 0, "{place:?} on {backend:?}");
            }
        }
    }
}

#[test]
fn rays_do_not_come_back_to_the_thin_facets_that_the_offset_alone_keeps_them_from() {
    // A pillar and a ball on it; the facets are 78 times as long as they are wide, which f32 does not know well.
    let scene = scene(
        r#"
        [[shapes]]
        type = "cylinder"
        base = [-6, -100, 0]
        top = [-6, 15, 0]
        radius = 30
        [[shapes]]
        type = "sphere"
        center = [-6, 55, 0]
        radius = 40
        "#,
    );
    let sampler = Sampler::new(SamplerKind::Independent, 5, 0, 0);
    let towards_pillar = |i: u32| {
        let origin = warp::uniform_sphere(sampler.pair(i, 0));
        let target = 0.4 * warp::uniform_sphere(sampler.pair(i, 1));
        Ray::new(origin, (target - origin).normalize())
    };
    for backend in backends() {
        let accel = accel::build(backend, &scene.shapes, &BuildOptions::default()).expect("it can be built");
        let rays: Vec<_> = (0..1_000_000).map(towards_pillar).collect();
        let mut hits = vec![None; rays.len()];
        accel.intersect(&rays, Coherence::Incoherent, &mut hits);
        let mut leaving = vec![];
        for (i, (ray, hit)) in (0..).zip(rays.iter().zip(&hits)) {
            let Some(point) = hit.as_ref().map(|hit| scene.interaction(ray, hit)) else { continue };
            // Away from the ball, and from the pillar, which is convex.
            let wi = warp::uniform_sphere(sampler.pair(i, 2));
            if point.flat && wi.dot(point.at.ng) > 0.1 && wi.y < 0.0 {
                leaving.push(point.spawn_shadow(wi, f32::INFINITY, SelfHit::Offset));
            }
        }
        assert!(leaving.len() > 5000, "{}", leaving.len());
        let mut occluded = vec![false; leaving.len()];
        accel.occluded(&leaving, Coherence::Incoherent, &mut occluded);
        let back = occluded.iter().filter(|&&occluded| occluded).count();
        assert_eq!(back, 0, "of {} on {backend:?}", leaving.len());
    }
}

#[test]
fn no_light_leaks_into_a_closed_room() {
    let folder = tempfile::tempdir().expect("a folder");
    let [smooth, flat] = smooth_and_flat(Generator::Sphere, 200);
    for place in Place::ALL {
        let file = |mesh, name| {
            format!("type = \"obj\"\nfile = \"{}\"", place.obj(mesh, folder.path(), name).display())
        };
        let ball = format!(
            "type = \"sphere\"\ncenter = {}\nradius = {}",
            place.point(0.0, 0.0, 0.0),
            place.length(1.0)
        );
        let room = format!(
            "type = \"box\"\nmin = {}\nmax = {}",
            place.point(-1.0, -1.0, -1.0),
            place.point(1.0, 1.0, 1.0)
        );
        for shape in [file(&flat, "flat"), file(&smooth, "smooth"), ball, room] {
            for backend in backends() {
                let text = format!(
                    r#"
                    [settings]
                    spp = 2
                    max_depth = 20
                    at_max_depth = "black"
                    [camera]
                    eye = {eye}
                    look_at = {middle}
                    fov_deg = 90
                    resolution = [12, 12]
                    [environment]
                    type = "constant"
                    radiance = 1e8
                    [materials.m]
                    type = "cosine-power"
                    kr = 0.8
                    exponent = 3
                    kd = 0.2
                    [[shapes]]
                    material = "m"
                    {shape}
                    "#,
                    eye = place.point(0.3, 0.2, 0.1),
                    middle = place.point(0.0, 0.0, 0.0),
                );
                let (_, most) = extremes(&picture_on(&scene(&text), backend, &RenderOptions::default()).film);
                assert_eq!(most, 0.0, "{shape} on {backend:?}");
            }
        }
    }
}
