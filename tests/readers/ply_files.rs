//! PLY files of all formats and layouts, and what is wrong with wrong ones.

use super::{complaint, write};
use glam::{DVec3, Vec2, Vec3};
use gloss::geometry::{MeshSource, ply};
use tempfile::TempDir;

/// A header with the given lines between `ply` and `end_header`.
fn header(lines: &[&str]) -> Vec<u8> {
    format!("ply\n{}\nend_header\n", lines.join("\n")).into_bytes()
}

const VERTICES: [&str; 4] = ["element vertex 3", "property float x", "property float y", "property float z"];
const FACES: [&str; 2] = ["element face 1", "property list uchar int vertex_indices"];

/// A text with the header of a triangle.
pub(crate) fn ascii(body: &str) -> Vec<u8> {
    let mut file = header(&[&["format ascii 1.0"], &VERTICES[..], &FACES[..]].concat());
    file.extend(body.bytes());
    file
}

#[test]
fn ply_files_of_every_format_and_layout_agree() {
    let layout = [
        "comment made by hand",
        "element material 2",
        "property list ushort char spare",
        "property short id",
        "element face 2",
        "property uchar flags",
        "property list uint16 uint8 vertex_index",
        "property list uint8 float64 texcoord",
        "element vertex 4",
        "property float64 z",
        "property uchar red",
        "property float nx",
        "property float t",
        "property float s",
        "property float ny",
        "property int32 x",
        "property list uchar short spare",
        "property float nz",
        "property short y",
        "element nothing 123456789012345",
        "obj_info the end",
    ];
    // The body once as numbers with their types, then in each of the three forms.
    let mut body: Vec<(f64, &str)> =
        vec![(1.0, "u16"), (7.0, "i8"), (-3.0, "i16"), (0.0, "u16"), (-4.0, "i16")];
    for polygon in [&[0.0, 1.0, 2.0, 3.0][..], &[0.0, 2.0, 1.0]] {
        body.extend([(255.0, "u8"), (polygon.len() as f64, "u16")]);
        body.extend(polygon.iter().map(|&v| (v, "u8")));
        body.extend([(1.0, "u8"), (0.5, "f64")]);
    }
    for (x, y) in [(0.0, 0.0), (1000.0, 0.0), (1000.0, -2.0), (0.0, -2.0)] {
        body.extend([(0.1, "f64"), (255.0, "u8"), (0.25, "f32"), (0.75, "f32"), (0.5, "f32"), (-1.0, "f32")]);
        body.extend([(x, "i32"), (2.0, "u8"), (-9.0, "i16"), (9.0, "i16"), (2.0, "f32"), (y, "i16")]);
    }
    let bytes = |big: bool| {
        let number = |&(x, kind): &(f64, &str)| {
            let mut bytes = match kind {
                "u8" => vec![x as u8],
                "i8" => vec![x as i8 as u8],
                "u16" => (x as u16).to_le_bytes().to_vec(),
                "i16" => (x as i16).to_le_bytes().to_vec(),
                "i32" => (x as i32).to_le_bytes().to_vec(),
                "f32" => (x as f32).to_le_bytes().to_vec(),
                _ => x.to_le_bytes().to_vec(),
            };
            if big {
                bytes.reverse();
            }
            bytes
        };
        body.iter().flat_map(number).collect::<Vec<u8>>()
    };
    let text = body.iter().map(|(x, _)| format!("{x} ")).collect::<String>().into_bytes();

    let at = |x, y| DVec3::new(x, y, 0.1);
    let expected = MeshSource {
        positions: vec![at(0.0, 0.0), at(1000.0, 0.0), at(1000.0, -2.0), at(0.0, -2.0)],
        indices: vec![[0, 1, 2], [0, 2, 3], [0, 2, 1]],
        normals: vec![Vec3::new(0.25, -1.0, 2.0); 4],
        uvs: vec![Vec2::new(0.5, 0.75); 4],
    };
    let folder = TempDir::new().unwrap();
    for (format, body) in
        [("ascii", text), ("binary_little_endian", bytes(false)), ("binary_big_endian", bytes(true))]
    {
        let mut file = header(&[&[&format!("format {format} 1.0")[..]], &layout[..]].concat());
        file.extend(body);
        assert_eq!(ply::read(&write(&folder, "a.ply", &file)).unwrap(), expected, "{format}");
        // Every shorter file is an error (the last byte of a text is a blank).
        let keep = if format == "ascii" { 2 } else { 1 };
        for length in 0..=file.len() - keep {
            assert!(ply::read(&write(&folder, "b.ply", &file[..length])).is_err(), "{format} {length}");
        }
    }
}

#[test]
fn wrong_ply_files_are_told_what_is_wrong_and_where() {
    let triangle = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    let little = |lines: &[&str], body: &[u8]| [header(lines), body.to_vec()].concat();
    let huge =
        [&["format binary_little_endian 1.0", "element vertex 4000000000"], &VERTICES[1..], &FACES].concat();
    let list = [
        &["format binary_little_endian 1.0"],
        &VERTICES[..],
        &["element face 1", "property list uint int vertex_indices"],
    ]
    .concat();
    let long_list = [vec![0; 36], vec![0xff, 0xff, 0xff, 0xff]].concat();
    for (file, expected) in [
        (b"solid".to_vec(), ", line 1: the file does not begin with `ply`"),
        (b"\x1f\x8b\x08".to_vec(), "unpack it first"),
        (b"ply\nformat ascii 1.0\n".to_vec(), ", line 3: the header has no `end_header`"),
        (header(&["format ascii 1.0", "element face 1"]), "no element `vertex`"),
        (header(&[&["format ascii 1.0"], &VERTICES[..]].concat()), "no element `face`"),
        (header(&[&VERTICES[..], &FACES].concat()), "names no format"),
        (header(&["format utf8 1.0"]), ", line 2: unknown format `utf8`"),
        (header(&["element vertex -1"]), "bad count"),
        (header(&["element vertex 1", "property real x"]), ", line 3: unknown type `real`"),
        (header(&["property float x"]), "before any element"),
        (header(&["what is this"]), "unknown header line `what is this`"),
        (header(&["element a 1", "property list float int b"]), "not a whole number"),
        (
            ascii(&triangle.replace("3 0 1 2", "3 0 1 3")),
            ", line 13: face 0 uses vertex 3, but there are 3 vertices",
        ),
        (ascii(&triangle.replace("3 0 1 2", "3 0 1 -1")), "face 0 uses vertex -1"),
        (
            ascii(&triangle.replace("3 0 1 2", "3 0 1 2.5")),
            "`2.5` in face 0 of 1 is not a number of its type",
        ),
        (
            ascii(&triangle.replace("1 0 0", "1 nan 0")),
            ", line 11: vertex 1 is at [1, NaN, 0], which is not finite",
        ),
        (ascii(&triangle.replace("1 0 0", "1 abc 0")), ", line 11: `abc` in vertex 1 of 3 is not a number"),
        (ascii("0 0 0 1 0 0"), "the file ends in vertex 2 of 3"),
        (ascii(&format!("{triangle}3 0 1 2")), "more in the file than its header says"),
        (
            little(&huge, &[0; 100]),
            &format!(", byte {}: the file ends in vertex 8 of 4000000000", header(&huge).len() + 100),
        ),
        (little(&list, &long_list), "the file ends in face 0 of 1"),
    ] {
        let message = complaint("a.ply", &file);
        assert!(message.contains(expected), "{:?}: {message}", String::from_utf8_lossy(&file));
    }
}
