//! Eight rays at a time through a [small hierarchy](super::small), however they go: all test each box that one of them
//! may enter, and each triangle in it.
//!
//! Single rays in a room of few triangles spend their time on branches that no processor can foresee. Here eight share
//! each branch, and most of what differs between them is a mask.

use super::data::{Hierarchy, Place};
use super::mode::Mode;
use super::ray::{Best, CULL_INFLATION, Prepared, Weights};
use super::rows::{EIGHT, Eight, Ready};
use super::simd::{Lanes, Mask, Simd};
use super::small::{Ball, Facet, Leaf, Small};
use super::sphere::{first_root, may_meet};
use super::watertight::AXES;
use super::ways::{Group, Groups};
use crate::core::{Hit, Ray};
use crate::geometry::Sphere;
use core::marker::PhantomData;

/// The rays to be swept through a small hierarchy.
pub(super) struct Sweeps<'a, M> {
    mode: PhantomData<M>,
    data: &'a Hierarchy,
    small: &'a Small,
    rays: &'a [Ray],
    /// Indices of those that are not usual, and so left out.
    pub(super) left: Vec<usize>,
    /// What each ray has hit of what is swept, if it may hit something else; nothing yet where it wants any hit.
    pub(super) beyond: Vec<Option<Best>>,
}

impl<'a, M: Mode> Sweeps<'a, M> {
    pub(super) fn new(data: &'a Hierarchy, small: &'a Small, rays: &'a [Ray]) -> Self {
        let beyond = if small.rest.is_some() { vec![None; rays.len()] } else { vec![] };
        Self { mode: PhantomData, data, small, rays, left: vec![], beyond }
    }

    /// Closest hits of all rays that are not left out.
    #[inline(always)]
    pub(super) fn closest<S: Simd>(&mut self, simd: S, hits: &mut [Option<Hit>]) {
        let mut groups = Groups::new(self.rays);
        while let Some(group) = groups.next() {
            let (found, beyond) = self.sweep::<S, false>(simd, &group);
            let (u, v) = (found.v / found.det, found.w / found.det);
            let (t, u, v, numbers) =
                (found.t.to_array(), u.to_array(), v.to_array(), found.number.to_array());
            let Small { ids, places, .. } = self.small;
            for (lane, &i) in group.indices.iter().enumerate().take(group.count) {
                let number = (numbers[lane] < f32::INFINITY).then_some(numbers[lane] as usize);
                hits[i] = number.map(|number| {
                    let (geom_id, prim_id) = ids[number];
                    Hit { t: t[lane], u: u[lane], v: v[lane], geom_id, prim_id }
                });
                if beyond >> lane & 1 == 1 {
                    let place = number.map_or(Place::NONE, |number| places[number]);
                    self.beyond[i] = Some(Best { t: t[lane], place });
                }
            }
        }
    }

    /// Whether anything is on each of the rays that are not left out.
    #[inline(always)]
    pub(super) fn any<S: Simd>(&mut self, simd: S, occluded: &mut [bool]) {
        let mut groups = Groups::new(self.rays);
        while let Some(group) = groups.next() {
            let (found, beyond) = self.sweep::<S, true>(simd, &group);
            let hits = found.t.le(simd.splat8(f32::NEG_INFINITY)).bits();
            for (lane, &i) in group.indices.iter().enumerate().take(group.count) {
                occluded[i] = hits >> lane & 1 == 1;
                if beyond >> lane & 1 == 1 {
                    self.beyond[i] = Some(Best::none(0.0));
                }
            }
        }
    }

    /// What a group's rays find, and which of them may find something else beyond what is swept.
    #[inline(always)]
    fn sweep<S: Simd, const ANY: bool>(&mut self, simd: S, group: &Group) -> (Found<S::F8>, u32) {
        let (mut rays, mut skipped) = ([&self.rays[0]; EIGHT], [[0.0; EIGHT]; 2]);
        for (lane, &i) in group.indices.iter().enumerate() {
            let ray = &self.rays[i];
            rays[lane] = ray;
            let [before, behind] = self.small.skipped(ray.skip);
            (skipped[0][lane], skipped[1][lane]) = (before, behind);
        }
        let eight = Eight::new(simd, rays);
        let usual = eight.usual();
        for lane in (0..group.count).filter(|lane| usual >> lane & 1 == 0) {
            self.left.push(group.indices[lane]);
        }
        let Ready { origin, dir, rcp, near, far, t_min, t_max } = Ready::new::<S, M>(simd, eight);
        let zero = simd.splat8(0.0);
        let is_negative = [rcp[0].le(zero), rcp[1].le(zero), rcp[2].le(zero)];
        let limit = t_max * simd.splat8(CULL_INFLATION);
        let number = simd.splat8(f32::INFINITY);
        let mut sweep = Sweep::<S, M, ANY> {
            simd,
            data: self.data,
            small: self.small,
            rays: &rays,
            origin,
            dir,
            bundle: M::bundle(AXES[group.axis % 3], origin, dir, rcp),
            slabs: Slabs { is_negative, rcp, near, far, t_min },
            skipped: [simd.load8(&skipped[0]), simd.load8(&skipped[1])],
            found: Found { t: t_max, limit, v: zero, w: zero, det: zero, number },
        };
        sweep.go(group.octant);
        let beyond = match &self.small.rest {
            Some(rest) => usual & sweep.slabs.enter(simd, &rest.planes, sweep.found.limit),
            None => 0,
        };
        (sweep.found, beyond)
    }
}

