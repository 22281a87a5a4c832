//! Eight coherent rays at a time: one frustum goes through the nodes, and a triangle is tested against all eight.
//!
//! The frustum's slab test takes the interval of the rays' origins and that of their reciprocal directions, so it
//! visits whatever one of the rays would visit (Overbeck, Ramamoorthi and Mark 2008, "Large Ray Packets for Real-time
//! Whitted Ray Tracing", as the packets of Embree do it). The triangle test is the one of a single ray, lane by lane.

use super::data::{BLOCK, Child, Hierarchy, Node, TriangleBlock};
use super::ray::{AXES, Best, CULL_INFLATION, EXIT_INFLATION, GREATEST_LENGTH, LEAST_LENGTH, Prepared};
use super::simd::{Lanes, Mask, Simd};
use super::single::{Stack, edge_on_lanes, pop, push_sorted};
use super::{sphere, triangle};
use crate::core::{Hit, Ray};

/// Rays of a packet.
pub(super) const PACKET: usize = 8;

/// Greatest difference of the slopes `dir[x] / dir[z]` within a packet, z being the fastest axis: about 3.5 degrees.
const SLOPE_SPREAD: f32 = 0.06;

/// Greatest distance of the origins along an axis, as a fraction of the scene.
const ORIGIN_SPREAD: f32 = 0.01;

/// Eight rays that go nearly the same way.
pub(super) struct Packet<F> {
    axes: [usize; 3],
    sign: [usize; 3],
    frustum: Frustum<F>,
    origin: [F; 3],
    neg_rcp: [F; 3],
    shear: triangle::Shear<F>,
    t_min: F,
    t: F,
}

/// The slab test's constants: for entries and for exits, by axis.
struct Frustum<F> {
    near_origin: [F; 3],
    near_neg_rcp: [F; 3],
    far_origin: [F; 3],
    far_neg_rcp: [F; 3],
    t_min: F,
}

/// Least and greatest lane.
#[inline(always)]
fn range<F: Lanes<PACKET>>(v: F) -> (f32, f32) {
    let lanes = v.to_array();
    let fold = |f: fn(f32, f32) -> f32| {
        let pairs =
            [f(lanes[0], lanes[4]), f(lanes[1], lanes[5]), f(lanes[2], lanes[6]), f(lanes[3], lanes[7])];
        f(f(pairs[0], pairs[1]), f(pairs[2], pairs[3]))
    };
    (fold(|a, b| if a < b { a } else { b }), fold(|a, b| if a > b { a } else { b }))
}

impl<F: Lanes<PACKET>> Packet<F> {
    /// The rays as a packet, if they are active, start and go alike, and need no scaling.
    #[inline(always)]
    pub(super) fn new<S: Simd<F8 = F>>(simd: S, data: &Hierarchy, rays: &[Ray; PACKET]) -> Option<Self> {
        let load = |component: fn(&Ray) -> f32| simd.load8(&core::array::from_fn(|i| component(&rays[i])));
        let origin = [load(|r| r.origin.x), load(|r| r.origin.y), load(|r| r.origin.z)];
        let dir = [load(|r| r.dir.x), load(|r| r.dir.y), load(|r| r.dir.z)];
        let (t_min, t_max) = (load(|r| r.t_min), load(|r| r.t_max));
        let zero = simd.splat8(0.0);
        let all = |mask: F::Mask| mask.bits() == 0xff;

        // Active, in the sense of `Prepared::new`, and starting in front of the origin.
        let finite = [origin[0], origin[1], origin[2], dir[0], dir[1], dir[2]];
        let nothing = finite.into_iter().fold(zero, |sum, v| sum + v * zero);
        if !(all(nothing.le(zero)) && all(t_min.le(t_max)) && all(zero.le(t_min))) {
            return None;
        }

        // One octant and one fastest axis for all.
        let neg_rcp = dir.map(|d| simd.splat8(-1.0) / d);
        let mut sign = [0; 3];
        for (sign, r) in sign.iter_mut().zip(neg_rcp) {
            *sign = match r.le(zero).bits() {
                0xff => 0,
                0 => 1,
                _ => return None,
            };
        }
        let length = dir.map(|d| d.max(zero - d));
        let fastest = (0..3).find(|&i| {
            let others = length[(i + 1) % 3].max(length[(i + 2) % 3]);
            all(others.le(length[i])) && others.ne(length[i]).bits() == 0xff
        })?;
        let axes = AXES[fastest];
        let usual =
            simd.splat8(LEAST_LENGTH).le(length[fastest]) & length[fastest].le(simd.splat8(GREATEST_LENGTH));
        if !all(usual) {
            return None;
        }

        // Close together.
        let z = zero - neg_rcp[fastest];
        let shear = [dir[axes[0]] * z, dir[axes[1]] * z, z];
        let is_narrow = |v: F, spread: f32| {
            let (least, greatest) = range(v);
            (greatest - least <= spread).then_some((least, greatest))
        };
        is_narrow(shear[0], SLOPE_SPREAD)?;
        is_narrow(shear[1], SLOPE_SPREAD)?;
        let spread = ORIGIN_SPREAD * data.extent;
        let origins =
            [is_narrow(origin[0], spread)?, is_narrow(origin[1], spread)?, is_narrow(origin[2], spread)?];

        Some(Self {
            axes,
            sign,
            frustum: Frustum::new(simd, sign, origins, neg_rcp, range(t_min).0),
            origin,
            neg_rcp,
            shear: triangle::Shear { origin: [origin[axes[0]], origin[axes[1]], origin[axes[2]]], shear },
            t_min,
            t: t_max,
        })
    }
}

