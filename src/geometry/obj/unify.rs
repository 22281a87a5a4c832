//! From corners with an index for each of position, texture coordinate and normal to vertices with one.

use super::assemble::Run;
use super::chunk::{Chunk, NONE, V, VN, VT};
use crate::geometry::MeshSource;
use glam::{DVec3, Vec2, Vec3};
use std::collections::HashMap;

/// The elements of all chunks.
pub(super) struct Pool {
    pub(super) positions: Vec<DVec3>,
    pub(super) uvs: Vec<Vec2>,
    pub(super) normals: Vec<Vec3>,
}

impl Pool {
    /// Takes them out of the chunks.
    pub(super) fn of(chunks: &mut [Chunk]) -> Self {
        fn join<'a, 'b: 'a, T: Copy>(
            chunks: &'a mut [Chunk<'b>],
            take: impl Fn(&mut Chunk<'b>) -> Vec<T>,
        ) -> Vec<T> {
            let parts: Vec<Vec<T>> = chunks.iter_mut().map(take).collect();
            parts.concat()
        }
        Self {
            positions: join(chunks, |c| std::mem::take(&mut c.positions)),
            uvs: join(chunks, |c| std::mem::take(&mut c.uvs)),
            normals: join(chunks, |c| std::mem::take(&mut c.normals)),
        }
    }
}

/// Finds the vertex of a corner; reused from mesh to mesh.
///
/// The vertices of one position form a list from `heads` on: there are few of them, so that this beats hashing.
/// Beyond [`LONGEST`] of them (the tip of a cone with many normals) a hash map takes over.
pub(super) struct Unifier<'a> {
    pool: &'a Pool,
    /// For each position its newest vertex.
    heads: Vec<u32>,
    vertices: Vec<Vertex>,
    rest: HashMap<[i32; 3], u32>,
}

struct Vertex {
    key: [i32; 3],
    /// The next older vertex at the same position, and how many there are.
    next: u32,
    older: u32,
}

const LONGEST: u32 = 24;
const END: u32 = u32::MAX;

impl<'a> Unifier<'a> {
    pub(super) fn new(pool: &'a Pool) -> Self {
        let heads = vec![END; pool.positions.len()];
        Self { pool, heads, vertices: Vec::new(), rest: HashMap::new() }
    }

    /// The mesh of some triangles. A corner without a normal, where others have one, gets the normal zero: there the
    /// surface is flat.
    pub(super) fn mesh(&mut self, chunks: &[Chunk], runs: &[Run]) -> MeshSource {
        let count = runs.iter().map(|(_, triangles)| triangles.len()).sum();
        let mut indices = Vec::with_capacity(count);
        for (number, triangles) in runs {
            let [v, vt, vn] = &chunks[*number].corners;
            let key = |i: usize| [v[i], *vt.get(i).unwrap_or(&NONE), *vn.get(i).unwrap_or(&NONE)];
            for first in triangles.clone().map(|t| 3 * t) {
                indices.push([first, first + 1, first + 2].map(|i| self.vertex(key(i))));
            }
        }

        let vertices = std::mem::take(&mut self.vertices);
        vertices.iter().for_each(|vertex| self.heads[vertex.key[V] as usize] = END);
        self.rest.clear();
        let uvs = column(&vertices, VT, &self.pool.uvs);
        let normals = column(&vertices, VN, &self.pool.normals);
        let positions = vertices.iter().map(|vertex| self.pool.positions[vertex.key[V] as usize]).collect();
        MeshSource { positions, indices, normals, uvs }
    }

    #[inline]
    fn vertex(&mut self, key: [i32; 3]) -> u32 {
        let head = self.heads[key[V] as usize];
        let mut at = head;
        for _ in 0..LONGEST {
            match self.vertices.get(at as usize) {
                Some(vertex) if vertex.key == key => return at,
                Some(vertex) => at = vertex.next,
                None => break,
            }
        }
        let new = self.vertices.len() as u32;
        let older = self.vertices.get(head as usize).map_or(0, |vertex| vertex.older + 1);
        if older >= LONGEST {
            if let Some(&known) = self.rest.get(&key) {
                return known;
            }
            self.rest.insert(key, new);
        } else {
            self.heads[key[V] as usize] = new;
        }
        self.vertices.push(Vertex { key, next: head, older });
        new
    }
}

/// The attribute of each vertex; zero where it has none, and nothing at all if none has one.
fn column<T: Copy + Default>(vertices: &[Vertex], kind: usize, pool: &[T]) -> Vec<T> {
    if vertices.iter().all(|vertex| vertex.key[kind] == NONE) {
        return Vec::new();
    }
    let value = |vertex: &Vertex| match vertex.key[kind] {
        NONE => T::default(),
        index => pool[index as usize],
    };
    vertices.iter().map(value).collect()
}
