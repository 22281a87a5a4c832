//! Few primitives once more, laid out for [sweeps](super::sweep): boxes in the order in which rays of an octant meet them, each
//! with where to go on for rays that do not enter it. So there is no stack and nothing to sort.
//!
//! They are all that a scene has, or what stands around its large meshes: walls, floors, lamps. What is not swept is a part
//! of the hierarchy for itself, which the rays that enter its box traverse after the sweep.

use super::boxes::Ref;
use super::builder::references;
use super::course::{Leaves, Tree};
use super::data::{BLOCK, Child, Hierarchy, NO_ID, Node, Place};
use super::emit::Primitives;
use super::mode::Triangle;
use crate::core::Skip;
use crate::geometry::{Shape, Sphere};
use glam::Vec3;

/// Most primitives for which a sweep is faster than a traversal.
const MOST: usize = 2048;

/// Most primitives that are swept beside others which are not.
const MOST_BESIDE: usize = 256;

/// Least area of walls, as a part of the area of the box around the scene.
const WALLS: f32 = 0.5;

/// The hierarchy for sweeps.
#[derive(Clone, Debug)]
pub(super) struct Small {
    /// For each octant of directions the boxes, nearest first.
    pub(super) courses: [Vec<Step>; 8],
    pub(super) facets: Vec<Facet>,
    pub(super) balls: Vec<Ball>,
    /// Geometry and primitive by number: the numbers are in the order of the ids.
    pub(super) ids: Vec<(u32, u32)>,
    /// Where each triangle is in the hierarchy, by number.
    pub(super) places: Vec<Place>,
    /// The number of the first primitive of each geometry, and behind them how many numbers there are.
    firsts: Vec<u32>,
    /// What is not swept, if there is anything.
    pub(super) rest: Option<Rest>,
}

/// The part of a hierarchy that is not swept.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rest {
    pub(super) root: Child,
    /// Its box, as a [`Step`] has it.
    pub(super) planes: [[f32; 2]; 3],
    /// Whether what is swept stands around it as the walls of a room do, so that most rays end there.
    pub(super) is_walled: bool,
}

/// A box, and what is in it if it is that of a leaf.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(super) struct Step {
    /// As a [`Node`] has them.
    pub(super) planes: [[f32; 2]; 3],
    /// The step after all that are in the box.
    pub(super) next: u32,
    pub(super) leaf: Leaf,
}

/// The primitives of a leaf.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leaf {
    pub(super) first: u32,
    pub(super) end: u32,
    pub(super) is_spheres: bool,
}

impl Leaf {
    /// Of nothing.
    pub(super) const NONE: Self = Self { first: 0, end: 0, is_spheres: false };
}

/// A triangle.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Facet {
    /// `vectors[which][axis]`, as a block has them.
    vectors: [[f32; 3]; 3],
    /// The axis of which all corners have the same coordinate, or 3.
    flat: u32,
    /// Number of the primitive.
    pub(super) number: f32,
    pub(super) place: Place,
}

impl Triangle for &Facet {
    #[inline(always)]
    fn vector(self, which: usize, axis: usize) -> f32 {
        self.vectors[which][axis]
    }

    #[inline(always)]
    fn flat_axis(self) -> Option<usize> {
        (self.flat < 3).then_some(self.flat as usize)
    }
}

/// A sphere.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ball {
    pub(super) sphere: Sphere,
    /// Number of the primitive.
    pub(super) number: f32,
}

/// Which shapes are swept: all, if they are few primitives and triangles for the most part, since the boxes of spheres are met by
/// few rays of eight; otherwise the smallest meshes, as many as are few together.
pub(super) fn swept(shapes: &[Shape]) -> Vec<bool> {
    let is_mesh = |shape: &Shape| matches!(shape, Shape::Mesh(_));
    let count: usize = shapes.iter().map(Shape::primitive_count).sum();
    let meshes = || (0..shapes.len()).filter(|&i| is_mesh(&shapes[i]));
    let triangles: usize = meshes().map(|i| shapes[i].primitive_count()).sum();
    if count <= MOST && 2 * triangles >= count {
        return vec![true; shapes.len()];
    }
    let mut smallest: Vec<usize> = meshes().collect();
    smallest.sort_by_key(|&i| shapes[i].primitive_count());
    let (mut swept, mut sum) = (vec![false; shapes.len()], 0);
    for i in smallest {
        sum += shapes[i].primitive_count();
        if sum > MOST_BESIDE {
            break;
        }
        swept[i] = true;
    }
    swept
}