impl<F: Lanes<PACKET>> Frustum<F> {
    /// Entries count from the last origin along the ray at the greatest speed, exits from the first at the least.
    #[inline(always)]
    fn new<S: Simd<F8 = F>>(
        simd: S,
        sign: [usize; 3],
        origins: [(f32, f32); 3],
        neg_rcp: [F; 3],
        t_min: f32,
    ) -> Self {
        let zero = simd.splat8(0.0);
        let mut frustum = Self {
            near_origin: [zero; 3],
            near_neg_rcp: [zero; 3],
            far_origin: [zero; 3],
            far_neg_rcp: [zero; 3],
            t_min: simd.splat8(t_min),
        };
        for axis in 0..3 {
            let ((first, last), (least, greatest)) = (origins[axis], range(neg_rcp[axis]));
            let (near, far) = if sign[axis] == 0 {
                ((last, greatest), (first, least))
            } else {
                ((first, least), (last, greatest))
            };
            frustum.near_origin[axis] = simd.splat8(near.0);
            frustum.near_neg_rcp[axis] = simd.splat8(near.1);
            frustum.far_origin[axis] = simd.splat8(far.0);
            frustum.far_neg_rcp[axis] = simd.splat8(far.1 * EXIT_INFLATION);
        }
        frustum
    }

    /// Entry distances of the eight boxes, and which of them any of the rays may enter before `t_max`. For NaN see
    /// the slab test of a single ray.
    #[inline(always)]
    fn enter<S: Simd<F8 = F>>(&self, simd: S, sign: [usize; 3], node: &Node, t_max: f32) -> (F, u32) {
        let near = |k: usize| {
            (self.near_origin[k] - simd.load8(&node.planes[k][sign[k] & 1])) * self.near_neg_rcp[k]
        };
        let far = |k: usize| {
            (self.far_origin[k] - simd.load8(&node.planes[k][sign[k] & 1 ^ 1])) * self.far_neg_rcp[k]
        };
        let entry = near(0).max(near(1)).max(near(2).max(self.t_min));
        let exit = far(0).min(far(1)).min(far(2).min(simd.splat8(t_max)));
        (entry, entry.le(exit).bits())
    }
}

/// What the eight rays have hit so far.
struct Found<F> {
    t: F,
    v: F,
    w: F,
    det: F,
    /// Geometry and primitive; `NO_ID` for nothing.
    ids: [(u32, u32); PACKET],
}

/// Closest hits of a packet.
#[inline(always)]
pub(super) fn traverse<S: Simd>(
    simd: S,
    data: &Hierarchy,
    rays: &[Ray; PACKET],
    packet: &Packet<S::F8>,
    stack: &mut Stack,
    hits: &mut [Option<Hit>],
) {
    let nothing = Best::none(0.0);
    let zero = simd.splat8(0.0);
    let mut found = Found {
        t: packet.t,
        v: zero,
        w: zero,
        det: simd.splat8(1.0),
        ids: [(nothing.geom_id, nothing.prim_id); PACKET],
    };
    let mut limit = range(found.t).1 * CULL_INFLATION;
    let mut top = 0;
    let mut current = data.root;
    'nodes: loop {
        while !current.is_leaf() {
            let node = &data.nodes[current.index()];
            let (near, mask) = packet.frustum.enter(simd, packet.sign, node, limit);
            if mask == 0 {
                match pop::<false>(stack, &mut top, limit) {
                    Some(child) => current = child,
                    None => break 'nodes,
                }
            } else if mask & (mask - 1) == 0 {
                current = node.children[mask.trailing_zeros() as usize & 7];
            } else {
                current = push_sorted(simd, data, node, near, mask, stack, &mut top);
            }
        }
        if leaf(simd, data, rays, packet, current, &mut found) {
            limit = range(found.t).1 * CULL_INFLATION;
        }
        match pop::<false>(stack, &mut top, limit) {
            Some(child) => current = child,
            None => break,
        }
    }

    let (t, u, v) = (found.t.to_array(), (found.v / found.det).to_array(), (found.w / found.det).to_array());
    for (i, hit) in hits.iter_mut().enumerate().take(PACKET) {
        let (geom_id, prim_id) = found.ids[i];
        *hit = (geom_id != nothing.geom_id).then_some(Hit { t: t[i], u: u[i], v: v[i], geom_id, prim_id });
    }
}

