//! Shapes on their way from the scene's coordinates to the unit world.

use super::source::Source;
use super::{Notes, SceneError};
use crate::geometry::{MeshSource, Shape, Sphere};
use crate::scene::World;
use crate::scene::load::transform::uniform_scale;
use glam::{DAffine3, DVec3};
use std::sync::Arc;

/// What will be one geometry.
pub(super) struct Part {
    pub(super) name: String,
    pub(super) material: u32,
    /// Where it is described.
    pub(super) path: String,
    /// From the body's coordinates to the scene's.
    pub(super) transform: DAffine3,
    pub(super) body: Body,
}

/// What a part is made of, in its own coordinates.
pub(super) enum Body {
    Mesh(Arc<MeshSource>),
    /// Centres and radii.
    Spheres(Vec<(DVec3, f64)>),
    /// A plane whose size follows from the rest of the scene.
    EndlessPlane {
        point: DVec3,
        normal: DVec3,
    },
}

/// Half the edge of an endless plane, in extents of the rest of the scene: from the height of that rest, the plane's
/// edge is seen a 200th of a degree below the horizon.
const PLANE_REACH: f64 = 1e4;

/// Cuts the endless planes to size, and gives the world around all that has a size of its own.
///
/// Where there is nothing else than planes, the distance from the eye stands for the extent of the rest.
pub(super) fn place_planes(parts: &mut [Part], eye: DVec3) -> World {
    let empty = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (mut min, mut max) =
        parts.iter().filter_map(Part::bounds).fold(empty, |b, p| (b.0.min(p.0), b.1.max(p.1)));
    if !min.cmple(max).all() {
        let plane = parts.iter().find_map(|p| match p.body {
            Body::EndlessPlane { point, .. } => Some(p.transform.transform_point3(point)),
            _ => None,
        });
        let Some(point) = plane else { return World::IDENTITY };
        let distance = eye.distance(point);
        let half = if distance > 0.0 && distance.is_finite() { 0.5 * distance } else { 0.5 };
        (min, max) = (point - half, point + half);
    }
    let reach = PLANE_REACH * (max - min).max_element();
    for part in parts {
        if let Body::EndlessPlane { point, normal } = part.body {
            let normal = part.transform.matrix3.inverse().transpose() * normal;
            let mesh = rings(part.transform.transform_point3(point), normal, reach);
            (part.body, part.transform) = (Body::Mesh(Arc::new(mesh)), DAffine3::IDENTITY);
        }
    }
    World::around(min, max)
}

/// A square of nested square rings, each four times the size of the one within: near its middle, where things
/// stand, the triangles are small and their points exact.
fn rings(center: DVec3, normal: DVec3, half_side: f64) -> MeshSource {
    const RINGS: i32 = 7;
    let (u, v) = normal.normalize().any_orthonormal_pair();
    let mut mesh = MeshSource::default();
    for ring in (0..=RINGS).rev() {
        let half = half_side * 4.0_f64.powi(-ring);
        mesh.positions.extend([-u - v, u - v, u + v, v - u].map(|corner| center + half * corner));
    }
    mesh.indices.extend([[0, 1, 2], [0, 2, 3]]);
    for inner in (0..RINGS as u32).map(|ring| 4 * ring) {
        for side in 0..4 {
            let next = (side + 1) % 4;
            let [a, b, c, d] = [inner + side, inner + next, inner + 4 + next, inner + 4 + side];
            mesh.indices.extend([[a, d, c], [a, c, b]]);
        }
    }
    mesh
}

impl Part {
    /// The box around it in the scene's coordinates; `None` for nothing and for endless planes.
    fn bounds(&self) -> Option<(DVec3, DVec3)> {
        let (min, max) = match &self.body {
            Body::EndlessPlane { .. } => return None,
            Body::Mesh(mesh) => mesh.bounds_f64(&self.transform),
            Body::Spheres(spheres) => {
                let scale = uniform_scale(&self.transform).unwrap_or(1.0);
                let empty = (DVec3::INFINITY, DVec3::NEG_INFINITY);
                spheres.iter().fold(empty, |(min, max), &(center, radius)| {
                    let center = self.transform.transform_point3(center);
                    (min.min(center - scale * radius), max.max(center + scale * radius))
                })
            }
        };
        min.cmple(max).all().then_some((min, max))
    }

    /// The shape in the unit world; nothing, with a warning, if nothing of it is left. Spheres that emit are a shape
    /// each, as each is a light of its own.
    pub(super) fn into_shapes(
        self,
        source: &Source,
        world: &World,
        emits: bool,
        notes: &mut Notes<'_>,
    ) -> Result<Vec<Shape>, SceneError> {
        let at = source.at(&self.path);
        let to_unit = world.affine() * self.transform;
        let shape = match self.body {
            Body::Mesh(mesh) => {
                let (mesh, dropped) = notes.cache.unit_mesh(&mesh, &to_unit).map_err(|e| at.fail(e))?;
                if dropped.total() > 0 {
                    notes.warnings.push(at.warn(format!(
                        "{} triangles of `{}` were left out: {} have no area, {} are too small for the world",
                        dropped.total(),
                        self.name,
                        dropped.zero_area,
                        dropped.too_small
                    )));
                }
                Shape::Mesh(mesh)
            }
            Body::Spheres(spheres) => {
                // The unit world's scale apart: its cube may be too small for a determinant.
                let Some(scale) = uniform_scale(&self.transform).map(|scale| scale * world.scale) else {
                    let message = "a sphere can only be scaled by the same factor along each axis; for an \
                                   ellipsoid use type = \"generated\", kind = \"sphere\"";
                    return Err(at.key("transform").fail(message));
                };
                let spheres: Vec<Sphere> = (spheres.into_iter())
                    .map(|(center, radius)| Sphere {
                        center: to_unit.transform_point3(center).as_vec3(),
                        radius: (scale * radius) as f32,
                    })
                    .collect();
                for (i, sphere) in spheres.iter().enumerate() {
                    if !(sphere.center.is_finite() && sphere.radius.is_finite()) {
                        let message = "is too large or too far away to be computed with: bring it nearer";
                        return Err(at.fail(format!("sphere {i} {message}")));
                    }
                    if sphere.radius <= 0.0 {
                        let message = "is too small for the size of the rest of the scene";
                        return Err(at.fail(format!("sphere {i} {message}")));
                    }
                }
                if emits {
                    return Ok(spheres.into_iter().map(|s| Shape::Spheres([s].into())).collect());
                }
                Shape::Spheres(spheres.into())
            }
            Body::EndlessPlane { .. } => unreachable!("`place_planes` has cut every plane to size"),
        };
        if shape.primitive_count() == 0 {
            notes.warnings.push(at.warn(format!("`{}` is empty and was left out", self.name)));
            return Ok(vec![]);
        }
        Ok(vec![shape])
    }
}
