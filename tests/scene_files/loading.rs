//! What becomes of each kind of thing in a file.

use super::{read, scene, with};
use glam::Vec3;
use gloss::bxdf::LobeKind;
use gloss::core::Rgb;
use gloss::geometry::Shape;
use gloss::scene::{Environment, Format, Light, Plan, Specular, Texture, load_str};
use std::path::Path;

#[test]
fn an_empty_scene_is_legal_and_black() {
    let scene = scene("");
    assert!(scene.shapes.is_empty() && scene.lights.is_empty() && scene.warnings.is_empty());
    let plan = Plan::of(&scene);
    assert!(!plan.bounces && !plan.shadow_rays && !plan.needs_skip && !plan.samples_lights);
}

#[test]
fn an_infinite_exponent_is_a_mirror_in_each_spelling() {
    let specular = |exponent: &str| {
        let text = format!("[materials.m]\ntype = \"cosine-power\"\nkr = 0.5\nexponent = {exponent}");
        scene(&text).materials[0].specular
    };
    let mirror = scene("[materials.m]\ntype = \"mirror\"\nkr = 0.5").materials[0].specular;
    for exponent in ["inf", "\"inf\"", "1e14"] {
        assert_eq!(specular(exponent), mirror);
    }
    for exponent in ["0", "0.5", "1e13"] {
        assert!(matches!(specular(exponent), Specular::CosinePower { .. }), "{exponent}");
    }
    let json = r#"{ "materials": { "m": { "type": "cosine-power", "kr": 0.5, "exponent": "inf" } } }"#;
    let json = load_str(json, Format::Json, Path::new(""), &[]).unwrap();
    assert_eq!(json.materials[0].specular, mirror);
}

#[test]
fn factors_and_colours_multiply_and_black_parts_are_left_out() {
    let scene = scene(
        r#"
        [materials.a]
        type = "diffuse"
        kd = 0.5
        cd = [1, 0.5, 0]
        ka = 0.25
        [materials.b]
        type = "mirror"
        kr = 0
        "#,
    );
    assert_eq!(scene.materials[0].diffuse, Some(Texture::Constant(Rgb::new(0.5, 0.25, 0.0))));
    assert_eq!(scene.materials[0].ambient, Some(Texture::Constant(Rgb::new(0.25, 0.125, 0.0))));
    assert_eq!((scene.materials[1].diffuse, scene.materials[1].specular), (None, Specular::None));
}

#[test]
fn reflecting_more_than_arrives_is_a_warning() {
    let warnings = |kd: f64| {
        scene(&format!("[materials.m]\ntype = \"cosine-power\"\nkr = 0.5\nexponent = 1\nkd = {kd}")).warnings
    };
    assert!(warnings(0.5).is_empty());
    assert!(warnings(0.6)[0].contains("up to 1.100 times"), "{:?}", warnings(0.6));
}

#[test]
fn the_colour_of_a_plastic_is_what_it_says() {
    let base = |keys: &str| {
        let plastic = scene(&format!("[materials.m]\ntype = \"plastic\"\n{keys}")).materials[0].specular;
        let Specular::Plastic { base: Texture::Constant(base), .. } = plastic else { panic!("{plastic:?}") };
        base.to_array()
    };
    assert_eq!(base("cd = [0.8, 0.4, 0.2]"), [0.8, 0.4, 0.2]);
    assert_eq!(base("kd = 0.5\ncd = [0.8, 0.4, 0.2]"), [0.4, 0.2, 0.1]);
    assert_eq!(base("kd = 0.8"), [0.8; 3]);
    assert_eq!(base(""), [0.5; 3]);
}

#[test]
fn a_diffuse_colour_that_nothing_shows_is_a_warning() {
    let warnings = |material: &str| scene(&format!("[materials.m]\n{material}")).warnings;
    for material in ["type = \"cosine-power\"\nexponent = 100", "type = \"mirror\""] {
        let forgotten = warnings(&format!("{material}\nkr = 0.5\ncd = 0.3"));
        assert!(matches!(&forgotten[..], [w] if w.contains("give `kd`")), "{material}: {forgotten:?}");
        for keys in ["kd = 0", "kd = 0.5", "ka = 0.5"] {
            let meant = warnings(&format!("{material}\nkr = 0.5\ncd = 0.3\n{keys}"));
            assert!(meant.is_empty(), "{material}, {keys}: {meant:?}");
        }
        assert!(warnings(material).is_empty());
    }
}

