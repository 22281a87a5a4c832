//! The mesh readers against an oracle, against each other, and against files that lie.

use glam::{DAffine3, DVec3, Vec2, Vec3};
use gloss::geometry::{Generator, MeshSource, generate, obj, ply};
use proptest::prelude::*;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

fn write(folder: &TempDir, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
    let path = folder.path().join(name);
    std::fs::write(&path, content).unwrap();
    path
}

/// The message of a file that cannot be read; it always names the file.
fn complaint(name: &str, content: impl AsRef<[u8]>) -> String {
    let folder = TempDir::new().unwrap();
    let path = write(&folder, name, content);
    let error = match name.ends_with("ply") {
        true => ply::read(&path).map(|_| ()),
        false => obj::read(&path).map(|_| ()),
    };
    let message = error.expect_err("the file is wrong").to_string();
    message.strip_prefix(&format!("{}", path.display())).expect("the message names the file").to_owned()
}

/// Position, texture coordinate and normal of each corner of each triangle: what a mesh is, however it is indexed.
type Corners = Vec<[(DVec3, Option<Vec2>, Option<Vec3>); 3]>;

fn corners(mesh: &MeshSource) -> Corners {
    let corner = |v: u32| {
        let v = v as usize;
        (mesh.positions[v], mesh.uvs.get(v).copied(), mesh.normals.get(v).copied())
    };
    mesh.indices.iter().map(|triangle| triangle.map(corner)).collect()
}

/// Name, material name and corners of each part, as tobj reads them.
fn by_tobj(path: &Path) -> Vec<(String, Option<String>, Corners)> {
    let (models, materials) = tobj::load_obj(path, &tobj::GPU_LOAD_OPTIONS).unwrap();
    let materials = materials.unwrap_or_default();
    let part = |model: tobj::Model| {
        let vectors = |v: &[f64]| v.chunks_exact(3).map(DVec3::from_slice).collect::<Vec<_>>();
        let mesh = MeshSource {
            positions: vectors(&model.mesh.positions),
            indices: model.mesh.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
            normals: vectors(&model.mesh.normals).iter().map(|n| n.as_vec3()).collect(),
            uvs: model.mesh.texcoords.chunks_exact(2).map(|t| Vec2::new(t[0] as f32, t[1] as f32)).collect(),
        };
        let name = if model.name == "unnamed_object" { String::new() } else { model.name };
        (name, model.mesh.material_id.map(|i| materials[i].name.clone()), corners(&mesh))
    };
    models.into_iter().map(part).filter(|part| !part.2.is_empty()).collect()
}

fn by_gloss(path: &Path) -> Vec<(String, Option<String>, Corners)> {
    let file = obj::read(path).unwrap();
    let material = |i: Option<usize>| i.map(|i| file.materials[i].name.clone());
    file.parts.iter().map(|p| (p.name.clone(), material(p.material), corners(&p.mesh))).collect()
}

const CUBE: &str = "\
# two materials, corners with normals of their own, quadrilaterals
mtllib cube.mtl
o cube
v -1 -1 -1
v 1 -1 -1.0e0
v 1 1 -1
v -1 1 -1
v -1 -1 1
v 1 -1 1
v 1 1 1
v -1 1 1
vt 0 0
vt 1 0
vt 1 1
vt 0 1
vn 0 0 -1
vn 0 0 1
vn -1 0 0
vn 1 0 0
usemtl red
f 4/4/1 3/3/1 2/2/1 1/1/1
f 5/1/2 6/2/2 7/3/2 8/4/2
usemtl blue paint
f 1/1/3 5/2/3 8/3/3 4/4/3
g side of the cube
f -7/1/-1 -6/2/-1 -2/3/-1 -3/4/-1
l 1 2
s off
";

const CUBE_MTL: &str = "\
newmtl red
Kd 0.8 0.1 0.1
Ks 0.5 0.5 0.5
Ns 250.5
newmtl blue paint
Kd 0.1
Ke 1 2 3
map_Kd paint.png
";

