//! Where a light is and where it shines.

use super::{Light, Receiver};
use crate::geometry::Aabb;
use glam::Vec3;

/// A box around lights, a cone about their normals, and what they emit.
///
/// Source: Conty Estevez and Kulla 2018, *Importance Sampling of Many Lights with Adaptive Tree Splitting*. Every
/// light here emits by the cosine to some normal of the cone; the cone of a light that shines all around is all
/// directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LightBounds {
    pub(super) bounds: Aabb,
    /// Middle of the cone of normals.
    pub(super) axis: Vec3,
    /// Cosine of its half angle.
    pub(super) cos_spread: f32,
    /// Luminance of the radiant intensity along the normals.
    pub(super) intensity: f32,
    /// Whether they shine along the opposite normals too.
    pub(super) both_sides: bool,
}

/// Cosine of `max(0, a - b)`, from sines and cosines of two angles in `[0, pi]`.
#[inline]
fn cos_difference(sin_a: f32, cos_a: f32, sin_b: f32, cos_b: f32) -> f32 {
    if cos_a > cos_b { 1.0 } else { cos_a * cos_b + sin_a * sin_b }
}

/// Sine of the angle in `[0, pi]` with this cosine.
#[inline]
fn sin_of(cos: f32) -> f32 {
    (1.0 - cos * cos).max(0.0).sqrt()
}

/// Least cosine that a receiver is taken to see a light under: a glossy lobe needs no cosine, and a shading normal's
/// horizon is not the surface's.
pub(super) const LEAST_COSINE: f32 = 0.02;

impl LightBounds {
    /// Of one light; `None` if it emits nothing, or does not weaken with distance.
    pub(super) fn new(light: &Light) -> Option<Self> {
        let bounds = match light {
            Light::Directional(_) => return None,
            Light::Point(point) => Self {
                bounds: Aabb::around([point.position]),
                axis: Vec3::Z,
                cos_spread: -1.0,
                intensity: if point.falloff { point.intensity.luminance() } else { 0.0 },
                both_sides: false,
            },
            Light::Rectangle(rectangle) => Self {
                bounds: Aabb::around(rectangle.corners()),
                axis: rectangle.normal(),
                cos_spread: 1.0,
                intensity: rectangle.radiance().luminance() * rectangle.area() as f32,
                both_sides: rectangle.both_sides(),
            },
            Light::Sphere(light) => Self {
                bounds: light.sphere.bounds(),
                axis: Vec3::Z,
                cos_spread: -1.0,
                intensity: light.radiance.luminance()
                    * (std::f32::consts::PI * light.sphere.radius * light.sphere.radius),
                both_sides: light.both_sides,
            },
            Light::Mesh(mesh) => {
                let (axis, cos) = mesh.normal_cone();
                // A closed surface shows a quarter of its area on average (Cauchy).
                let shown = if cos > 0.0 { 1.0 } else { 0.25 };
                Self {
                    bounds: mesh.shape().bounds(),
                    axis: axis.as_vec3(),
                    cos_spread: (cos as f32 - 1e-5).max(-1.0),
                    intensity: mesh.radiance().luminance() * shown * mesh.area() as f32,
                    both_sides: mesh.both_sides(),
                }
            }
        };
        (bounds.intensity > 0.0 && bounds.intensity.is_finite()).then_some(bounds)
    }

    /// The bounds of both.
    pub(super) fn union(&self, other: &Self) -> Self {
        let (axis, cos_spread) = self.cone_union(other);
        Self {
            bounds: self.bounds.union(other.bounds),
            axis,
            cos_spread,
            intensity: self.intensity + other.intensity,
            both_sides: self.both_sides || other.both_sides,
        }
    }

