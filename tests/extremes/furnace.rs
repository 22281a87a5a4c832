//! White furnaces: whatever is hit from wherever, a surface that reflects everything is as bright as the sky.

use super::common::{assert_mean, glossy_plate, picture_on, scene, scene_with};
use super::{Place, backends, extremes, smooth_and_flat};
use gloss::accel::{self, BuildOptions, Coherence};
use gloss::core::{Hit, Ray, Vec3};
use gloss::geometry::generate::Generator;
use gloss::render::{RayClass, RenderOptions};
use gloss::scene::SelfHit;

const EXPONENTS: [f64; 9] = [0.0, 1e-3, 1.0, 1e2, 1e5, 1e7, 1e9, 1e13, f64::INFINITY];
const SKY: &str = "[environment]\ntype = \"constant\"\nradiance = [1, 1, 1]";

/// 90 degrees minus one f32 step: the cosine is 1.3e-7.
fn nearly_level() -> f64 {
    f64::from(90.0f32.next_down())
}

#[test]
fn a_plate_under_a_white_sky_is_white_for_every_exponent_at_every_incidence() {
    for degrees in [0.0, 45.0, 89.0, 89.99, nearly_level()] {
        for e in EXPONENTS {
            let text = glossy_plate(degrees, e, "fold", 4, SKY).replace("0.0001", "1e-7");
            for backend in backends() {
                let what = format!("e = {e} at {degrees} degrees on {backend:?}");
                let lobe = scene_with(&text, &[("settings.direct_light", "lobe")]);
                let outcome = picture_on(&lobe, backend, &RenderOptions::default());
                let (least, most) = extremes(&outcome.film);
                assert!((least - 1.0).abs() < 2e-6 && (most - 1.0).abs() < 2e-6, "{what}: {least}, {most}");
                // Nearly level, some directions round to the other side of the horizon.
                let hits = outcome.tally.class(RayClass::Glossy).rays;
                let expected = if degrees < 89.999 { 1024..=1024 } else { 512..=1024 };
                assert!(expected.contains(&hits), "{what}: {hits} rays hit the plate");
                // With light sampling beside it the mean has noise.
                assert_mean(&picture_on(&scene(&text), backend, &RenderOptions::default()).film, 1.0, &what);
            }
        }
    }
}

#[test]
fn other_policies_lose_light_and_nothing_else() {
    for horizon in ["fold-weighted", "clip", "reject", "modified-phong"] {
        for degrees in [0.0, 45.0, 89.0, 89.99, nearly_level()] {
            for e in EXPONENTS {
                let text = glossy_plate(degrees, e, horizon, 4, SKY).replace("0.0001", "1e-7");
                let lobe = scene_with(&text, &[("settings.direct_light", "lobe")]);
                let film = picture_on(&lobe, backends()[0], &RenderOptions::default()).film;
                let (least, most) = extremes(&film);
                // A modified Phong sample may weigh (e + 2) / (e + 1), at most 2.
                let bound = if horizon == "modified-phong" { 2.0 } else { 1.0 };
                let what = format!("{horizon} e = {e} at {degrees} degrees");
                assert!(least >= 0.0 && most < bound + 1e-5, "{what}: {least}, {most}");
                picture_on(&scene(&text), backends()[0], &RenderOptions::default());
            }
        }
    }
}

