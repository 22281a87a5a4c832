//! Shapes and rays, drawn from fixed seeds.

use gloss::core::{Ray, Vec3};
use gloss::geometry::{Shape, Sphere, TriangleMesh};
use std::collections::HashMap;
use std::sync::Arc;

/// SplitMix64 (Steele, Lea and Flood 2014).
pub(crate) struct Rng(u64);

impl Rng {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub(crate) fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In [0, 1).
    pub(crate) fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1u64 << 24) as f32
    }

    pub(crate) fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }

    /// In the cube from -1 to 1.
    pub(crate) fn point(&mut self) -> Vec3 {
        Vec3::from_array(std::array::from_fn(|_| 2.0 * self.unit() - 1.0))
    }

    /// Of unit length.
    pub(crate) fn direction(&mut self) -> Vec3 {
        loop {
            let p = self.point();
            if p.length_squared() > 0.01 && p.length_squared() < 1.0 {
                return p.normalize();
            }
        }
    }
}

pub(crate) fn mesh(positions: Vec<Vec3>, indices: Vec<[u32; 3]>) -> Shape {
    Shape::Mesh(Arc::new(TriangleMesh::new(positions, indices, vec![], vec![]).unwrap()))
}

pub(crate) fn triangle(corners: [Vec3; 3]) -> Shape {
    mesh(corners.to_vec(), vec![[0, 1, 2]])
}

pub(crate) fn spheres(spheres: &[(Vec3, f32)]) -> Shape {
    Shape::Spheres(spheres.iter().map(|&(center, radius)| Sphere { center, radius }).collect())
}

/// The unit right triangle at height `z`, seen from above.
pub(crate) fn right_triangle(z: f32) -> [Vec3; 3] {
    [Vec3::new(0.0, 0.0, z), Vec3::new(1.0, 0.0, z), Vec3::new(0.0, 1.0, z)]
}

/// Triangles that share nothing, of sizes from a hundredth to one.
pub(crate) fn soup(rng: &mut Rng, count: u32) -> Shape {
    let positions = (0..count).flat_map(|_| {
        let (center, size) = (rng.point(), 10f32.powf(-2.0 * rng.unit()));
        [(); 3].map(|()| center + size * rng.point())
    });
    mesh(positions.collect(), (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
}

pub(crate) fn random_spheres(rng: &mut Rng, count: usize) -> Shape {
    Shape::Spheres(
        (0..count)
            .map(|_| Sphere { center: rng.point(), radius: 0.3 * 10f32.powf(-2.0 * rng.unit()) })
            .collect(),
    )
}

/// A closed mesh about the origin with vertices shared by its triangles: an icosahedron, each triangle cut into four
/// `levels` times, dented so that edges meet at all angles but every point still sees the origin.
pub(crate) fn dented_ball(levels: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let (mut points, mut triangles) = icosahedron();
    for _ in 0..levels {
        let mut middles = HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                points.push((points[a as usize] + points[b as usize]).normalize());
                points.len() as u32 - 1
            })
        };
        triangles = triangles
            .into_iter()
            .flat_map(|[a, b, c]| {
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
            })
            .collect();
    }
    let mut rng = Rng::new(7);
    let points = points.into_iter().map(|p| p * (0.8 + 0.2 * rng.unit())).collect();
    (points, triangles)
}

fn icosahedron() -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let g = f32::midpoint(1.0, 5f32.sqrt());
    let points = [(-1.0, g), (1.0, g), (-1.0, -g), (1.0, -g)]
        .iter()
        .map(|&(a, b)| Vec3::new(a, b, 0.0))
        .chain([(-1.0, g), (1.0, g), (-1.0, -g), (1.0, -g)].iter().map(|&(a, b)| Vec3::new(0.0, a, b)))
        .chain([(g, -1.0), (g, 1.0), (-g, -1.0), (-g, 1.0)].iter().map(|&(a, b)| Vec3::new(a, 0.0, b)))
        .map(Vec3::normalize)
        .collect();
    let triangles = vec![
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    (points, triangles)
}

/// Rays between random points of a cube twice the size of the scene's.
pub(crate) fn random_rays(rng: &mut Rng, count: usize) -> Vec<Ray> {
    (0..count)
        .map(|_| {
            let (from, to) = (2.0 * rng.point(), rng.point());
            Ray::new(from, (to - from).normalize())
        })
        .collect()
}

/// Rays of a pinhole camera in blocks of neighbours.
pub(crate) fn camera_rays(count: usize) -> Vec<Ray> {
    let side = (count as f32).sqrt().ceil() as usize;
    let eye = Vec3::new(0.3, 0.2, 3.0);
    (0..count)
        .map(|i| {
            let (x, y) = ((i % side) as f32, (i / side) as f32);
            let on_plane = Vec3::new(2.37 * x / side as f32 - 1.1, 2.37 * y / side as f32 - 1.1, 0.0);
            Ray::new(eye, (on_plane - eye).normalize())
        })
        .collect()
}
