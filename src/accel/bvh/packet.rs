//! Eight coherent rays at a time: one frustum goes through the nodes, and a triangle is tested against all eight.
//!
//! The frustum's slab test takes the interval of the rays' origins and that of their reciprocal directions, so it
//! visits whatever one of the rays would visit (Overbeck, Ramamoorthi and Mark 2008, "Large Ray Packets for Real-time
//! Whitted Ray Tracing", as the packets of Embree do it). The triangle test is the one of a single ray, lane by lane.

use super::data::{BLOCK, Child, Hierarchy, NO_ID, Node, Place};
use super::mode::{Mode, OfBlock};
use super::ray::{
    Best, CULL_INFLATION, GREATEST_LENGTH, GREATEST_RECIPROCAL, LEAST_LENGTH, Prepared, SLACK, Weights,
    comes_first,
};
use super::simd::{Lanes, Mask, Simd};
use super::single::{Stack, pop, push_sorted};
use super::sphere;
use super::watertight::AXES;
use crate::core::{Hit, Ray, Skip};
use crate::geometry::Sphere;

/// Rays of a packet.
pub(super) const PACKET: usize = 8;

/// Greatest difference of the slopes `dir[x] / dir[z]` within a packet, z being the fastest axis: about 3.5 degrees.
const SLOPE_SPREAD: f32 = 0.06;

/// Greatest distance of the origins along an axis, as a fraction of the scene.
const ORIGIN_SPREAD: f32 = 0.01;

/// Eight rays that go nearly the same way.
pub(super) struct Packet<M: Mode, F: Copy> {
    origin: [F; 3],
    dir: [F; 3],
    sign: [usize; 3],
    frustum: Frustum<F>,
    bundle: M::Bundle<F>,
    t_min: F,
    t_max: F,
    /// Whether one of the rays has a skip rule.
    has_rules: bool,
}

/// Bounds of the rays' slab tests, by axis: entries at `plane * near_rcp - near`, exits at `plane * far_rcp - far`.
struct Frustum<F> {
    near_rcp: [F; 3],
    near: [F; 3],
    far_rcp: [F; 3],
    far: [F; 3],
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

impl<M: Mode, F: Lanes<PACKET>> Packet<M, F> {
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
        let greatest = simd.splat8(GREATEST_RECIPROCAL);
        let rcp = dir.map(|d| (simd.splat8(1.0) / d).min(greatest).max(zero - greatest));
        let mut sign = [0; 3];
        for (sign, r) in sign.iter_mut().zip(rcp) {
            *sign = match r.le(zero).bits() {
                0 => 0,
                0xff => 1,
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
        let z = rcp[fastest];
        let slopes = [dir[axes[0]] * z, dir[axes[1]] * z];
        let is_narrow = |v: F, spread: f32| {
            let (least, greatest) = range(v);
            (greatest - least <= spread).then_some((least, greatest))
        };
        is_narrow(slopes[0], SLOPE_SPREAD)?;
        is_narrow(slopes[1], SLOPE_SPREAD)?;
        let spread = ORIGIN_SPREAD * data.extent;
        let origins =
            [is_narrow(origin[0], spread)?, is_narrow(origin[1], spread)?, is_narrow(origin[2], spread)?];

        Some(Self {
            origin,
            dir,
            sign,
            frustum: Frustum::new::<S, M>(simd, sign, origins, rcp, range(t_min).0),
            bundle: M::bundle(axes, origin, dir, rcp),
            t_min,
            t_max: t_max.min(simd.splat8(f32::MAX)),
            has_rules: rays.iter().any(|ray| ray.skip != Skip::None),
        })
    }
}

impl<F: Lanes<PACKET>> Frustum<F> {
    /// Entries count from the last origin along the ray at the greatest speed, exits from the first at the least.
    #[inline(always)]
    fn new<S: Simd<F8 = F>, M: Mode>(
        simd: S,
        sign: [usize; 3],
        origins: [(f32, f32); 3],
        rcp: [F; 3],
        t_min: f32,
    ) -> Self {
        let zero = simd.splat8(0.0);
        let [near_rcp, near, far_rcp, far] = [[zero; 3]; 4];
        let mut frustum = Self { near_rcp, near, far_rcp, far, t_min: simd.splat8(t_min) };
        let farthest = origins.iter().fold(0.0f32, |most, o| most.max(o.0.abs()).max(o.1.abs()));
        let slack = if M::WATERTIGHT { SLACK * farthest } else { 0.0 };
        for axis in 0..3 {
            let ((first, last), (least, greatest)) = (origins[axis], range(rcp[axis]));
            let (near, far) = if sign[axis] == 0 {
                ((last, least), (first, greatest))
            } else {
                ((first, greatest), (last, least))
            };
            frustum.near_rcp[axis] = simd.splat8(near.1);
            frustum.near[axis] = simd.splat8(near.0 * near.1 + slack * near.1.abs());
            frustum.far_rcp[axis] = simd.splat8(far.1);
            frustum.far[axis] = simd.splat8(far.0 * far.1 - slack * far.1.abs());
        }
        frustum
    }

