//! Surfaces that are shaded side by side against the same ones by themselves.

use crate::accel::bvh::Bvh;
use crate::film::{Film, PixelRect};
use crate::guiding::{GuideMap, Guides};
use crate::integrator::{Integrator, Scratch, Tally, Work, z_order};
use crate::scene::load::{Format, load_str};
use crate::scene::{Plan, Scene};
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// A room with a lamp, a light that makes a bright spot on the ceiling, and a slit through which the sky is seen: walls, one of them checkered, and a ball that are diffuse, a
/// patch that glows, a ball of rough gold, one of plastic, balls that are glossy, and diffuse with a gloss, of every kind that
/// rays are drawn for once, and a silver wall that throws the lamp's light on others.
const ROOM: &str = r#"
    [camera]
    eye = [0, 0, 0.9]
    look_at = [0, 0, -1]
    resolution = [32, 32]
    fov_deg = 90
    [environment]
    type = "constant"
    radiance = [0.2, 0.3, 0.4]
    [materials.grey]
    type = "diffuse"
    cd = [0.9, 0.8, 0.7]
    [materials.red]
    type = "diffuse"
    cd = { checker = [[0.7, 0.1, 0], [0.9, 0.8, 0.7]], size = 0.3 }
    [materials.glowing]
    type = "emissive"
    radiance = [0.1, 0.1, 0.3]
    [materials.silver]
    type = "conductor"
    alpha = 0.02
    [materials.gold]
    type = "conductor"
    metal = "gold"
    alpha = 0.3
    [materials.toy]
    type = "plastic"
    cd = [0.1, 0.3, 0.6]
    alpha = 0.2
    [materials.glossy]
    type = "cosine-power"
    kr = 0.8
    cr = [1, 0.9, 0.5]
    exponent = 30
    [materials.varnished]
    type = "cosine-power"
    ka = 0.2
    kr = 0.3
    exponent = 200
    kd = 0.6
    cd = [0.4, 0.7, 0.3]
    horizon = "fold-weighted"
    [materials.tiles]
    type = "cosine-power"
    kr = 0.5
    exponent = 8
    kd = 0.5
    cd = { checker = [[0, 0, 0], [0.9, 0.8, 0.7]], size = 0.1 }
    horizon = "modified-phong"
    [materials.clipped]
    type = "cosine-power"
    kr = 0.9
    exponent = 3
    horizon = "clip"
    [[shapes]]
    type = "sphere"
    center = [-0.7, -0.8, 0.1]
    radius = 0.2
    material = "glossy"
    [[shapes]]
    type = "sphere"
    center = [-0.3, -0.85, 0.15]
    radius = 0.15
    material = "varnished"
    [[shapes]]
    type = "sphere"
    center = [0.6, -0.8, 0.1]
    radius = 0.2
    material = "tiles"
    [[shapes]]
    type = "sphere"
    center = [0.8, -0.2, -0.6]
    radius = 0.15
    material = "clipped"
    [[shapes]]
    type = "rect"
    corner = [-1, -1, 1]
    u = [2, 0, 0]
    v = [0, 0, -2]
    material = "grey"
    [[shapes]]
    type = "rect"
    corner = [-1, -1, -1]
    u = [2, 0, 0]
    v = [0, 2, 0]
    material = "red"
    [[shapes]]
    type = "rect"
    corner = [-1, -1, -1]
    u = [0, 2, 0]
    v = [0, 0, 2]
    material = "silver"
    [[shapes]]
    type = "rect"
    corner = [1, -1, 1]
    u = [0, 1.7, 0]
    v = [0, 0, -2]
    material = "grey"
    [[shapes]]
    type = "rect"
    corner = [-1, 1, -1]
    u = [2, 0, 0]
    v = [0, 0, 2]
    material = "grey"
    [[shapes]]
    type = "rect"
    corner = [-1, -1, 1]
    u = [0, 2, 0]
    v = [2, 0, 0]
    material = "grey"
    [[shapes]]
    type = "rect"
    corner = [0.5, -0.5, -0.9]
    u = [0.3, 0, 0]
    v = [0, 0.3, 0]
    material = "glowing"
    [[shapes]]
    type = "sphere"
    center = [0.4, -0.6, -0.4]
    radius = 0.3
    material = "grey"
    [[shapes]]
    type = "sphere"
    center = [-0.3, -0.7, -0.5]
    radius = 0.3
    material = "gold"
    [[shapes]]
    type = "sphere"
    center = [0.1, -0.8, 0.1]
    radius = 0.2
    material = "toy"
    [[lights]]
    type = "sphere"
    center = [0.2, 0.7, -0.2]
    radius = 0.1
    radiance = [20, 20, 20]
    [[lights]]
    type = "point"
    position = [-0.3, 0.5, 0.5]
    intensity = [0.3, 0.2, 0.1]
    [[lights]]
    type = "point"
    position = [0.7, 0.97, 0.7]
    intensity = [5, 5, 5]
