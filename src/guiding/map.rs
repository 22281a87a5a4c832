//! Photons where they have landed, in cells: what a surface finds its guide by.

use super::directions::Directions;
use crate::geometry::Aabb;
use glam::Vec3;
use std::f32::consts::{PI, TAU};

/// Light of a caustic that has come to a diffuse surface.
#[derive(Clone, Copy, Debug)]
pub struct Photon {
    /// Where it has landed.
    pub p: Vec3,
    /// The surface's normal there, on its side.
    pub n: Vec3,
    /// Where it came from; unit length.
    pub wi: Vec3,
    /// Its flux.
    pub power: f32,
    /// Radiance that one ray found there which was drawn from the surface's own lobe, without caustics; `None` where no
    /// ray looked.
    pub other: Option<f32>,
}

/// The caustics on surfaces that are near each other and face about the same way.
#[derive(Clone, Debug)]
pub struct Cell {
    /// The share of rays that shall look for caustics, below 1.
    pub share: f32,
    /// Where caustics come from.
    pub directions: Directions,
    /// Where it counts.
    bounds: Aabb,
}

/// Photons of a leaf at most: as many as tell a direction from noise.
const MOST: usize = 64;

/// The greatest share of rays that look for caustics: the others must not be starved.
const GREATEST_SHARE: f32 = 0.8;

/// A share below which a guide is not worth asking.
const LEAST_SHARE: f32 = 0.02;

/// Root mean square of what rays bring that follow a guide, by their mean: it does not follow caustics in all detail.
const SPREAD: f32 = 1.4;

impl Cell {
    fn new(photons: &[Photon]) -> Option<Self> {
        let bounds = Aabb::around(photons.iter().map(|photon| photon.p));
        let caustic = photons.iter().map(|photon| photon.power).sum::<f32>() / area(photons);
        // Variances go with mean squares: the best share is that of the roots.
        let looked = || photons.iter().filter_map(|photon| photon.other);
        let mean_square = looked().map(|other| other * other).sum::<f32>() / looked().count() as f32;
        let other = PI * mean_square.sqrt();
        let caustic = SPREAD * caustic;
        let share = caustic / (caustic + other);
        // Nor where there is no telling.
        if share.is_nan() || share < LEAST_SHARE {
            return None;
        }
        let share = share.min(GREATEST_SHARE);
        let directions = Directions::new(photons.iter().map(|photon| (photon.wi, photon.power)))?;
        let margin = 0.1 * bounds.size().max_element();
        let bounds = bounds.grow(bounds.min - margin).grow(bounds.max + margin);
        Some(Self { share, directions, bounds })
    }
}

/// The area over which photons are spread: that of a disk in which points are as far from each other.
fn area(photons: &[Photon]) -> f32 {
    let count = photons.len() as f32;
    let mean = photons.iter().map(|photon| photon.p).sum::<Vec3>() / count;
    // Points of a disk of radius r are r apart, in the root mean square: twice their variance.
    TAU * photons.iter().map(|photon| photon.p.distance_squared(mean)).sum::<f32>() / count
}

/// A step on the way to a cell, packed: many rays ask for it.
#[derive(Clone, Copy, Debug)]
struct Node {
    /// What is below this along the axis is told by the next node.
    at: f32,
    /// The axis and four times the node that tells of the rest; [`LEAF`](Self::LEAF) and four times the cell.
    next: u32,
}

impl Node {
    /// In place of an axis.
    const LEAF: u32 = 3;
    /// In place of a cell, where there is none.
    const NO_CELL: u32 = u32::MAX >> 2;

    fn split(at: f32, axis: usize, above: usize) -> Self {
        Self { at, next: above as u32 * 4 + axis as u32 }
    }

    fn leaf(cell: Option<usize>) -> Self {
        Self { at: 0.0, next: cell.map_or(Self::NO_CELL, |cell| cell as u32) * 4 + Self::LEAF }
    }

    /// The axis and the node above, if it splits.
    #[inline]
    fn axis_and_above(self) -> Option<(usize, u32)> {
        (self.next % 4 != Self::LEAF).then_some(((self.next % 4) as usize, self.next / 4))
    }
}

/// Photons on surfaces that face along one axis.
#[derive(Clone, Debug)]
struct Tree {
    nodes: Vec<Node>,
    /// Around all photons.
    bounds: Aabb,
    /// Boxes of a regular grid for each unit of length.
    per_length: Vec3,
    /// For each box of the grid, the node that tells of all of it.
    entries: Vec<u32>,
}

/// Boxes of a tree's grid along each axis.
const GRID: usize = 16;