    /// Entry distances of the eight boxes, and which of them any of the rays may enter before `t_max`. For NaN see
    /// the slab test of a single ray.
    #[inline(always)]
    fn enter<S: Simd<F8 = F>>(&self, simd: S, sign: [usize; 3], node: &Node, t_max: f32) -> (F, u32) {
        let near =
            |k: usize| simd.load8(&node.planes[k][sign[k] & 1]).mul_sub(self.near_rcp[k], self.near[k]);
        let far =
            |k: usize| simd.load8(&node.planes[k][sign[k] & 1 ^ 1]).mul_sub(self.far_rcp[k], self.far[k]);
        let entry = near(0).max(near(1)).max(near(2).max(self.t_min));
        let exit = far(0).min(far(1)).min(far(2).min(simd.splat8(t_max)));
        (entry, entry.le(exit).bits())
    }
}

/// What the eight rays have hit so far.
struct Found<F> {
    t: F,
    /// See [`Weights`].
    v: F,
    w: F,
    det: F,
    /// The bits of each [`Place`].
    places: F,
}

impl<F: Lanes<PACKET>> Found<F> {
    fn place(&self, lane: usize) -> Place {
        Place(self.places.to_array()[lane].to_bits())
    }
}

/// Closest hits of a packet, and how many leaves it took to find them.
#[inline(always)]
pub(super) fn traverse<S: Simd, M: Mode>(
    simd: S,
    data: &Hierarchy,
    rays: &[Ray; PACKET],
    packet: &Packet<M, S::F8>,
    stack: &mut Stack,
    hits: &mut [Option<Hit>],
) -> usize {
    let zero = simd.splat8(0.0);
    let nowhere = simd.splat8(f32::from_bits(Place::NONE.0));
    let mut found = Found { t: packet.t_max, v: zero, w: zero, det: zero, places: nowhere };
    let mut limit = range(found.t).1 * CULL_INFLATION;
    let (mut top, mut leaves) = (0, 0);
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
        leaves += 1;
        if leaf(simd, data, rays, packet, current, &mut found) {
            limit = range(found.t).1 * CULL_INFLATION;
        }
        match pop::<false>(stack, &mut top, limit) {
            Some(child) => current = child,
            None => break,
        }
    }