#[test]
fn the_ends_of_the_random_numbers_give_directions_that_leave_the_plate() {
    const LAST: f32 = 1.0 - 1.0 / (1 << 24) as f32;
    const FIRST: f32 = 1.0 / (1 << 24) as f32;
    for horizon in ["fold", "fold-weighted", "clip", "reject", "modified-phong"] {
        for e in EXPONENTS {
            let scene = scene(&glossy_plate(0.0, e, horizon, 1, ""));
            let accels = backends()
                .into_iter()
                .map(|b| accel::build(b, &scene.shapes, &BuildOptions::default()).expect("two triangles"))
                .collect::<Vec<_>>();
            for cos in [1.0f32, 0.5f32.sqrt(), 0.017, 1.7e-4, 1.3e-7, f32::EPSILON / 64.0, 0.0] {
                let wo = Vec3::new((1.0 - cos * cos).sqrt(), cos, 0.0);
                let hit = Hit { t: 1.0, u: 0.25, v: 0.25, geom_id: 0, prim_id: 0 };
                let point = scene.interaction(&Ray::new(wo, -wo), &hit);
                let bsdf = scene.materials[scene.geometries[0].material as usize].bsdf(point.p);
                for u in [0.0, FIRST, 0.5, LAST] {
                    for v in [0.0, FIRST, 0.25, LAST] {
                        let what = format!("{horizon} e = {e} cos = {cos} u = ({u}, {v})");
                        let Some(sample) = bsdf.lobe(0).sample(&point.at, [u, v]) else { continue };
                        assert!(
                            sample.weight.is_finite() && sample.weight.to_array().iter().all(|w| *w >= 0.0)
                        );
                        assert!(!sample.pdf.is_nan(), "{what}");
                        assert!((sample.wi.length() - 1.0).abs() < 1e-6, "{what}: {}", sample.wi);
                        assert!(sample.wi.dot(point.at.ng) >= 0.0, "{what}: {}", sample.wi);
                        for self_hit in [SelfHit::Geometry, SelfHit::Primitive, SelfHit::Offset] {
                            let ray = point.spawn(sample.wi, f32::INFINITY, self_hit);
                            for accel in &accels {
                                let mut hits = [None];
                                accel.intersect(&[ray], Coherence::Incoherent, &mut hits);
                                assert_eq!(hits, [None], "{what} {self_hit:?}");
                            }
                        }
                    }
                }
            }
        }
    }
}

/// A convex thing of a material that reflects everything, at most once.
fn white_thing(place: Place, shape: &str, material: &str) -> String {
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
        fov_deg = 26
        resolution = [24, 24]
        {SKY}
        [materials.white]
        {material}
        [[shapes]]
        material = "white"
        {shape}
        "#,
        eye = place.point(1.0, 2.0, 4.0),
        middle = place.point(0.0, 0.0, 0.0),
    )
}

#[test]
fn convex_things_of_any_size_and_place_show_no_speckle() {
    let folder = tempfile::tempdir().expect("a folder");
    let [smooth, flat] = smooth_and_flat(Generator::Sphere, 400);
    let diffuse = "type = \"diffuse\"\nkd = 1";
    let glossy = |e: &str| format!("type = \"cosine-power\"\nkr = 1\nexponent = {e}");
    for place in Place::ALL {
        let file = |mesh, name| {
            format!("type = \"obj\"\nfile = \"{}\"", place.obj(mesh, folder.path(), name).display())
        };
        let (flat, smooth) = (file(&flat, "flat"), file(&smooth, "smooth"));
        let round = format!(
            "type = \"sphere\"\ncenter = {}\nradius = {}",
            place.point(0.0, 0.0, 0.0),
            place.length(1.0)
        );
        let thin = format!(
            "type = \"box\"\nmin = {}\nmax = {}",
            place.point(-1.0, -1e-5, -1.0),
            place.point(1.0, 1e-5, 1.0)
        );
        // Smooth normals let a diffuse surface see below its triangle: only the glossy lobe is bent upwards.
        for (shape, diffuse_too) in [(&flat, true), (&round, true), (&thin, true), (&smooth, false)] {
            let mut materials = ["0", "1", "1e5", "\"inf\""].map(glossy).to_vec();
            materials.extend(diffuse_too.then(|| diffuse.to_owned()));
            for material in materials {
                for self_hit in ["primitive", "offset"] {
                    let text = white_thing(place, shape, &material);
                    let scene = scene_with(&text, &[("settings.self_hit", self_hit)]);
                    for backend in backends() {
                        let (least, most) =
                            extremes(&picture_on(&scene, backend, &RenderOptions::default()).film);
                        assert!(
                            (least - 1.0).abs() < 3e-6 && (most - 1.0).abs() < 3e-6,
                            "{least} to {most} with {self_hit} on {backend:?}\n{text}"
                        );
                    }
                }
            }
        }
    }
}
