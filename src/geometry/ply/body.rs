//! The elements of a PLY file: vertices and faces are kept, others passed over.

use super::header::{Element, Header, Kind, Property, Scalar};
use super::numbers::Numbers;
use crate::geometry::MeshSource;
use crate::geometry::file_error::{Fault, Place};
use glam::{DVec2, DVec3};

/// Reads all elements after the header.
pub(super) fn read(header: &Header, mut numbers: impl Numbers) -> Result<MeshSource, Fault> {
    let table = |name: &str| header.elements.iter().find(|e| e.name == name);
    let missing = |what, mend| Fault::new(Place::Line(1), what, mend);
    let vertex =
        table("vertex").ok_or_else(|| missing("the header has no element `vertex`", "export a mesh"))?;
    let columns = Columns::of(vertex)
        .ok_or_else(|| missing("the element `vertex` has no numbers x, y and z", "export the positions"))?;
    let face = table("face").ok_or_else(|| {
        missing("the header has no element `face`", "a cloud of points has no surface: make triangles of it")
    })?;
    let corners = (face.find("vertex_indices").or(face.find("vertex_index")))
        .filter(|&i| matches!(face.properties[i].kind, Kind::List { item, .. } if item.is_integer()))
        .ok_or_else(|| {
            missing("the element `face` has no list of whole numbers `vertex_indices`", "export the faces")
        })?;
    if u32::try_from(vertex.count).is_err() {
        let what = format!("{} vertices are more than a mesh can have", vertex.count);
        return Err(missing(&what, "split the mesh into files of less than 4294967296 vertices"));
    }

    let mut mesh = MeshSource::default();
    for element in &header.elements {
        match &element.name[..] {
            "vertex" => read_vertices(&mut numbers, vertex, &columns, &mut mesh)?,
            "face" => mesh.indices = read_faces(&mut numbers, face, corners, vertex.count)?,
            _ => pass_over(&mut numbers, element)?,
        }
    }
    if !numbers.is_finished() {
        let what = "there is more in the file than its header says";
        return Err(Fault::new(
            numbers.place(),
            what,
            "mend the counts in the header or export the mesh again",
        ));
    }
    Ok(mesh)
}

/// Where each property of a vertex goes.
struct Columns {
    /// For each property, the place in a [`Row`]; the last place is never read.
    places: Vec<usize>,
    has_normals: bool,
    has_uvs: bool,
}

/// x y z, nx ny nz, u v, and a place for the rest.
type Row = [f64; 9];

impl Columns {
    /// `None` if there are no positions.
    fn of(vertex: &Element) -> Option<Self> {
        let scalar = |name: &&str| match vertex.properties[vertex.find(name)?].kind {
            Kind::Scalar(_) => vertex.find(name),
            Kind::List { .. } => None,
        };
        let all = |names: &[&str]| names.iter().map(scalar).collect::<Option<Vec<usize>>>();
        let positions = all(&["x", "y", "z"])?;
        let normals = all(&["nx", "ny", "nz"]);
        let uv_names = [["u", "v"], ["s", "t"], ["texture_u", "texture_v"], ["texture_s", "texture_t"]];
        let uvs = uv_names.iter().find_map(|names| all(names));

        let mut places = vec![8; vertex.properties.len()];
        for (first, found) in [(0, Some(&positions)), (3, normals.as_ref()), (6, uvs.as_ref())] {
            for (i, &property) in found.into_iter().flatten().enumerate() {
                places[property] = first + i;
            }
        }
        Some(Self { places, has_normals: normals.is_some(), has_uvs: uvs.is_some() })
    }
}