#[test]
fn every_kind_of_material_makes_its_lobe() {
    for (text, kind) in [
        ("type = \"diffuse\"", LobeKind::Diffuse),
        ("type = \"mirror\"", LobeKind::Delta),
        ("type = \"cosine-power\"\nexponent = 10", LobeKind::Glossy),
        ("type = \"conductor\"\nmetal = \"copper\"", LobeKind::Glossy),
        ("type = \"conductor\"\nexponent = inf", LobeKind::Delta),
        ("type = \"conductor\"\neta = [0.2, 0.9, 1.1]\nk = [3.9, 2.4, 2.1]\nalpha = 0", LobeKind::Delta),
        ("type = \"plastic\"", LobeKind::Glossy),
    ] {
        let scene = scene(&format!("[materials.m]\n{text}"));
        let kinds: Vec<_> = scene.materials[0].bsdf(Vec3::ZERO).lobes().iter().map(|l| l.kind()).collect();
        assert_eq!(kinds, [kind], "{text}");
    }
    // Glass has a lobe for each way.
    let glass = scene("[materials.m]\ntype = \"dielectric\"").materials[0].bsdf(Vec3::ZERO);
    assert!(glass.lobes().len() == 2 && glass.lobes().iter().all(|lobe| lobe.kind() == LobeKind::Delta));
    // The cosine power e is about as wide as the roughness 1 / sqrt(2 e).
    let plastic = scene("[materials.m]\ntype = \"plastic\"\nexponent = 50").materials[0].specular;
    let Specular::Plastic { coat, .. } = plastic else { panic!("{plastic:?}") };
    assert!((coat.alpha() - 0.1).abs() < 1e-7 && coat.eta() == 1.5, "{coat:?}");
}

#[test]
fn transforms_apply_in_their_order() {
    let corner = |steps: &str| {
        let scene = scene(&format!(
            r#"
            shapes = [
                {{ type = "sphere", spheres = [[0, 0, 0, 1], [16, 16, 16, 1], [-16, -16, -16, 1]] }},
                {{ type = "sphere", radius = 0.5, center = [1, 0, 0], transform = [{steps}] }},
            ]"#
        ));
        let Shape::Spheres(spheres) = &scene.shapes[1] else { panic!("a sphere") };
        (scene.world.to_scene(spheres[0].center), scene.world.length_to_scene(spheres[0].radius))
    };
    let turn = "{ rotate = { axis = [0, 0, 2], deg = 90 } }";
    for (steps, place, radius) in [
        (String::new(), [1.0, 0.0, 0.0], 0.5),
        (format!("{{ translate = [2, 0, 0] }}, {turn}"), [0.0, 3.0, 0.0], 0.5),
        (format!("{turn}, {{ translate = [2, 0, 0] }}"), [2.0, 1.0, 0.0], 0.5),
        ("{ scale = 3 }, { translate = [0, 0, 1] }".into(), [3.0, 0.0, 1.0], 1.5),
        ("{ scale = [-2, 2, 2] }".into(), [-2.0, 0.0, 0.0], 1.0),
        ("{ matrix = [0,-1,0,5, 1,0,0,6, 0,0,1,7, 0,0,0,1] }".into(), [5.0, 7.0, 7.0], 0.5),
    ] {
        let (center, r) = corner(&steps);
        assert!((center - glam::DVec3::from(place)).length() < 1e-5, "{steps}: {center}");
        assert!((r - radius).abs() < 1e-6, "{steps}: {r}");
    }
}

