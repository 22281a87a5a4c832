//! The points that eight rays hit, side by side.

use super::Scene;
use super::interaction::{
    LEAST_OFFSET, Plane, SurfaceInteraction, bent_normal, gamma, mirror_leaves, on_sphere, plane,
};
use crate::bxdf::Incidence;
use crate::core::lanes::{Floats, LANES, Vectors};
use crate::core::{Hit, Ray};
use crate::geometry::{Shape, TriangleMesh};
use crate::scene::SelfHit;
use glam::Vec3;

impl Scene {
    /// What each of eight hits means.
    ///
    /// The point comes from the barycentric coordinates (pbrt-v4, 6.8.5), which bounds its error by the size of the
    /// coordinates and not by the length of the ray.
    #[inline(always)]
    pub fn interactions(&self, hits: [(&Ray, &Hit); LANES]) -> Interactions {
        let (mut triangles, mut spheres) = (Triangles::default(), [None; LANES]);
        let (mut geom_id, mut prim_id) = ([0; LANES], [0; LANES]);
        for (lane, (ray, hit)) in hits.into_iter().enumerate() {
            (geom_id[lane], prim_id[lane]) = (hit.geom_id, hit.prim_id);
            match &self.shapes[hit.geom_id as usize] {
                Shape::Mesh(mesh) => triangles.set(lane, mesh, ray, hit),
                Shape::Spheres(of_shape) => spheres[lane] = Some(of_shape[hit.prim_id as usize]),
            }
        }
        let mut interactions = Interactions { geom_id, prim_id, ..triangles.interactions() };
        for (lane, (ray, hit)) in hits.into_iter().enumerate() {
            if let Some(sphere) = spheres[lane] {
                interactions.set(lane, &on_sphere(sphere, ray, hit));
            }
        }
        interactions
    }
}

/// Points of eight surfaces side by side: see [`SurfaceInteraction`].
#[derive(Clone, Copy, Debug)]
pub struct Interactions {
    /// The points.
    pub p: Vectors,
    /// Bounds of their errors.
    p_error: Floats,
    /// Towards the viewers.
    pub wo: Vectors,
    /// The shading normals.
    pub n: Vectors,
    /// The geometric normals.
    pub ng: Vectors,
    /// Whether the viewers are on the outer sides.
    pub front: [bool; LANES],
    geom_id: [u32; LANES],
    prim_id: [u32; LANES],
    flat: [bool; LANES],
    clearance: Floats,
    clears: [bool; LANES],
}

/// Eight [`Incidence`]s side by side, on either side of their surfaces.
///
/// A copy, so that a compiler knows that what a loop writes is none of it.
#[derive(Clone, Copy)]
pub struct Incidences {
    wo: Vectors,
    n: Vectors,
    ng: Vectors,
}

impl Incidences {
    /// The one in a lane.
    #[inline(always)]
    pub fn get(&self, lane: usize) -> Incidence {
        Incidence { wo: self.wo.get(lane), n: self.n.get(lane), ng: self.ng.get(lane), front: true }
    }
}

impl Interactions {
    /// The point in a lane.
    #[inline(always)]
    pub fn get(&self, lane: usize) -> SurfaceInteraction {
        SurfaceInteraction {
            p: self.p.get(lane),
            p_error: self.p_error[lane],
            at: Incidence {
                wo: self.wo.get(lane),
                n: self.n.get(lane),
                ng: self.ng.get(lane),
                front: self.front[lane],
            },
            geom_id: self.geom_id[lane],
            prim_id: self.prim_id[lane],
            flat: self.flat[lane],
            clearance: self.clearance[lane],
            clears: self.clears[lane],
        }
    }

    /// The points as lobes see them that are the same on both sides.
    #[inline(always)]
    pub fn incidences(&self) -> Incidences {
        Incidences { wo: self.wo, n: self.n, ng: self.ng }
    }

    /// The origins of [`spawn`](SurfaceInteraction::spawn) along `wi`.
    #[inline(always)]
    pub fn starts(&self, wi: &Vectors, self_hit: SelfHit) -> Vectors {
        let mut lifts = Floats::default();
        for lane in 0..LANES {
            lifts[lane] = self.get(lane).lift(self_hit);
        }
        self.lifted(wi, &lifts)
    }

    /// The origins of [`spawn_shadow`](SurfaceInteraction::spawn_shadow) along `wi`.
    #[inline(always)]
    pub fn shadow_starts(&self, wi: &Vectors, self_hit: SelfHit) -> Vectors {
        let mut lifts = Floats::default();
        for lane in 0..LANES {
            lifts[lane] = self.get(lane).shadow_lift(self_hit);
        }
        self.lifted(wi, &lifts)
    }

    #[inline(always)]
    fn lifted(&self, wi: &Vectors, lifts: &Floats) -> Vectors {
        let mut origins = Vectors::default();
        for lane in 0..LANES {
            origins.set(lane, self.get(lane).start(wi.get(lane), lifts[lane]));
        }
        origins
    }

