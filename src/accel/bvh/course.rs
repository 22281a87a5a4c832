//! A fine tree over few primitives, and the order in which the rays of an octant meet its boxes.
//!
//! Eight rays that go down together test a box in a third of the time of a triangle, and a box without a need is soon
//! passed by: leaves are small, here a wall of two triangles.

use super::boxes::{Bounds, Ref, bounds_of};
use super::ray::SLACK;
use super::small::{Leaf, Step};
use glam::Vec4Swizzles;

/// Time of a primitive's test over that of a box.
const PRIMITIVE: f32 = 3.0;

/// Rays of eight that go as if each were alone, as far as the chance is concerned that one of them enters a box.
const INDEPENDENT: f32 = 3.0;

/// Primitives and how leaves are made of them.
pub(super) trait Leaves {
    /// A leaf of references of one kind.
    fn leaf(&mut self, refs: &[Ref]) -> Leaf;

    /// Whether a reference is to a sphere.
    fn is_sphere(&self, r: &Ref) -> bool;
}

/// An inner node or a leaf.
pub(super) struct Tree {
    bounds: Bounds,
    content: Content,
    /// Whether rays test its box: not if nearly all that enter the one around it would enter.
    boxed: bool,
}

enum Content {
    Leaf(Leaf),
    Inner(Box<[Tree; 2]>),
}

impl Tree {
    /// Over all references, if there are any.
    pub(super) fn new(mut refs: Vec<Ref>, leaves: &mut impl Leaves) -> Option<Self> {
        if refs.is_empty() {
            return None;
        }
        let mut tree = Self::over(&mut refs, leaves);
        // Most rays start in there.
        tree.choose_boxes(tree.bounds.half_area());
        Some(tree)
    }

    fn over(refs: &mut [Ref], leaves: &mut impl Leaves) -> Self {
        let bounds = bounds_of(refs);
        let content = match cut(refs, bounds.half_area(), leaves) {
            None => Content::Leaf(leaves.leaf(refs)),
            Some(cut) => {
                let (lefts, rights) = refs.split_at_mut(cut);
                Content::Inner(Box::new([Self::over(lefts, leaves), Self::over(rights, leaves)]))
            }
        };
        Self { bounds, content, boxed: true }
    }

    /// Leaves out boxes that are not worth their test, for rays that were found to enter one of half area `outer`. What
    /// the tree then costs them.
    fn choose_boxes(&mut self, outer: f32) -> f32 {
        let own = self.bounds.half_area();
        let inside = match &mut self.content {
            Content::Leaf(leaf) => PRIMITIVE * (leaf.end - leaf.first) as f32,
            Content::Inner(children) => children.iter_mut().map(|child| child.choose_boxes(own)).sum(),
        };
        let boxed = 1.0 + chance(own, outer) * inside;
        self.boxed = boxed < inside;
        boxed.min(inside)
    }

    /// The boxes for rays of an octant, nearest first.
    pub(super) fn course(&self, octant: usize) -> Vec<Step> {
        let mut course = vec![];
        self.lay(octant, &mut course);
        course
    }

    fn lay(&self, octant: usize, course: &mut Vec<Step>) {
        let at = course.len();
        match &self.content {
            Content::Leaf(leaf) => course.push(self.step(*leaf)),
            Content::Inner(children) => {
                if self.boxed {
                    course.push(self.step(Leaf::NONE));
                }
                let [a, b] = &**children;
                let (near, far) = if b.along(octant) < a.along(octant) { (b, a) } else { (a, b) };
                near.lay(octant, course);
                far.lay(octant, course);
            }
        }
        if self.boxed || matches!(self.content, Content::Leaf(_)) {
            course[at].next = course.len() as u32;
        }
    }

    /// Its box, or one that everything enters.
    fn step(&self, leaf: Leaf) -> Step {
        let (lo, hi) = (self.bounds.lo(), self.bounds.hi());
        let slack = SLACK * lo.abs().max(hi.abs()).xyz().max_element();
        let planes = core::array::from_fn(|axis| match self.boxed {
            true => [lo[axis] - slack, hi[axis] + slack],
            false => [f32::NEG_INFINITY, f32::INFINITY],
        });
        Step { planes, next: 0, leaf }
    }

    /// How far its middle is along the diagonal of an octant.
    fn along(&self, octant: usize) -> f32 {
        let middle = self.bounds.lo() + self.bounds.hi();
        (0..3).map(|axis| if octant >> axis & 1 == 1 { -middle[axis] } else { middle[axis] }).sum()
    }
}

/// The chance that one of a packet's rays enters a box within another, by their half areas.
fn chance(inner: f32, outer: f32) -> f32 {
    1.0 - (1.0 - (inner / outer).clamp(0.0, 1.0)).powf(INDEPENDENT)
}

/// Sorts the references such that they are best cut in two, and where; `None` if they had better be a leaf.
fn cut(refs: &mut [Ref], area: f32, leaves: &impl Leaves) -> Option<usize> {
    let spheres = refs.iter().filter(|r| leaves.is_sphere(r)).count();
    let may_be_leaf = spheres == 0 || spheres == refs.len();
    let leaf = if may_be_leaf { PRIMITIVE * refs.len() as f32 } else { f32::INFINITY };
    let Some((axis, cut)) = best_cut(refs, area, leaf) else {
        refs.sort_by_key(|r| leaves.is_sphere(r));
        return (!may_be_leaf).then_some(refs.len() - spheres);
    };
    sort_along(refs, axis);
    Some(cut)
}

/// Along which axis the references are best cut in two, and where, if that costs less than `least`.
fn best_cut(refs: &mut [Ref], area: f32, mut least: f32) -> Option<(usize, usize)> {
    let mut best = None;
    let mut areas = vec![0.0; refs.len()];
    for axis in 0..3 {
        sort_along(refs, axis);
        let (mut before, mut behind) = (Bounds::EMPTY, Bounds::EMPTY);
        for (area, r) in areas.iter_mut().zip(&*refs).rev() {
            behind.join(r.bounds());
            *area = behind.half_area();
        }
        for cut in 1..refs.len() {
            before.join(refs[cut - 1].bounds());
            let side = |side: f32, count: usize| 1.0 + chance(side, area) * PRIMITIVE * count as f32;
            let cost = side(before.half_area(), cut) + side(areas[cut], refs.len() - cut);
            if cost < least {
                (least, best) = (cost, Some((axis, cut)));
            }
        }
    }
    best
}

/// Sorts by the centres, and where these are alike by the ids.
fn sort_along(refs: &mut [Ref], axis: usize) {
    let key = |r: &Ref| (r.geom_id(), r.prim_id());
    refs.sort_unstable_by(|a, b| a.center()[axis].total_cmp(&b.center()[axis]).then(key(a).cmp(&key(b))));
}
