//! Geometry that stays from one scene to the next: files are read, and meshes moved to the unit world, once.

use crate::geometry::{Dropped, MeshError, MeshSource, TriangleMesh, obj::ObjFile};
use blake3::Hash;
use glam::DAffine3;
use std::collections::HashMap;
use std::hash::Hash as Key;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

/// What [`load_with`](super::load_with) keeps of the scenes that it has loaded, up to a number of bytes; what was not
/// used for the longest time goes first.
///
/// A file is known by its contents, under whatever name; a mesh in the unit world by its source and its transform. So
/// scenes that have the same shapes share them: their [`Shape`](crate::geometry::Shape)s are the same pointers.
pub struct GeometryCache {
    limit: usize,
    bytes: usize,
    clock: u64,
    meshes: HashMap<MeshKey, Kept<Arc<MeshSource>>>,
    objects: HashMap<PathBuf, Kept<Arc<Object>>>,
    /// By the source's address, which is taken as long as the entry holds it.
    unit_meshes: HashMap<(usize, [u64; 12]), Kept<UnitMesh>>,
    hashes: HashMap<PathBuf, (u64, Option<SystemTime>, Hash)>,
}

/// Where a mesh comes from.
#[derive(Clone, PartialEq, Eq, Hash)]
pub(super) enum MeshKey {
    /// A PLY file of these contents.
    Ply(Hash),
    /// A formula with its parameters.
    Generated(String),
}

/// An OBJ file with its meshes taken out of their parts.
pub(super) struct Object {
    /// The file; its meshes are empty.
    pub(super) file: ObjFile,
    /// The mesh of each part.
    pub(super) meshes: Vec<Arc<MeshSource>>,
    /// Hashes of the file and of its MTL files.
    hashes: Vec<Hash>,
}

#[derive(Clone)]
struct UnitMesh {
    _source: Arc<MeshSource>,
    mesh: Arc<TriangleMesh>,
    dropped: Dropped,
}

struct Kept<T> {
    value: T,
    bytes: usize,
    last_used: u64,
}

impl GeometryCache {
    /// A cache that keeps up to so many bytes.
    pub fn new(limit: usize) -> Self {
        Self {
            limit,
            bytes: 0,
            clock: 0,
            meshes: HashMap::new(),
            objects: HashMap::new(),
            unit_meshes: HashMap::new(),
            hashes: HashMap::new(),
        }
    }

    /// Bytes kept at present.
    pub fn bytes(&self) -> usize {
        self.bytes
    }

    fn is_used(&self) -> bool {
        self.limit > 0
    }

    /// Whether a file's hash is known, though the file may have changed since.
    pub(super) fn knows(&self, path: &Path) -> bool {
        self.hashes.contains_key(path)
    }

    /// Notes the hash of a file that has just been read.
    pub(super) fn learn(&mut self, path: &Path, hash: Hash) {
        if let Ok((length, modified)) = version_of(path) {
            self.hashes.insert(path.to_owned(), (length, modified, hash));
        }
    }

    /// Hash of a file's contents; read again only if its size or time has changed.
    pub(super) fn hash_of(&mut self, path: &Path) -> io::Result<Hash> {
        let (length, modified) = version_of(path)?;
        if let Some((known_length, known, hash)) = self.hashes.get(path)
            && (*known_length, known) == (length, &modified)
            && modified.is_some()
        {
            return Ok(*hash);
        }
        let hash = hash_file(path)?;
        self.hashes.insert(path.to_owned(), (length, modified, hash));
        Ok(hash)
    }

    /// A PLY file's mesh.
    pub(super) fn ply<E>(
        &mut self,
        path: &Path,
        read: impl FnOnce() -> Result<MeshSource, E>,
    ) -> Result<Arc<MeshSource>, E> {
        // A file that cannot be hashed cannot be read: its reader says so better.
        let hash = if self.is_used() { self.hash_of(path).ok() } else { None };
        match hash {
            None => read().map(Arc::new),
            Some(hash) => self.mesh(MeshKey::Ply(hash), read),
        }
    }

