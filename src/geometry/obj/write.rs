//! The OBJ writer.

use crate::geometry::MeshSource;
use glam::{DVec3, Vec2, Vec3};
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// Writes a mesh as an OBJ file; positions, normals and texture coordinates read back as the same numbers.
///
/// # Errors
/// If the file cannot be written.
pub fn write(path: &Path, mesh: &MeshSource) -> io::Result<()> {
    let mut out = BufWriter::with_capacity(1 << 20, File::create(path)?);
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