    /// The smallest cone about both cones.
    fn cone_union(&self, other: &Self) -> (Vec3, f32) {
        let (wide, narrow) = if self.cos_spread <= other.cos_spread { (self, other) } else { (other, self) };
        let between = wide.axis.angle_between(narrow.axis);
        let [wide_angle, narrow_angle] = [wide, narrow].map(|b| b.cos_spread.clamp(-1.0, 1.0).acos());
        if between + narrow_angle <= wide_angle {
            return (wide.axis, wide.cos_spread);
        }
        // A little wider than exact, so that rounding loses no light.
        let spread = 0.5 * (between + narrow_angle + wide_angle) + 1e-4;
        let turn_axis = wide.axis.cross(narrow.axis).try_normalize();
        match turn_axis {
            Some(turn_axis) if spread < std::f32::consts::PI => {
                let turn = glam::Quat::from_axis_angle(turn_axis, spread - wide_angle);
                ((turn * wide.axis).normalize(), spread.cos())
            }
            _ => (wide.axis, -1.0),
        }
    }

    /// How much a group of lights costs: intensity times the sizes of the box and of the cone (eq. 1 of the paper,
    /// with the squared diagonal for the area of the box, which lights along a line have too).
    pub(super) fn cost(&self) -> f32 {
        let spread = self.cos_spread.clamp(-1.0, 1.0).acos();
        let reach = (spread + std::f32::consts::FRAC_PI_2).min(std::f32::consts::PI);
        let cone = std::f32::consts::TAU * (1.0 - self.cos_spread)
            + std::f32::consts::FRAC_PI_2
                * (2.0 * reach * sin_of(self.cos_spread)
                    - (spread - 2.0 * reach).cos()
                    - 2.0 * spread * sin_of(self.cos_spread)
                    + self.cos_spread);
        self.intensity * cone * self.bounds.size().length_squared()
    }
}

/// What [`importance`](Self::importance) needs of [`LightBounds`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Emission {
    /// Of the sphere about the box.
    center: Vec3,
    radius_squared: f32,
    axis: Vec3,
    cos_spread: f32,
    sin_spread: f32,
    intensity: f32,
    both_sides: bool,
}

impl From<LightBounds> for Emission {
    fn from(b: LightBounds) -> Self {
        Self {
            center: b.bounds.center(),
            radius_squared: 0.25 * b.bounds.size().length_squared(),
            axis: b.axis,
            cos_spread: b.cos_spread,
            sin_spread: sin_of(b.cos_spread),
            intensity: b.intensity,
            both_sides: b.both_sides,
        }
    }
}

impl Emission {
    /// About how much irradiance the lights may give to the receiver; 0 only if they give none.
    #[inline]
    pub(super) fn importance(&self, to: &Receiver) -> f32 {
        let way = self.center - to.p;
        let radius_squared = self.radius_squared;
        let squared = way.length_squared();
        if squared <= radius_squared {
            return (self.intensity / radius_squared.max(f32::MIN_POSITIVE)).min(1e30);
        }
        let inverse = squared.sqrt().recip();

        // The angle in which the box is seen makes every direction uncertain.
        let sin_box_squared = radius_squared / squared;
        let (sin_box, cos_box) = (sin_box_squared.sqrt(), (1.0 - sin_box_squared).max(0.0).sqrt());

        let cos_axis = (-self.axis.dot(way) * inverse).clamp(-1.0, 1.0);
        let cos_axis = if self.both_sides { cos_axis.abs() } else { cos_axis };
        let sin_axis = sin_of(cos_axis);
        let cos_out = cos_difference(sin_axis, cos_axis, self.sin_spread, self.cos_spread);
        let greatest_out = cos_difference(sin_of(cos_out), cos_out, sin_box, cos_box);
        if greatest_out <= 0.0 {
            return 0.0;
        }
        let cos_in = (to.n.dot(way) * inverse).clamp(-1.0, 1.0);
        let greatest_in = cos_difference(sin_of(cos_in), cos_in, sin_box, cos_box);

        // Halfway from what the middle of the box gives to what any part of it may give: the bounds alone, which keep
        // every light reachable, hardly tell the children of a near node apart.
        let out = 0.5 * (greatest_out + cos_out.max(0.0));
        let into = (0.5 * (greatest_in + cos_in.max(0.0))).max(LEAST_COSINE);
        (self.intensity * out * into / squared).min(1e30)
    }
}
