//! What is kept: 8-wide nodes and leaves of 4 primitives side by side.
//!
//! ```text
//! Node            256 bytes: 6 x 8 planes, 8 children, 8 octant orders
//! TriangleBlock   176 bytes: 3 vectors x 3 axes x 4 triangles, their ids
//! SphereBlock     128 bytes: 4 spheres, their ids
//! ```

use super::small::Small;
use crate::geometry::Sphere;
use glam::Vec3;

/// Primitives of a leaf block.
pub(super) const BLOCK: usize = 4;

/// Children of a node.
pub(super) const WIDTH: usize = 8;

/// An id that no geometry and no primitive has: empty lanes, and rays that skip nothing.
pub(super) const NO_ID: u32 = u32::MAX;

/// Where a child is: a node's index, or a leaf's first block and number of blocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(transparent)]
pub(super) struct Child(pub(super) u32);

impl Child {
    const LEAF: u32 = 1 << 31;
    const SPHERES: u32 = 1 << 30;
    const COUNT_SHIFT: u32 = 27;
    const COUNT_MASK: u32 = 7;

    /// Most blocks of a leaf.
    pub(super) const MAX_BLOCKS: usize = Self::COUNT_MASK as usize;
    /// Most blocks of a structure.
    pub(super) const MAX_FIRST: usize = 1 << Self::COUNT_SHIFT;
    /// A leaf of nothing.
    pub(super) const EMPTY: Self = Self(Self::LEAF);

    /// The node at `index`.
    pub(super) fn node(index: usize) -> Self {
        debug_assert!(index < Self::LEAF as usize);
        Self(index as u32)
    }

    /// A leaf of triangle blocks.
    pub(super) fn triangles(first: usize, count: usize) -> Self {
        debug_assert!(first < Self::MAX_FIRST && count <= Self::MAX_BLOCKS);
        Self(Self::LEAF | (count as u32) << Self::COUNT_SHIFT | first as u32)
    }

    /// A leaf of sphere blocks.
    pub(super) fn spheres(first: usize, count: usize) -> Self {
        Self(Self::triangles(first, count).0 | Self::SPHERES)
    }

    /// The bits of eight children.
    #[inline(always)]
    pub(super) fn bits(children: &[Self; WIDTH]) -> [u32; WIDTH] {
        children.map(|child| child.0)
    }

    #[inline(always)]
    pub(super) fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    #[inline(always)]
    pub(super) fn is_spheres(self) -> bool {
        self.0 & Self::SPHERES != 0
    }

    /// Index of the node.
    #[inline(always)]
    pub(super) fn index(self) -> usize {
        self.0 as usize
    }

    /// First block of the leaf.
    #[inline(always)]
    pub(super) fn first(self) -> usize {
        (self.0 & (Self::MAX_FIRST as u32 - 1)) as usize
    }

    /// Blocks of the leaf.
    #[inline(always)]
    pub(super) fn blocks(self) -> core::ops::Range<usize> {
        let count = self.0 >> Self::COUNT_SHIFT & Self::COUNT_MASK;
        self.first()..self.first() + count as usize
    }

    /// The same child where the arrays that it points into begin later.
    pub(super) fn moved(self, nodes: usize, triangles: usize, spheres: usize) -> Self {
        let by = match (self.is_leaf(), self.is_spheres()) {
            _ if self == Self::EMPTY => 0,
            (false, _) => nodes,
            (true, false) => triangles,
            (true, true) => spheres,
        };
        Self(self.0 + by as u32)
    }
}

/// Where a primitive is: its block and lane, and a bit for spheres.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(transparent)]
pub(super) struct Place(pub(super) u32);

impl Place {
    const SPHERE: u32 = 1 << 31;

    /// Nowhere.
    pub(super) const NONE: Self = Self(u32::MAX);

    #[inline(always)]
    pub(super) fn triangle(block: usize, lane: usize) -> Self {
        Self((block * BLOCK + lane) as u32)
    }

    pub(super) fn sphere(block: usize, lane: usize) -> Self {
        Self(Self::triangle(block, lane).0 | Self::SPHERE)
    }

    #[inline(always)]
    pub(super) fn is_sphere(self) -> bool {
        self.0 & Self::SPHERE != 0
    }

    /// Index of the block.
    #[inline(always)]
    pub(super) fn block(self) -> usize {
        (self.0 & !Self::SPHERE) as usize / BLOCK
    }

