//! One ray in f64, slowly: for the rare answer that f32 puts beside its primitive.

use super::data::{Child, Hierarchy, NO_ID, Node, WIDTH};
use crate::accel::exact::{self, Point};
use crate::core::{Hit, Ray};
use crate::geometry::Shape;
use glam::DVec3;

/// The closest hit of an active ray, as brute force in f64 finds it.
#[cold]
pub(super) fn closest(data: &Hierarchy, shapes: &[Shape], ray: &Ray) -> Option<Hit> {
    let mut best: Option<Hit> = None;
    let mut stack = vec![data.root];
    while let Some(child) = stack.pop() {
        if child.is_leaf() {
            for (geom_id, prim_id) in ids(data, child) {
                if !ray.skip.rejects(geom_id, prim_id) {
                    keep_nearer(&mut best, ray, &shapes[geom_id as usize], geom_id, prim_id);
                }
            }
        } else {
            let node = &data.nodes[child.index()];
            stack.extend(
                (0..WIDTH).filter(|&lane| meets_box(ray, node, lane)).map(|lane| node.children[lane]),
            );
        }
    }
    best
}

/// The primitives of a leaf.
fn ids(data: &Hierarchy, leaf: Child) -> Vec<(u32, u32)> {
    let pairs = |blocks: &mut dyn Iterator<Item = (&[u32], &[u32])>| {
        let ids = blocks.flat_map(|(geoms, prims)| geoms.iter().copied().zip(prims.iter().copied()));
        ids.filter(|&(geom_id, _)| geom_id != NO_ID).collect()
    };
    if leaf.is_spheres() {
        pairs(&mut data.spheres[leaf.blocks()].iter().map(|b| (&b.geom_ids[..], &b.prim_ids[..])))
    } else {
        pairs(&mut data.triangles[leaf.blocks()].iter().map(|b| (&b.geom_ids[..], &b.prim_ids[..])))
    }
}

/// Makes the primitive's hit the best one if it is in the interval and nearer, or as near with lesser ids.
fn keep_nearer(best: &mut Option<Hit>, ray: &Ray, shape: &Shape, geom_id: u32, prim_id: u32) {
    let points: [Option<Point>; 2] = match shape {
        Shape::Mesh(mesh) => [exact::crossing(ray, mesh.triangle(prim_id)), None],
        Shape::Spheres(spheres) => {
            exact::sphere_ends(ray, spheres[prim_id as usize]).map(|end| (end.beside == 0.0).then_some(end))
        }
    };
    let inside = |p: &Point| (p.t as f32) >= ray.t_min && (p.t as f32) <= ray.t_max;
    if let Some(p) = points.into_iter().flatten().find(inside) {
        let hit = Hit { t: p.t as f32, u: p.u as f32, v: p.v as f32, geom_id, prim_id };
        let key = |hit: &Hit| (hit.t, hit.geom_id, hit.prim_id);
        if best.is_none_or(|best| key(&hit) < key(&best)) {
            *best = Some(hit);
        }
    }
}

/// Whether the ray's interval meets a child's box.
fn meets_box(ray: &Ray, node: &Node, lane: usize) -> bool {
    if node.children[lane] == Child::EMPTY {
        return false;
    }
    let plane =
        |side: usize| DVec3::from_array(std::array::from_fn(|axis| f64::from(node.planes[axis][side][lane])));
    let (origin, dir) = (ray.origin.as_dvec3(), ray.dir.as_dvec3());
    let (lo, hi) = (plane(0) - origin, plane(1) - origin);
    let (mut near, mut far) = (f64::from(ray.t_min), f64::from(ray.t_max));
    for axis in 0..3 {
        if dir[axis] == 0.0 {
            if lo[axis] > 0.0 || hi[axis] < 0.0 {
                return false;
            }
            continue;
        }
        let (a, b) = (lo[axis] / dir[axis], hi[axis] / dir[axis]);
        near = near.max(a.min(b));
        far = far.min(a.max(b));
    }
    near <= far + 1e-12 * far.abs()
}
