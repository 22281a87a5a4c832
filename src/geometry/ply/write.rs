//! The PLY writer.

use crate::geometry::MeshSource;
use glam::DVec3;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// Writes a mesh as a binary (little-endian) PLY file, which reads back as the same numbers.
///
/// Positions take four bytes a number if none of them loses by it, else eight.
///
/// # Errors
/// If the file cannot be written, or the normals or texture coordinates are not one per vertex.
pub fn write(path: &Path, mesh: &MeshSource) -> io::Result<()> {
    let vertices = mesh.positions.len();
    let has = |count: usize, what: &str| match count {
        0 => Ok(false),
        _ if count == vertices => Ok(true),
        _ => Err(io::Error::new(
            io::ErrorKind::InvalidInput,
            format!("{count} {what} for {vertices} vertices"),
        )),
    };
    let (normals, uvs) = (has(mesh.normals.len(), "normals")?, has(mesh.uvs.len(), "texture coordinates")?);
    let narrow = mesh.positions.iter().all(|p| p.as_vec3().as_dvec3() == *p);

    let mut out = BufWriter::with_capacity(1 << 20, File::create(path)?);
    writeln!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}")?;
    let kind = if narrow { "float" } else { "double" };
    let mut declare = |kind: &str, names: &[&str]| {
        names.iter().try_for_each(|name| writeln!(out, "property {kind} {name}"))
    };
    declare(kind, &["x", "y", "z"])?;
    declare("float", if normals { &["nx", "ny", "nz"] } else { &[] })?;
    declare("float", if uvs { &["u", "v"] } else { &[] })?;
    writeln!(
        out,
        "element face {}\nproperty list uchar uint vertex_indices\nend_header",
        mesh.indices.len()
    )?;

    for (i, &position) in mesh.positions.iter().enumerate() {
        write_position(&mut out, position, narrow)?;
        for x in mesh.normals.get(i).iter().flat_map(|n| n.to_array()) {
            out.write_all(&x.to_le_bytes())?;
        }
        for x in mesh.uvs.get(i).iter().flat_map(|t| t.to_array()) {
            out.write_all(&x.to_le_bytes())?;
        }
    }
    for &[a, b, c] in &mesh.indices {
        out.write_all(&[3])?;
        out.write_all(&a.to_le_bytes())?;
        out.write_all(&b.to_le_bytes())?;
        out.write_all(&c.to_le_bytes())?;
    }
    out.flush()
}

fn write_position(out: &mut impl Write, position: DVec3, narrow: bool) -> io::Result<()> {
    for x in position.to_array() {
        match narrow {
            true => out.write_all(&(x as f32).to_le_bytes())?,
            false => out.write_all(&x.to_le_bytes())?,
        }
    }
    Ok(())
}