#[test]
fn an_obj_file_is_what_tobj_makes_of_it() {
    let folder = TempDir::new().unwrap();
    write(&folder, "cube.mtl", CUBE_MTL.replace("Kd 0.1\n", "Kd 0.1 0.1 0.1\n"));
    let path = write(&folder, "cube.obj", CUBE);
    let parts = by_gloss(&path);
    let name = |name: &str, material: &str| (name.to_owned(), Some(material.to_owned()));
    let names: Vec<_> = parts.iter().map(|p| (p.0.clone(), p.1.clone())).collect();
    let expected = [name("cube", "red"), name("cube", "blue paint"), name("side of the cube", "blue paint")];
    assert_eq!(names, expected);
    assert_eq!(parts, by_tobj(&path));
}

#[test]
fn materials_are_read_with_what_they_leave_out() {
    let folder = TempDir::new().unwrap();
    write(&folder, "cube.mtl", CUBE_MTL);
    let file = obj::read(&write(&folder, "cube.obj", CUBE)).unwrap();
    let [red, blue] = &file.materials[..] else { panic!("{:?}", file.materials) };
    assert_eq!(
        (red.diffuse, red.specular, red.exponent),
        (Some([0.8, 0.1, 0.1]), Some([0.5; 3]), Some(250.5))
    );
    assert_eq!((blue.diffuse, blue.specular, blue.exponent), (Some([0.1; 3]), None, None));
    assert_eq!((red.emission, blue.emission), (None, Some([1.0, 2.0, 3.0])));
    assert_eq!(file.files, [folder.path().join("cube.obj"), folder.path().join("cube.mtl")]);
    assert!(matches!(&file.warnings[..], [w] if w.contains("paint.png")), "{:?}", file.warnings);
}

#[test]
fn materials_that_are_not_there_are_warnings() {
    let folder = TempDir::new().unwrap();
    let file = obj::read(&write(&folder, "cube.obj", CUBE)).unwrap();
    assert!(file.parts.iter().all(|p| p.material.is_none()));
    for word in ["cube.mtl", "`red`", "`blue paint`"] {
        assert!(file.warnings.iter().any(|w| w.contains(word)), "{word}: {:?}", file.warnings);
    }
}

#[test]
fn triangles_of_one_name_and_material_are_one_part() {
    let folder = TempDir::new().unwrap();
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\ng a\nusemtl m\nf 1 2 3\nusemtl n\nf 1 2 3\nusemtl m\nf 3 2 1\ng b\ng a\nf 2 3 1\n";
    let parts = obj::read(&write(&folder, "a.obj", text)).unwrap().parts;
    assert_eq!(parts.iter().map(|p| p.mesh.indices.len()).collect::<Vec<_>>(), [3, 1]);
}

#[test]
fn corners_without_a_normal_are_flat_where_others_have_one() {
    let folder = TempDir::new().unwrap();
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//1\nf 1 2 3\n";
    let mesh = &obj::read(&write(&folder, "a.obj", text)).unwrap().parts[0].mesh;
    assert_eq!(mesh.positions.len(), 6);
    let normals: Vec<Vec3> = corners(mesh).iter().flatten().map(|corner| corner.2.unwrap()).collect();
    assert_eq!(normals, [Vec3::Z, Vec3::Z, Vec3::Z, Vec3::ZERO, Vec3::ZERO, Vec3::ZERO]);
}

#[test]
fn a_vertex_of_many_normals_is_unified_too() {
    let folder = TempDir::new().unwrap();
    let mut text = "v 0 0 0\nv 1 0 0\nv 0 1 0\n".to_owned();
    (0..100).for_each(|i| writeln!(text, "vn {i} 1 0").unwrap());
    for i in (1..=100).chain(1..=100) {
        writeln!(text, "f 1//{i} 2//1 3//1").unwrap();
    }
    let path = write(&folder, "a.obj", text);
    let file = obj::read(&path).unwrap();
    assert_eq!(file.parts[0].mesh.positions.len(), 102);
    assert_eq!(by_gloss(&path), by_tobj(&path));
}

