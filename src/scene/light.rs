//! What emits, and how to choose and sample it from a point.

use crate::core::Rgb;
use glam::Vec3;

/// A direction towards a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSample {
    /// Towards the light; unit length.
    pub wi: Vec3,
    /// How far a shadow ray may go; infinite for lights at infinity. Ends before the light's own surface.
    pub t_max: f32,
    /// Radiance that arrives if nothing is in the way, divided by the density of the sample (with the probability
    /// of having chosen this light).
    pub le_over_pdf: Rgb,
    /// Natural logarithm of that density over solid angle; infinite for a light that no ray can hit.
    pub ln_pdf: f32,
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
    Point {
        /// Where.
        position: Vec3,
        /// Radiant intensity for `falloff`, else radiance at any distance (the textbook's).
        intensity: Rgb,
        /// Whether it dims with the square of the distance.
        falloff: bool,
        /// Whether it casts shadows.
        shadow: bool,
    },
}

/// Radiance from beyond everything.
#[derive(Clone, Debug)]
pub enum Environment {
    /// The same from everywhere.
    Constant(Rgb),
}

impl Environment {
    /// Radiance from the unit direction `wi`, which points towards the environment.
    #[inline]
    pub fn le(&self, _wi: Vec3) -> Rgb {
        match self {
            Self::Constant(le) => *le,
        }
    }
}

/// All lights of a scene and how one is chosen.
#[derive(Clone, Debug, Default)]
pub struct Lights {
    /// Lights by index: what [`Geometry::light`](super::Geometry::light) refers to.
    pub lights: Vec<Light>,
    /// What a ray sees that hits nothing.
    pub environment: Option<Environment>,
}

impl Lights {
    /// Whether there is anything to sample.
    pub fn is_empty(&self) -> bool {
        self.lights.is_empty() && self.environment.is_none()
    }

    /// Chooses a light that matters to the receiver and a direction towards it.
    ///
    /// `None` where nothing would arrive. `choice` and `u` are in `[0, 1)`.
    pub fn sample(&self, _to: &Receiver, _choice: f32, _u: [f32; 2]) -> Option<LightSample> {
        None
    }

    /// Logarithm of the density with which [`sample`](Self::sample) goes to this point of a light.
    pub fn ln_pdf(&self, _to: &Receiver, _hit: &EmitterHit) -> f32 {
        f32::NEG_INFINITY
    }

    /// Logarithm of the density with which [`sample`](Self::sample) goes along `wi` to the environment.
    pub fn ln_pdf_environment(&self, _to: &Receiver, _wi: Vec3) -> f32 {
        f32::NEG_INFINITY
    }
}
