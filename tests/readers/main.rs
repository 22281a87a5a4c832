//! The mesh readers against an oracle, against each other, and against files that lie.

mod obj_files;
mod ply_files;
mod property;

use glam::{DVec3, Vec2, Vec3};
use gloss::geometry::{MeshSource, obj, ply};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

fn write(folder: &TempDir, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
    let path = folder.path().join(name);
    std::fs::write(&path, content).unwrap();
    path
}

/// The message of a file that cannot be read; it always names the file.
fn complaint(name: &str, content: impl AsRef<[u8]>) -> String {
    let folder = TempDir::new().unwrap();
    let path = write(&folder, name, content);
    let error = match name.ends_with("ply") {
        true => ply::read(&path).map(|_| ()),
        false => obj::read(&path).map(|_| ()),
    };
    let message = error.expect_err("the file is wrong").to_string();
    message.strip_prefix(&format!("{}", path.display())).expect("the message names the file").to_owned()
}

/// Position, texture coordinate and normal of each corner of each triangle: what a mesh is, however it is indexed.
type Corners = Vec<[(DVec3, Option<Vec2>, Option<Vec3>); 3]>;

fn corners(mesh: &MeshSource) -> Corners {
    let corner = |v: u32| {
        let v = v as usize;
        (mesh.positions[v], mesh.uvs.get(v).copied(), mesh.normals.get(v).copied())
    };
    mesh.indices.iter().map(|triangle| triangle.map(corner)).collect()
}

/// Name, material name and corners of each part, as tobj reads them.
fn by_tobj(path: &Path) -> Vec<(String, Option<String>, Corners)> {
    let (models, materials) = tobj::load_obj(path, &tobj::GPU_LOAD_OPTIONS).unwrap();
    let materials = materials.unwrap_or_default();
    let part = |model: tobj::Model| {
        let vectors = |v: &[f64]| v.chunks_exact(3).map(DVec3::from_slice).collect::<Vec<_>>();
        let mesh = MeshSource {
            positions: vectors(&model.mesh.positions),
            indices: model.mesh.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
            normals: vectors(&model.mesh.normals).iter().map(|n| n.as_vec3()).collect(),
            uvs: model.mesh.texcoords.chunks_exact(2).map(|t| Vec2::new(t[0] as f32, t[1] as f32)).collect(),
        };
        let name = if model.name == "unnamed_object" { String::new() } else { model.name };
        (name, model.mesh.material_id.map(|i| materials[i].name.clone()), corners(&mesh))
    };
    models.into_iter().map(part).filter(|part| !part.2.is_empty()).collect()
}

fn by_gloss(path: &Path) -> Vec<(String, Option<String>, Corners)> {
    let file = obj::read(path).unwrap();
    let material = |i: Option<usize>| i.map(|i| file.materials[i].name.clone());
    file.parts.iter().map(|p| (p.name.clone(), material(p.material), corners(&p.mesh))).collect()
}