#[test]
fn odd_but_legal_texts_are_read() {
    let folder = TempDir::new().unwrap();
    let text = "\u{feff}v 0 0 0 # a comment\r\n\tv 2 0 0 2\r\nv 0 1 0 0.5 0.5 0.5\r\nv 0\\\r\n0 1\r\n# C:\\dir\\\r\nvt 0.5\r\nf 1 2\\\r\n 3 \r\nf 1 3 4";
    let mesh = &obj::read(&write(&folder, "a.obj", text)).unwrap().parts[0].mesh;
    assert_eq!(mesh.positions, [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z]);
    assert_eq!(mesh.indices, [[0, 1, 2], [0, 2, 3]]);
}

#[test]
fn a_mesh_far_from_the_origin_keeps_its_shape() {
    let folder = TempDir::new().unwrap();
    let text = "v 10000000.001 0 0\nv 10000000.002 0 0\nv 10000000.001 0.001 0\nf 1 2 3\n";
    let source = obj::read(&write(&folder, "a.obj", text)).unwrap().parts.remove(0).mesh;
    let to_unit = DAffine3::from_scale(DVec3::splat(1000.0)) * DAffine3::from_translation(-1e7 * DVec3::X);
    let (mesh, dropped) = source.to_mesh(&to_unit).unwrap();
    assert_eq!(dropped.total(), 0);
    assert!((mesh.positions()[1] - 2.0 * Vec3::X).length() < 1e-4, "{}", mesh.positions()[1]);
}

#[test]
fn wrong_obj_files_are_told_what_is_wrong_and_where() {
    for (text, expected) in [
        ("v 1 2\n", ", line 1: a vertex of 2 numbers: "),
        ("v 1 2 3\nv 1 x 3\n", ", line 2: `x` is there where a number is due: "),
        ("# a\n\nv 1 nan 3\n", ", line 3: a vertex at [1, NaN, 3], which is not finite: "),
        ("v 1 1 1e999\n", "which is not finite"),
        ("v 1 1 1 0\n", "which is not finite"),
        ("v 0 0 0\nf 1 1 2\n", ", line 2: a corner of the face refers to something else than the 1 vertices"),
        (
            "v 0 0 0\n\nf 1 1 1\nf 1/1 1/1 1/1\n",
            ", line 4: a corner of the face refers to something else than the 0 tex",
        ),
        ("v 0 0 0\nf 1//1 1//1 1//1\n", "the 0 normals"),
        ("v 0 0 0\nf -1 -1 -2\n", ", line 2: a corner of the face refers"),
        ("v 0 0 0\nf 0 1 1\n", ", line 2: a corner names number 0: "),
        ("v 0 0 0\nf 1 1 99999999999\n", "a corner names number 99999999999"),
        ("f 1/2/3/4 1 1\n", "`/4` is there"),
        ("f\n", ", line 1: the line ends where a number is due: a face is"),
        ("vn 1 0\n", "a normal of 2 numbers"),
        ("vt\n", "a texture coordinate of 0 numbers"),
    ] {
        let message = complaint("a.obj", text);
        assert!(message.contains(expected), "{text:?}: {message}");
    }
}

#[test]
fn a_wrong_material_file_is_named() {
    let folder = TempDir::new().unwrap();
    let path = write(&folder, "a.obj", "mtllib a.mtl\n");
    let mtl = write(&folder, "a.mtl", "newmtl a\nKd 1 0\n");
    let message = obj::read(&path).unwrap_err().to_string();
    assert!(message.starts_with(&format!("{}, line 2: `1 0` ", mtl.display())), "{message}");
}

#[test]
fn a_missing_file_is_named() {
    for error in
        [obj::read(Path::new("no/such.obj")).unwrap_err(), ply::read(Path::new("no/such.obj")).unwrap_err()]
    {
        assert!(error.to_string().starts_with("cannot read no/such.obj: "), "{error}");
    }
}

/// A header with the given lines between `ply` and `end_header`.
fn header(lines: &[&str]) -> Vec<u8> {
    format!("ply\n{}\nend_header\n", lines.join("\n")).into_bytes()
}

const VERTICES: [&str; 4] = ["element vertex 3", "property float x", "property float y", "property float z"];
const FACES: [&str; 2] = ["element face 1", "property list uchar int vertex_indices"];

