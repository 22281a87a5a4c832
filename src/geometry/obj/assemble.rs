//! The chunks of an OBJ file put together.

use super::chunk::{self, Chunk, Mark, NONE, V, VN, VT};
use super::unify::{Pool, Unifier};
use crate::geometry::MeshSource;
use crate::geometry::file_error::{Fault, Place};
use crate::geometry::number::line_of;
use rayon::prelude::*;
use std::collections::HashMap;
use std::ops::Range;

/// What the text of an OBJ file says.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Content {
    pub(super) pieces: Vec<Piece>,
    /// The values of its `mtllib` statements.
    pub(super) libraries: Vec<String>,
}

/// The triangles of one name and material.
#[derive(Debug, PartialEq)]
pub(super) struct Piece {
    pub(super) name: String,
    pub(super) material: Option<String>,
    pub(super) mesh: MeshSource,
}

/// Reads the text in chunks of about `chunk_size` bytes, which does not change the outcome.
pub(super) fn parse(bytes: &[u8], chunk_size: usize) -> Result<Content, Fault> {
    let cuts = chunk::cuts(bytes, chunk_size);
    let chunks: Vec<_> = cuts.into_par_iter().map(|cut| chunk::parse(bytes, cut)).collect();
    let place = |fault: Fault| match fault.at {
        Place::Byte(at) => Fault { at: Place::Line(line_of(bytes, at)), ..fault },
        Place::Line(_) => fault,
    };
    let chunks = chunks.into_iter().collect::<Result<Vec<_>, _>>().map_err(place)?;
    assemble(bytes, chunks)
}

fn assemble(bytes: &[u8], mut chunks: Vec<Chunk>) -> Result<Content, Fault> {
    resolve(bytes, &mut chunks)?;
    let triangles: usize = chunks.iter().map(|c| c.corners[V].len() / 3).sum();
    if triangles > u32::MAX as usize / 3 {
        let what = format!("{triangles} triangles are too many for one file");
        return Err(Fault::new(Place::Line(1), what, "split it"));
    }
    let (groups, libraries) = groups(&chunks);
    let plain = |chunk: &Chunk| chunk.corners[VT].is_empty() && chunk.corners[VN].is_empty();
    let mesh_of_all = groups.len() == 1 && chunks.iter().all(plain);
    let pool = Pool::of(&mut chunks);
    if mesh_of_all {
        let triangles = chunks.par_iter().flat_map_iter(|c| c.corners[V].chunks_exact(3));
        let indices = triangles.map(|t| [t[0] as u32, t[1] as u32, t[2] as u32]).collect();
        let mut mesh = Some(MeshSource { positions: pool.positions, indices, ..MeshSource::default() });
        let piece = |g: Group| mesh.take().map(|mesh| Piece { name: g.name, material: g.material, mesh });
        return Ok(Content { pieces: groups.into_iter().filter_map(piece).collect(), libraries });
    }
    let mut unifier = Unifier::new(&pool);
    let pieces = groups.into_iter().map(|group| {
        let mesh = unifier.mesh(&chunks, &group.runs);
        Piece { name: group.name, material: group.material, mesh }
    });
    Ok(Content { pieces: pieces.collect(), libraries })
}

/// Makes every index count from the first element of the file, and checks that there is such an element.
fn resolve(bytes: &[u8], chunks: &mut [Chunk]) -> Result<(), Fault> {
    let counts = |c: &Chunk| [c.positions.len(), c.uvs.len(), c.normals.len()].map(|n| n as i64);
    let mut total = [0_i64; 3];
    let mut bases = Vec::with_capacity(chunks.len());
    for chunk in chunks.iter() {
        bases.push(total);
        let count = counts(chunk);
        total = [0, 1, 2].map(|kind| total[kind] + count[kind]);
    }
    let stray = (chunks.par_iter_mut().zip(bases)).find_map_first(|(chunk, base)| {
        let kind = [V, VT, VN].into_iter().find_map(|kind| {
            let corner = resolve_column(chunk, kind, base[kind], total[kind])?;
            Some((kind, corner))
        });
        kind.map(|(kind, corner)| (chunk.start, kind, corner))
    });
    match stray {
        Some((start, kind, corner)) => Err(stray_fault(bytes, start, kind, corner / 3, total[kind])),
        None => Ok(()),
    }
}

