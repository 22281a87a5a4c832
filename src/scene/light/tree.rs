//! Choosing one of many lights by what it may contribute to a receiver.

use super::bounds::{EightEmissions, Emission, LightBounds};
use super::pick::{Picked, Picking};
use super::unit::below_one;
use super::{Receiver, Receivers};
use crate::core::lanes::{Floats, LANES};
use crate::core::prefetch;
use crate::geometry::Aabb;
use glam::Vec3;

/// A tree over lights; each inner node goes on to one of up to eight children by their importance, which is found side
/// by side.
///
/// Source: Conty Estevez and Kulla 2018, *Importance Sampling of Many Lights with Adaptive Tree Splitting*. Eight
/// children instead of two are found in a third of the steps, and up to eight lights are each weighed by their own
/// importance.
#[derive(Clone, Debug, Default)]
pub(super) struct LightTree {
    /// All lights together.
    all: Option<Emission>,
    /// The root is first; empty if there is one light or none.
    nodes: Vec<Node>,
    /// The light, if it is one.
    only: Option<u32>,
    /// Where each light is a child; `None` for a light that is in no node.
    places: Vec<Option<Place>>,
}

/// A child of a node.
#[derive(Clone, Copy, Debug)]
struct Place {
    node: u32,
    child: u32,
}

#[derive(Clone, Debug)]
struct Node {
    /// Of the children; those beyond the last give nothing.
    emissions: EightEmissions,
    /// How many there are.
    children: usize,
    links: [Link; LANES],
    /// Where it is a child itself; `None` for the root.
    parent: Option<Place>,
}

#[derive(Clone, Copy, Debug)]
enum Link {
    /// Index of another node.
    Node(u32),
    /// Index of the light.
    Light(u32),
}

impl Node {
    /// The importance of each child, and the sum of all.
    #[inline(always)]
    fn importances(&self, to: &Receiver) -> (Floats, f32) {
        let importances = self.emissions.importances(to);
        (importances, importances.iter().sum())
    }

    /// Asks for what [`importances`](Self::importances) reads.
    #[inline(always)]
    fn prefetch(&self) {
        self.emissions.prefetch();
        prefetch(&self.links);
    }

    /// The child that each number of `choice` falls on for its receiver, each as in [`pick`].
    #[inline(always)]
    fn pick_eight(&self, to: &Receivers, choice: &[f64; LANES]) -> Picked {
        let mut importances = [Floats::default(); LANES];
        let mut total = Floats::default();
        for (child, importances) in importances.iter_mut().enumerate().take(self.children) {
            *importances = self.emissions.importances_of(child, to);
            for lane in 0..LANES {
                total[lane] += importances[lane];
            }
        }
        let mut picking = Picking::new(&total, choice);
        for (child, importances) in (0..).zip(&importances[..self.children]) {
            picking = picking.offer(child, importances);
        }
        picking.picked()
    }
}

/// The light that is chosen for each of eight receivers, if one is.
#[derive(Default)]
pub(super) struct EightChosen {
    pub(super) light: [Option<u32>; LANES],
    /// With what probability.
    pub(super) probability: [f64; LANES],
    /// What is left of each choice.
    pub(super) rest: [f64; LANES],
}

/// The bounds of one or more leaves.
fn bounds_of(leaves: &[(u32, LightBounds)]) -> LightBounds {
    leaves[1..].iter().fold(leaves[0].1, |all, (_, leaf)| all.union(leaf))
}

/// From this depth on nodes are split into halves, so that lights along a line make no endless chain.
const HALVE_FROM: u32 = 24;

/// Bins per axis.
const BINS: usize = 12;

impl LightTree {
    /// A tree over those of `bounds`, by light, that are there.
    pub(super) fn new(bounds: &[Option<LightBounds>]) -> Self {
        let mut leaves: Vec<_> =
            bounds.iter().enumerate().filter_map(|(i, b)| b.map(|b| (i as u32, b))).collect();
        let mut tree = Self::default();
        match &*leaves {
            [] => {}
            [(light, bounds)] => {
                tree.only = Some(*light);
                tree.all = Some((*bounds).into());
            }
            _ => {
                tree.all = Some(bounds_of(&leaves).into());
                tree.places = vec![None; bounds.len()];
                tree.build(&mut leaves, 0, None);
            }
        }
        tree
    }

