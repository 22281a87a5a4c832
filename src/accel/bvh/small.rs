//! A hierarchy of few primitives once more, laid out for [sweeps](super::sweep): boxes in the order in which rays of an
//! octant meet them, each with where to go on for rays that do not enter it. So there is no stack and nothing to sort.

use super::boxes::Ref;
use super::builder::references;
use super::course::{Leaves, Tree};
use super::data::{BLOCK, Hierarchy, NO_ID, Place};
use super::emit::Primitives;
use super::mode::Triangle;
use crate::core::Skip;
use crate::geometry::{Shape, Sphere};
use glam::Vec3;

/// Most primitives for which a sweep is faster than a traversal.
const MOST: usize = 2048;

/// The hierarchy for sweeps.
#[derive(Clone, Debug)]
pub(super) struct Small {
    /// For each octant of directions the boxes, nearest first.
    pub(super) courses: [Vec<Step>; 8],
    pub(super) facets: Vec<Facet>,
    pub(super) balls: Vec<Ball>,
    /// Geometry and primitive by number: the numbers are in the order of the ids.
    pub(super) ids: Vec<(u32, u32)>,
    /// The number of the first primitive of each geometry, and behind them how many numbers there are.
    firsts: Vec<u32>,
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

impl Small {
    /// The hierarchy laid out anew, if it is small enough and of triangles for the most part: the boxes of spheres are met
    /// by few rays of eight.
    pub(super) fn new(data: &Hierarchy, primitives: Primitives<'_>) -> Option<Self> {
        let shapes = primitives.shapes;
        let is_spheres = |shape: &&Shape| matches!(shape, Shape::Spheres(_));
        let count: usize = shapes.iter().map(Shape::primitive_count).sum();
        let spheres: usize = shapes.iter().filter(is_spheres).map(Shape::primitive_count).sum();
        if count > MOST || 2 * spheres > count {
            return None;
        }
        let mut ids = Vec::with_capacity(count);
        let mut firsts = Vec::with_capacity(shapes.len() + 1);
        for (geom_id, shape) in (0..).zip(shapes) {
            firsts.push(ids.len() as u32);
            ids.extend((0..shape.primitive_count() as u32).map(|prim_id| (geom_id, prim_id)));
        }
        firsts.push(ids.len() as u32);
        let mut small = Self { courses: Default::default(), facets: vec![], balls: vec![], ids, firsts };
        let places = small.places(data);
        let tree = Tree::new(references(shapes), &mut Growing { small: &mut small, primitives, places })?;
        small.courses = core::array::from_fn(|octant| tree.course(octant));
        Some(small)
    }

    /// Where each triangle is, by number.
    fn places(&self, data: &Hierarchy) -> Vec<Place> {
        let mut places = vec![Place::NONE; self.ids.len()];
        for (index, block) in data.triangles.iter().enumerate() {
            for lane in (0..BLOCK).filter(|&lane| block.geom_ids[lane] != NO_ID) {
                let number = self.number(block.geom_ids[lane], block.prim_ids[lane]);
                places[number as usize] = Place::triangle(index, lane);
            }
        }
        places
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
            + self.firsts.capacity() * size_of::<u32>()
    }
}

/// Where the primitives of leaves are put.
struct Growing<'a> {
    small: &'a mut Small,
    primitives: Primitives<'a>,
    /// Of each triangle, by number.
    places: Vec<Place>,
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
                    let place = self.places[number as usize];
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

/// See [`Facet::flat`].
fn flat_axis([a, b, c]: [Vec3; 3]) -> u32 {
    (0..3).find(|&axis| a[axis] == b[axis] && a[axis] == c[axis]).map_or(3, |axis| axis as u32)
}