fn read_vertices<N: Numbers>(
    numbers: &mut N,
    vertex: &Element,
    columns: &Columns,
    mesh: &mut MeshSource,
) -> Result<(), Fault> {
    // The count may lie: there is room for no more than the file can hold.
    let count = vertex.count;
    let room = count.min(numbers.most(Scalar::U8) / vertex.properties.len());
    mesh.positions.reserve_exact(room);
    mesh.normals.reserve_exact(if columns.has_normals { room } else { 0 });
    mesh.uvs.reserve_exact(if columns.has_uvs { room } else { 0 });
    for i in 0..count {
        let mut row: Row = [0.0; 9];
        for (property, &place) in vertex.properties.iter().zip(&columns.places) {
            let value = match property.kind {
                Kind::Scalar(scalar) => numbers.float(scalar),
                Kind::List { .. } => skip_property(numbers, property).map(|()| 0.0),
            };
            row[place] = value.ok_or_else(|| numbers.fault(&format!("vertex {i} of {count}")))?;
        }
        let position = DVec3::new(row[0], row[1], row[2]);
        if !position.is_finite() {
            let what = format!("vertex {i} is at {position}, which is not finite");
            return Err(Fault::new(numbers.place(), what, "remove or mend the vertex"));
        }
        mesh.positions.push(position);
        if columns.has_normals {
            mesh.normals.push(DVec3::new(row[3], row[4], row[5]).as_vec3());
        }
        if columns.has_uvs {
            mesh.uvs.push(DVec2::new(row[6], row[7]).as_vec2());
        }
    }
    Ok(())
}

fn read_faces<N: Numbers>(
    numbers: &mut N,
    face: &Element,
    corners: usize,
    vertices: usize,
) -> Result<Vec<[u32; 3]>, Fault> {
    let count = face.count;
    let mut triangles = Vec::with_capacity(count.min(numbers.most(Scalar::U8) / 4));
    let mut polygon = Vec::new();
    for i in 0..count {
        for (place, property) in face.properties.iter().enumerate() {
            let done = match property.kind {
                Kind::List { count, item } if place == corners => {
                    read_polygon(numbers, count, item, vertices, &mut polygon)
                }
                _ => skip_property(numbers, property),
            };
            if done.is_none() {
                return Err(face_fault(numbers, &polygon, i, count, vertices));
            }
        }
        push_fan(&polygon, &mut triangles);
    }
    Ok(triangles)
}

/// The corners of a face; `None` if it cannot be read, or with a last corner that is no vertex.
#[inline]
fn read_polygon<N: Numbers>(
    numbers: &mut N,
    count: Scalar,
    item: Scalar,
    vertices: usize,
    polygon: &mut Vec<i64>,
) -> Option<()> {
    polygon.clear();
    for _ in 0..usize::try_from(numbers.integer(count)?).ok()? {
        let corner = numbers.integer(item)?;
        polygon.push(corner);
        if corner < 0 || corner >= vertices as i64 {
            return None;
        }
    }
    Some(())
}

/// What is wrong with face `i`.
fn face_fault<N: Numbers>(numbers: &N, polygon: &[i64], i: usize, count: usize, vertices: usize) -> Fault {
    match polygon.last() {
        Some(&corner) if corner < 0 || corner >= vertices as i64 => {
            let what =
                format!("face {i} uses vertex {corner}, but there are {vertices} vertices (the first is 0)");
            Fault::new(numbers.place(), what, "export the mesh again")
        }
        _ => numbers.fault(&format!("face {i} of {count}")),
    }
}

/// A fan of triangles: right for convex polygons. A point or a line becomes a triangle without area, so that it is
/// counted when those are dropped.
#[inline]
fn push_fan(polygon: &[i64], triangles: &mut Vec<[u32; 3]>) {
    match *polygon {
        [] => {}
        [a] => triangles.push([a as u32; 3]),
        [a, b] => triangles.push([a as u32, b as u32, b as u32]),
        [a, ref rest @ ..] => triangles.extend(rest.windows(2).map(|w| [a as u32, w[0] as u32, w[1] as u32])),
    }
}

fn skip_property<N: Numbers>(numbers: &mut N, property: &Property) -> Option<()> {
    match property.kind {
        Kind::Scalar(scalar) => numbers.skip(1, scalar),
        Kind::List { count, item } => {
            let length = usize::try_from(numbers.integer(count)?).ok()?;
            numbers.skip(length, item)
        }
    }
}

fn pass_over<N: Numbers>(numbers: &mut N, element: &Element) -> Result<(), Fault> {
    // Rows without properties take no room, whatever their count.
    let rows = if element.properties.is_empty() { 0 } else { element.count };
    for i in 0..rows {
        for property in &element.properties {
            skip_property(numbers, property).ok_or_else(|| {
                numbers.fault(&format!("row {i} of element {}", element.name.escape_debug()))
            })?;
        }
    }
    Ok(())
}
