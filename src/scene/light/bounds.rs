//! Where a light is and where it shines.

use super::{Light, Receiver, Receivers};
use crate::core::lanes::{Floats, LANES};
use crate::core::prefetch;
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
#[inline(always)]
fn cos_difference(sin_a: f32, cos_a: f32, sin_b: f32, cos_b: f32) -> f32 {
    if cos_a > cos_b { 1.0 } else { cos_a * cos_b + sin_a * sin_b }
}

/// Sine of the angle in `[0, pi]` with this cosine.
#[inline(always)]
fn sin_of(cos: f32) -> f32 {
    most(1.0 - cos * cos, 0.0).sqrt()
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
    ///
    /// Without a branch, so that eight are found side by side.
    #[inline(always)]
    pub(super) fn importance(&self, to: &Receiver) -> f32 {
        let way = self.center - to.p;
        let radius_squared = self.radius_squared;
        let squared = way.length_squared();
        let inverse = squared.sqrt().recip();

        // The angle in which the box is seen makes every direction uncertain.
        let sin_box_squared = least(radius_squared / squared, 1.0);
        let (sin_box, cos_box) = (sin_box_squared.sqrt(), (1.0 - sin_box_squared).sqrt());

        let cos_axis = within_one(-self.axis.dot(way) * inverse);
        let cos_axis = if self.both_sides { cos_axis.abs() } else { cos_axis };
        let cos_out = cos_difference(sin_of(cos_axis), cos_axis, self.sin_spread, self.cos_spread);
        let greatest_out = cos_difference(sin_of(cos_out), cos_out, sin_box, cos_box);
        let cos_in = within_one(to.n.dot(way) * inverse);
        let greatest_in = cos_difference(sin_of(cos_in), cos_in, sin_box, cos_box);

        // Halfway from what the middle of the box gives to what any part of it may give: the bounds alone, which keep
        // every light reachable, hardly tell the children of a near node apart.
        let out = 0.5 * (greatest_out + most(cos_out, 0.0));
        let into = most(0.5 * (greatest_in + most(cos_in, 0.0)), LEAST_COSINE);
        let outside = if greatest_out > 0.0 { self.intensity * out * into / squared } else { 0.0 };
        let inside = self.intensity / most(radius_squared, f32::MIN_POSITIVE);
        least(if squared <= radius_squared { inside } else { outside }, 1e30)
    }
}

impl Emission {
    /// The [importance](Self::importance) to each of eight receivers.
    #[inline(always)]
    pub(super) fn importances(&self, to: &Receivers) -> Floats {
        let mut importances = Floats::default();
        for lane in 0..LANES {
            importances[lane] = self.importance(&to.get(lane));
        }
        importances
    }
}

/// The lesser of two numbers, in one instruction: the second if one is NaN.
#[inline(always)]
fn least(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The greater of two numbers, likewise.
#[inline(always)]
fn most(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// A cosine that rounding may have moved beyond 1.
#[inline(always)]
fn within_one(cos: f32) -> f32 {
    least(most(cos, -1.0), 1.0)
}

/// Eight of them side by side.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct EightEmissions {
    center: [Floats; 3],
    radius_squared: Floats,
    axis: [Floats; 3],
    cos_spread: Floats,
    sin_spread: Floats,
    intensity: Floats,
    both_sides: [bool; LANES],
}

impl EightEmissions {
    /// Of up to eight; lanes beyond the last give nothing.
    pub(super) fn new(emissions: impl Iterator<Item = Emission>) -> Self {
        let mut eight = Self::default();
        for (lane, emission) in emissions.enumerate() {
            for c in 0..3 {
                eight.center[c][lane] = emission.center[c];
                eight.axis[c][lane] = emission.axis[c];
            }
            eight.radius_squared[lane] = emission.radius_squared;
            eight.cos_spread[lane] = emission.cos_spread;
            eight.sin_spread[lane] = emission.sin_spread;
            eight.intensity[lane] = emission.intensity;
            eight.both_sides[lane] = emission.both_sides;
        }
        eight
    }

    /// The [importance](Emission::importance) of each.
    #[inline(always)]
    pub(super) fn importances(&self, to: &Receiver) -> Floats {
        let mut importances = Floats::default();
        for lane in 0..LANES {
            importances[lane] = self.get(lane).importance(to);
        }
        importances
    }

    /// Asks for all of them.
    #[inline(always)]
    pub(super) fn prefetch(&self) {
        let numbers = [&self.radius_squared, &self.cos_spread, &self.sin_spread, &self.intensity];
        for numbers in self.center.iter().chain(&self.axis).chain(numbers) {
            prefetch(numbers);
        }
    }

    /// The importance of the one in a lane to each of eight receivers.
    #[inline(always)]
    pub(super) fn importances_of(&self, lane: usize, to: &Receivers) -> Floats {
        self.get(lane).importances(to)
    }

    #[inline(always)]
    fn get(&self, lane: usize) -> Emission {
        Emission {
            center: Vec3::new(self.center[0][lane], self.center[1][lane], self.center[2][lane]),
            radius_squared: self.radius_squared[lane],
            axis: Vec3::new(self.axis[0][lane], self.axis[1][lane], self.axis[2][lane]),
            cos_spread: self.cos_spread[lane],
            sin_spread: self.sin_spread[lane],
            intensity: self.intensity[lane],
            both_sides: self.both_sides[lane],
        }
    }
}
