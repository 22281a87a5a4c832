//! Parts of an emissive mesh, to choose those that shine on a receiver.

use super::bounds::LightBounds;
use super::tree::LightTree;
use super::unit::below_one;
use super::{Receiver, Receivers};
use crate::core::lanes::LANES;
use crate::geometry::{Aabb, TriangleMesh};
use glam::DVec3;

/// Triangles of a mesh in patches of neighbours: a tree chooses the patch by what it may give to the receiver, the
/// patch a triangle by area.
///
/// A mesh that winds through a scene, or goes around it, is near a receiver with one part only, and turns its back on
/// it with half of the others: points that are uniform over its whole area are mostly wasted, since `le / pdf` goes
/// with `cos / t^2`. A patch is as large as is about flat and as wide as it is long, since there is nothing to choose
/// within a lamp that is one piece.
#[derive(Clone, Debug, Default)]
pub(super) struct Patches {
    tree: LightTree,
    /// Triangles, patch by patch; those without area are left out.
    triangles: Vec<u32>,
    /// Area of all before each of them, and after the last.
    before: Vec<f64>,
    /// Where in `triangles` each patch begins, and where the last ends.
    starts: Vec<u32>,
    /// The patch of each triangle of the mesh, if it has one.
    patch_of: Vec<Option<u32>>,
}

/// A triangle to take a point of.
#[derive(Clone, Copy, Debug)]
pub(super) struct ChosenTriangle {
    pub(super) prim_id: u32,
    /// With which a point that is uniform on it is chosen, by area.
    pub(super) density: f64,
    /// What is left of the number that chose: uniform in `[0, 1)` again.
    pub(super) rest: f64,
}

/// Times that triangles that face about the same way are halved, at most: a choice among more than a thousand patches
/// costs more than it saves.
const DEEPEST: u32 = 8;

/// Cosine of the angle between normals and their mean up to which a patch counts as flat.
const FLAT: f64 = 0.9;

/// Part of the greatest side of its box that the triangles of a patch must fill.
const FILLED: f64 = 0.4;

/// Normal of a triangle, as long as twice its area.
pub(super) fn cross(mesh: &TriangleMesh, prim_id: u32) -> DVec3 {
    let [a, b, c] = mesh.triangle(prim_id).map(|p| p.as_dvec3());
    (b - a).cross(c - a)
}

fn area(mesh: &TriangleMesh, prim_id: u32) -> f64 {
    0.5 * cross(mesh, prim_id).length()
}

fn bounds(mesh: &TriangleMesh, prim_id: u32) -> Aabb {
    Aabb::around(mesh.triangle(prim_id))
}

/// The axis and the cosine of the half angle of a cone about the normals of triangles; (any, -1) if they are all over.
pub(super) fn normal_cone(mesh: &TriangleMesh, triangles: impl Iterator<Item = u32> + Clone) -> (DVec3, f64) {
    let crosses = triangles.map(|i| cross(mesh, i));
    let area: f64 = crosses.clone().map(|n| 0.5 * n.length()).sum();
    let axis = crosses.clone().sum::<DVec3>();
    if axis.length() < 1e-6 * area {
        return (DVec3::Z, -1.0);
    }
    let axis = axis.normalize();
    let cos = crosses.filter_map(DVec3::try_normalize).map(|n| n.dot(axis)).fold(1.0, f64::min);
    (axis, cos)
}

impl Patches {
    /// Of a mesh that emits a radiance of this luminance.
    pub(super) fn new(mesh: &TriangleMesh, luminance: f32, both_sides: bool) -> Self {
        let all = 0..mesh.triangle_count() as u32;
        let mut triangles: Vec<u32> = all.filter(|&i| area(mesh, i) > 0.0).collect();
        let mut patches = vec![];
        let mut done = |patch: &[u32]| patches.push(patch.to_vec());
        if is_patch(mesh, &triangles) {
            done(&triangles);
        } else {
            // Those that face about the same way, so that a thin tube's front and back are never one patch.
            triangles.sort_by_key(|&i| side(cross(mesh, i)));
            for facing in triangles.chunk_by_mut(|&a, &b| side(cross(mesh, a)) == side(cross(mesh, b))) {
                part(mesh, facing, 0, &mut done);
            }
        }

        let mut made = Self {
            before: vec![0.0],
            starts: vec![0],
            patch_of: vec![None; mesh.triangle_count()],
            ..Self::default()
        };
        let mut leaves = vec![];
        for (number, patch) in (0..).zip(patches) {
            let mut sum = *made.before.last().expect("it begins with 0");
            for &triangle in &patch {
                sum += area(mesh, triangle);
                made.before.push(sum);
                made.patch_of[triangle as usize] = Some(number);
            }
            made.triangles.extend(&patch);
            made.starts.push(made.triangles.len() as u32);
            let (axis, cos) = normal_cone(mesh, patch.iter().copied());
            leaves.push(Some(LightBounds {
                bounds: patch.iter().fold(Aabb::EMPTY, |all, &i| all.union(bounds(mesh, i))),
                axis: axis.as_vec3(),
                cos_spread: (cos as f32 - 1e-5).max(-1.0),
                intensity: luminance * made.area(number) as f32,
                both_sides,
            }));
        }
        made.tree = LightTree::new(&leaves);
        made
    }

