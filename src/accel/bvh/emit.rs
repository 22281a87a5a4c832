//! Nodes and leaf blocks as they are kept, made piece by piece and put together in the order of the tree.

use super::boxes::{Bounds, Ref};
use super::data::{BLOCK, Child, Hierarchy, Node, SphereBlock, TriangleBlock, WIDTH};
use super::huge;
use super::ray::SLACK;
use crate::geometry::Shape;
use glam::{Vec3, Vec4Swizzles};

/// What references refer to, and the three vectors by which a triangle is kept.
#[derive(Clone, Copy)]
pub(super) struct Primitives<'s> {
    pub(super) shapes: &'s [Shape],
    pub(super) kept: fn([Vec3; 3]) -> [Vec3; 3],
}

/// Nodes and leaves of a subtree; indices count from its own beginning.
#[derive(Default)]
pub(super) struct Piece {
    nodes: Vec<Node>,
    triangles: Vec<TriangleBlock>,
    spheres: Vec<SphereBlock>,
}

impl Piece {
    /// Room for the nodes and leaves of `count` of the references: usually enough, and what is not used costs nothing.
    pub(super) fn with_room(primitives: Primitives<'_>, refs: &[Ref], count: usize) -> Self {
        let spheres = refs
            .first()
            .is_some_and(|first| matches!(primitives.shapes[first.geom_id() as usize], Shape::Spheres(_)));
        let blocks = count / 2 + 1;
        let [triangles, spheres] = if spheres { [0, blocks] } else { [blocks, 0] };
        Self {
            nodes: huge::vec_with_capacity(count / 8 + 1),
            triangles: huge::vec_with_capacity(triangles),
            spheres: huge::vec_with_capacity(spheres),
        }
    }

    /// Room for a node whose children come after it.
    pub(super) fn reserve_node(&mut self) -> usize {
        self.nodes.push(Node::EMPTY);
        self.nodes.len() - 1
    }

    /// Fills a node that was reserved.
    pub(super) fn set_node(&mut self, index: usize, bounds: &[Bounds], children: &[Child]) {
        let node = &mut self.nodes[index];
        for (slot, (bounds, &child)) in bounds.iter().zip(children).enumerate() {
            let (lo, hi) = (bounds.lo(), bounds.hi());
            let slack = SLACK * lo.abs().max(hi.abs()).xyz().max_element();
            for (axis, planes) in node.planes.iter_mut().enumerate() {
                planes[0][slot] = lo[axis] - slack;
                planes[1][slot] = hi[axis] + slack;
            }
            node.children[slot] = child;
        }
        node.order = octant_orders(bounds);
    }

    /// A leaf of references of one kind.
    pub(super) fn leaf(&mut self, primitives: Primitives<'_>, refs: &[Ref]) -> Child {
        let Some(first) = refs.first() else { return Child::EMPTY };
        match &primitives.shapes[first.geom_id() as usize] {
            Shape::Mesh(_) => {
                let start = self.triangles.len();
                self.triangles.extend(refs.chunks(BLOCK).map(|refs| triangle_block(primitives, refs)));
                Child::triangles(start, self.triangles.len() - start)
            }
            Shape::Spheres(_) => {
                let start = self.spheres.len();
                self.spheres.extend(refs.chunks(BLOCK).map(|refs| sphere_block(primitives.shapes, refs)));
                Child::spheres(start, self.spheres.len() - start)
            }
        }
    }
}

fn triangle_block(primitives: Primitives<'_>, refs: &[Ref]) -> TriangleBlock {
    let mut block = TriangleBlock::EMPTY;
    for (lane, r) in refs.iter().enumerate() {
        let Shape::Mesh(mesh) = &primitives.shapes[r.geom_id() as usize] else { continue };
        let vectors = (primitives.kept)(mesh.triangle(r.prim_id()));
        for (to, vector) in block.vectors.iter_mut().zip(vectors) {
            for (axis, lanes) in to.iter_mut().enumerate() {
                lanes[lane] = vector[axis];
            }
        }
        block.geom_ids[lane] = r.geom_id();
        block.prim_ids[lane] = r.prim_id();
    }
    block
}

fn sphere_block(shapes: &[Shape], refs: &[Ref]) -> SphereBlock {
    let mut block = SphereBlock::EMPTY;
    for (lane, r) in refs.iter().enumerate() {
        let Shape::Spheres(spheres) = &shapes[r.geom_id() as usize] else { continue };
        let sphere = spheres[r.prim_id() as usize];
        for (lanes, x) in block.center.iter_mut().zip(sphere.center.to_array()) {
            lanes[lane] = x;
        }
        block.radius[lane] = sphere.radius;
        block.geom_ids[lane] = r.geom_id();
        block.prim_ids[lane] = r.prim_id();
    }
    block
}