    /// Adds the node over two or more leaves. Its index.
    fn build(&mut self, leaves: &mut [(u32, LightBounds)], depth: u32, parent: Option<Place>) -> u32 {
        let groups = eight_groups(leaves, depth);
        let node = self.nodes.len() as u32;
        let emissions = EightEmissions::new(groups.iter().map(|(_, group)| bounds_of(group).into()));
        let children = groups.len();
        self.nodes.push(Node { emissions, children, links: [Link::Light(0); LANES], parent });
        for (child, (depth, group)) in (0..).zip(groups) {
            let place = Place { node, child };
            self.nodes[node as usize].links[child as usize] = match *group {
                [(light, _)] => {
                    self.places[light as usize] = Some(place);
                    Link::Light(light)
                }
                _ => Link::Node(self.build(group, depth, Some(place))),
            };
        }
        node
    }

    /// Whether no light is in the tree.
    #[inline]
    pub(super) fn is_empty(&self) -> bool {
        self.all.is_none()
    }

    /// The one light that is in the tree, if it is one.
    #[inline(always)]
    pub(super) fn only(&self) -> Option<u32> {
        self.only
    }

    /// About how much irradiance all its lights may give to the receiver.
    #[inline]
    pub(super) fn importance(&self, to: &Receiver) -> f32 {
        self.all.as_ref().map_or(0.0, |all| all.importance(to))
    }

    /// The same for each of eight receivers.
    #[inline(always)]
    pub(super) fn importances(&self, to: &Receivers) -> Floats {
        match &self.all {
            Some(all) => all.importances(to),
            None => Floats::default(),
        }
    }

    /// A light for each receiver, the probability of choosing it, and what is left of the numbers `choice`: uniform in
    /// `[0, 1)` again. None where no light reaches the receiver.
    ///
    /// All go down together, so that none waits alone for what memory or the processor are slow to tell.
    #[inline(always)]
    pub(super) fn sample_eight(&self, to: &Receivers, choice: &[f64; LANES]) -> EightChosen {
        let mut chosen = EightChosen { probability: [1.0; LANES], rest: *choice, ..Default::default() };
        if let Some(only) = self.only {
            chosen.light = [Some(only); LANES];
        }
        let Some(root) = self.nodes.first() else { return chosen };
        let picked = root.pick_eight(to, choice);
        // Those on their way, and the node that each has come to.
        let (mut left, mut nodes) = (0, [(0, 0); LANES]);
        for lane in to.lanes().filter(|&lane| picked.there[lane]) {
            (chosen.probability[lane], chosen.rest[lane]) = (picked.share[lane], picked.rest[lane]);
            match root.links[picked.index[lane] as usize] {
                Link::Light(light) => chosen.light[lane] = Some(light),
                Link::Node(node) => {
                    nodes[left] = (lane, node);
                    left += 1;
                }
            }
        }
        while left > 0 {
            let before = std::mem::take(&mut left);
            for i in 0..before {
                let (lane, node) = nodes[i];
                let node = &self.nodes[node as usize];
                let importances = node.emissions.importances(&to.get(lane));
                let Some((child, share, rest)) = pick(&importances, chosen.rest[lane]) else { continue };
                chosen.probability[lane] *= share;
                chosen.rest[lane] = rest;
                match node.links[child] {
                    Link::Light(light) => chosen.light[lane] = Some(light),
                    Link::Node(next) => {
                        self.nodes[next as usize].prefetch();
                        nodes[left] = (lane, next);
                        left += 1;
                    }
                }
            }
        }
        chosen
    }

