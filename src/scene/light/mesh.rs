//! Emissive meshes: disks, polygons and whatever else is made of triangles.

use super::alias::{AliasTable, narrow};
use super::{EmitterHit, LightSample, Receiver, density, shadow_end};
use crate::core::{Rgb, warp};
use crate::geometry::TriangleMesh;
use glam::DVec3;
use std::sync::Arc;

/// A mesh that emits the same radiance everywhere; points are uniform over its area.
#[derive(Clone, Debug)]
pub struct MeshLight {
    mesh: Arc<TriangleMesh>,
    /// Triangles by area; `None` if there is no area.
    by_area: Option<AliasTable>,
    area: f64,
    radiance: Rgb,
    both_sides: bool,
}

/// Normal of a triangle, as long as twice its area.
fn cross(mesh: &TriangleMesh, prim_id: u32) -> DVec3 {
    let [a, b, c] = mesh.triangle(prim_id).map(|p| p.as_dvec3());
    (b - a).cross(c - a)
}

impl MeshLight {
    /// See [`Light::mesh`](super::Light::mesh).
    pub(super) fn new(mesh: Arc<TriangleMesh>, radiance: Rgb, both_sides: bool) -> Self {
        let areas: Vec<f64> =
            (0..mesh.triangle_count()).map(|i| 0.5 * cross(&mesh, i as u32).length()).collect();
        let area = areas.iter().sum();
        Self { by_area: AliasTable::new(&areas), mesh, area, radiance, both_sides }
    }

    /// In unit lengths squared.
    pub(super) fn area(&self) -> f64 {
        self.area
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
        let crosses = || (0..self.mesh.triangle_count()).map(|i| cross(&self.mesh, i as u32));
        let axis = crosses().sum::<DVec3>();
        if axis.length() < 1e-6 * self.area {
            return (DVec3::Z, -1.0);
        }
        let axis = axis.normalize();
        let cos = crosses().filter_map(DVec3::try_normalize).map(|n| n.dot(axis)).fold(1.0, f64::min);
        (axis, cos)
    }

    /// A direction towards the mesh; the first of `u` chooses the triangle.
    #[inline]
    pub(super) fn sample(&self, to: &Receiver, u: [f64; 2]) -> Option<LightSample> {
        let (triangle, rest) = self.by_area.as_ref()?.sample(u[0]);
        let prim_id = triangle as u32;
        let [a, b, c] = self.mesh.triangle(prim_id).map(|p| p.as_dvec3());
        let [bu, bv] = warp::uniform_triangle(narrow([rest, u[1]])).map(f64::from);
        let way = a + bu * (b - a) + bv * (c - a) - to.p.as_dvec3();
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let facing = -normal.dot(way);
        if !(facing > 0.0 || (self.both_sides && facing < 0.0)) {
            return None;
        }
        let squared = way.length_squared();
        let distance = squared.sqrt();
        let solid_angle = self.area * facing.abs() / (squared * distance);
        Some(LightSample {
            wi: (way / distance).as_vec3(),
            t_max: shadow_end(to.p, distance as f32),
            le_over_pdf: self.radiance * solid_angle as f32,
            pdf: density(solid_angle),
            shadow: true,
        })
    }

    /// The density of [`sample`](Self::sample) at a point that a ray has found.
    #[inline]
    pub(super) fn pdf(&self, hit: &EmitterHit) -> f32 {
        let normal = cross(&self.mesh, hit.prim_id).normalize_or_zero();
        let cos = -normal.dot(hit.wi.as_dvec3());
        if !(cos > 0.0 || (self.both_sides && cos < 0.0)) {
            return 0.0;
        }
        let t = f64::from(hit.t);
        density(cos.abs() * self.area / (t * t))
    }
}
