//! Choosing one of many lights by what it may contribute to a receiver.

use super::Receiver;
use super::alias::below_one;
use super::bounds::{Emission, LightBounds};
use crate::geometry::Aabb;
use glam::Vec3;

/// A binary tree over lights; each inner node goes left or right by the importance of the two.
///
/// Source: Conty Estevez and Kulla 2018, *Importance Sampling of Many Lights with Adaptive Tree Splitting*.
#[derive(Clone, Debug, Default)]
pub(super) struct LightTree {
    /// The root is first; two children lie side by side.
    nodes: Vec<Node>,
    /// For each light the turns from the root to it, the first in the lowest bit (1 is right); `None` for a light
    /// that is not in the tree.
    trails: Vec<Option<u64>>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    emission: Emission,
    link: Link,
}

#[derive(Clone, Copy, Debug)]
enum Link {
    /// Index of the left child; the right one is next.
    Children(u32),
    /// Index of the light.
    Light(u32),
}

impl Node {
    /// Over one or more leaves, not linked yet.
    fn new(leaves: &[(u32, LightBounds)]) -> Self {
        Self { emission: bounds_of(leaves).into(), link: Link::Children(0) }
    }
}

/// The bounds of one or more leaves.
fn bounds_of(leaves: &[(u32, LightBounds)]) -> LightBounds {
    leaves[1..].iter().fold(leaves[0].1, |all, (_, leaf)| all.union(leaf))
}

/// From this depth on nodes are split into halves, so that a trail of 64 turns always suffices.
const HALVE_FROM: u32 = 24;

/// Bins per axis.
const BINS: usize = 12;

impl LightTree {
    /// A tree over those of `bounds`, by light, that are there.
    pub(super) fn new(bounds: &[Option<LightBounds>]) -> Self {
        let mut leaves: Vec<_> =
            bounds.iter().enumerate().filter_map(|(i, b)| b.map(|b| (i as u32, b))).collect();
        let mut tree = Self {
            nodes: Vec::with_capacity(2 * leaves.len()),
            trails: vec![None; if leaves.is_empty() { 0 } else { bounds.len() }],
        };
        if !leaves.is_empty() {
            tree.nodes.push(Node::new(&leaves));
            tree.build(0, &mut leaves, 0, 0);
        }
        tree
    }

    /// Puts children below node `index`, which stands over `leaves`.
    fn build(&mut self, index: usize, leaves: &mut [(u32, LightBounds)], depth: u32, trail: u64) {
        if let [(light, _)] = *leaves {
            self.nodes[index].link = Link::Light(light);
            self.trails[light as usize] = Some(trail);
            return;
        }
        let middle = split(leaves, depth);
        let (left, right) = leaves.split_at_mut(middle);
        let children = self.nodes.len();
        self.nodes[index].link = Link::Children(children as u32);
        self.nodes.extend([Node::new(left), Node::new(right)]);
        self.build(children, left, depth + 1, trail);
        self.build(children + 1, right, depth + 1, trail | 1 << depth);
    }

    /// Whether no light is in the tree.
    #[inline]
    pub(super) fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// The one light that is in the tree, if it is one.
    #[inline(always)]
    pub(super) fn only(&self) -> Option<u32> {
        match *self.nodes {
            [Node { link: Link::Light(light), .. }] => Some(light),
            _ => None,
        }
    }

    /// About how much irradiance all its lights may give to the receiver.
    #[inline]
    pub(super) fn importance(&self, to: &Receiver) -> f32 {
        self.nodes.first().map_or(0.0, |root| root.emission.importance(to))
    }

    /// How often a choice between two children goes left; `None` if neither side gives light.
    #[inline]
    fn left_share(&self, children: u32, to: &Receiver) -> Option<f64> {
        let [left, right] =
            [0, 1].map(|side| f64::from(self.nodes[children as usize + side].emission.importance(to)));
        (left + right > 0.0).then(|| left / (left + right))
    }