/// The rays' slab tests.
struct Slabs<F: Lanes<EIGHT>> {
    is_negative: [F::Mask; 3],
    rcp: [F; 3],
    near: [F; 3],
    far: [F; 3],
    t_min: F,
}

impl<F: Lanes<EIGHT>> Slabs<F> {
    /// The rays that enter the box before `limit`.
    #[inline(always)]
    fn enter<S: Simd<F8 = F>>(&self, simd: S, planes: &[[f32; 2]; 3], limit: F) -> u32 {
        let side = |k: usize| {
            let (lo, hi) = (simd.splat8(planes[k][0]), simd.splat8(planes[k][1]));
            let is_negative = self.is_negative[k];
            let (near, far) = (hi.select(is_negative, lo), lo.select(is_negative, hi));
            (near.mul_sub(self.rcp[k], self.near[k]), far.mul_sub(self.rcp[k], self.far[k]))
        };
        let (x, y, z) = (side(0), side(1), side(2));
        let entry = x.0.max(y.0).max(z.0.max(self.t_min));
        let exit = x.1.min(y.1).min(z.1.min(limit));
        entry.le(exit).bits()
    }
}

/// What the rays have hit so far. Rays that want any hit and have one end before they start, at negative infinity.
struct Found<F> {
    t: F,
    /// Boxes that start behind this are not entered.
    limit: F,
    /// See [`Weights`].
    v: F,
    w: F,
    det: F,
    /// The primitives' numbers, infinite for none.
    number: F,
}

/// Eight rays on their way.
struct Sweep<'a, S: Simd, M: Mode, const ANY: bool> {
    simd: S,
    data: &'a Hierarchy,
    small: &'a Small,
    rays: &'a [&'a Ray; EIGHT],
    origin: [S::F8; 3],
    dir: [S::F8; 3],
    bundle: M::Bundle<S::F8>,
    slabs: Slabs<S::F8>,
    skipped: [S::F8; 2],
    found: Found<S::F8>,
}