    /// A mesh by its key.
    pub(super) fn mesh<E>(
        &mut self,
        key: MeshKey,
        make: impl FnOnce() -> Result<MeshSource, E>,
    ) -> Result<Arc<MeshSource>, E> {
        if let Some(found) = touch(&mut self.clock, &mut self.meshes, &key) {
            return Ok(found);
        }
        let mesh = Arc::new(make()?);
        let bytes = source_bytes(&mesh);
        keep(self, |cache| &mut cache.meshes, key, Arc::clone(&mesh), bytes);
        Ok(mesh)
    }

    /// An OBJ file.
    pub(super) fn obj<E>(
        &mut self,
        path: &Path,
        read: impl FnOnce() -> Result<ObjFile, E>,
    ) -> Result<Arc<Object>, E> {
        let key = path.to_owned();
        if let Some(found) = touch(&mut self.clock, &mut self.objects, &key)
            && self.hashes_of(&found.file.files).is_some_and(|now| now == found.hashes)
        {
            return Ok(found);
        }
        let mut file = read()?;
        let meshes: Vec<_> =
            file.parts.iter_mut().map(|part| Arc::new(std::mem::take(&mut part.mesh))).collect();
        let bytes = meshes.iter().map(|mesh| source_bytes(mesh)).sum();
        let hashes = if self.is_used() { self.hashes_of(&file.files) } else { None };
        let keeps = hashes.is_some();
        let object = Arc::new(Object { file, meshes, hashes: hashes.unwrap_or_default() });
        if keeps {
            keep(self, |cache| &mut cache.objects, key, Arc::clone(&object), bytes);
        }
        Ok(object)
    }

    fn hashes_of(&mut self, files: &[PathBuf]) -> Option<Vec<Hash>> {
        files.iter().map(|file| self.hash_of(file).ok()).collect()
    }

    /// The mesh in the unit world, and what was left out of it.
    pub(super) fn unit_mesh(
        &mut self,
        source: &Arc<MeshSource>,
        to_unit: &DAffine3,
    ) -> Result<(Arc<TriangleMesh>, Dropped), MeshError> {
        let key = (Arc::as_ptr(source) as usize, to_unit.to_cols_array().map(f64::to_bits));
        if let Some(UnitMesh { mesh, dropped, .. }) = touch(&mut self.clock, &mut self.unit_meshes, &key) {
            return Ok((mesh, dropped));
        }
        let (mesh, dropped) = source.to_mesh(to_unit)?;
        let mesh = Arc::new(mesh);
        // What nobody else holds will not be asked for again.
        if Arc::strong_count(source) > 1 {
            let entry = UnitMesh { _source: Arc::clone(source), mesh: Arc::clone(&mesh), dropped };
            let bytes = mesh.memory_bytes();
            keep(self, |cache| &mut cache.unit_meshes, key, entry, bytes);
        }
        Ok((mesh, dropped))
    }

    /// Forgets what was not used for the longest time until the rest fits.
    fn shrink(&mut self) {
        while self.bytes > self.limit {
            let oldest = [oldest(&self.meshes), oldest(&self.objects), oldest(&self.unit_meshes)];
            let Some(age) = oldest.into_iter().flatten().min() else { break };
            self.bytes -= forget(&mut self.meshes, age);
            self.bytes -= forget(&mut self.objects, age);
            self.bytes -= forget(&mut self.unit_meshes, age);
        }
    }
}

/// By what a change of a file is noticed: its length and the time of its last change.
fn version_of(path: &Path) -> io::Result<(u64, Option<SystemTime>)> {
    let meta = std::fs::metadata(path)?;
    Ok((meta.len(), meta.modified().ok()))
}

/// Hash of a file's contents.
pub(super) fn hash_file(path: &Path) -> io::Result<Hash> {
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(std::fs::File::open(path)?)?;
    Ok(hasher.finalize())
}

fn touch<K: Key + Eq, T: Clone>(clock: &mut u64, kept: &mut HashMap<K, Kept<T>>, key: &K) -> Option<T> {
    let entry = kept.get_mut(key)?;
    *clock += 1;
    entry.last_used = *clock;
    Some(entry.value.clone())
}

