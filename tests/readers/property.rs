//! Any mesh, and any bytes.

use super::obj_files::{CUBE, CUBE_MTL};
use super::ply_files::ascii;
use super::{by_gloss, by_tobj, corners, write};
use glam::{DVec3, Vec2, Vec3};
use gloss::geometry::{Generator, MeshSource, generate, obj, ply};
use proptest::prelude::*;
use tempfile::TempDir;

#[test]
fn generated_meshes_survive_both_formats() {
    let folder = TempDir::new().unwrap();
    for kind in Generator::ALL {
        let mesh = generate::generate(kind, 2000, 4);
        let [a, b] = ["a.ply", "a.obj"].map(|name| folder.path().join(name));
        ply::write(&a, &mesh).unwrap();
        obj::write(&b, &mesh).unwrap();
        assert_eq!(ply::read(&a).unwrap(), mesh, "{kind:?}");
        assert_eq!(corners(&obj::read(&b).unwrap().parts[0].mesh), corners(&mesh), "{kind:?}");
        assert_eq!(by_gloss(&b), by_tobj(&b), "{kind:?}");
    }
}

prop_compose! {
    /// A mesh of any finite numbers.
    fn mesh()(count in 1_usize..20, normals in any::<bool>(), uvs in any::<bool>())(
        positions in prop::collection::vec(prop::array::uniform3(prop::num::f64::NORMAL | prop::num::f64::ZERO | prop::num::f64::SUBNORMAL), count),
        indices in prop::collection::vec(prop::array::uniform3(0..count as u32), 1..30),
        normals in prop::collection::vec(prop::array::uniform3(-1.0_f32..1.0), if normals { count } else { 0 }),
        uvs in prop::collection::vec(prop::array::uniform2(-9.0_f32..9.0), if uvs { count } else { 0 }),
    ) -> MeshSource {
        MeshSource {
            positions: positions.into_iter().map(DVec3::from_array).collect(),
            indices,
            normals: normals.into_iter().map(Vec3::from_array).collect(),
            uvs: uvs.into_iter().map(Vec2::from_array).collect(),
        }
    }
}

/// A valid file of each kind, to be spoilt.
fn valid_files() -> Vec<Vec<u8>> {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("a.ply");
    ply::write(&path, &generate::generate(Generator::Terrain, 8, 0)).unwrap();
    vec![CUBE.into(), CUBE_MTL.into(), ascii("0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"), std::fs::read(path).unwrap()]
}

proptest! {
    #[test]
    fn any_mesh_reads_back_as_it_was_written(mesh in mesh()) {
        let folder = TempDir::new().unwrap();
        let [a, b] = ["a.ply", "a.obj"].map(|name| folder.path().join(name));
        ply::write(&a, &mesh).unwrap();
        prop_assert_eq!(&ply::read(&a).unwrap(), &mesh);
        obj::write(&b, &mesh).unwrap();
        prop_assert_eq!(corners(&obj::read(&b).unwrap().parts[0].mesh), corners(&mesh));
        prop_assert_eq!(by_gloss(&b), by_tobj(&b));
    }

    #[test]
    fn spoilt_files_never_panic(
        which in 0_usize..4,
        edits in prop::collection::vec((any::<prop::sample::Index>(), prop::sample::select(&b"0123456789-/.e \n\\vfglu#\x00\xff"[..])), 1..6),
        cut in any::<prop::sample::Index>(),
        cutting in any::<bool>(),
    ) {
        let mut file = valid_files().swap_remove(which);
        for (place, byte) in edits {
            let place = place.index(file.len());
            file[place] = byte;
        }
        file.truncate(if cutting { cut.index(file.len()) } else { file.len() });
        let folder = TempDir::new().unwrap();
        let path = write(&folder, "a.mtl", &file);
        let _ = (ply::read(&path), obj::read(&path));
        let _ = obj::read(&write(&folder, "a.obj", "mtllib a.mtl\n"));
    }

    #[test]
    fn any_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..200), ply_header in any::<bool>()) {
        let start = if ply_header { ascii("") } else { Vec::new() };
        let folder = TempDir::new().unwrap();
        let path = write(&folder, "a.mtl", [start, bytes].concat());
        let _ = (ply::read(&path), obj::read(&path));
        let _ = obj::read(&write(&folder, "a.obj", "mtllib a.mtl\n"));
    }
}
