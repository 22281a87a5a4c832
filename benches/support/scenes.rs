//! Generated scenes of different kinds, and meshes from files to put among them.

use super::{Random, argument};
use glam::{Quat, Vec3};
use gloss::geometry::{Aabb, Shape, TriangleMesh, obj, ply};
use std::f32::consts::{PI, TAU};
use std::path::Path;
use std::sync::Arc;

/// Shapes and how to look at them.
pub struct Scene {
    pub name: String,
    pub shapes: Vec<Shape>,
    pub eye: Vec3,
    pub look_at: Vec3,
    /// Corner and edges of the light.
    pub light: [Vec3; 3],
    /// Start of rays that leave a surface.
    pub t_min: f32,
}

impl Scene {
    pub fn triangles(&self) -> usize {
        self.shapes.iter().map(Shape::primitive_count).sum()
    }
}

/// The generated scenes of `--scenes` and the meshes of `--mesh`, each made when it is asked for.
pub fn wanted() -> impl Iterator<Item = Scene> {
    let meshes = argument("--mesh").unwrap_or_default();
    let default = if meshes.is_empty() { "knot,terrain,stadium,sticks" } else { "terrain,stadium,sticks" };
    let names = argument("--scenes").unwrap_or(default.into());
    let split =
        |list: String| list.split(',').filter(|s| !s.is_empty()).map(str::to_owned).collect::<Vec<_>>();
    let files = split(meshes).into_iter().map(|file| from_file(Path::new(&file)));
    files.chain(split(names).into_iter().map(|name| generated(&name)))
}

fn generated(name: &str) -> Scene {
    match name {
        "knot" => in_room("knot", torus_knot(1200, 25, 0.22)),
        "terrain" => terrain(708),
        "stadium" => stadium(),
        "sticks" => sticks(40_000),
        "blobs" => blobs(2000),
        _ => panic!("no scene `{name}`: knot, terrain, stadium, sticks or blobs"),
    }
}

/// A mesh of an OBJ or PLY file in a room.
fn from_file(path: &Path) -> Scene {
    let sources = if path.extension().is_some_and(|e| e == "obj") {
        let file = obj::read(path).unwrap_or_else(|e| panic!("{e}"));
        file.parts.into_iter().map(|part| part.mesh).collect()
    } else {
        vec![ply::read(path).unwrap_or_else(|e| panic!("{e}"))]
    };
    let (mut positions, mut indices) = (vec![], vec![]);
    for mesh in sources {
        let base = positions.len() as u32;
        positions.extend(mesh.positions.iter().map(|p| p.as_vec3()));
        indices.extend(mesh.indices.iter().map(|t| t.map(|i| base + i)));
    }
    in_room(&path.file_stem().unwrap_or_default().to_string_lossy(), (positions, indices))
}

type Soup = (Vec<Vec3>, Vec<[u32; 3]>);

fn shape((positions, indices): Soup) -> Shape {
    Shape::Mesh(Arc::new(
        TriangleMesh::new(positions, indices, vec![], vec![]).expect("generated meshes are valid"),
    ))
}

/// Scaled about the room's floor: 2 units across.
fn in_room(name: &str, mut mesh: Soup) -> Scene {
    let bounds = Aabb::around(mesh.0.iter().copied());
    let scale = 2.0 / bounds.size().max_element();
    for p in &mut mesh.0 {
        *p = (*p - bounds.center()) * scale;
    }
    let floor = -0.5 * scale * bounds.size().y;
    let room = boxed(Vec3::new(-3.0, floor, -3.0), Vec3::new(3.0, floor + 4.0, 3.0));
    Scene {
        name: name.into(),
        shapes: vec![shape(mesh), shape(room)],
        eye: Vec3::new(0.4, 0.7, 2.6),
        look_at: Vec3::ZERO,
        light: [Vec3::new(-0.5, floor + 3.9, -0.5), Vec3::X, Vec3::Z],
        t_min: 2e-4,
    }
}