"#;

fn room(settings: &str) -> Scene {
    let text = format!("ambient = 0.3\n[settings]\nspp = 4\n{settings}\n{ROOM}");
    load_str(&text, Format::Toml, Path::new(""), &[]).expect("the room loads")
}

/// The picture of a scene with so many rays at first hits; whether surfaces are shaded side by side, where they are alike, and
/// whether rays are guided.
fn film(
    scene: &Scene,
    (accel, guides, portals): (&Bvh, &Guides, &GuideMap),
    split: u32,
    alike: bool,
    guided: bool,
) -> (Film, Tally) {
    let integrator = Integrator::new(scene, accel);
    let mut integrator = if guided {
        integrator.guided_by(guides).guided_to_indirect(true).through(portals)
    } else {
        integrator
    };
    assert!(integrator.alike, "side by side where nothing is said");
    integrator.alike = alike;
    let rect = PixelRect { x0: 0, y0: 0, x1: 32, y1: 32 };
    let (mut film, mut tally) = (Film::new([32, 32], rect), Tally::default());
    let work = Work { pixels: &z_order(rect), samples: 0..4, split };
    integrator.render(&mut film, &work, &mut Scratch::default(), &mut tally, &AtomicBool::new(false));
    (film, tally)
}

#[test]
fn surfaces_side_by_side_reflect_to_the_bit_what_each_reflects_alone() {
    for settings in [
        "max_depth = 3\nat_max_depth = \"black\"",
        "max_depth = 3\nat_max_depth = \"background\"\nself_hit = \"offset\"\nclamp_indirect = 0.2",
        "max_depth = 2\nat_max_depth = \"roulette\"\nself_hit = \"geometry\"",
        "max_depth = 4\nglossy_samples = 2",
        "max_depth = 3\nhighlights = false\nglossy_samples = 3",
        "max_depth = 3\ndiffuse_bounces = false",
        "max_depth = 3\nlight_samples = \"split\"",
        "max_depth = 3\nlight_samples = \"split\"\nglossy_samples = { any = 2 }",
        "max_depth = 3\nlight_samples = \"split\"\nglossy_samples = [2, 3]",
        "max_depth = 3\nlight_candidates = 4",
        "max_depth = 3\nat_max_depth = \"black\"\nlight_candidates = 2\nlight_samples = \"split\"\nglossy_samples = { any = 2 }",
        "max_depth = 3\nlight_candidates = 3\nclamp_indirect = 0.2\nself_hit = \"offset\"",
        "preset = \"suffern\"",
        "max_depth = 20\nroulette_from = 0\nat_max_depth = \"black\"\nsampler = \"independent\"",
    ] {
        let scene = room(settings);
        let accel = Bvh::new(&scene.shapes, &Default::default()).expect("the room is built");
        let (guides, portals) = (Guides::of(&scene, &accel), GuideMap::to_portals(&scene, &accel));
        let plan = Plan::of(&scene);
        assert_eq!(guides.is_empty(), !plan.guides, "the mirror makes a caustic");
        assert_eq!(guides.has_indirect(), plan.guides_indirect, "there is a bright spot");
        assert_eq!(portals.is_empty(), !plan.portals, "little of the sky is seen");
        for (split, guided) in [(1, false), (1, true), (3, false), (3, true)] {
            let [(together, counted), (alone, counted_alone)] =
                [true, false].map(|alike| film(&scene, (&accel, &guides, &portals), split, alike, guided));
            assert!(together == alone, "{settings}, split in {split}, guided: {guided}");
            let rays = |tally: &Tally| tally.all_rays().rays;
            assert_eq!(rays(&counted), rays(&counted_alone));
            assert_eq!(counted.lost_throughput(), counted_alone.lost_throughput());
        }
    }
}