    /// The probability with which [`sample_eight`](Self::sample_eight) chooses this light.
    #[inline(always)]
    pub(super) fn probability(&self, to: &Receiver, light: u32) -> f64 {
        if let Some(only) = self.only {
            return f64::from(u8::from(only == light));
        }
        let Some(mut place) = self.places.get(light as usize).copied().flatten() else { return 0.0 };
        let mut probability = 1.0;
        loop {
            let node = &self.nodes[place.node as usize];
            let (importances, total) = node.importances(to);
            if total <= 0.0 {
                return 0.0;
            }
            probability *= f64::from(importances[place.child as usize]) / f64::from(total);
            match node.parent {
                Some(parent) => place = parent,
                None => return probability,
            }
        }
    }
}

/// The child that `choice` falls on, its share of all importance, and what is left of `choice`; `None` where no child is of
/// any importance.
#[inline(always)]
fn pick(importances: &Floats, choice: f64) -> Option<(usize, f64, f64)> {
    let mut before = [0.0; LANES + 1];
    for child in 0..LANES {
        before[child + 1] = before[child] + importances[child];
    }
    let total = before[LANES];
    if total <= 0.0 {
        return None;
    }
    let at = choice * f64::from(total);
    // One whose end lies beyond it is of some importance.
    let place = (at as f32).min(total.next_down());
    let child = before[1..].iter().map(|&end| usize::from(end <= place)).sum::<usize>();
    let importance = f64::from(importances[child]);
    let rest = below_one((at - f64::from(before[child])) / importance);
    Some((child, importance / f64::from(total), rest))
}

/// Parts two or more leaves into up to eight groups, each with its depth of halving: the group of most leaves is parted
/// until there are eight, so that the tree becomes no deeper than it must.
fn eight_groups(leaves: &mut [(u32, LightBounds)], depth: u32) -> Vec<(u32, &mut [(u32, LightBounds)])> {
    let mut groups = vec![(depth, leaves)];
    while groups.len() < LANES
        && let Some(most) =
            (0..groups.len()).filter(|&i| groups[i].1.len() > 1).max_by_key(|&i| groups[i].1.len())
    {
        let (depth, group) = groups.swap_remove(most);
        let middle = split(group, depth);
        let (left, right) = group.split_at_mut(middle);
        groups.extend([(depth + 1, left), (depth + 1, right)]);
    }
    groups
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::Rgb;
    use crate::geometry::Sphere;
    use crate::scene::Light;
    use crate::scene::Rivals;

    #[test]
    fn up_to_eight_lights_are_each_weighed_by_their_own_importance() {
        let lamp = |i: u8| {
            let center = Vec3::new(f32::from(i), 1.0 + f32::from(i * i % 5), 0.0);
            let radiance = Rgb::grey(1.0 + f32::from(i * 7 % 4));
            LightBounds::new(&Light::sphere(Sphere { center, radius: 0.1 }, radiance, false))
        };
        let lamps: Vec<_> = (0..8).map(lamp).collect();
        let to = Receiver { p: Vec3::new(2.5, 0.0, 0.0), n: Vec3::Y, rivals: Rivals::None };
        let importance =
            |lamp: &Option<LightBounds>| Emission::from(lamp.expect("it shines")).importance(&to);
        let total: f32 = lamps.iter().map(importance).sum();
        let tree = LightTree::new(&lamps);
        for (light, lamp) in (0..).zip(&lamps) {
            let expected = f64::from(importance(lamp) / total);
            assert!((tree.probability(&to, light) / expected - 1.0).abs() < 1e-5, "{light}");
        }
    }

    #[test]
    fn lights_along_a_line_of_growing_steps_make_no_deep_tree() {
        let lamp = |i: i32| {
            let position = Vec3::X * 1.2f32.powi(i);
            LightBounds::new(&Light::point(position, Rgb::WHITE, true, true))
        };
        let tree = LightTree::new(&(0..300).map(lamp).collect::<Vec<_>>());
        let depth = |light: usize| {
            let place = |place: Place| tree.nodes[place.node as usize].parent;
            std::iter::successors(tree.places[light], |&at| place(at)).count()
        };
        let deepest = (0..300).map(depth).max();
        assert!(deepest <= Some(12), "{deepest:?}");
    }
}
