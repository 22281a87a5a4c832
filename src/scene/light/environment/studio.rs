//! A photographer's studio: softboxes before a gradient.

use super::super::Receiver;
use super::super::spherical_rectangle::SphericalRectangle;
use super::super::unit::{below_one, narrow};
use super::broad;
use super::gradient::Gradient;
use crate::core::Rgb;
use glam::{DVec3, Vec3};
use std::f32::consts::PI;

/// A bright rectangle, infinitely far and large: its size is an angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Softbox {
    /// Towards its middle; any length.
    pub toward: Vec3,
    /// Tangents of the half angles of its width (level) and height, as seen from the middle of the studio.
    pub half_size: [f32; 2],
    /// Radiance of its middle, in addition to the background.
    pub radiance: Rgb,
    /// The outer fraction of each half size over which it fades; 0 for a hard edge.
    pub softness: f32,
}

/// A softbox with what sampling it takes.
#[derive(Clone, Debug, PartialEq)]
struct Lamp {
    softbox: Softbox,
    /// Level, upright, and towards the middle.
    axes: [Vec3; 3],
    seen: SphericalRectangle,
    /// Luminance times solid angle.
    power: f32,
}

/// Softboxes before a gradient.
#[derive(Clone, Debug, PartialEq)]
pub struct Studio {
    background: Gradient,
    lamps: Vec<Lamp>,
    /// Luminance of the background times the solid angle of a hemisphere.
    background_power: f32,
}

/// Least fraction of its full weight that a softbox keeps where it stands below the receiver's horizon.
const LEAST_FACING: f32 = 0.05;

impl Lamp {
    fn new(softbox: Softbox) -> Self {
        let z = softbox.toward.try_normalize().unwrap_or(Vec3::Y);
        let x = Vec3::Y.cross(z).try_normalize().unwrap_or(Vec3::X);
        let [w, h] = softbox.half_size.map(|s| f64::from(s).abs());
        let seen = SphericalRectangle::new([-w, w], [-h, h], -1.0);
        let power = softbox.radiance.luminance() * seen.solid_angle() as f32;
        Self { softbox, axes: [x, z.cross(x), z], seen, power }
    }

    /// How far `wi` is from the middle towards the edge, level and upright, where the edges are at 1.
    #[inline]
    fn place(&self, wi: Vec3) -> Option<[f32; 2]> {
        let [x, y, z] = self.axes.map(|axis| axis.dot(wi));
        let [w, h] = self.softbox.half_size;
        // Before the divisions, since few directions meet it.
        if !((z > 0.0) & (x.abs() <= w * z) & (y.abs() <= h * z)) {
            return None;
        }
        Some([x.abs() / (w * z), y.abs() / (h * z)])
    }

    #[inline]
    fn le(&self, wi: Vec3) -> Rgb {
        let Some(place) = self.place(wi) else { return Rgb::BLACK };
        let fade = place.map(|p| smooth_step((1.0 - p) / self.softbox.softness.max(1e-6)));
        self.softbox.radiance * (fade[0] * fade[1])
    }

    #[inline]
    fn weight(&self, n: Vec3) -> f32 {
        self.power * self.axes[2].dot(n).max(LEAST_FACING)
    }

    #[inline]
    fn sample(&self, u: [f64; 2]) -> Vec3 {
        let DVec3 { x, y, z } = self.seen.sample(u);
        let [level, upright, middle] = self.axes.map(Vec3::as_dvec3);
        (level * x + upright * y - middle * z).normalize().as_vec3()
    }
}

/// From 0 at 0 to 1 at 1 with level ends.
fn smooth_step(x: f32) -> f32 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

impl Studio {
    /// Softboxes before a gradient. A softbox without size or light is left out.
    pub fn new(background: Gradient, softboxes: Vec<Softbox>) -> Self {
        let lamps = softboxes.into_iter().map(Lamp::new).filter(|l| l.power > 0.0).collect();
        Self { background, lamps, background_power: background.mean().luminance() * PI }
    }