#[test]
fn emitting_shapes_are_lights_of_their_kind_whichever_way_they_are_described() {
    let scene = scene(
        r#"
        [materials.lamp]
        type = "emissive"
        radiance = 2
        both_sides = true
        [[shapes]]
        type = "sphere"
        [[shapes]]
        type = "sphere"
        spheres = [[3, 0, 0, 1], [6, 0, 0, 1]]
        material = "lamp"
        [[shapes]]
        type = "generated"
        kind = "knot"
        triangles = 100
        material = "lamp"
        [[lights]]
        type = "point"
        position = [0, 9, 0]
        intensity = 1
        [[lights]]
        type = "directional"
        direction = [0, -1, 0]
        irradiance = 1
        [[lights]]
        type = "rect"
        corner = [0, 0, 5]
        u = [1, 0, 0]
        v = [0, 1, 0]
        radiance = [3, 2, 1]
        [[lights]]
        type = "disk"
        center = [0, 5, 0]
        normal = [0, -1, 0]
        radius = 1
        radiance = 1
        [[lights]]
        type = "sphere"
        center = [0, -5, 0]
        radius = 1
        radiance = 1
        "#,
    );
    let of_shapes: Vec<_> = scene.geometries.iter().map(|g| g.light).collect();
    assert_eq!(of_shapes, [None, Some(2), Some(3), Some(4), Some(5), Some(6), Some(7)]);
    let kinds: Vec<_> = (scene.lights.lights.iter())
        .map(|light| match light {
            Light::Point(_) => "point",
            Light::Directional(_) => "directional",
            Light::Sphere(_) => "sphere",
            Light::Rectangle(_) => "rect",
            Light::Mesh(_) => "mesh",
        })
        .collect();
    assert_eq!(kinds, ["point", "directional", "sphere", "sphere", "mesh", "rect", "mesh", "sphere"]);
    let material = |i: usize| &scene.materials[scene.geometries[i].material as usize];
    assert_eq!((material(1).emission, material(1).emits_both_sides), (Some(Rgb::grey(2.0)), true));
    assert_eq!(material(4).emission, Some(Rgb::new(3.0, 2.0, 1.0)));
    assert!(!material(4).emits_both_sides && scene.geometries[4].name == "light 2");
}

#[test]
fn mtl_materials_come_with_their_mesh_and_give_way_to_the_scenes() {
    let dir = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(dir.path().join(name), text).unwrap();
    write("m.mtl", "newmtl a\nKd 0.5 0.25 0\nKs 0.25 0.25 0.25\nNs 20\nnewmtl b\nKe 1 2 3\n");
    write(
        "m.obj",
        "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nusemtl a\nf 1 2 3\nf 1 1 2\nusemtl b\nf 1 3 4\n",
    );
    let load = |more: &str| {
        let text = format!(
            "[materials.own]\ntype = \"mirror\"\n[[shapes]]\ntype = \"obj\"\nfile = \"m.obj\"\n{more}"
        );
        load_str(&text, Format::Toml, dir.path(), &[]).unwrap()
    };
    let scene = load("");
    let material = |i: usize| &scene.materials[scene.geometries[i].material as usize];
    assert_eq!(material(0).diffuse, Some(Texture::Constant(Rgb::new(0.5, 0.25, 0.0))));
    assert!(matches!(material(0).specular, Specular::CosinePower { exponent: 20.0, .. }));
    assert_eq!(material(1).emission, Some(Rgb::new(1.0, 2.0, 3.0)));
    assert_eq!((scene.geometries[0].light, scene.geometries[1].light), (None, Some(0)));
    assert!(scene.warnings.iter().any(|w| w.contains("1 triangles of")), "{:?}", scene.warnings);

    let own = load("material = \"own\"");
    assert!(own.geometries.iter().all(|g| own.materials[g.material as usize].name == "own"));

    // A file's content counts for the hash.
    let before = scene.hash;
    write("m.mtl", "newmtl a\nKd 0.5 0.25 0.1\n");
    assert_ne!(load("").hash, before);
}

#[test]
fn environment_pictures_are_read_from_exr_and_hdr() {
    let dir = tempfile::tempdir().unwrap();
    let (width, height) = (8usize, 4usize);
    // The upper half is bright: 2, 1, 0.5 are exact in RGBE too.
    let pixel = |y: usize| if y < 2 { [2.0f32, 1.0, 0.5] } else { [0.25f32; 3] };
    exr::prelude::write_rgb_file(dir.path().join("sky.exr"), width, height, |_, y| {
        let [r, g, b] = pixel(y);
        (r, g, b)
    })
    .unwrap();
    let file = std::fs::File::create(dir.path().join("sky.hdr")).unwrap();
    let pixels: Vec<_> = (0..width * height).map(|i| image::Rgb(pixel(i / width))).collect();
    image::codecs::hdr::HdrEncoder::new(file).encode(&pixels, width, height).unwrap();
    for name in ["sky.exr", "sky.hdr"] {
        let text = format!("[environment]\ntype = \"image\"\nfile = \"{name}\"\nscale = 2");
        let scene = load_str(&text, Format::Toml, dir.path(), &[]).unwrap();
        let environment = scene.lights.environment.expect("there is one");
        for (wi, expected) in [(Vec3::Y, [4.0, 2.0, 1.0]), (Vec3::NEG_Y, [0.5; 3])] {
            let le = environment.le(wi);
            let error = (le - Rgb::from(expected)).map(f32::abs).max_channel();
            assert!(error < 0.02, "{name} {wi}: {le:?}");
        }
    }
}