fn keep<K: Key + Eq, T>(
    cache: &mut GeometryCache,
    map: impl Fn(&mut GeometryCache) -> &mut HashMap<K, Kept<T>>,
    key: K,
    value: T,
    bytes: usize,
) {
    if bytes > cache.limit {
        return;
    }
    cache.clock += 1;
    let entry = Kept { value, bytes, last_used: cache.clock };
    let replaced = map(cache).insert(key, entry).map_or(0, |old| old.bytes);
    cache.bytes = cache.bytes + bytes - replaced;
    cache.shrink();
}

fn oldest<K, T>(kept: &HashMap<K, Kept<T>>) -> Option<u64> {
    kept.values().map(|entry| entry.last_used).min()
}

/// Removes the entry that was used at that time; its bytes.
fn forget<K, T>(kept: &mut HashMap<K, Kept<T>>, last_used: u64) -> usize {
    kept.extract_if(|_, entry| entry.last_used == last_used).map(|(_, entry)| entry.bytes).sum()
}

fn source_bytes(mesh: &MeshSource) -> usize {
    size_of_val(&mesh.positions[..])
        + size_of_val(&mesh.indices[..])
        + size_of_val(&mesh.normals[..])
        + size_of_val(&mesh.uvs[..])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Generator, Shape, generate};
    use crate::scene::{Override, load, load_with};

    fn ball() -> MeshSource {
        generate::generate(Generator::Sphere, 500, 1)
    }

    fn shapes_are_shared(a: &[Shape], b: &[Shape]) -> bool {
        a.iter().zip(b).all(|pair| match pair {
            (Shape::Mesh(a), Shape::Mesh(b)) => Arc::ptr_eq(a, b),
            _ => false,
        })
    }

    #[test]
    fn scenes_of_the_same_files_share_their_meshes() {
        let directory = tempfile::tempdir().unwrap();
        let path = |name: &str| directory.path().join(name);
        crate::geometry::ply::write(&path("a.ply"), &ball()).unwrap();
        std::fs::copy(path("a.ply"), path("b.ply")).unwrap();
        let text = "[materials.m]\ntype = \"diffuse\"\n[[shapes]]\ntype = \"ply\"\nfile = \"a.ply\"\nmaterial = \"m\"\n";
        std::fs::write(path("a.toml"), text).unwrap();
        std::fs::write(path("b.toml"), text.replace("a.ply", "b.ply")).unwrap();

        let mut cache = GeometryCache::new(1 << 30);
        let first = load_with(&path("a.toml"), &[], &mut cache).unwrap();
        let other = [Override::new("materials.m.kd", 0.3), Override::new("camera.eye", "[1, 2, 3]")];
        let second = load_with(&path("b.toml"), &other, &mut cache).unwrap();
        assert!(shapes_are_shared(&first.shapes, &second.shapes));
        let apart = load(&path("a.toml"), &[]).unwrap();
        assert_eq!(apart.hash, first.hash);
        assert!(!shapes_are_shared(&first.shapes, &apart.shapes));

        let moved = [Override::new("shapes.0.transform", "[{ scale = [1, 2, 1] }]")];
        let moved = load_with(&path("a.toml"), &moved, &mut cache).unwrap();
        assert!(!shapes_are_shared(&first.shapes, &moved.shapes));

        // Another content under the same name is another mesh.
        crate::geometry::ply::write(&path("a.ply"), &generate::generate(Generator::Knot, 700, 1)).unwrap();
        let changed = load_with(&path("a.toml"), &[], &mut cache).unwrap();
        assert!(!shapes_are_shared(&first.shapes, &changed.shapes) && changed.hash != first.hash);
    }

    #[test]
    fn what_is_kept_is_bounded() {
        let one = source_bytes(&ball());
        let mut cache = GeometryCache::new(5 * one / 2);
        let mut made = 0;
        let mut ask = |cache: &mut GeometryCache, name: &str| {
            let make = || -> Result<_, MeshError> {
                made += 1;
                Ok(ball())
            };
            cache.mesh(MeshKey::Generated(name.into()), make).unwrap();
            made
        };
        assert_eq!(["a", "b", "a", "c", "a", "b"].map(|name| ask(&mut cache, name)), [1, 2, 2, 3, 3, 4]);
        assert!(cache.bytes() <= 5 * one / 2);
        let mut none = GeometryCache::new(0);
        assert_eq!([ask(&mut none, "a"), ask(&mut none, "a")], [5, 6]);
        assert_eq!(none.bytes(), 0);
    }
}
