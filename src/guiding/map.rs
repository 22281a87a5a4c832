//! Photons where they have landed, in cells: what a surface finds its guide by.

use super::fit::fit;
use super::mixture::{Lobe, Mixture};
use crate::core::lanes::{Floats, LANES, Vectors};
use crate::core::prefetch;
use crate::core::warp::within;
use crate::geometry::Aabb;
use glam::Vec3;
use std::f32::consts::{PI, TAU};

/// Light that has come to a surface.
#[derive(Clone, Copy, Debug)]
pub struct Photon {
    /// Where it has landed.
    pub p: Vec3,
    /// The surface's normal there, on its side.
    pub n: Vec3,
    /// Where it came from; unit length.
    pub wi: Vec3,
    /// Its flux; of a ray that was sent out to look for light, what it found, by how much likelier a diffuse lobe alone would have
    /// sent it there.
    pub power: f32,
    /// Radiance that the surface shows without this light, as one sample without a guide has it; `None` where no sample was
    /// taken.
    pub other: Option<f32>,
    /// The density with which its direction was drawn, in 1/sr; of rays that were sent out to look for light.
    pub pdf: f32,
}

/// The guide of surfaces that are near each other and face about the same way.
#[derive(Clone, Debug)]
pub struct Cell {
    /// The share of samples that shall follow it, below 1.
    pub share: f32,
    /// Light from where it leads, by the root mean square of all else, as a white surface would show both.
    pub odds: f32,
    /// Where light comes from.
    pub mixture: Mixture,
}

/// The greatest share of rays that follow a guide: a cell that its few looks around have told wrong things then costs
/// no more than twice the variance either way.
pub(super) const GREATEST_SHARE: f32 = 0.5;

/// The same of rays of glossy lobes, of which looks around tell less: they see light on diffuse surfaces alone.
const GREATEST_GLOSSY_SHARE: f32 = 0.25;

/// A share below which a guide is not worth asking.
const LEAST_SHARE: f32 = 0.02;

/// Root mean square of what samples bring that follow a guide, by their mean: it does not follow light in all detail.
pub(super) const SPREAD: f32 = 1.4;

impl Cell {
    /// The direction for the point `p` that the numbers `u` draw from the guide, if they ask it.
    #[inline(always)]
    pub fn draw(&self, p: Vec3, [x, y]: [f32; 2]) -> Option<Vec3> {
        (x < self.share).then(|| self.mixture.sample(p, [within(x, 0.0, self.share), y]))
    }

    /// The guide to the caustics of photons, for the points of `bounds`.
    pub(super) fn to_caustics(photons: &[Photon], bounds: &Aabb) -> Option<Self> {
        let caustic = photons.iter().map(|photon| photon.power).sum::<f32>() / area(photons);
        let share = Self::share_of(caustic, PI * Self::other(photons));
        Self::new(photons, bounds, share, GREATEST_SHARE)
    }

    /// Root mean square of the radiance that surfaces show without the light of photons; NaN where nobody knows.
    pub(super) fn other(photons: &[Photon]) -> f32 {
        let looked = || photons.iter().filter_map(|photon| photon.other);
        (looked().map(|other| other * other).sum::<f32>() / looked().count() as f32).sqrt()
    }

    /// The best share of samples for so much light in the mean, where all else has such a root mean square: variances go with
    /// mean squares.
    pub(super) fn share_of(light: f32, other: f32) -> f32 {
        let light = SPREAD * light;
        light / (light + other)
    }

    /// The guide to the light of photons, if it is worth a share.
    pub(super) fn new(photons: &[Photon], bounds: &Aabb, share: f32, greatest: f32) -> Option<Self> {
        // Nor where there is no telling.
        if share.is_nan() || share < LEAST_SHARE {
            return None;
        }
        let mixture = fit(photons, 0.5 * (bounds.min + bounds.max), 0.5 * bounds.size().length())?;
        Some(Self { share: share.min(greatest), odds: odds(share), mixture })
    }

    /// The guide for a lobe about an axis at a point with the normal `n`: to what the lobe shows of the light.
    #[inline(always)]
    pub fn within(&self, p: Vec3, n: Vec3, lobe: &Lobe) -> Self {
        let (mixture, shown) = self.mixture.within(p, n, lobe);
        // A white surface shows 1 / pi of what arrives.
        let odds = self.odds * PI * shown;
        let share = odds / (1.0 + odds);
        let share = if share > LEAST_SHARE { share.min(GREATEST_GLOSSY_SHARE) } else { 0.0 };
        Self { share, odds, mixture }
    }
}

/// Light by all else, where the best share of samples for it is this one.
pub(super) fn odds(share: f32) -> f32 {
    share / (1.0 - share.min(0.999))
}

/// What is left of a number where it does not ask the guide, which has a `share` of them.
#[inline(always)]
pub fn unguided(share: f32, u: f32) -> f32 {
    within(u, share, 1.0 - share)
}

/// The area over which photons are spread: that of a disk in which points are as far from each other.
fn area(photons: &[Photon]) -> f32 {
    let count = photons.len() as f32;
    let mean = photons.iter().map(|photon| photon.p).sum::<Vec3>() / count;
    // Points of a disk of radius r are r apart, in the root mean square: twice their variance.
    TAU * photons.iter().map(|photon| photon.p.distance_squared(mean)).sum::<f32>() / count
}

/// A step on the way to a cell, packed: many rays ask for it.
///
/// Whoever has come to a leaf stays there: its own number stands for those below it, and `at` is above what there is
/// in place of a coordinate.
#[derive(Clone, Copy, Debug)]
struct Node {
    /// What is below this along the axis is told by the first of two nodes, the rest by the second.
    at: f32,
    /// The axis, or [`LEAF`](Self::LEAF), and four times the first node.
    next: u32,
}

