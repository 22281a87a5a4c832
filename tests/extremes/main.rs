//! Numbers at their ends: exponents, incidences, sizes and places of worlds, thin and tiny triangles, dark and bright
//! light, many samples, deep paths. Nowhere a NaN, an infinity, a negative number (`common::picture` fails on the
//! first that the film drops) or a speckle of a surface that hides from itself.

#[path = "../common/mod.rs"]
mod common;
mod furnace;
mod light;
mod shadow;
mod world;

use glam::DVec3;
use gloss::accel::Backend;
use gloss::film::Film;
use gloss::geometry::generate::{Generator, generate};
use gloss::geometry::{MeshSource, obj};
use std::path::{Path, PathBuf};

/// Every backend but brute force, which is their oracle elsewhere.
fn backends() -> Vec<Backend> {
    if cfg!(feature = "embree") { vec![Backend::Bvh, Backend::Embree] } else { vec![Backend::Bvh] }
}

/// A place and a size: a point of the unit scene and a length of it, as a scene file writes them.
#[derive(Clone, Copy, Debug)]
struct Place {
    scale: f64,
    offset: f64,
}

impl Place {
    const UNIT: Self = Self { scale: 1.0, offset: 0.0 };
    /// The unit scene, a millionth and a million of its size, and ten million from the origin.
    const ALL: [Self; 4] = [
        Self::UNIT,
        Self { scale: 1e-6, offset: 0.0 },
        Self { scale: 1e6, offset: 0.0 },
        Self { scale: 1.0, offset: 1e7 },
    ];

    fn at(self, p: DVec3) -> DVec3 {
        p * self.scale + self.offset
    }

    fn point(self, x: f64, y: f64, z: f64) -> String {
        let p = self.at(DVec3::new(x, y, z));
        format!("[{:e}, {:e}, {:e}]", p.x, p.y, p.z)
    }

    fn vector(self, x: f64, y: f64, z: f64) -> String {
        let p = DVec3::new(x, y, z) * self.scale;
        format!("[{:e}, {:e}, {:e}]", p.x, p.y, p.z)
    }

    fn length(self, x: f64) -> String {
        format!("{:e}", x * self.scale)
    }

    /// The mesh at this place as an OBJ file.
    fn obj(self, mesh: &MeshSource, folder: &Path, name: &str) -> PathBuf {
        let mesh =
            MeshSource { positions: mesh.positions.iter().map(|&p| self.at(p)).collect(), ..mesh.clone() };
        let path = folder.join(format!("{name}-{:e}-{:e}.obj", self.scale, self.offset));
        obj::write(&path, &mesh).expect("the folder can be written to");
        path
    }
}

/// A mesh with and without its smooth normals.
fn smooth_and_flat(kind: Generator, triangles: usize) -> [MeshSource; 2] {
    let smooth = generate(kind, triangles, 0);
    let flat = MeshSource { normals: vec![], ..smooth.clone() };
    [smooth, flat]
}

/// The greatest and the least mean of a channel.
fn extremes(film: &Film) -> (f32, f32) {
    let channels = film.pixels.iter().flat_map(|p| p.mean().to_array());
    channels.fold((f32::INFINITY, f32::NEG_INFINITY), |(least, most), c| (least.min(c), most.max(c)))
}