impl Small {
    /// What is `swept` of a hierarchy, laid out anew, if it is anything.
    pub(super) fn new(data: &Hierarchy, primitives: Primitives<'_>, swept: &[bool]) -> Option<Self> {
        let shapes = primitives.shapes;
        let (mut ids, mut firsts) = (vec![], Vec::with_capacity(shapes.len() + 1));
        for ((geom_id, shape), &swept) in (0..).zip(shapes).zip(swept) {
            firsts.push(ids.len() as u32);
            let count = if swept { shape.primitive_count() } else { 0 };
            ids.extend((0..count as u32).map(|prim_id| (geom_id, prim_id)));
        }
        firsts.push(ids.len() as u32);
        let rest = data.rest.map(|root| {
            let Node { planes, .. } = data.nodes[data.root.index()];
            let [x, y, z] = planes.map(|[lo, hi]| hi[0].max(hi[1]) - lo[0].min(lo[1]));
            let is_walled = area(shapes, swept) >= WALLS * 2.0 * (x * y + y * z + z * x);
            Rest { root, planes: planes.map(|[lo, hi]| [lo[1], hi[1]]), is_walled }
        });
        let (places, courses) = (vec![Place::NONE; ids.len()], Default::default());
        let mut small = Self { courses, facets: vec![], balls: vec![], ids, places, firsts, rest };
        small.find_places(data, swept);
        let refs = references(shapes, |geom_id| swept[geom_id]);
        let tree = Tree::new(refs, &mut Growing { small: &mut small, primitives })?;
        small.courses = core::array::from_fn(|octant| tree.course(octant));
        Some(small)
    }

    /// Finds where each triangle is.
    fn find_places(&mut self, data: &Hierarchy, swept: &[bool]) {
        let is_swept = |geom_id: u32| geom_id != NO_ID && swept[geom_id as usize];
        // What is swept comes first, if there is anything else.
        let blocks = data.triangles.iter().take_while(|block| is_swept(block.geom_ids[0]));
        for (index, block) in blocks.enumerate() {
            for lane in (0..BLOCK).filter(|&lane| is_swept(block.geom_ids[lane])) {
                let number = self.number(block.geom_ids[lane], block.prim_ids[lane]);
                self.places[number as usize] = Place::triangle(index, lane);
            }
        }
    }

    fn number(&self, geom_id: u32, prim_id: u32) -> f32 {
        (self.firsts[geom_id as usize] + prim_id) as f32
    }

    /// The numbers between which a ray must hit nothing, both ends not among them.
    #[inline(always)]
    pub(super) fn skipped(&self, skip: Skip) -> [f32; 2] {
        let span = |geom: u32| match self.firsts.get(geom as usize..) {
            Some(&[first, end, ..]) => (first, end),
            _ => (0, 0),
        };
        match skip {
            Skip::None => [f32::INFINITY; 2],
            Skip::Geometry(geom) => {
                let (first, end) = span(geom);
                [first as f32 - 1.0, end as f32]
            }
            Skip::Primitive { geom, prim } => {
                let (first, end) = span(geom);
                if prim < end - first {
                    [(first + prim) as f32 - 1.0, (first + prim) as f32 + 1.0]
                } else {
                    [f32::INFINITY; 2]
                }
            }
        }
    }

    /// Bytes of the arrays.
    pub(super) fn memory_bytes(&self) -> usize {
        let steps: usize = self.courses.iter().map(Vec::capacity).sum();
        steps * size_of::<Step>()
            + self.facets.capacity() * size_of::<Facet>()
            + self.balls.capacity() * size_of::<Ball>()
            + self.ids.capacity() * size_of::<(u32, u32)>()
            + self.places.capacity() * size_of::<Place>()
            + self.firsts.capacity() * size_of::<u32>()
    }
}

/// Where the primitives of leaves are put.
struct Growing<'a> {
    small: &'a mut Small,
    primitives: Primitives<'a>,
}

impl Leaves for Growing<'_> {
    fn is_sphere(&self, r: &Ref) -> bool {
        matches!(self.primitives.shapes[r.geom_id() as usize], Shape::Spheres(_))
    }

    fn leaf(&mut self, refs: &[Ref]) -> Leaf {
        let is_spheres = self.is_sphere(&refs[0]);
        let Small { facets, balls, .. } = &*self.small;
        let first = if is_spheres { balls.len() } else { facets.len() };
        for r in refs {
            let number = self.small.number(r.geom_id(), r.prim_id());
            match &self.primitives.shapes[r.geom_id() as usize] {
                Shape::Mesh(mesh) => {
                    let corners = mesh.triangle(r.prim_id());
                    let vectors = (self.primitives.kept)(corners).map(|vector| vector.to_array());
                    let place = self.small.places[number as usize];
                    self.small.facets.push(Facet { vectors, flat: flat_axis(corners), number, place });
                }
                Shape::Spheres(spheres) => {
                    self.small.balls.push(Ball { sphere: spheres[r.prim_id() as usize], number });
                }
            }
        }
        Leaf { first: first as u32, end: (first + refs.len()) as u32, is_spheres }
    }
}

/// The area of the meshes that are swept.
fn area(shapes: &[Shape], swept: &[bool]) -> f32 {
    let meshes = shapes.iter().zip(swept).filter_map(|(shape, &swept)| match shape {
        Shape::Mesh(mesh) if swept => Some(mesh),
        _ => None,
    });
    let corners = meshes.flat_map(|mesh| (0..mesh.triangle_count() as u32).map(|i| mesh.triangle(i)));
    corners.map(|[a, b, c]| 0.5 * (b - a).cross(c - a).length()).sum()
}

/// See [`Facet::flat`].
fn flat_axis([a, b, c]: [Vec3; 3]) -> u32 {
    (0..3).find(|&axis| a[axis] == b[axis] && a[axis] == c[axis]).map_or(3, |axis| axis as u32)
}