/// All cells: six trees, for surfaces that face along each axis.
#[derive(Clone, Debug, Default)]
pub struct CausticMap {
    cells: Vec<Cell>,
    trees: [Option<Tree>; 6],
}

impl CausticMap {
    /// The map of these photons, the same for the same photons in the same order.
    pub fn new(photons: Vec<Photon>) -> Self {
        let mut facing: [Vec<Photon>; 6] = Default::default();
        for photon in photons {
            facing[side(photon.n)].push(photon);
        }
        let mut map = Self::default();
        for (side, photons) in facing.iter_mut().enumerate() {
            if !photons.is_empty() {
                let mut nodes = vec![];
                map.grow(photons, &mut nodes);
                map.trees[side] = Some(Tree::new(nodes, Aabb::around(photons.iter().map(|photon| photon.p))));
            }
        }
        map
    }

    /// Adds the tree of some photons to `nodes`.
    fn grow(&mut self, photons: &mut [Photon], nodes: &mut Vec<Node>) {
        let size = Aabb::around(photons.iter().map(|photon| photon.p)).size();
        if photons.len() <= MOST || size == Vec3::ZERO {
            nodes.push(Node::leaf(Cell::new(photons).map(|cell| {
                self.cells.push(cell);
                self.cells.len() - 1
            })));
            return;
        }
        let axis = size.max_position();
        let half = photons.len() / 2;
        photons.select_nth_unstable_by(half, |a, b| a.p[axis].total_cmp(&b.p[axis]));
        let at = photons[half].p[axis];
        let (below, above) = photons.split_at_mut(half);
        let node = nodes.len();
        nodes.push(Node::leaf(None));
        self.grow(below, nodes);
        nodes[node] = Node::split(at, axis, nodes.len());
        self.grow(above, nodes);
    }

    /// Whether there is no caustic anywhere.
    pub fn is_empty(&self) -> bool {
        self.cells.is_empty()
    }

    /// The number of the cell at a point of a surface with normal `n`.
    #[inline]
    pub fn find(&self, p: Vec3, n: Vec3) -> Option<u32> {
        let cell = self.trees[side(n)].as_ref()?.find(p)?;
        let Aabb { min, max } = self.cells[cell as usize].bounds;
        (p.cmpge(min).all() && p.cmple(max).all()).then_some(cell)
    }

    /// The cell of a number that [`find`](Self::find) gave.
    #[inline]
    pub fn cell(&self, number: u32) -> &Cell {
        &self.cells[number as usize]
    }
}

impl Tree {
    fn new(nodes: Vec<Node>, bounds: Aabb) -> Self {
        let per_length = GRID as f32 / bounds.size().max(Vec3::splat(f32::MIN_POSITIVE));
        let mut tree = Self { nodes, bounds, per_length, entries: vec![] };
        let mut entries = vec![0; GRID.pow(3)];
        for (i, entry) in entries.iter_mut().enumerate() {
            let corner = [i % GRID, i / GRID % GRID, i / GRID / GRID].map(|c| c as f32);
            let min = bounds.min + Vec3::from(corner) / per_length;
            *entry = tree.node_of(min, min + per_length.recip());
        }
        tree.entries = entries;
        tree
    }

    /// The number of the cell at a point.
    #[inline]
    fn find(&self, p: Vec3) -> Option<u32> {
        let place = (p - self.bounds.min) * self.per_length;
        let [x, y, z] = place.to_array().map(|c| (c as i32).clamp(0, GRID as i32 - 1) as usize);
        let mut node = self.entries[x + GRID * (y + GRID * z)];
        while let Some((axis, above)) = self.nodes[node as usize].axis_and_above() {
            node = if p[axis] < self.nodes[node as usize].at { node + 1 } else { above };
        }
        let cell = self.nodes[node as usize].next / 4;
        (cell != Node::NO_CELL).then_some(cell)
    }

    /// The last node that tells of all of a box.
    fn node_of(&self, min: Vec3, max: Vec3) -> u32 {
        let mut node = 0;
        while let Some((axis, above)) = self.nodes[node as usize].axis_and_above() {
            let at = self.nodes[node as usize].at;
            node = match (max[axis] < at, min[axis] > at) {
                (true, _) => node + 1,
                (_, true) => above,
                _ => return node,
            };
        }
        node
    }
}

/// The axis along which a normal points most, and which way.
#[inline]
fn side(n: Vec3) -> usize {
    let axis = n.abs().max_position();
    2 * axis + usize::from(n[axis] < 0.0)
}

#[cfg(test)]
#[path = "map_tests.rs"]
mod tests;