    /// The studio of a product shot: a large key light high on the left, a tall strip on the right, a bank overhead
    /// and a low rim light behind, before a dim grey cove; the camera is thought at +z. A white sphere's front comes
    /// out at about radiance 1 for `scale` 1. `rotation_deg` turns it about +y, counter-clockwise from above.
    pub fn product_shot(scale: f32, rotation_deg: f32) -> Self {
        let turn = |v: Vec3| glam::Mat3::from_rotation_y(rotation_deg.to_radians()) * v;
        let softbox = |toward: Vec3, half_size, radiance: Rgb| Softbox {
            toward: turn(toward),
            half_size,
            radiance: radiance * scale,
            softness: 0.15,
        };
        let grey = |v: f32| Rgb::new(v, v, 1.06 * v) * scale;
        Self::new(
            Gradient { up: Vec3::Y, zenith: grey(0.22), horizon: grey(0.10), nadir: grey(0.05) },
            vec![
                softbox(Vec3::new(-0.75, 0.75, 0.65), [0.48, 0.36], Rgb::new(5.2, 5.0, 4.7)),
                softbox(Vec3::new(1.0, 0.25, 0.45), [0.14, 0.75], Rgb::new(3.4, 3.6, 3.9)),
                softbox(Vec3::new(0.1, 1.0, -0.25), [0.7, 0.22], Rgb::new(2.6, 2.6, 2.6)),
                softbox(Vec3::new(0.55, 0.12, -1.0), [0.5, 0.12], Rgb::new(4.0, 3.8, 3.5)),
            ],
        )
    }

    /// Radiance from the unit direction `wi`.
    #[inline]
    pub fn le(&self, wi: Vec3) -> Rgb {
        self.lamps.iter().fold(self.background.le(wi), |sum, lamp| sum + lamp.le(wi))
    }

    /// Mean radiance of all directions; the fading edges count in full.
    pub(super) fn mean(&self) -> Rgb {
        let lamps = self.lamps.iter().map(|l| l.softbox.radiance * l.seen.solid_angle() as f32);
        self.background.mean() + lamps.sum::<Rgb>() / (4.0 * PI)
    }

    /// Whether there is no softbox.
    pub(super) fn is_bare(&self) -> bool {
        self.lamps.is_empty()
    }

    /// What the background counts for beside the softboxes: nothing where lobes look for it themselves.
    #[inline]
    fn background_weight(&self, to: &Receiver) -> f32 {
        if to.lobes_look { 0.0 } else { self.background_power }
    }

    fn total_weight(&self, to: &Receiver) -> f32 {
        self.background_weight(to) + self.lamps.iter().map(|l| l.weight(to.n)).sum::<f32>()
    }

    /// A direction: to a softbox by what it may give to the receiver, or all over; the first of `u` chooses.
    #[inline]
    pub(super) fn sample(&self, to: &Receiver, u: [f64; 2]) -> Vec3 {
        let mut left = u[0] * f64::from(self.total_weight(to));
        let background = f64::from(self.background_weight(to));
        for (i, lamp) in self.lamps.iter().enumerate() {
            let weight = f64::from(lamp.weight(to.n));
            let is_last = background == 0.0 && i + 1 == self.lamps.len();
            if left < weight || is_last {
                return lamp.sample([below_one(left / weight), u[1]]);
            }
            left -= weight;
        }
        broad::sample(to.n, narrow([below_one(left / background), u[1]]))
    }

    /// The density of [`sample`](Self::sample) over solid angle.
    #[inline]
    pub(super) fn pdf(&self, to: &Receiver, wi: Vec3) -> f32 {
        let lamps = self.lamps.iter().filter(|l| l.place(wi).is_some());
        let lamps: f32 = lamps.map(|l| l.weight(to.n) / l.seen.solid_angle() as f32).sum();
        (lamps + self.background_weight(to) * broad::pdf(to.n, wi)) / self.total_weight(to)
    }
}
