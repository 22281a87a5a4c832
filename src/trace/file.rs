//! The file of rays: little-endian, a header, then batches as the integrator asked them.
//!
//! ```text
//! header   8 bytes   "glossry1"
//! batch    u32 class, u32 count, then per ray 11 words of 32 bits:
//!          origin x y z, t_min, dir x y z, t_max, skip kind (0 none, 1 primitive, 2 geometry), geometry, primitive
//! ```

use crate::core::{Ray, Skip, Vec3};
use crate::integrator::{RayClass, RayLog};
use std::fs::File;
use std::io::{self, BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

const MAGIC: &[u8; 8] = b"glossry1";
const RAY_BYTES: usize = 44;

/// Why a file is not one of rays.
#[derive(Debug, thiserror::Error)]
pub enum RayFileError {
    /// It cannot be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// Its bytes make no sense.
    #[error("{}: {what} at byte {offset}: not a file that `gloss render --dump-rays` wrote, or a torn one", path.display())]
    Malformed {
        /// Which file.
        path: PathBuf,
        /// What is wrong.
        what: &'static str,
        /// Where.
        offset: u64,
    },
}

/// A file that rays are written to while a render asks them.
pub struct RayFile {
    path: PathBuf,
    out: Mutex<(BufWriter<File>, io::Result<()>)>,
}

impl RayFile {
    /// Makes the file, or empties it.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn create(path: &Path) -> Result<Self, RayFileError> {
        let io_error = |source| RayFileError::Io { path: path.into(), source };
        let mut out = BufWriter::new(File::create(path).map_err(io_error)?);
        out.write_all(MAGIC).map_err(io_error)?;
        Ok(Self { path: path.into(), out: Mutex::new((out, Ok(()))) })
    }

    /// Writes what is still in memory.
    ///
    /// # Errors
    /// If this or any earlier write failed.
    pub fn finish(self) -> Result<(), RayFileError> {
        let (mut out, result) = self.out.into_inner().expect("no thread panics while it writes");
        result.and_then(|()| out.flush()).map_err(|source| RayFileError::Io { path: self.path, source })
    }
}

impl RayLog for RayFile {
    fn record(&self, class: RayClass, rays: &[Ray]) {
        let mut bytes = Vec::with_capacity(8 + rays.len() * RAY_BYTES);
        bytes.extend((class as u32).to_le_bytes());
        bytes.extend((rays.len() as u32).to_le_bytes());
        for ray in rays {
            for word in words(ray) {
                bytes.extend(word.to_le_bytes());
            }
        }
        let mut out = self.out.lock().expect("no thread panics while it writes");
        if out.1.is_ok() {
            out.1 = out.0.write_all(&bytes);
        }
    }
}

fn words(ray: &Ray) -> [u32; 11] {
    let [ox, oy, oz] = ray.origin.to_array().map(f32::to_bits);
    let [dx, dy, dz] = ray.dir.to_array().map(f32::to_bits);
    let [kind, geom, prim] = match ray.skip {
        Skip::None => [0, 0, 0],
        Skip::Primitive { geom, prim } => [1, geom, prim],
        Skip::Geometry(geom) => [2, geom, 0],
    };
    [ox, oy, oz, ray.t_min.to_bits(), dx, dy, dz, ray.t_max.to_bits(), kind, geom, prim]
}

fn ray(bytes: &[u8]) -> Option<Ray> {
    let word =
        |i: usize| u32::from_le_bytes([bytes[4 * i], bytes[4 * i + 1], bytes[4 * i + 2], bytes[4 * i + 3]]);
    let vector =
        |i| Vec3::new(f32::from_bits(word(i)), f32::from_bits(word(i + 1)), f32::from_bits(word(i + 2)));
    let skip = match word(8) {
        0 => Skip::None,
        1 => Skip::Primitive { geom: word(9), prim: word(10) },
        2 => Skip::Geometry(word(9)),
        _ => return None,
    };
    let (t_min, t_max) = (f32::from_bits(word(3)), f32::from_bits(word(7)));
    Some(Ray { origin: vector(0), t_min, dir: vector(4), t_max, skip })
}

/// Rays that were asked together.
#[derive(Clone, Debug, PartialEq)]
pub struct Batch {
    /// What they are for.
    pub class: RayClass,
    /// In the order in which they were asked.
    pub rays: Vec<Ray>,
}

/// Reads all batches of a file.
///
/// # Errors
/// If it cannot be read or is not whole.
pub fn read(path: &Path) -> Result<Vec<Batch>, RayFileError> {
    let io_error = |source| RayFileError::Io { path: path.into(), source };
    let mut file = BufReader::new(File::open(path).map_err(io_error)?);
    let size = file.get_ref().metadata().map_err(io_error)?.len();
    let malformed = |what, offset| RayFileError::Malformed { path: path.into(), what, offset };
    let mut header = [0; 8];
    file.read_exact(&mut header).map_err(|_| malformed("no header", 0))?;
    if header != *MAGIC {
        return Err(malformed("another header", 0));
    }
    let (mut batches, mut offset) = (Vec::new(), 8);
    while offset < size {
        file.read_exact(&mut header).map_err(|_| malformed("half a batch header", offset))?;
        let class = u32::from_le_bytes([header[0], header[1], header[2], header[3]]);
        let count = u32::from_le_bytes([header[4], header[5], header[6], header[7]]);
        let class =
            RayClass::ALL.get(class as usize).ok_or_else(|| malformed("an unknown ray class", offset))?;
        let length = u64::from(count) * RAY_BYTES as u64;
        if offset + 8 + length > size {
            return Err(malformed("a batch that ends after the file", offset));
        }
        let mut bytes = vec![0; length as usize];
        file.read_exact(&mut bytes).map_err(io_error)?;
        let rays: Option<Vec<Ray>> = bytes.chunks_exact(RAY_BYTES).map(ray).collect();
        let rays = rays.ok_or_else(|| malformed("an unknown skip rule", offset))?;
        batches.push(Batch { class: *class, rays });
        offset += 8 + length;
    }
    Ok(batches)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rays() -> Vec<Ray> {
        let skips = [Skip::None, Skip::Primitive { geom: 3, prim: 9 }, Skip::Geometry(7)];
        skips.map(|skip| Ray { skip, t_max: 2.5, ..Ray::new(Vec3::new(1.0, -2.0, 3.0), Vec3::Y) }).to_vec()
    }

    #[test]
    fn what_is_written_is_read_and_a_torn_file_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("rays");
        let file = RayFile::create(&path).unwrap();
        file.record(RayClass::Glossy, &rays());
        file.record(RayClass::Shadow, &rays()[..1]);
        file.finish().unwrap();
        let batches = read(&path).unwrap();
        assert_eq!(batches[0], Batch { class: RayClass::Glossy, rays: rays() });
        assert_eq!(batches[1], Batch { class: RayClass::Shadow, rays: rays()[..1].to_vec() });

        let whole = std::fs::read(&path).unwrap();
        for length in [0, 7, 11, 20, whole.len() - 1] {
            std::fs::write(&path, &whole[..length]).unwrap();
            assert!(matches!(read(&path), Err(RayFileError::Malformed { .. })), "{length} bytes");
        }
    }
}