impl<S: Simd, M: Mode, const ANY: bool> Sweep<'_, S, M, ANY> {
    #[inline(always)]
    fn go(&mut self, octant: usize) {
        let steps = &self.small.courses[octant][..];
        let mut i = 0;
        while let Some(step) = steps.get(i) {
            let entering = self.slabs.enter(self.simd, &step.planes, self.found.limit);
            if entering == 0 {
                i = step.next as usize;
                continue;
            }
            i += 1;
            let Leaf { first, end, is_spheres } = step.leaf;
            let leaf = first as usize..end as usize;
            if is_spheres {
                for ball in &self.small.balls[leaf] {
                    self.ball(ball, entering);
                }
            } else {
                for facet in &self.small.facets[leaf] {
                    self.facet(facet);
                }
            }
            if ANY && self.slabs.t_min.le(self.found.limit).bits() == 0 {
                return;
            }
        }
    }

    #[inline(always)]
    fn facet(&mut self, facet: &Facet) {
        let simd = self.simd;
        let interval = [self.slabs.t_min, self.found.t];
        let Some(crossing) = M::test_bundle::<S, false>(simd, &self.bundle, facet, interval) else { return };
        let number = simd.splat8(facet.number);
        self.keep(crossing.hits & self.allowed(number), crossing.t, number, crossing.weights);
        if crossing.edge_on != 0 {
            self.edge_on(facet, crossing.edge_on);
        }
    }

    /// The triangle for those rays that only f64 can tell.
    #[inline(always)]
    fn edge_on(&mut self, facet: &Facet, rays: u32) {
        for lane in (0..EIGHT).filter(|lane| rays >> lane & 1 == 1) {
            let prepared = Prepared::<M>::new(self.rays[lane]);
            let (none, mut weights) = (Best::none(self.found.t.to_array()[lane]), Weights::NONE);
            let (block, bit) = (facet.place.block(), 1 << facet.place.lane());
            let best = M::edge_on_lanes(self.data, &prepared, block, bit, none, &mut weights);
            if best.is_hit() {
                // The same in all lanes.
                let [v, w, det] = weights.0.map(|lanes| lanes[0]);
                let weights = [self.simd.splat8(v), self.simd.splat8(w), self.simd.splat8(det)];
                let (t, number) = (self.simd.splat8(best.t), self.simd.splat8(facet.number));
                self.keep(self.simd.mask8(1 << lane), t, number, weights);
            }
        }
    }

    /// Makes hits that are no farther the best of their rays, if they are nearer or lesser.
    #[inline(always)]
    fn keep(
        &mut self,
        hits: <S::F8 as Lanes<EIGHT>>::Mask,
        t: S::F8,
        number: S::F8,
        [v, w, det]: [S::F8; 3],
    ) {
        let Self { simd, found, .. } = self;
        if ANY {
            found.t = simd.splat8(f32::NEG_INFINITY).select(hits, found.t);
            found.limit = simd.splat8(f32::NEG_INFINITY).select(hits, found.limit);
            return;
        }
        let better = hits & (t.ne(found.t) | number.le(found.number));
        found.t = t.select(better, found.t);
        found.limit = found.t * simd.splat8(CULL_INFLATION);
        found.v = v.select(better, found.v);
        found.w = w.select(better, found.w);
        found.det = det.select(better, found.det);
        found.number = number.select(better, found.number);
    }

    #[inline(always)]
    fn ball(&mut self, ball: &Ball, entering: u32) {
        let simd = self.simd;
        let Sphere { center, radius } = ball.sphere;
        let center = [simd.splat8(center.x), simd.splat8(center.y), simd.splat8(center.z)];
        let mut met = entering & may_meet(self.origin, self.dir, center, simd.splat8(radius));
        if met == 0 {
            return;
        }
        let mut roots = [f32::INFINITY; EIGHT];
        while met != 0 {
            let lane = met.trailing_zeros() as usize % EIGHT;
            met &= met - 1;
            let ray = self.rays[lane];
            if let Some(t) = first_root([ray.origin, ray.dir], [ray.t_min, f32::MAX], ball.sphere) {
                roots[lane] = t;
            }
        }
        let (t, number) = (simd.load8(&roots), simd.splat8(ball.number));
        let (zero, one) = (simd.splat8(0.0), simd.splat8(1.0));
        self.keep(t.le(self.found.t) & self.allowed(number), t, number, [zero, zero, one]);
    }

    /// The rays that may hit the primitive of a number.
    #[inline(always)]
    fn allowed(&self, number: S::F8) -> <S::F8 as Lanes<EIGHT>>::Mask {
        number.le(self.skipped[0]) | self.skipped[1].le(number)
    }
}

#[cfg(test)]
mod tests {
    use crate::accel::bvh::{Bvh, Isa};
    use crate::accel::{Accelerator, BuildOptions, Coherence};
    use crate::core::sampler::hash;
    use crate::core::{Hit, Ray, Skip};
    use crate::geometry::{Shape, Sphere, TriangleMesh};
    use glam::Vec3;
    use std::sync::Arc;

    fn number(i: u32) -> f32 {
        hash(i) as f32 / u32::MAX as f32
    }

    fn vector(i: u32) -> Vec3 {
        2.0 * Vec3::new(number(i), number(i + 1), number(i + 2)) - 1.0
    }