fn ascii(body: &str) -> Vec<u8> {
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

#[test]
fn generated_meshes_survive_both_formats() {
    let folder = TempDir::new().unwrap();
    for kind in Generator::ALL {
        let mesh = generate::generate(kind, 2000, 4);
        let [a, b] = ["a.ply", "a.obj"].map(|name| folder.path().join(name));
        ply::write(&a, &mesh).unwrap();
        obj::write(&b, &mesh).unwrap();
        assert_eq!(ply::read(&a).unwrap(), mesh, "{kind:?}");
        assert_eq!(corners(&obj::read(&b).unwrap().parts[0].mesh), corners(&mesh), "{kind:?}");
        assert_eq!(by_gloss(&b), by_tobj(&b), "{kind:?}");
    }
}

prop_compose! {
    /// A mesh of any finite numbers.
    fn mesh()(count in 1_usize..20, normals in any::<bool>(), uvs in any::<bool>())(
        positions in prop::collection::vec(prop::array::uniform3(prop::num::f64::NORMAL | prop::num::f64::ZERO | prop::num::f64::SUBNORMAL), count),
        indices in prop::collection::vec(prop::array::uniform3(0..count as u32), 1..30),
        normals in prop::collection::vec(prop::array::uniform3(-1.0_f32..1.0), if normals { count } else { 0 }),
        uvs in prop::collection::vec(prop::array::uniform2(-9.0_f32..9.0), if uvs { count } else { 0 }),
    ) -> MeshSource {
        MeshSource {
            positions: positions.into_iter().map(DVec3::from_array).collect(),
            indices,
            normals: normals.into_iter().map(Vec3::from_array).collect(),
            uvs: uvs.into_iter().map(Vec2::from_array).collect(),
        }
    }
}

/// A valid file of each kind, to be spoilt.
fn valid_files() -> Vec<Vec<u8>> {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("a.ply");
    ply::write(&path, &generate::generate(Generator::Terrain, 8, 0)).unwrap();
    vec![CUBE.into(), CUBE_MTL.into(), ascii("0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"), std::fs::read(path).unwrap()]
}

proptest! {
    #[test]
    fn any_mesh_reads_back_as_it_was_written(mesh in mesh()) {
        let folder = TempDir::new().unwrap();
        let [a, b] = ["a.ply", "a.obj"].map(|name| folder.path().join(name));
        ply::write(&a, &mesh).unwrap();
        prop_assert_eq!(&ply::read(&a).unwrap(), &mesh);
        obj::write(&b, &mesh).unwrap();
        prop_assert_eq!(corners(&obj::read(&b).unwrap().parts[0].mesh), corners(&mesh));
        prop_assert_eq!(by_gloss(&b), by_tobj(&b));
    }

    #[test]
    fn spoilt_files_never_panic(
        which in 0_usize..4,
        edits in prop::collection::vec((any::<prop::sample::Index>(), prop::sample::select(&b"0123456789-/.e \n\\vfglu#\x00\xff"[..])), 1..6),
        cut in any::<prop::sample::Index>(),
        cutting in any::<bool>(),
    ) {
        let mut file = valid_files().swap_remove(which);
        for (place, byte) in edits {
            let place = place.index(file.len());
            file[place] = byte;
        }
        file.truncate(if cutting { cut.index(file.len()) } else { file.len() });
        let folder = TempDir::new().unwrap();
        let path = write(&folder, "a.mtl", &file);
        let _ = (ply::read(&path), obj::read(&path));
        let _ = obj::read(&write(&folder, "a.obj", "mtllib a.mtl\n"));
    }

    #[test]
    fn any_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..200), ply_header in any::<bool>()) {
        let start = if ply_header { ascii("") } else { Vec::new() };
        let folder = TempDir::new().unwrap();
        let path = write(&folder, "a.mtl", [start, bytes].concat());
        let _ = (ply::read(&path), obj::read(&path));
        let _ = obj::read(&write(&folder, "a.obj", "mtllib a.mtl\n"));
    }
}
