//! What emits, and how to choose and sample it from a point.
//!
//! One kind of light a file, each with its sampling beside its density; [`Environment`] is what lies beyond all
//! surfaces. [`Lights`] chooses one light for each receiver by what it may contribute. Nothing here sees a ray or an
//! accelerator: a [`LightSample`] says how far a shadow ray must go. Read [`LightSample`], then [`Lights`].

mod bounds;
mod choose;
mod eight;
pub mod environment;
mod far;
mod mesh;
mod patches;
mod pick;
mod point;
mod rectangle;
mod sphere;
mod spherical_rectangle;
mod tree;
mod unit;

pub use choose::{Lights, Needs};
pub use eight::{EightSamples, Receivers};
pub use environment::Environment;
pub use mesh::MeshLight;
pub use point::{DirectionalLight, PointLight};
pub use rectangle::RectangleLight;
pub use sphere::SphereLight;

use crate::core::Rgb;
use crate::geometry::{Sphere, TriangleMesh};
use glam::Vec3;
use std::sync::Arc;

/// A direction towards a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSample {
    /// Towards the light; unit length.
    pub wi: Vec3,
    /// How far a shadow ray may go; infinite for lights at infinity. Ends before the light's own surface.
    pub t_max: f32,
    /// Radiance that arrives if nothing is in the way, divided by the density of the sample (with the probability
    /// of having chosen this light). For a light that no ray can hit: what arrives on a surface that faces it,
    /// divided by that probability.
    pub le_over_pdf: Rgb,
    /// That density over solid angle, in 1/sr; infinite for a light that no ray can hit.
    pub pdf: f32,
    /// Whether things in between cast a shadow.
    pub shadow: bool,
}

/// Where light is wanted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Receiver {
    /// The point.
    pub p: Vec3,
    /// Its shading normal, on the viewer's side.
    pub n: Vec3,
    /// Who else finds the light.
    pub rivals: Rivals,
}

/// Who finds the light that samples of lights find, and is weighed against them: broad light is theirs to find.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rivals {
    /// Nobody.
    #[default]
    None,
    /// Rays of the receiver's own lobes.
    Lobes,
    /// Those, and samples of the environment that are drawn in another way than here: through portals. What is left is a sun.
    Portals,
}

/// A point of an emitter that a lobe's ray has found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmitterHit {
    /// Index into [`Lights::lights`].
    pub light: u32,
    /// Primitive of the light's shape.
    pub prim_id: u32,
    /// Unit direction from the receiver.
    pub wi: Vec3,
    /// Distance from the receiver.
    pub t: f32,
    /// Geometric normal of the emitter, on the receiver's side.
    pub ng: Vec3,
}

/// One light.
#[derive(Clone, Debug)]
pub enum Light {
    /// From one point.
    Point(PointLight),
    /// From one direction.
    Directional(DirectionalLight),
    /// From a rectangle.
    Rectangle(RectangleLight),
    /// From a sphere.
    Sphere(SphereLight),
    /// From a mesh.
    Mesh(MeshLight),
}

impl Light {
    /// Light from one point: `intensity` per square of the distance with `falloff`, at any distance without.
    pub fn point(position: Vec3, intensity: Rgb, falloff: bool, shadow: bool) -> Self {
        Self::Point(PointLight { position, intensity, falloff, shadow })
    }

    /// Parallel light that travels along `direction` (any length but zero, which counts as downwards) and puts
    /// `irradiance` on a surface that faces it.
    pub fn directional(direction: Vec3, irradiance: Rgb, shadow: bool) -> Self {
        let wi = -direction.try_normalize().unwrap_or(Vec3::NEG_Y);
        Self::Directional(DirectionalLight { wi, irradiance, shadow })
    }

    /// The parallelogram from `corner` along `edge_u` and `edge_v`. Its front is where `edge_u x edge_v` points; the
    /// geometry that rays hit must have its normals there too.
    pub fn rectangle(corner: Vec3, edge_u: Vec3, edge_v: Vec3, radiance: Rgb, both_sides: bool) -> Self {
        Self::Rectangle(RectangleLight::new(corner, [edge_u, edge_v], radiance, both_sides))
    }

    /// One sphere; its front is the outside. A geometry of several spheres is several lights.
    pub fn sphere(sphere: Sphere, radiance: Rgb, both_sides: bool) -> Self {
        Self::Sphere(SphereLight { sphere, radiance, both_sides })
    }

    /// The mesh that rays hit; its front is where the triangles are counter-clockwise.
    pub fn mesh(mesh: Arc<TriangleMesh>, radiance: Rgb, both_sides: bool) -> Self {
        Self::Mesh(MeshLight::new(mesh, radiance, both_sides))
    }

    /// The density with which a point of this light is sampled, if it is chosen; 0 for a light that no ray can hit.
    #[inline]
    fn pdf(&self, to: &Receiver, hit: &EmitterHit) -> f32 {
        match self {
            Self::Point(_) | Self::Directional(_) => 0.0,
            Self::Rectangle(light) => light.pdf(to, hit),
            Self::Sphere(light) => light.pdf(to),
            Self::Mesh(light) => light.pdf(to, hit),
        }
    }
}

/// The density in 1/sr that is uniform over a solid angle: finite for the least one too.
#[inline(always)]
fn density(solid_angle: f64) -> f32 {
    (solid_angle as f32).recip().min(f32::MAX)
}

/// The fraction of the way to a light that its shadow rays leave out.
const SHADOW_GAP: f32 = 1e-4;

/// Where a shadow ray from `p` ends that goes to a surface at distance `t`: short of it by a fraction of the way and
/// by what rounding moves points of this size, so that it never meets the light itself, at any scale. Blockers
/// nearer to the light than that cast no shadow.
#[inline(always)]
fn shadow_end(p: Vec3, t: f32) -> f32 {
    (t * (1.0 - SHADOW_GAP) - 8.0 * f32::EPSILON * p.abs().max_element()).max(0.0)
}