    /// Area of a patch.
    #[inline]
    fn area(&self, patch: u32) -> f64 {
        let [start, end] = [0, 1].map(|k| self.starts[(patch + k) as usize] as usize);
        self.before[end] - self.before[start]
    }

    /// A triangle for each receiver. None where there is nothing that could shine on it.
    #[inline(always)]
    pub(super) fn sample_eight(
        &self,
        to: &Receivers,
        choice: &[f64; LANES],
    ) -> [Option<ChosenTriangle>; LANES] {
        let patches = self.tree.sample_eight(to, choice);
        let mut triangles = [None; LANES];
        for lane in to.lanes() {
            if let Some(patch) = patches.light[lane] {
                triangles[lane] = Some(self.within(patch, patches.probability[lane], patches.rest[lane]));
            }
        }
        triangles
    }

    /// A triangle of a patch that was chosen with this probability.
    #[inline]
    fn within(&self, patch: u32, probability: f64, choice: f64) -> ChosenTriangle {
        let [start, end] = [0, 1].map(|k| self.starts[(patch + k) as usize] as usize);
        let before = &self.before[start..=end];
        let area = before[end - start] - before[0];
        let at = before[0] + choice * area;
        let place = (before.partition_point(|&sum| sum <= at).max(1) - 1).min(end - start - 1);
        let rest = below_one((at - before[place]) / (before[place + 1] - before[place]));
        ChosenTriangle { prim_id: self.triangles[start + place], density: probability / area, rest }
    }

    /// The density of [`sample_eight`](Self::sample_eight) on a triangle, by area.
    #[inline]
    pub(super) fn density(&self, to: &Receiver, triangle: u32) -> f64 {
        match (self.patch_of[triangle as usize], self.tree.only()) {
            (None, _) => 0.0,
            (Some(patch), Some(_)) => self.area(patch).recip(),
            (Some(patch), None) => self.tree.probability(to, patch) / self.area(patch),
        }
    }

    /// Area of all patches.
    pub(super) fn total_area(&self) -> f64 {
        self.before.last().copied().unwrap_or(0.0)
    }
}

/// The axis along which a normal points most, and which way.
fn side(n: DVec3) -> usize {
    let axis = n.abs().max_position();
    2 * axis + usize::from(n[axis] < 0.0)
}

/// Halves triangles until each part is a patch, and gives each to `done`.
fn part(mesh: &TriangleMesh, triangles: &mut [u32], depth: u32, done: &mut impl FnMut(&[u32])) {
    if triangles.len() == 1 || depth == DEEPEST || is_patch(mesh, triangles) {
        done(triangles);
        return;
    }
    let center = |i: u32| bounds(mesh, i).center();
    let axis = Aabb::around(triangles.iter().map(|&i| center(i))).size().max_position();
    let half = triangles.len() / 2;
    triangles.select_nth_unstable_by(half, |&a, &b| center(a)[axis].total_cmp(&center(b)[axis]));
    let (below, above) = triangles.split_at_mut(half);
    part(mesh, below, depth + 1, done);
    part(mesh, above, depth + 1, done);
}

/// Whether triangles are about flat and fill the box around them.
fn is_patch(mesh: &TriangleMesh, triangles: &[u32]) -> bool {
    if triangles.is_empty() {
        return false;
    }
    let size = triangles.iter().fold(Aabb::EMPTY, |all, &i| all.union(bounds(mesh, i))).size().as_dvec3();
    let side = (size.x * size.y).max(size.y * size.z).max(size.z * size.x);
    let filled: f64 = triangles.iter().map(|&i| area(mesh, i)).sum();
    filled > FILLED * side && normal_cone(mesh, triangles.iter().copied()).1 > FLAT
}