fn boxed(lo: Vec3, hi: Vec3) -> Soup {
    let corner = |i: usize| {
        let pick = |axis: usize| if i >> axis & 1 == 1 { hi[axis] } else { lo[axis] };
        Vec3::new(pick(0), pick(1), pick(2))
    };
    let quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
    let indices = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    ((0..8).map(corner).collect(), indices)
}

/// A grid of `u * v` quads over a map from the unit square, closed in both directions or open.
fn grid(u: u32, v: u32, closed: bool, at: impl Fn(f32, f32) -> Vec3) -> Soup {
    let (cols, rows) = if closed { (u, v) } else { (u + 1, v + 1) };
    let mut positions = Vec::with_capacity((cols * rows) as usize);
    for j in 0..rows {
        for i in 0..cols {
            positions.push(at(i as f32 / u as f32, j as f32 / v as f32));
        }
    }
    let index = |i: u32, j: u32| i % cols + cols * (j % rows);
    let mut indices = Vec::with_capacity(2 * (u * v) as usize);
    for j in 0..v {
        for i in 0..u {
            let [a, b, c, d] = [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)];
            indices.extend([[a, b, c], [a, c, d]]);
        }
    }
    (positions, indices)
}

fn torus_knot(around: u32, sides: u32, radius: f32) -> Soup {
    let center = |t: f32| {
        let (p, q) = (2.0 * TAU * t, 3.0 * TAU * t);
        let r = 1.0 + 0.4 * q.cos();
        Vec3::new(r * p.cos(), 0.5 * q.sin(), r * p.sin())
    };
    grid(around, sides, true, |t, s| {
        let tangent = (center(t + 1e-3) - center(t - 1e-3)).normalize();
        let side = tangent.cross(Vec3::Y).normalize();
        let up = side.cross(tangent);
        let angle = TAU * s;
        center(t) + radius * (1.0 + 0.1 * (40.0 * TAU * t).sin()) * (angle.cos() * side + angle.sin() * up)
    })
}

/// Value noise in nine octaves, seen at a grazing angle.
fn terrain(n: u32) -> Scene {
    let hash = |x: i32, y: i32, octave: i32| {
        let seed = (x as u64) << 40 ^ (y as u64 & 0xff_ffff) << 8 ^ octave as u64;
        Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15)).unit()
    };
    let noise = |x: f32, y: f32, octave: i32| {
        let (ix, iy) = (x.floor(), y.floor());
        let smooth = |f: f32| f * f * (3.0 - 2.0 * f);
        let (fx, fy) = (smooth(x - ix), smooth(y - iy));
        let (ix, iy) = (ix as i32, iy as i32);
        let row = |j: i32| hash(ix, j, octave) * (1.0 - fx) + hash(ix + 1, j, octave) * fx;
        row(iy) * (1.0 - fy) + row(iy + 1) * fy
    };
    let height = |x: f32, y: f32| {
        (0..9).map(|o| 0.5f32.powi(o) * noise(x * 2f32.powi(o), y * 2f32.powi(o), o)).sum::<f32>()
    };
    let mesh = grid(n, n, false, |u, v| {
        let (x, z) = (10.0 * u, 10.0 * v);
        Vec3::new(x - 5.0, height(x, z), z - 5.0)
    });
    Scene {
        name: "terrain".into(),
        shapes: vec![shape(mesh)],
        eye: Vec3::new(0.0, 2.4, 5.2),
        look_at: Vec3::new(0.0, 0.9, 0.0),
        light: [Vec3::new(-1.0, 6.0, -1.0), 2.0 * Vec3::X, 2.0 * Vec3::Z],
        t_min: 1e-3,
    }
}