/// For each octant the children from the farthest to the nearest, by the corners' middle along its diagonal; empty
/// slots count as farthest. The opposite octant has the opposite order among the children that there are.
fn octant_orders(bounds: &[Bounds]) -> [u32; WIDTH] {
    let mut middles = [[0.0; WIDTH]; 3];
    for (slot, b) in bounds.iter().enumerate() {
        let middle_of_box = b.lo() + b.hi();
        for (axis, middle) in middles.iter_mut().enumerate() {
            middle[slot] = middle_of_box[axis];
        }
    }
    let count = bounds.len();
    let empty = WIDTH - count;
    let mut order = [0; WIDTH];
    for (place, order) in order[..empty].iter_mut().enumerate() {
        *order = (0..8).fold(0, |bits, octant| bits | ((count + place) as u32) << (3 * octant));
    }
    for octant in 0..4u32 {
        let [x, y, z] = [0, 1, 2].map(|axis| if octant >> axis & 1 == 1 { -1.0 } else { 1.0 });
        let far: [i32; WIDTH] = core::array::from_fn(|slot| {
            ordered(x * middles[0][slot] + y * middles[1][slot] + z * middles[2][slot])
        });
        // A slot's place is the number of those before it: no branches, where sorting has many.
        for slot in 0..count {
            let mut before = 0;
            for other in 0..count {
                before += usize::from(far[other] > far[slot] || far[other] == far[slot] && other < slot);
            }
            order[empty + before] |= (slot as u32) << (3 * octant);
            order[WIDTH - 1 - before] |= (slot as u32) << (3 * (7 - octant));
        }
    }
    order
}

/// An integer that is ordered as the number is, NaN included.
fn ordered(x: f32) -> i32 {
    let bits = x.to_bits() as i32;
    bits ^ (bits >> 31 & i32::MAX)
}

/// Pieces below the nodes whose children were built in parallel.
pub(super) enum Tree {
    /// A subtree and its root.
    Piece(Piece, Child),
    /// Boxes of the children, and the children.
    Inner(Vec<Bounds>, Vec<Tree>),
}

impl Tree {
    /// One hierarchy of all pieces, depth first.
    pub(super) fn assemble(self, extent: f32) -> Hierarchy {
        if let Self::Piece(piece, root) = self {
            let Piece { mut nodes, mut triangles, mut spheres } = piece;
            nodes.shrink_to_fit();
            triangles.shrink_to_fit();
            spheres.shrink_to_fit();
            return Hierarchy { root, extent, nodes, triangles, spheres, rest: None, small: None };
        }
        let [nodes, triangles, spheres] = self.sizes();
        let mut all = Piece {
            nodes: huge::vec_with_capacity(nodes),
            triangles: huge::vec_with_capacity(triangles),
            spheres: huge::vec_with_capacity(spheres),
        };
        let root = self.append_to(&mut all);
        let Piece { nodes, triangles, spheres } = all;
        Hierarchy { root, extent, nodes, triangles, spheres, rest: None, small: None }
    }

    fn sizes(&self) -> [usize; 3] {
        match self {
            Self::Piece(piece, _) => [piece.nodes.len(), piece.triangles.len(), piece.spheres.len()],
            Self::Inner(_, trees) => trees.iter().map(Self::sizes).fold([1, 0, 0], |mut sum, sizes| {
                for (sum, size) in sum.iter_mut().zip(sizes) {
                    *sum += size;
                }
                sum
            }),
        }
    }

    fn append_to(self, all: &mut Piece) -> Child {
        match self {
            Self::Piece(mut piece, root) => {
                let offset = [all.nodes.len(), all.triangles.len(), all.spheres.len()];
                for node in &mut piece.nodes {
                    node.children = node.children.map(|c| c.moved(offset[0], offset[1], offset[2]));
                }
                all.nodes.append(&mut piece.nodes);
                all.triangles.append(&mut piece.triangles);
                all.spheres.append(&mut piece.spheres);
                root.moved(offset[0], offset[1], offset[2])
            }
            Self::Inner(bounds, trees) => {
                let node = all.reserve_node();
                let children: Vec<Child> = trees.into_iter().map(|tree| tree.append_to(all)).collect();
                all.set_node(node, &bounds, &children);
                Child::node(node)
            }
        }
    }
}
