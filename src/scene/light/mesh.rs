//! Emissive meshes: disks, polygons and whatever else is made of triangles.

use super::patches::{ChosenTriangle, Patches, cross, normal_cone};
use super::unit::narrow;
use super::{EightSamples, EmitterHit, LightSample, Receiver, Receivers, density, shadow_end};
use crate::core::lanes::LANES;
use crate::core::{Rgb, warp};
use crate::geometry::TriangleMesh;
use glam::{DVec3, Vec3};
use std::sync::Arc;

/// A mesh that emits the same radiance everywhere.
///
/// Points are uniform over the area of each of its patches, which are chosen by what they may give to the receiver.
#[derive(Clone, Debug)]
pub struct MeshLight {
    mesh: Arc<TriangleMesh>,
    patches: Patches,
    radiance: Rgb,
    both_sides: bool,
}

impl MeshLight {
    /// See [`Light::mesh`](super::Light::mesh).
    pub(super) fn new(mesh: Arc<TriangleMesh>, radiance: Rgb, both_sides: bool) -> Self {
        Self { patches: Patches::new(&mesh, radiance.luminance(), both_sides), mesh, radiance, both_sides }
    }

    /// In unit lengths squared.
    pub(super) fn area(&self) -> f64 {
        self.patches.total_area()
    }

    /// What it emits.
    pub(super) fn radiance(&self) -> Rgb {
        self.radiance
    }

    /// Whether the back emits as well.
    pub(super) fn both_sides(&self) -> bool {
        self.both_sides
    }

    /// What it is made of.
    pub(super) fn shape(&self) -> &TriangleMesh {
        &self.mesh
    }

    /// The axis and the cosine of the half angle of a cone about all normals; (any, -1) if they are all over.
    pub(super) fn normal_cone(&self) -> (DVec3, f64) {
        normal_cone(&self.mesh, 0..self.mesh.triangle_count() as u32)
    }

    /// Directions towards the mesh for the receivers that are there; the first of `u` chooses the patch and the triangle.
    #[inline(always)]
    pub(super) fn sample_eight(&self, to: &Receivers, u: &[[f64; LANES]; 2], samples: &mut EightSamples) {
        let triangles = self.patches.sample_eight(to, &u[0]);
        for lane in to.lanes() {
            let sample =
                triangles[lane].and_then(|triangle| self.point(to.p.get(lane), triangle, u[1][lane]));
            samples.put(lane, sample);
        }
    }

    /// The direction from `p` towards a point of a triangle; `u` is a number beside the one that is left.
    #[inline]
    fn point(&self, p: Vec3, triangle: ChosenTriangle, u: f64) -> Option<LightSample> {
        let ChosenTriangle { prim_id, density: by_area, rest } = triangle;
        let [a, b, c] = self.mesh.triangle(prim_id).map(|p| p.as_dvec3());
        let [bu, bv] = warp::uniform_triangle(narrow([rest, u])).map(f64::from);
        let way = a + bu * (b - a) + bv * (c - a) - p.as_dvec3();
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let facing = -normal.dot(way);
        if !(facing > 0.0 || (self.both_sides && facing < 0.0)) {
            return None;
        }
        let squared = way.length_squared();
        let distance = squared.sqrt();
        let solid_angle = facing.abs() / (squared * distance * by_area);
        Some(LightSample {
            wi: (way / distance).as_vec3(),
            t_max: shadow_end(p, distance as f32),
            le_over_pdf: self.radiance * solid_angle as f32,
            pdf: density(solid_angle),
            shadow: true,
        })
    }

    /// The density of [`sample_eight`](Self::sample_eight) at a point that a ray has found.
    #[inline]
    pub(super) fn pdf(&self, to: &Receiver, hit: &EmitterHit) -> f32 {
        let normal = cross(&self.mesh, hit.prim_id).normalize_or_zero();
        let cos = -normal.dot(hit.wi.as_dvec3());
        if !(cos > 0.0 || (self.both_sides && cos < 0.0)) {
            return 0.0;
        }
        let by_area = self.patches.density(to, hit.prim_id);
        if by_area == 0.0 {
            return 0.0;
        }
        let t = f64::from(hit.t);
        density(cos.abs() / (t * t * by_area))
    }
}