/// A small thing of 60,000 triangles in a bowl 220 units wide.
fn stadium() -> Scene {
    let mut small = torus_knot(1200, 25, 0.22);
    for p in &mut small.0 {
        *p = 0.1 * *p + 0.08 * Vec3::Y;
    }
    let bowl = grid(600, 30, false, |u, v| {
        let step = (30.0 * v).floor() + 0.5 * (30.0 * v).fract();
        let (sin, cos) = (TAU * u).sin_cos();
        let r = 60.0 + 50.0 * v;
        Vec3::new(r * cos, step, r * sin)
    });
    let field = (
        vec![
            Vec3::new(-110.0, 0.0, -110.0),
            Vec3::new(110.0, 0.0, -110.0),
            Vec3::new(110.0, 0.0, 110.0),
            Vec3::new(-110.0, 0.0, 110.0),
        ],
        vec![[0, 1, 2], [0, 2, 3]],
    );
    Scene {
        name: "stadium".into(),
        shapes: vec![shape(small), shape(bowl), shape(field)],
        eye: Vec3::new(0.05, 0.25, 0.45),
        look_at: Vec3::new(0.0, 0.06, 0.0),
        light: [Vec3::new(-10.0, 60.0, -10.0), 20.0 * Vec3::X, 20.0 * Vec3::Z],
        t_min: 1e-4,
    }
}

/// Long thin prisms at random, in a room.
fn sticks(count: u32) -> Scene {
    let mut random = Random(11);
    let (mut positions, mut indices) = (vec![], vec![]);
    for _ in 0..count {
        let center = 10.0 * Vec3::new(random.signed(), random.signed(), random.signed());
        let turn = Quat::from_euler(
            glam::EulerRot::XYZ,
            TAU * random.unit(),
            TAU * random.unit(),
            TAU * random.unit(),
        );
        let half = turn * Vec3::X * (0.25 + 2.25 * random.unit());
        let thick = 0.006 + 0.01 * random.unit();
        let base = positions.len() as u32;
        for end in [-half, half] {
            for k in 0..3 {
                let (sin, cos) = (TAU * k as f32 / 3.0).sin_cos();
                positions.push(center + end + turn * Vec3::new(0.0, thick * cos, thick * sin));
            }
        }
        for k in 0..3 {
            let next = (k + 1) % 3;
            indices.push([base + k, base + next, base + 3 + next]);
            indices.push([base + k, base + 3 + next, base + 3 + k]);
        }
    }
    Scene {
        name: "sticks".into(),
        shapes: vec![shape((positions, indices)), shape(boxed(Vec3::splat(-13.0), Vec3::splat(13.0)))],
        eye: Vec3::new(3.0, 2.0, 12.0),
        look_at: Vec3::ZERO,
        light: [Vec3::new(-2.0, 12.9, -2.0), 4.0 * Vec3::X, 4.0 * Vec3::Z],
        t_min: 1e-3,
    }
}

/// Displaced spheres of 5,120 triangles, flattened into the scene, on a ground.
fn blobs(count: u32) -> Scene {
    let mut random = Random(12);
    let side = (count as f32).sqrt();
    let mut shapes = Vec::with_capacity(count as usize + 1);
    for _ in 0..count {
        let center = Vec3::new(side * random.signed(), 0.6 + 2.0 * random.unit(), side * random.signed());
        let radius = 0.3 + 0.5 * random.unit();
        let [a, b, c] = [0, 1, 2].map(|_| 2.0 + 6.0 * random.unit());
        shapes.push(shape(grid(64, 40, false, |u, v| {
            let (theta, phi) = (PI * v, TAU * (u % 1.0));
            let p = Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
            let bump = 1.0 + 0.1 * ((a * p.x).sin() + (b * p.y).sin() + (c * p.z).sin());
            center + radius * bump * p
        })));
    }
    let s = 1.5 * side;
    let ground =
        vec![Vec3::new(-s, 0.0, -s), Vec3::new(s, 0.0, -s), Vec3::new(s, 0.0, s), Vec3::new(-s, 0.0, s)];
    shapes.push(shape((ground, vec![[0, 2, 1], [0, 3, 2]])));
    Scene {
        name: "blobs".into(),
        shapes,
        eye: Vec3::new(0.0, 6.0, side),
        look_at: Vec3::new(0.0, 1.0, 0.0),
        light: [Vec3::new(-3.0, 30.0, -3.0), 6.0 * Vec3::X, 6.0 * Vec3::Z],
        t_min: 1e-3,
    }
}