#[test]
fn skies_and_studios_are_what_they_say() {
    let environment = |text: &str| scene(&format!("[environment]\n{text}")).lights.environment.unwrap();
    assert_eq!(environment("type = \"constant\"\nradiance = [1, 2, 3]").le(Vec3::X), Rgb::new(1.0, 2.0, 3.0));
    let sky = environment("type = \"gradient\"\nzenith = [0, 0, 4]\nhorizon = 1\nnadir = 0");
    assert_eq!(sky.le(Vec3::Y), Rgb::new(0.0, 0.0, 4.0));
    assert_eq!(sky.le(Vec3::X), Rgb::WHITE);
    assert_eq!(sky.le(Vec3::NEG_Y), Rgb::BLACK);
    let softbox = "{ direction = [0, 0, 1], width_deg = 60, height_deg = 20, radiance = 3 }";
    let studio = environment(&format!(
        "type = \"studio\"\nbackground = 0.5\nscale = 2\nrotate_deg = 90\nsoftboxes = [{softbox}]"
    ));
    let le = |x: f32, y: f32| studio.le(Vec3::new(1.0, y, x).normalize());
    assert_eq!((le(0.0, 0.0), le(0.5, 0.1)), (Rgb::grey(7.0), Rgb::grey(7.0)));
    assert_eq!((le(0.6, 0.0), le(0.0, 0.2)), (Rgb::grey(1.0), Rgb::grey(1.0)));
    let cove = environment("type = \"studio\"\nbackground = 1\nzenith = 3\nsoftboxes = []");
    assert_eq!([Vec3::X, Vec3::Y, Vec3::NEG_Y].map(|w| cove.le(w)), [1.0, 3.0, 1.0].map(Rgb::grey));
    assert!(matches!(environment("type = \"studio\""), Environment::Studio(_)));
}

#[test]
fn the_two_ways_to_give_a_field_of_view_agree() {
    let camera = |text: &str| scene(&format!("[camera]\nresolution = [300, 200]\n{text}")).camera;
    let fov_deg = 2.0 * (100.0f64 / 500.0).atan().to_degrees();
    let by_angle = camera(&format!("fov_deg = {fov_deg}"));
    let by_plane = camera("view_plane_distance = 1000\npixel_size = 4\nzoom = 2");
    let off = (by_angle.right - by_plane.right).length() + (by_angle.down - by_plane.down).length();
    assert!(off < 1e-9, "{off}");
    // The upper edge is half the angle above the middle.
    let up = by_plane.direction(150.0, 0.0).dot(by_plane.forward).acos().to_degrees();
    assert!((f64::from(up) - 0.5 * fov_deg).abs() < 1e-3, "{up}");
}

