//! The scenes in `scenes/` and the schema.

use gloss::geometry::Shape;
use gloss::scene::{AtMaxDepth, Format, Scene, Specular, load, load_str, schema};
use serde_json::Value;
use std::path::PathBuf;

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("scenes")
}

fn shipped() -> Vec<PathBuf> {
    let files = std::fs::read_dir(folder()).unwrap().map(|entry| entry.unwrap().path());
    let mut scenes: Vec<_> = files.filter(|p| p.extension().is_some_and(|e| e == "toml")).collect();
    scenes.sort();
    scenes
}

fn named(name: &str) -> Scene {
    load(&folder().join(name), &[]).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn every_scene_loads_and_only_the_mirror_room_warns() {
    assert!(shipped().len() >= 7);
    for path in shipped() {
        let scene = load(&path, &[]).unwrap_or_else(|e| panic!("{e}"));
        let warns = path.ends_with("mirror-room.toml");
        assert_eq!(scene.warnings.len(), usize::from(warns), "{}: {:?}", path.display(), scene.warnings);
        assert!(!scene.shapes.is_empty());
    }
}

#[test]
fn json_says_the_same_as_toml() {
    for path in shipped() {
        let text = std::fs::read_to_string(&path).unwrap();
        let value: Value = toml::from_str(&text).unwrap();
        let json = load_str(&value.to_string(), Format::Json, &folder(), &[]).unwrap();
        let toml = load(&path, &[]).unwrap();
        assert_eq!(json.hash, toml.hash, "{}", path.display());
    }
}

#[test]
fn the_textbooks_figures_have_the_textbooks_numbers() {
    for (name, resolution, spp, depth) in [
        ("rim.toml", [400, 400], 100, 1),
        ("lemon.toml", [600, 600], 25, 1),
        ("boxes.toml", [600, 200], 256, 1),
        ("mirror-room.toml", [600, 600], 100, 19),
        ("checker-sphere.toml", [400, 400], 100, 1),
    ] {
        let scene = named(name);
        let settings = &scene.settings;
        assert_eq!((scene.camera.resolution, settings.spp, settings.max_depth), (resolution, spp, depth));
        assert_eq!(settings.at_max_depth, AtMaxDepth::Black, "{name}");
    }
    let exponents = |name: &str| {
        let scene = named(name);
        let exponent = |m: &gloss::scene::Material| match m.specular {
            Specular::CosinePower { exponent, .. } => Some(exponent),
            _ => None,
        };
        scene.materials.iter().filter_map(exponent).collect::<Vec<_>>()
    };
    assert_eq!(exponents("rim.toml"), [1.0]);
    assert_eq!(exponents("lemon.toml"), [100.0]);
    assert_eq!(exponents("boxes.toml"), [1e5, 1e4, 1e3, 1e2]);
    assert_eq!(exponents("mirror-room.toml"), [25_000.0]);
    assert_eq!(exponents("checker-sphere.toml"), [100.0]);
}

#[test]
fn the_knot_is_a_mesh_of_the_repository() {
    let scene = named("mesh.toml");
    let Shape::Mesh(mesh) = &scene.shapes[0] else { panic!("a mesh") };
    assert!((10_000..20_000).contains(&mesh.triangle_count()), "{}", mesh.triangle_count());
    assert!(!mesh.normals().is_empty());
    let size = std::fs::metadata(folder().join("meshes/knot.obj")).unwrap().len();
    assert!(size < 2_000_000, "{size}");
}

/// Follows a `$ref` of the schema.
fn resolve<'a>(root: &'a Value, node: &'a Value) -> &'a Value {
    match node.get("$ref").and_then(Value::as_str) {
        Some(reference) => {
            root.pointer(reference.trim_start_matches('#')).expect("a reference leads somewhere")
        }
        None => node,
    }
}

#[test]
fn the_schema_names_every_type_with_its_tag_among_its_keys() {
    let schema = schema();
    for (list, types) in [
        ("/properties/shapes/items", 9),
        ("/properties/lights/items", 5),
        ("/properties/materials/additionalProperties", 7),
    ] {
        let variants = resolve(&schema, schema.pointer(list).expect(list))["oneOf"].as_array().expect(list);
        assert_eq!(variants.len(), types, "{list}");
        for variant in variants {
            let tag = &variant["properties"]["type"]["const"];
            assert!(tag.is_string(), "{variant}");
            assert!(variant["required"].as_array().unwrap().contains(&"type".into()), "{variant}");
            // Keys of the variant must not be forbidden beside the tag.
            let inner = resolve(&schema, variant);
            assert!(
                variant.get("$ref").is_none() || inner.get("additionalProperties") != Some(&false.into()),
                "{variant}"
            );
        }
    }
    for key in ["settings", "camera", "ambient", "environment"] {
        assert!(schema["properties"][key].is_object(), "{key}");
    }
    assert_eq!(schema["additionalProperties"], false);
}