    #[inline(always)]
    pub(super) fn lane(self) -> usize {
        self.0 as usize % BLOCK
    }
}

/// Eight children and their boxes.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Node {
    /// `planes[axis][0]` the least coordinates, `planes[axis][1]` the greatest, with [`SLACK`](super::ray::SLACK);
    /// `+inf, -inf` for no child.
    pub(super) planes: [[[f32; WIDTH]; 2]; 3],
    /// The children; `EMPTY` for no child.
    pub(super) children: [Child; WIDTH],
    /// `order[j]` holds for each octant o, in the 3 bits from 3 o, which child comes j-th from the far end.
    pub(super) order: [u32; WIDTH],
}

impl Node {
    /// No children.
    pub(super) const EMPTY: Self = Self {
        planes: [[[f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]]; 3],
        children: [Child::EMPTY; WIDTH],
        order: [0; WIDTH],
    };
}

/// Four triangles; unused lanes have NaN vectors, which no test passes.
#[derive(Clone, Debug)]
#[repr(C, align(16))]
pub(super) struct TriangleBlock {
    /// `vectors[which][axis][lane]`: the corners, or what the [mode](super::mode::Mode::kept) keeps in their place.
    pub(super) vectors: [[[f32; BLOCK]; 3]; 3],
    /// Geometry ids.
    pub(super) geom_ids: [u32; BLOCK],
    /// Primitive ids.
    pub(super) prim_ids: [u32; BLOCK],
}

impl TriangleBlock {
    /// No triangles.
    pub(super) const EMPTY: Self =
        Self { vectors: [[[f32::NAN; BLOCK]; 3]; 3], geom_ids: [NO_ID; BLOCK], prim_ids: [NO_ID; BLOCK] };
}

/// Four spheres; unused lanes have the id [`NO_ID`].
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct SphereBlock {
    /// Centres, by axis.
    pub(super) center: [[f32; BLOCK]; 3],
    pub(super) radius: [f32; BLOCK],
    /// Geometry ids.
    pub(super) geom_ids: [u32; BLOCK],
    /// Primitive ids.
    pub(super) prim_ids: [u32; BLOCK],
}

impl SphereBlock {
    /// No spheres.
    pub(super) const EMPTY: Self = Self {
        center: [[f32::NAN; BLOCK]; 3],
        radius: [f32::NAN; BLOCK],
        geom_ids: [NO_ID; BLOCK],
        prim_ids: [NO_ID; BLOCK],
    };

    /// A sphere of the block.
    #[inline(always)]
    pub(super) fn sphere(&self, lane: usize) -> Sphere {
        let [x, y, z] = &self.center;
        Sphere { center: Vec3::new(x[lane], y[lane], z[lane]), radius: self.radius[lane] }
    }
}

/// The whole hierarchy.
#[derive(Clone, Debug)]
pub(super) struct Hierarchy {
    /// Where every ray starts.
    pub(super) root: Child,
    /// Greatest edge of the box around everything.
    pub(super) extent: f32,
    pub(super) nodes: Vec<Node>,
    pub(super) triangles: Vec<TriangleBlock>,
    pub(super) spheres: Vec<SphereBlock>,
    /// The part that holds what is [not swept](super::small::swept), if it is a part of its own: the second child of the root.
    pub(super) rest: Option<Child>,
    /// What is swept, laid out for that.
    pub(super) small: Option<Small>,
}

impl Hierarchy {
    /// Geometry and primitive at a place; greater than all for none.
    #[inline(always)]
    pub(super) fn ids(&self, place: Place) -> (u32, u32) {
        let (block, lane) = (place.block(), place.lane());
        if place == Place::NONE {
            (NO_ID, NO_ID)
        } else if place.is_sphere() {
            (self.spheres[block].geom_ids[lane], self.spheres[block].prim_ids[lane])
        } else {
            (self.triangles[block].geom_ids[lane], self.triangles[block].prim_ids[lane])
        }
    }

    /// Bytes of the arrays.
    pub(super) fn memory_bytes(&self) -> usize {
        self.nodes.capacity() * size_of::<Node>()
            + self.triangles.capacity() * size_of::<TriangleBlock>()
            + self.spheres.capacity() * size_of::<SphereBlock>()
            + self.small.as_ref().map_or(0, Small::memory_bytes)
    }
}
