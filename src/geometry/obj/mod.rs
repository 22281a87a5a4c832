//! Wavefront OBJ files and their materials.

use super::file_error::{Fault, Place, read_bytes};
use super::{MeshFileError, MeshSource};
use glam::{DVec3, Vec2, Vec3};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// The triangles of one object or group that share a material.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// The object's or group's name; empty if it has none.
    pub name: String,
    /// Index into [`ObjFile::materials`].
    pub material: Option<usize>,
    /// The triangles, with only the vertices that they use.
    pub mesh: MeshSource,
}

/// A material as an MTL file gives it; what the file leaves out is `None`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ObjMaterial {
    /// What `usemtl` calls it.
    pub name: String,
    /// `Ka`: ambient reflection.
    pub ambient: Option<[f32; 3]>,
    /// `Kd`: diffuse reflection.
    pub diffuse: Option<[f32; 3]>,
    /// `Ks`: glossy reflection.
    pub specular: Option<[f32; 3]>,
    /// `Ns`: exponent of the cosine lobe.
    pub exponent: Option<f32>,
    /// `Ke`: emitted radiance.
    pub emission: Option<[f32; 3]>,
}

/// What an OBJ file holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ObjFile {
    /// One part for each object or group and material, in the order of the file; none is empty.
    pub parts: Vec<Part>,
    /// The materials of all its MTL files.
    pub materials: Vec<ObjMaterial>,
    /// Every file that was read: the OBJ file, then its MTL files.
    pub files: Vec<PathBuf>,
    /// What was left out or could not be found, in sentences.
    pub warnings: Vec<String>,
}

/// Reads an OBJ file and the MTL files that it names.
///
/// # Errors
/// If the file cannot be read or is malformed.
pub fn read(path: &Path) -> Result<ObjFile, MeshFileError> {
    let bytes = read_bytes(path)?;
    let mut files = vec![path.to_path_buf()];
    let options = tobj::LoadOptions { single_index: true, triangulate: true, ..tobj::GPU_LOAD_OPTIONS };
    let found = std::cell::RefCell::new(Vec::new());
    let (models, materials) = tobj::load_obj_buf(&mut &bytes[..], &options, |name| {
        let full = path.parent().unwrap_or(Path::new("")).join(name);
        found.borrow_mut().push(full.clone());
        tobj::load_mtl(full)
    })
    .map_err(|e| Fault::new(Place::Byte(0), e.to_string(), "mend the file").in_file(path))?;
    files.extend(found.into_inner());
    let rgb = |c: Option<[f64; 3]>| c.map(|c| c.map(|x| x as f32));
    let materials = (materials.unwrap_or_default().into_iter())
        .map(|m| ObjMaterial {
            name: m.name,
            ambient: rgb(m.ambient),
            diffuse: rgb(m.diffuse),
            specular: rgb(m.specular),
            exponent: m.shininess.map(|x| x as f32),
            emission: rgb(m.emissive),
        })
        .collect();
    let vec3 = |v: &[f64]| DVec3::from_slice(v);
    let parts = (models.into_iter())
        .map(|m| Part {
            name: m.name,
            material: m.mesh.material_id,
            mesh: MeshSource {
                positions: m.mesh.positions.chunks_exact(3).map(vec3).collect(),
                indices: m.mesh.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
                normals: m.mesh.normals.chunks_exact(3).map(|n| vec3(n).as_vec3()).collect(),
                uvs: m.mesh.texcoords.chunks_exact(2).map(|t| Vec2::new(t[0] as f32, t[1] as f32)).collect(),
            },
        })
        .filter(|p| !p.mesh.indices.is_empty())
        .collect();
    Ok(ObjFile { parts, materials, files, warnings: vec![] })
}

/// Writes a mesh as an OBJ file; positions, normals and texture coordinates read back as the same numbers.
///
/// # Errors
/// If the file cannot be written.
pub fn write(path: &Path, mesh: &MeshSource) -> io::Result<()> {
    let mut out = BufWriter::new(std::fs::File::create(path)?);
    for DVec3 { x, y, z } in &mesh.positions {
        writeln!(out, "v {x} {y} {z}")?;
    }
    for Vec2 { x, y } in &mesh.uvs {
        writeln!(out, "vt {x} {y}")?;
    }
    for Vec3 { x, y, z } in &mesh.normals {
        writeln!(out, "vn {x} {y} {z}")?;
    }
    let (uvs, normals) = (!mesh.uvs.is_empty(), !mesh.normals.is_empty());
    for triangle in &mesh.indices {
        write!(out, "f")?;
        for v in triangle.map(|v| u64::from(v) + 1) {
            match (uvs, normals) {
                (false, false) => write!(out, " {v}")?,
                (true, false) => write!(out, " {v}/{v}")?,
                (false, true) => write!(out, " {v}//{v}")?,
                (true, true) => write!(out, " {v}/{v}/{v}")?,
            }
        }
        writeln!(out)?;
    }
    out.flush()
}