#[test]
fn the_plan_asks_for_no_more_than_the_scene_needs() {
    let plan = |text: &str| {
        Plan::of(&scene(&format!(
            "[materials.m]\ntype = \"mirror\"\n[materials.g]\ntype = \"cosine-power\"\nexponent = 9\n{text}"
        )))
    };
    let light = "[[lights]]\ntype = \"point\"\nposition = [0, 9, 0]\nintensity = 1\n";
    let shape = |material: &str| format!("[[shapes]]\ntype = \"sphere\"\nmaterial = \"{material}\"\n");

    let mirror = plan(&format!("{}{light}", shape("m")));
    assert!(mirror.has_delta && mirror.bounces && mirror.needs_skip);
    assert!(!mirror.shadow_rays && !mirror.samples_lights, "no light can be sampled into a mirror");
    let glossy = plan(&format!("{}{light}", shape("g")));
    assert!(glossy.has_glossy && glossy.samples_lights && glossy.shadow_rays);
    let dull = plan(&format!("{}{light}[settings]\nhighlights = false", shape("g")));
    assert!(!dull.samples_lights && !dull.shadow_rays);
    let shadowless = plan(&format!("{}{light}shadows = false", shape("g")));
    assert!(shadowless.samples_lights && !shadowless.shadow_rays);
    let primary = plan(&format!("{}[settings]\nmax_depth = 0\nat_max_depth = \"black\"", shape("g")));
    assert!(!primary.bounces && !primary.needs_skip);
    let offset = plan(&format!("{}{light}[settings]\nself_hit = \"offset\"", shape("g")));
    assert!(offset.shadow_rays && !offset.needs_skip);
    let sky = "[environment]\ntype = \"constant\"\nradiance = 1\n";
    assert!(!plan(&format!("{}{sky}", shape("g"))).environment_table);
    let studio = "[environment]\ntype = \"studio\"\n";
    assert!(plan(&format!("{}{studio}", shape("g"))).environment_table);
    assert!(!plan(&format!("{}{studio}", shape("m"))).environment_table);
    assert!(glossy.shares_out && glossy.splits_by_pilot);
    assert!(glossy.lines().iter().any(|line| line.contains("a pilot")));
    for setting in ["spp = 3", "adaptive = false", "sampler = \"regular\"", "preset = \"suffern\""] {
        assert!(!plan(&format!("{}[settings]\n{setting}", shape("g"))).shares_out, "{setting}");
    }
    assert!(!mirror.splits_by_pilot, "a mirror does not split");
    let any = plan(&format!("{}[settings]\nglossy_samples = {{ any = 3 }}", shape("g")));
    assert!(any.split == 3 && any.splits_any && !any.splits_by_pilot);
    // The lecture's tree: 9 + 81 + ... + 9^5 glossy rays.
    let tree = plan(&format!("{}[settings]\npreset = \"lecture\"", shape("g")));
    assert_eq!((tree.split, tree.glossy_rays_bound), (9, Some(66_429.0)));
}

#[test]
fn the_hash_follows_the_scene_and_not_its_spelling() {
    let base = "ambient = 1\n[settings]\nspp = 4\n[[shapes]]\ntype = \"sphere\"\nradius = 2\n";
    let hash = |text: &str| read(text).unwrap().hash;
    assert_eq!(hash(base).len(), 64);
    let respelt =
        "# comment\nambient = 1.0\nshapes = [{ radius = 2.0, type = \"sphere\" }]\n[settings]\nspp = 4";
    assert_eq!(hash(base), hash(respelt));
    let with = |change: &str| with(base, &[change]).unwrap().hash;
    assert_eq!(hash(base), with("settings.spp=400"));
    assert_eq!(hash(base), with("settings.preset=accurate"));
    for change in
        ["settings.seed=1", "settings.max_depth=3", "shapes.0.radius=3", "camera.zoom=2", "ambient=2"]
    {
        assert_ne!(hash(base), with(change), "{change}");
    }
}

#[test]
fn many_mesh_files_are_read_as_each_alone() {
    use gloss::geometry::{Generator, generate::generate, obj, ply};
    let directory = tempfile::tempdir().unwrap();
    let load = |text: &str| load_str(text, Format::Toml, directory.path(), &[]);
    let shape = |kind: &str, file: &str| format!("[[shapes]]\ntype = \"{kind}\"\nfile = \"{file}\"\n");
    obj::write(&directory.path().join("a.obj"), &generate(Generator::Knot, 900, 1)).unwrap();
    ply::write(&directory.path().join("b.ply"), &generate(Generator::Blob, 700, 2)).unwrap();
    let [a, b] = [shape("obj", "a.obj"), shape("ply", "b.ply")];

    let all = load(&[&*a, &b, &a].concat()).unwrap();
    let sizes: Vec<_> = all.shapes.iter().map(Shape::primitive_count).collect();
    let alone = [&a, &b, &a].map(|text| load(text).unwrap().shapes[0].primitive_count());
    assert_eq!(sizes, alone);
    // The first that is wrong is named, whichever was read first.
    let broken = [&*a, &shape("ply", "c.ply"), &b, &shape("obj", "d.obj")].concat();
    let message = load(&broken).unwrap_err().to_string();
    assert!(message.contains("c.ply") && message.contains(":6:8"), "{message}");
}