/// The rays against the primitives of a leaf. Whether any found something better.
#[inline(always)]
fn leaf<S: Simd>(
    simd: S,
    data: &Hierarchy,
    rays: &[Ray; PACKET],
    packet: &Packet<S::F8>,
    leaf: Child,
    found: &mut Found<S::F8>,
) -> bool {
    let mut improved = false;
    if leaf.is_spheres() {
        for lane in 0..PACKET {
            improved |= one_by_one(simd, rays, found, lane, |ray, best| {
                sphere::intersect_leaf(ray, &data.spheres[leaf.blocks()], best)
            });
        }
        return improved;
    }
    for block in &data.triangles[leaf.blocks()] {
        for lane in 0..BLOCK {
            let (geom_id, prim_id) = (block.geom_ids[lane], block.prim_ids[lane]);
            let corners = splat_triangle(simd, packet.axes, block, lane);
            let crossing = triangle::cross(&packet.shear, &corners);
            if crossing.inside.bits() == 0 {
                continue;
            }
            let axis = usize::from(block.flat_axes[lane]);
            let t = if axis < 3 {
                let plane = simd.splat8(block.corners[0][axis][lane]);
                crossing.flat_distance(&packet.shear, packet.origin[axis], plane, packet.neg_rcp[axis])
            } else {
                crossing.distance(&packet.shear)
            };
            let (valid, edge_on) = (crossing.hits(t, packet.t_min, found.t), crossing.edge_on());
            let mut accepted = 0;
            let (new, old) = (t.to_array(), found.t.to_array());
            let mut lanes = valid;
            while lanes != 0 {
                let i = lanes.trailing_zeros() as usize % PACKET;
                lanes &= lanes - 1;
                let better = new[i] < old[i] || (geom_id, prim_id) < found.ids[i];
                if better && !rays[i].skip.rejects(geom_id, prim_id) {
                    found.ids[i] = (geom_id, prim_id);
                    accepted |= 1 << i;
                }
            }
            if accepted != 0 {
                improved = true;
                let mask = simd.mask8(accepted);
                found.t = t.select(mask, found.t);
                found.v = crossing.v.select(mask, found.v);
                found.w = crossing.w.select(mask, found.w);
                found.det = crossing.det.select(mask, found.det);
            }
            for i in (0..PACKET).filter(|i| edge_on >> i & 1 == 1) {
                improved |=
                    one_by_one(simd, rays, found, i, |ray, best| edge_on_lanes(ray, block, 1 << lane, best));
            }
        }
    }
    improved
}

/// One triangle of a block in all lanes.
#[inline(always)]
fn splat_triangle<S: Simd>(
    simd: S,
    axes: [usize; 3],
    block: &TriangleBlock,
    lane: usize,
) -> triangle::Corners<S::F8> {
    let [x, y, z] = axes;
    let [a, b, c] = &block.corners;
    let corner =
        |p: &[[f32; BLOCK]; 3]| [simd.splat8(p[x][lane]), simd.splat8(p[y][lane]), simd.splat8(p[z][lane])];
    [corner(a), corner(b), corner(c)]
}

/// Lets one ray of the packet find something by itself.
#[cold]
#[inline(never)]
fn one_by_one<S: Simd>(
    simd: S,
    rays: &[Ray; PACKET],
    found: &mut Found<S::F8>,
    lane: usize,
    find: impl FnOnce(&Prepared, Best) -> Best,
) -> bool {
    let Some(ray) = Prepared::new(&rays[lane]) else { return false };
    let (mut t, mut v, mut w, mut det) =
        (found.t.to_array(), found.v.to_array(), found.w.to_array(), found.det.to_array());
    let (geom_id, prim_id) = found.ids[lane];
    let before = Best { geom_id, prim_id, ..Best::none(t[lane]) };
    let after = find(&ray, before);
    if (after.t, after.geom_id, after.prim_id) == (before.t, geom_id, prim_id) {
        return false;
    }
    let [new_v, new_w, new_det] = after.weights;
    (t[lane], v[lane], w[lane], det[lane]) = (after.t, new_v, new_w, new_det);
    found.ids[lane] = (after.geom_id, after.prim_id);
    (found.t, found.v) = (simd.load8(&t), simd.load8(&v));
    (found.w, found.det) = (simd.load8(&w), simd.load8(&det));
    true
}