    /// The ray of [`spawn`](SurfaceInteraction::spawn) in a lane, without an end, from what [`starts`](Self::starts) gave.
    #[inline(always)]
    pub fn ray(&self, lane: usize, origin: Vec3, wi: Vec3, self_hit: SelfHit) -> Ray {
        let skip = self.get(lane).rule(wi, self_hit);
        Ray { origin, t_min: 0.0, dir: wi, t_max: f32::INFINITY, skip }
    }

    /// The ray of [`spawn_shadow`](SurfaceInteraction::spawn_shadow) in a lane, from what
    /// [`shadow_starts`](Self::shadow_starts) gave.
    #[inline(always)]
    pub fn shadow_ray(&self, lane: usize, origin: Vec3, wi: Vec3, t_max: f32, self_hit: SelfHit) -> Ray {
        self.get(lane).shadow_ray(origin, wi, t_max, self_hit)
    }

    #[inline(always)]
    fn set(&mut self, lane: usize, point: &SurfaceInteraction) {
        self.p.set(lane, point.p);
        self.p_error[lane] = point.p_error;
        self.wo.set(lane, point.at.wo);
        self.n.set(lane, point.at.n);
        self.ng.set(lane, point.at.ng);
        self.front[lane] = point.at.front;
        (self.geom_id[lane], self.prim_id[lane]) = (point.geom_id, point.prim_id);
        (self.flat[lane], self.clearance[lane], self.clears[lane]) =
            (point.flat, point.clearance, point.clears);
    }
}

/// Eight triangles with a point of each and where it is seen from. Lanes without one have zeros, of which nobody asks
/// what comes out.
#[derive(Default)]
struct Triangles {
    corners: [Vectors; 3],
    /// Normals at the corners; zeros where the mesh has none.
    normals: [Vectors; 3],
    u: Floats,
    v: Floats,
    wo: Vectors,
}

impl Triangles {
    #[inline(always)]
    fn set(&mut self, lane: usize, mesh: &TriangleMesh, ray: &Ray, hit: &Hit) {
        let corners = mesh.indices()[hit.prim_id as usize];
        for (all, v) in self.corners.iter_mut().zip(corners) {
            all.set(lane, mesh.positions()[v as usize]);
        }
        if let normals @ [_, ..] = mesh.normals() {
            for (all, v) in self.normals.iter_mut().zip(corners) {
                all.set(lane, normals[v as usize]);
            }
        }
        (self.u[lane], self.v[lane]) = (hit.u, hit.v);
        self.wo.set(lane, -ray.dir);
    }

    /// The points, but for the numbers of their primitives.
    #[inline(always)]
    fn interactions(&self) -> Interactions {
        let mut points = Interactions {
            p: Vectors::default(),
            p_error: Floats::default(),
            wo: self.wo,
            n: Vectors::default(),
            ng: Vectors::default(),
            front: [false; LANES],
            geom_id: [0; LANES],
            prim_id: [0; LANES],
            flat: [true; LANES],
            clearance: Floats::default(),
            clears: [false; LANES],
        };
        let mut bent = [false; LANES];
        for i in 0..LANES {
            let [a, b, c] = [self.corners[0].get(i), self.corners[1].get(i), self.corners[2].get(i)];
            let weights = [1.0 - self.u[i] - self.v[i], self.u[i], self.v[i]];
            points.p.set(i, weights[0] * a + weights[1] * b + weights[2] * c);
            let sum = (weights[0] * a).abs() + (weights[1] * b).abs() + (weights[2] * c).abs();
            let Plane { ng, clearance, thin } = plane(a, b, c);
            points.p_error[i] = (gamma(7.0) * ng.abs().dot(sum)).max(LEAST_OFFSET);
            points.clearance[i] = clearance;
            points.clears[i] = !thin;
            let wo = self.wo.get(i);
            let front = ng.dot(wo) >= 0.0;
            let ng = if front { ng } else { -ng };
            points.front[i] = front;
            points.ng.set(i, ng);

            let [na, nb, nc] = [self.normals[0].get(i), self.normals[1].get(i), self.normals[2].get(i)];
            let n = weights[0] * na + weights[1] * nb + weights[2] * nc;
            let scale = 1.0 / n.length();
            let n = n * if n.dot(ng) < 0.0 { -scale } else { scale };
            // Not where there is no normal, so that the scale is infinite.
            let seen = (scale < f32::INFINITY) & (n.dot(wo) > 0.0);
            points.n.set(i, if seen { n } else { ng });
            bent[i] = seen & !mirror_leaves(n, ng, wo);
        }
        for i in (0..LANES).filter(|&i| bent[i]) {
            points.n.set(i, bent_normal(points.n.get(i), points.ng.get(i), self.wo.get(i)));
        }
        points
    }
}
