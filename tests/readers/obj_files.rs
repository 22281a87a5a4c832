//! OBJ and MTL files: what tobj makes of them, and what is wrong with wrong ones.

use super::{by_gloss, by_tobj, complaint, corners, write};
use glam::{DAffine3, DVec3, Vec3};
use gloss::geometry::{obj, ply};
use std::fmt::Write;
use std::path::Path;
use tempfile::TempDir;

pub(crate) const CUBE: &str = "\
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

pub(crate) const CUBE_MTL: &str = "\
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

#[test]
fn what_is_no_text_is_refused_with_its_line() {
    let folder = TempDir::new().unwrap();
    let utf_16: Vec<u8> = CUBE.encode_utf16().flat_map(u16::to_le_bytes).collect();
    for (bytes, line) in
        [(&b"# a cube\nv 0 0 \0\n"[..], 2), (&utf_16, 1), (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", 3)]
    {
        let path = folder.path().join("a.obj");
        std::fs::write(&path, bytes).unwrap();
        let message = obj::read(&path).unwrap_err().to_string();
        assert!(message.contains(&format!("a.obj, line {line}: a zero byte")), "{message}");
    }
}