impl Node {
    /// In place of an axis.
    const LEAF: u32 = 3;

    fn split(at: f32, axis: usize, first: usize) -> Self {
        Self { at, next: first as u32 * 4 + axis as u32 }
    }

    fn leaf(number: usize) -> Self {
        Self { at: 1.0, next: number as u32 * 4 + Self::LEAF }
    }
}

/// Axes, each with two ways to face along it.
const SIDES: usize = 6;

/// All cells: six trees, for surfaces that face along each axis.
#[derive(Clone, Debug, Default)]
pub struct GuideMap {
    cells: Vec<Cell>,
    /// Where each cell counts.
    bounds: Vec<Aabb>,
    /// Of all trees, each of which begins with the node of its side's number.
    nodes: Vec<Node>,
    /// The number of each leaf's cell, if it has one.
    of_leaves: Vec<Option<u32>>,
}

/// How cells are made.
#[derive(Clone, Copy)]
pub(super) struct Making {
    /// Photons with light of a leaf at most: as many as tell directions from noise.
    pub most: usize,
    /// Whether those without light count too.
    pub counts_dark: bool,
    /// The cell of the photons of a leaf, for the points of its bounds.
    pub cell: fn(&[Photon], &Aabb) -> Option<Cell>,
}

impl GuideMap {
    /// The map of these photons, the same for the same photons in the same order.
    pub(super) fn new(photons: Vec<Photon>, making: Making) -> Self {
        let mut facing: [Vec<Photon>; SIDES] = Default::default();
        for photon in photons {
            facing[side(photon.n)].push(photon);
        }
        let mut map = Self::default();
        map.add_leaves(SIDES);
        for (side, photons) in facing.iter_mut().enumerate() {
            map.grow(side, photons, making);
        }
        map
    }

    /// Adds leaves without a cell. The number of the first.
    fn add_leaves(&mut self, count: usize) -> usize {
        let first = self.nodes.len();
        self.nodes.extend((first..first + count).map(Node::leaf));
        self.of_leaves.resize(first + count, None);
        first
    }

    /// Makes the tree of some photons of a leaf.
    fn grow(&mut self, node: usize, photons: &mut [Photon], making: Making) {
        let bounds = Aabb::around(photons.iter().map(|photon| photon.p));
        let size = bounds.size();
        let lit = if making.counts_dark {
            photons.len()
        } else {
            photons.iter().filter(|photon| photon.power > 0.0).count()
        };
        if lit <= making.most || size == Vec3::ZERO {
            let margin = 0.1 * size.max_element();
            let bounds = bounds.grow(bounds.min - margin).grow(bounds.max + margin);
            if let Some(cell) = (making.cell)(photons, &bounds) {
                self.of_leaves[node] = Some(self.cells.len() as u32);
                self.bounds.push(bounds);
                self.cells.push(cell);
            }
            return;
        }
        let axis = size.max_position();
        let half = photons.len() / 2;
        photons.select_nth_unstable_by(half, |a, b| a.p[axis].total_cmp(&b.p[axis]));
        let first = self.add_leaves(2);
        self.nodes[node] = Node::split(photons[half].p[axis], axis, first);
        let (below, above) = photons.split_at_mut(half);
        self.grow(first, below, making);
        self.grow(first + 1, above, making);
    }

    /// Whether there is no guide anywhere.
    pub fn is_empty(&self) -> bool {
        self.cells.is_empty()
    }

    /// The numbers of the cells at eight points of surfaces with normals, in a map that is not empty.
    ///
    /// All go down their trees together and without a branch, since nobody can tell before which way one goes.
    #[inline(always)]
    pub fn find(&self, points: &Vectors, normals: &Vectors) -> [Option<u32>; LANES] {
        // By axis, and zeros for leaves.
        let mut coordinates = [Floats::default(); 4];
        let mut nodes = [0; LANES];
        for lane in 0..LANES {
            let Vec3 { x, y, z } = points.get(lane);
            [coordinates[0][lane], coordinates[1][lane], coordinates[2][lane]] = [x, y, z];
            nodes[lane] = side(normals.get(lane)) as u32;
        }
        let mut arrived = false;
        while !arrived {
            arrived = true;
            for lane in 0..LANES {
                let Node { at, next } = self.nodes[nodes[lane] as usize];
                let axis = next % 4;
                arrived &= axis == Node::LEAF;
                nodes[lane] = next / 4 + u32::from(coordinates[axis as usize][lane] >= at);
            }
        }
        let mut found = [None; LANES];
        for lane in 0..LANES {
            if let Some(cell) = self.of_leaves[nodes[lane] as usize]
                && self.bounds[cell as usize].contains(points.get(lane))
            {
                prefetch(&self.cells[cell as usize]);
                found[lane] = Some(cell);
            }
        }
        found
    }

    /// The cell of a number that [`find`](Self::find) gave.
    #[inline]
    pub fn cell(&self, number: u32) -> &Cell {
        &self.cells[number as usize]
    }
}

/// The axis along which a normal points most, and which way.
#[inline(always)]
fn side(n: Vec3) -> usize {
    let Vec3 { x, y, z } = n.abs();
    // Choices and no branches, as above.
    let (axis, most, along) = if y > x { (2, y, n.y) } else { (0, x, n.x) };
    let (axis, along) = if z > most { (4, n.z) } else { (axis, along) };
    axis + usize::from(along < 0.0)
}

#[cfg(test)]
#[path = "map_tests.rs"]
mod tests;