    fn cuboid(center: Vec3, half: Vec3) -> Shape {
        let corner = |i: u32| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32) * 2.0 - 1.0;
        let positions = (0..8).map(|i| center + half * corner(i)).collect();
        let sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
        let indices = sides.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        let mesh = TriangleMesh::new(positions, indices, vec![], vec![]);
        Shape::Mesh(Arc::new(mesh.expect("it is a mesh")))
    }

    /// A room with boxes, two of them in one place, and spheres.
    fn room() -> Vec<Shape> {
        let mut shapes = vec![cuboid(Vec3::ZERO, Vec3::new(2.0, 1.5, 3.0))];
        shapes.extend((0..20).map(|i| cuboid(1.4 * vector(50 * i), 0.3 * vector(50 * i + 9).abs() + 0.02)));
        shapes.push(shapes[3].clone());
        let sphere =
            |i: u32| Sphere { center: 1.4 * vector(70 * i + 5), radius: 0.3 * number(70 * i) + 0.01 };
        shapes.insert(2, Shape::Spheres((0..9).map(sphere).collect()));
        shapes
    }

    fn rays() -> Vec<Ray> {
        let mut rays: Vec<Ray> =
            (0..3000).map(|i| Ray::new(1.4 * vector(20 * i + 3), vector(20 * i + 7))).collect();
        for (i, ray) in (0u32..).zip(&mut rays) {
            let (geom, prim) = (hash(i) % 25, hash(i + 1) % 13);
            match i % 16 {
                0 => ray.skip = Skip::Geometry(geom),
                1..8 => ray.skip = Skip::Primitive { geom, prim },
                8 => ray.t_max = 1.0,
                9 => ray.dir *= 1e-12,
                10 => ray.dir.x = 0.0,
                11 => ray.dir = Vec3::X,
                12 if i % 64 == 12 => *ray = Ray::inactive(),
                _ => {}
            }
        }
        rays
    }

    fn bits(hit: Option<Hit>) -> Option<[u32; 5]> {
        hit.map(|h| [h.t.to_bits(), h.u.to_bits(), h.v.to_bits(), h.geom_id, h.prim_id])
    }

    /// A room with few walls, many balls, and a mesh of many triangles, of which some lie in walls.
    fn crowded_room() -> Vec<Shape> {
        let mut shapes = room();
        shapes.truncate(12);
        let mut corners: Vec<Vec3> = (0..2400)
            .flat_map(|i| {
                let corner = 0.8 * vector(30 * i + 2);
                [corner, corner + 0.1 * vector(30 * i + 11), corner + 0.1 * vector(30 * i + 21)]
            })
            .collect();
        for shape in &shapes {
            let Shape::Mesh(mesh) = shape else { continue };
            corners.extend((0..3).flat_map(|i| mesh.triangle(i)));
        }
        let indices = (0..corners.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let mesh = TriangleMesh::new(corners, indices, vec![], vec![]);
        shapes.insert(5, Shape::Mesh(Arc::new(mesh.expect("it is a mesh"))));
        let ball = |i: u32| Sphere { center: 1.4 * vector(90 * i + 1), radius: 0.05 * number(90 * i) + 0.01 };
        shapes.push(Shape::Spheres((0..300).map(ball).collect()));
        shapes
    }

    #[test]
    fn eight_rays_find_what_each_finds_alone() {
        for shapes in [room(), crowded_room()] {
            find_what_each_finds_alone(&shapes);
        }
    }

    fn find_what_each_finds_alone(shapes: &[Shape]) {
        let rays = rays();
        for (robust, isa) in [(true, Isa::Avx2), (true, Isa::Sse2), (false, Isa::Avx2), (false, Isa::Sse2)] {
            let options = BuildOptions { robust, ..BuildOptions::default() };
            let bvh = Bvh::new(shapes, &options).expect("they are few");
            let small = bvh.data.small.as_ref().expect("some are swept");
            assert!(small.rest.is_none_or(|rest| rest.is_walled));
            let Some(bvh) = bvh.with_raw_hits().with_isa(isa) else { continue };
            let (mut alone, mut together) = (vec![None; rays.len()], vec![None; rays.len()]);
            let (mut any_alone, mut any) = (vec![false; rays.len()], vec![false; rays.len()]);
            bvh.intersect(&rays, Coherence::Incoherent, &mut together);
            bvh.occluded(&rays, Coherence::Incoherent, &mut any);
            let bvh = bvh.with_single_rays();
            bvh.intersect(&rays, Coherence::Incoherent, &mut alone);
            bvh.occluded(&rays, Coherence::Incoherent, &mut any_alone);
            assert!(alone.iter().flatten().count() > 1000, "the rays meet something");
            for (i, ray) in rays.iter().enumerate() {
                assert_eq!(bits(together[i]), bits(alone[i]), "{isa:?}, robust {robust}: {ray:?}");
                assert_eq!(any[i], any_alone[i], "{isa:?}, robust {robust}: {ray:?}");
            }
        }
    }

    #[test]
    fn a_course_leads_past_every_primitive_once() {
        let bvh = Bvh::new(&room(), &BuildOptions::default()).expect("they are few");
        let small = bvh.data.small.as_ref().expect("they are few");
        for course in &small.courses {
            let mut facets = vec![0; small.facets.len()];
            let mut balls = vec![0; small.balls.len()];
            for (at, step) in course.iter().enumerate() {
                assert!(step.next as usize > at && step.next as usize <= course.len());
                let counts = if step.leaf.is_spheres { &mut balls } else { &mut facets };
                (step.leaf.first..step.leaf.end).for_each(|i| counts[i as usize] += 1);
            }
            assert!(facets.iter().chain(&balls).all(|&count| count == 1));
            assert_eq!((facets.len(), balls.len()), (22 * 12, 9));
        }
    }
}
