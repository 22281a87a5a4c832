//! Photons where they have landed, in cells: what a surface finds its guide by.

use super::directions::Directions;
use crate::geometry::Aabb;
use glam::Vec3;
use std::f32::consts::TAU;

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
    /// Radiance that one ray found there which was drawn from the surface's own lobe, without caustics.
    pub other: f32,
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
const MOST: usize = 96;

/// The greatest share of rays that look for caustics: the others must not be starved.
const GREATEST_SHARE: f32 = 0.8;

/// A share below which a guide is not worth asking.
const LEAST_SHARE: f32 = 0.02;

impl Cell {
    fn new(photons: &[Photon]) -> Option<Self> {
        let bounds = Aabb::around(photons.iter().map(|photon| photon.p));
        let caustic = photons.iter().map(|photon| photon.power).sum::<f32>() / area(photons);
        // The radiance of both is weighed by its root mean square, with which the variances go: that of the caustics is
        // what a distribution that follows them would have.
        let other = TAU
            * 0.5
            * (photons.iter().map(|photon| photon.other * photon.other).sum::<f32>() / photons.len() as f32)
                .sqrt();
        let share = (caustic / (caustic + other)).min(GREATEST_SHARE);
        if !(share >= LEAST_SHARE) {
            return None;
        }
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

/// A step on the way to a cell.
#[derive(Clone, Copy, Debug)]
enum Node {
    /// What is below `at` along `axis` is told by the next node, the rest by the node `above`.
    Split { axis: u8, at: f32, above: u32 },
    /// The cell, if there is one.
    Leaf(Option<u32>),
}

/// All cells: six trees, for surfaces that face along each axis.
#[derive(Clone, Debug, Default)]
pub struct CausticMap {
    cells: Vec<Cell>,
    trees: [Vec<Node>; 6],
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
            let mut nodes = vec![];
            if !photons.is_empty() {
                map.grow(photons, &mut nodes);
            }
            map.trees[side] = nodes;
        }
        map
    }

    /// Adds the tree of some photons to `nodes`.
    fn grow(&mut self, photons: &mut [Photon], nodes: &mut Vec<Node>) {
        let size = Aabb::around(photons.iter().map(|photon| photon.p)).size();
        if photons.len() <= MOST || size == Vec3::ZERO {
            let cell = Cell::new(photons).map(|cell| {
                self.cells.push(cell);
                self.cells.len() as u32 - 1
            });
            nodes.push(Node::Leaf(cell));
            return;
        }
        let axis = size.max_position();
        let half = photons.len() / 2;
        photons.select_nth_unstable_by(half, |a, b| a.p[axis].total_cmp(&b.p[axis]));
        let at = photons[half].p[axis];
        let (below, above) = photons.split_at_mut(half);
        let node = nodes.len();
        nodes.push(Node::Leaf(None));
        self.grow(below, nodes);
        nodes[node] = Node::Split { axis: axis as u8, at, above: nodes.len() as u32 };
        self.grow(above, nodes);
    }

    /// Whether there is no caustic anywhere.
    pub fn is_empty(&self) -> bool {
        self.cells.is_empty()
    }

    /// The number of the cell at a point of a surface with normal `n`.
    #[inline]
    pub fn find(&self, p: Vec3, n: Vec3) -> Option<u32> {
        let tree = &self.trees[side(n)];
        let mut node = 0;
        loop {
            match *tree.get(node)? {
                Node::Split { axis, at, above } => {
                    node = if p[usize::from(axis)] < at { node + 1 } else { above as usize };
                }
                Node::Leaf(cell) => {
                    return cell.filter(|&cell| {
                        let Aabb { min, max } = self.cells[cell as usize].bounds;
                        p.cmpge(min).all() && p.cmple(max).all()
                    });
                }
            }
        }
    }

    /// The cell of a number that [`find`](Self::find) gave.
    #[inline]
    pub fn cell(&self, number: u32) -> &Cell {
        &self.cells[number as usize]
    }
}

/// The axis along which a normal points most, and which way.
#[inline]
fn side(n: Vec3) -> usize {
    let axis = n.abs().max_position();
    2 * axis + usize::from(n[axis] < 0.0)
}