    /// A light, the probability of choosing it, and what is left of `choice`: uniform in `[0, 1)` again.
    #[inline]
    pub(super) fn sample(&self, to: &Receiver, mut choice: f64) -> Option<(u32, f64, f64)> {
        let (mut index, mut probability) = (0, 1.0);
        loop {
            match self.nodes.get(index)?.link {
                Link::Light(light) => return Some((light, probability, choice)),
                Link::Children(children) => {
                    let left_share = self.left_share(children, to)?;
                    if choice < left_share {
                        choice = below_one(choice / left_share);
                        probability *= left_share;
                        index = children as usize;
                    } else {
                        choice = below_one((choice - left_share) / (1.0 - left_share));
                        probability *= 1.0 - left_share;
                        index = children as usize + 1;
                    }
                }
            }
        }
    }

    /// The probability with which [`sample`](Self::sample) chooses this light.
    #[inline]
    pub(super) fn probability(&self, to: &Receiver, light: u32) -> f64 {
        let Some(mut trail) = self.trails.get(light as usize).copied().flatten() else { return 0.0 };
        let (mut index, mut probability) = (0, 1.0);
        while let Link::Children(children) = self.nodes[index].link {
            let Some(left_share) = self.left_share(children, to) else { return 0.0 };
            if trail & 1 == 0 {
                probability *= left_share;
                index = children as usize;
            } else {
                probability *= 1.0 - left_share;
                index = children as usize + 1;
            }
            trail >>= 1;
        }
        probability
    }
}

/// Reorders two or more leaves into two groups and gives the size of the first, neither of them empty.
fn split(leaves: &mut [(u32, LightBounds)], depth: u32) -> usize {
    let centers = Aabb::around(leaves.iter().map(|(_, b)| b.bounds.center()));
    let bin_of = |axis: usize, b: &LightBounds| {
        let at = (b.bounds.center()[axis] - centers.min[axis]) / centers.size()[axis];
        ((at * BINS as f32) as usize).min(BINS - 1)
    };
    let best = if depth < HALVE_FROM { best_split(leaves, centers.size(), bin_of) } else { None };
    if let Some((axis, last)) = best {
        leaves.sort_by_key(|(_, b)| bin_of(axis, b) > last);
        return leaves.partition_point(|(_, b)| bin_of(axis, b) <= last);
    }
    // Halves along the longest axis.
    let size = centers.size();
    let axis = (0..3).max_by(|&a, &b| size[a].total_cmp(&size[b])).unwrap_or(0);
    leaves.sort_by(|(_, a), (_, b)| a.bounds.center()[axis].total_cmp(&b.bounds.center()[axis]));
    leaves.len() / 2
}

/// The axis and the last bin of the first group that cost least; `None` if all centres are one point.
fn best_split(
    leaves: &[(u32, LightBounds)],
    size: Vec3,
    bin_of: impl Fn(usize, &LightBounds) -> usize,
) -> Option<(usize, usize)> {
    let extent = leaves.iter().fold(Aabb::EMPTY, |all, (_, leaf)| all.union(leaf.bounds)).size();
    let mut best = None;
    for axis in (0..3).filter(|&axis| size[axis] > 0.0) {
        let mut bins = [None::<LightBounds>; BINS];
        for (_, leaf) in leaves {
            let bin = &mut bins[bin_of(axis, leaf)];
            *bin = join(*bin, Some(*leaf));
        }
        // Thin boxes should be cut across (the paper's regularisation).
        let regular = extent.max_element() / extent[axis];
        for last in 0..BINS - 1 {
            let [first, second] =
                [&bins[..=last], &bins[last + 1..]].map(|side| side.iter().copied().fold(None, join));
            let (Some(first), Some(second)) = (first, second) else { continue };
            let cost = regular * (first.cost() + second.cost());
            if best.is_none_or(|(least, _, _)| cost < least) {
                best = Some((cost, axis, last));
            }
        }
    }
    best.map(|(_, axis, last)| (axis, last))
}

/// The bounds of both, where they are there.
fn join(a: Option<LightBounds>, b: Option<LightBounds>) -> Option<LightBounds> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.union(&b)),
        (one, other) => one.or(other),
    }
}
