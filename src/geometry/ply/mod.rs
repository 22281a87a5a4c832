//! PLY files (Turk 1994, "The PLY polygon file format"): ascii, and binary of both byte orders.
//!
//! Read: the element `vertex` with `x y z`, `nx ny nz` and texture coordinates (`u v`, `s t`, `texture_u texture_v`),
//! and the element `face` with the list `vertex_indices` (or `vertex_index`). Elements and properties come in any
//! order and type; others are passed over. Nothing is believed that the header says before the file bears it out.

mod body;
mod header;
mod numbers;
mod write;

pub use write::write;

use super::file_error::{Fault, read_bytes};
use super::number::Cursor;
use super::{MeshFileError, MeshSource};
use header::Format;
use numbers::{Ascii, Binary};
use std::path::Path;

/// Reads a PLY file. Faces of more than three corners become fans of triangles.
///
/// # Errors
/// If the file cannot be read, its header is malformed, it holds less or more than the header says, a face uses a
/// vertex that is not there, or a position is not finite. The message says where.
pub fn read(path: &Path) -> Result<MeshSource, MeshFileError> {
    parse(&read_bytes(path)?).map_err(|fault| fault.in_file(path))
}

/// The mesh in the bytes of a PLY file.
fn parse(bytes: &[u8]) -> Result<MeshSource, Fault> {
    let header = header::parse(bytes)?;
    let at = header.length;
    match header.format {
        Format::Ascii => body::read(&header, Ascii(Cursor::new(bytes, at))),
        Format::LittleEndian => body::read(&header, Binary::<false> { bytes, at }),
        Format::BigEndian => body::read(&header, Binary::<true> { bytes, at }),
    }
}