/// The first corner of a chunk whose index of the given kind is none of `total` elements.
fn resolve_column(chunk: &mut Chunk, kind: usize, base: i64, total: i64) -> Option<usize> {
    let column = &mut chunk.corners[kind];
    for &corner in &chunk.relative[kind] {
        // What does not fit is no element either.
        column[corner] = i32::try_from(base + i64::from(column[corner])).unwrap_or(i32::MAX);
    }
    let is_stray = |&index: &i32| !(0..total.min(i64::from(i32::MAX))).contains(&i64::from(index));
    let may_miss = |index: &i32| kind != V && *index == NONE;
    column.iter().position(|index| is_stray(index) && !may_miss(index))
}

/// The fault of a triangle of the chunk that begins at byte `start`: its line is looked for only now.
fn stray_fault(bytes: &[u8], start: usize, kind: usize, triangle: usize, total: i64) -> Fault {
    let what = ["vertices", "texture coordinates", "normals"][kind];
    let mut left = triangle;
    let mut at = start;
    for (from, to) in chunk::cuts(bytes, 1).into_iter().filter(|&(from, _)| from >= start) {
        at = from;
        let triangles = chunk::parse(bytes, (from, to)).map_or(0, |c| c.corners[V].len() / 3);
        if left < triangles {
            break;
        }
        left -= triangles;
    }
    let what = format!("a corner of the face refers to something else than the {total} {what} of the file");
    Fault::new(Place::Line(line_of(bytes, at)), what, "mend the number or export the mesh again")
}

/// Triangles of one name and material, by chunk.
struct Group {
    name: String,
    material: Option<String>,
    runs: Vec<Run>,
}

/// Triangles that follow each other: the number of their chunk and their places in it.
pub(super) type Run = (usize, Range<usize>);

/// The groups in the order in which they begin, and the material libraries.
fn groups(chunks: &[Chunk]) -> (Vec<Group>, Vec<String>) {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let (mut groups, mut libraries) = (Vec::<Group>::new(), Vec::new());
    let mut known = HashMap::new();
    let mut state: (&[u8], Option<&[u8]>) = (b"", None);
    for (number, chunk) in chunks.iter().enumerate() {
        let mut from = 0;
        let end = (chunk.corners[V].len() / 3, None);
        for (at, mark) in chunk.marks.iter().map(|&(at, mark)| (at, Some(mark))).chain([end]) {
            if from < at {
                let group = *known.entry(state).or_insert(groups.len());
                if group == groups.len() {
                    groups.push(Group { name: text(state.0), material: state.1.map(text), runs: vec![] });
                }
                groups[group].runs.push((number, from..at));
                from = at;
            }
            match mark {
                Some(Mark::Name(name)) => state.0 = name,
                Some(Mark::Material(name)) => state.1 = Some(name).filter(|name| !name.is_empty()),
                Some(Mark::Library(name)) => libraries.push(text(name)),
                None => {}
            }
        }
    }
    (groups, libraries)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_line_of_a_stray_corner_is_found_in_any_chunk() {
        let text =
            b"v 0 0 0\n\nf 1 1 1\nf -1 \\\n-1 -1\n# a comment\no name\n\nf 1 1 1 1\nf 1 1 1 1 9\nf 1 1 1\n";
        for size in 1..text.len() + 2 {
            assert_eq!(parse(text, size).unwrap_err().at, Place::Line(10), "{size}");
        }
    }

    proptest! {
        #[test]
        fn the_size_of_the_chunks_changes_nothing(
            lines in prop::collection::vec(prop::sample::select(&[
                "v 1 2 3", "v 4 5 6 0.5", "v 7 8 9 0.1 0.2 0.3", "vt 0.5", "vt 0.25 0.75", "vn 0 0 1", "vn 0 1 0 ",
                "f 1 2 3", "f -1 -2 -3 -4", "f 1/1/1 2/2/2 3/1/2", "f -1//-1 -2//-1 \\\n-3//-2", "f 2/1 1/1 3/2", "",
                "f 1 1 \\\r\n 2\r", "o a", "g b", "usemtl m", "usemtl", "mtllib x.mtl", "# comment \\", "s 1", "l 1 2", "f 9 9 9",
            ][..]), 0..60),
            size in 1_usize..200,
        ) {
            let start = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvt 0 0\nvt 1 1\nvn 1 0 0\nvn 0 1 0\n";
            let text = format!("{start}{}", lines.join("\n"));
            prop_assert_eq!(parse(text.as_bytes(), size), parse(text.as_bytes(), usize::MAX));
        }
    }
}
