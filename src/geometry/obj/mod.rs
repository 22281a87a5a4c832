//! Wavefront OBJ files and their materials.
//!
//! The text is cut into chunks of lines that threads read apart (`chunk`); `assemble` resolves what a line says
//! about lines before it and sorts the triangles by name and material; `unify` gives each vertex one index.

mod assemble;
mod chunk;
mod mtl;
mod unify;
mod write;

pub use write::write;

use super::file_error::{Fault, Place, read_bytes};
use super::{MeshFileError, MeshSource};
use std::collections::{BTreeSet, HashMap};
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

/// Bytes that one thread reads at a time.
const CHUNK_SIZE: usize = 1 << 20;

/// Reads an OBJ file and the MTL files that it names.
///
/// Reads `v` (a weight divides, a colour is passed over), `vt`, `vn`, `f` (indices that count back too; more than
/// three corners become a fan of triangles), `o` and `g` (both name the triangles after them), `usemtl`, `mtllib`;
/// a backslash joins lines. Other statements are passed over. A corner without a normal, in a part where others
/// have one, gets a zero normal.
///
/// # Errors
/// If a file cannot be read (but a missing MTL file only makes a warning) or a line is malformed, names something
/// that is not there, or holds a number that is not finite; or if a byte is zero, as in binary files and UTF-16.
pub fn read(path: &Path) -> Result<ObjFile, MeshFileError> {
    let bytes = read_bytes(path)?;
    check_text(&bytes).map_err(|fault| fault.in_file(path))?;
    let content = assemble::parse(&bytes, CHUNK_SIZE).map_err(|fault| fault.in_file(path))?;
    let mut file = ObjFile { files: vec![path.to_path_buf()], ..ObjFile::default() };
    for library in content.libraries {
        file.read_library(path.parent().unwrap_or(Path::new("")), &library)?;
    }

    // A material that is defined again counts as it is defined last.
    let materials = file.materials.iter().enumerate();
    let known: HashMap<String, usize> = materials.map(|(i, m)| (m.name.clone(), i)).collect();
    let mut unknown = BTreeSet::new();
    for piece in content.pieces {
        let material = piece.material.as_ref().and_then(|name| known.get(name).copied());
        unknown.extend(piece.material.filter(|_| material.is_none()));
        file.parts.push(Part { name: piece.name, material, mesh: piece.mesh });
    }
    let warning = |name: String| format!("{}: no MTL file defines the material `{name}`", path.display());
    file.warnings.extend(unknown.into_iter().map(warning));
    Ok(file)
}

/// Refuses what is no text in ASCII or UTF-8, of which not one line might look like a statement: all of it would be
/// passed over.
fn check_text(bytes: &[u8]) -> Result<(), Fault> {
    if !bytes.contains(&0) {
        return Ok(());
    }
    let before = bytes.iter().take_while(|&&b| b != 0);
    let line = 1 + before.filter(|&&b| b == b'\n').count();
    Err(Fault::new(
        Place::Line(line),
        "a zero byte",
        "an OBJ file is text in ASCII or UTF-8: is it another kind of file?",
    ))
}

impl ObjFile {
    /// Reads what an `mtllib` statement names: one file (its name may hold blanks), or several.
    fn read_library(&mut self, folder: &Path, value: &str) -> Result<(), MeshFileError> {
        let whole = folder.join(value);
        let paths = match whole.is_file() {
            true => vec![whole],
            false => value.split_ascii_whitespace().map(|name| folder.join(name)).collect(),
        };
        for path in paths {
            if self.files.contains(&path) {
                continue;
            }
            let bytes = match read_bytes(&path) {
                Ok(bytes) => bytes,
                Err(error) => {
                    self.warnings.push(error.to_string());
                    continue;
                }
            };
            let (materials, warnings) = mtl::parse(&bytes).map_err(|fault| fault.in_file(&path))?;
            self.materials.extend(materials);
            self.warnings.extend(warnings.into_iter().map(|w| format!("{}: {w}", path.display())));
            self.files.push(path);
        }
        Ok(())
    }
}
