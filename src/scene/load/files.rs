//! Mesh files, read side by side, before shapes are made of them one after the other.

use super::Notes;
use super::cache::hash_file;
use crate::geometry::obj::ObjFile;
use crate::geometry::{MeshFileError, MeshSource, obj, ply};
use crate::scene::desc::{SceneDesc, ShapeDesc};
use blake3::Hash;
use rayon::prelude::*;
use std::collections::HashMap;
use std::io;
use std::path::{Path, PathBuf};

/// What the mesh files of a scene hold; what is wrong with one is told to whoever takes it.
#[derive(Default)]
pub(super) struct MeshFiles {
    objects: HashMap<PathBuf, Result<ObjFile, MeshFileError>>,
    meshes: HashMap<PathBuf, Result<MeshSource, MeshFileError>>,
}

/// A file's content.
enum Content {
    Obj(Result<ObjFile, MeshFileError>),
    Ply(Result<MeshSource, MeshFileError>),
}

impl MeshFiles {
    /// Reads and hashes the files that a scene names, on all threads, but for those that a scene before has had read.
    pub(super) fn read(desc: &SceneDesc, notes: &mut Notes<'_>) -> Self {
        let mut paths: Vec<(PathBuf, bool)> = vec![];
        for shape in &desc.shapes {
            let named = match shape {
                ShapeDesc::Obj(desc) => (notes.path_of(&desc.file), true),
                ShapeDesc::Ply(desc) => (notes.path_of(&desc.file), false),
                _ => continue,
            };
            if !notes.cache.knows(&named.0) && !paths.contains(&named) {
                paths.push(named);
            }
        }
        let all: Vec<(Content, io::Result<Hash>)> = paths.par_iter().map(read_and_hash).collect();
        let mut files = Self::default();
        for ((path, _), (content, hash)) in paths.into_iter().zip(all) {
            if let Ok(hash) = hash {
                notes.cache.learn(&path, hash);
            }
            match content {
                Content::Obj(object) => drop(files.objects.insert(path, object)),
                Content::Ply(mesh) => drop(files.meshes.insert(path, mesh)),
            }
        }
        files
    }

    /// Takes an OBJ file; one that is not there any more is read again.
    pub(super) fn obj(&mut self, path: &Path) -> Result<ObjFile, MeshFileError> {
        self.objects.remove(path).unwrap_or_else(|| obj::read(path))
    }

    /// Takes a PLY file; one that is not there any more is read again.
    pub(super) fn ply(&mut self, path: &Path) -> Result<MeshSource, MeshFileError> {
        self.meshes.remove(path).unwrap_or_else(|| ply::read(path))
    }
}

fn read_and_hash((path, is_obj): &(PathBuf, bool)) -> (Content, io::Result<Hash>) {
    let read = || if *is_obj { Content::Obj(obj::read(path)) } else { Content::Ply(ply::read(path)) };
    rayon::join(read, || hash_file(path))
}