    let [t, u, v] = [found.t, found.v / found.det, found.w / found.det].map(Lanes::to_array);
    let places = found.places.to_array().map(|bits| Place(bits.to_bits()));
    for (i, hit) in hits.iter_mut().enumerate().take(PACKET) {
        *hit = (places[i] != Place::NONE).then(|| {
            let (geom_id, prim_id) = data.ids(places[i]);
            Hit { t: t[i], u: u[i], v: v[i], geom_id, prim_id }
        });
    }
    leaves
}

/// The rays against the primitives of a leaf. Whether any found something better.
#[inline(always)]
fn leaf<S: Simd, M: Mode>(
    simd: S,
    data: &Hierarchy,
    rays: &[Ray; PACKET],
    packet: &Packet<M, S::F8>,
    leaf: Child,
    found: &mut Found<S::F8>,
) -> bool {
    let mut improved = false;
    if leaf.is_spheres() {
        for index in leaf.blocks() {
            improved |= spheres(simd, data, rays, packet, index, found);
        }
        return improved;
    }
    for (i, block) in data.triangles[leaf.blocks()].iter().enumerate() {
        for lane in 0..BLOCK {
            if block.geom_ids[lane] == NO_ID {
                break;
            }
            let interval = [packet.t_min, found.t];
            let Some(crossing) =
                M::test_bundle::<S, true>(simd, &packet.bundle, OfBlock { block, lane }, interval)
            else {
                continue;
            };
            let place = Place::triangle(leaf.first() + i, lane);
            let (mut hits, t) = (crossing.hits, crossing.t);
            let ties = hits.bits() & !t.ne(found.t).bits();
            if ties != 0 || packet.has_rules {
                hits = simd.mask8(accepted(data, rays, found, hits.bits(), ties, place));
            }
            if hits.bits() != 0 {
                improved = true;
                found.t = t.select(hits, found.t);
                let [v, w, det] = crossing.weights;
                found.v = v.select(hits, found.v);
                found.w = w.select(hits, found.w);
                found.det = det.select(hits, found.det);
                found.places = simd.splat8(f32::from_bits(place.0)).select(hits, found.places);
            }
            for ray in (0..PACKET).filter(|ray| crossing.edge_on >> ray & 1 == 1) {
                improved |= one_by_one::<S, M>(simd, rays, found, ray, |ray, best, weights| {
                    M::edge_on_lanes(data, ray, leaf.first() + i, 1 << lane, best, weights)
                });
            }
        }
    }
    improved
}

/// The rays against the spheres of a block. Whether any found something better.
#[inline(always)]
fn spheres<S: Simd, M: Mode>(
    simd: S,
    data: &Hierarchy,
    rays: &[Ray; PACKET],
    packet: &Packet<M, S::F8>,
    index: usize,
    found: &mut Found<S::F8>,
) -> bool {
    let (block, mut improved) = (&data.spheres[index], false);
    for lane in 0..BLOCK {
        if block.geom_ids[lane] == NO_ID {
            break;
        }
        let Sphere { center, radius } = block.sphere(lane);
        let center = [simd.splat8(center.x), simd.splat8(center.y), simd.splat8(center.z)];
        let mut met = sphere::may_meet(packet.origin, packet.dir, center, simd.splat8(radius));
        while met != 0 {
            let ray = met.trailing_zeros() as usize % PACKET;
            met &= met - 1;
            improved |= one_by_one::<S, M>(simd, rays, found, ray, |ray, best, weights| {
                sphere::nearest(data, ray, index, 1 << lane, best, weights)
            });
        }
    }
    improved
}

/// Those of the `hits` on a primitive that no rule rejects and that, where they are `ties`, have the smaller ids.
#[cold]
#[inline(never)]
fn accepted<F: Lanes<PACKET>>(
    data: &Hierarchy,
    rays: &[Ray; PACKET],
    found: &Found<F>,
    hits: u32,
    ties: u32,
    place: Place,
) -> u32 {
    let (geom_id, prim_id) = data.ids(place);
    let is_better = |i: &usize| ties >> i & 1 == 0 || comes_first(data, place, found.place(*i));
    let lanes = (0..PACKET).filter(|i| hits >> i & 1 == 1).filter(is_better);
    lanes.filter(|&i| !rays[i].skip.rejects(geom_id, prim_id)).fold(0, |bits, i| bits | 1 << i)
}

/// Lets one ray of the packet find something by itself. In line, where wide instructions are known to be there: calls of a
/// function that is compiled without them would each go through memory.
#[inline(always)]
fn one_by_one<S: Simd, M: Mode>(
    simd: S,
    rays: &[Ray; PACKET],
    found: &mut Found<S::F8>,
    lane: usize,
    find: impl FnOnce(&Prepared<M>, Best, &mut Weights) -> Best,
) -> bool {
    let before = Best { t: found.t.to_array()[lane], place: found.place(lane) };
    let mut weights = Weights::NONE;
    let after = find(&Prepared::new(&rays[lane]), before, &mut weights);
    if after.place == before.place {
        return false;
    }
    let only = simd.mask8(1 << lane);
    found.t = simd.splat8(after.t).select(only, found.t);
    let [v, w, det] = weights.0.map(|lanes| simd.splat8(lanes[after.place.lane()]));
    (found.v, found.w) = (v.select(only, found.v), w.select(only, found.w));
    found.det = det.select(only, found.det);
    found.places = simd.splat8(f32::from_bits(after.place.0)).select(only, found.places);
    true
}
