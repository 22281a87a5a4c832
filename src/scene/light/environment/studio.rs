//! A photographer's studio: softboxes before a gradient.

use super::super::pick::Picking;
use super::super::spherical_rectangle::SphericalRectangle;
use super::super::{Receivers, Rivals};
use super::broad;
use super::gradient::Gradient;
use crate::core::Rgb;
use crate::core::lanes::{Floats, LANES, Vectors};
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

    /// Its radiance along `wi` by that of its middle, and 1 where it stands; without a branch, for several side by side.
    #[inline(always)]
    fn fade(&self, wi: Vec3) -> (f32, f32) {
        let [x, y, z] = self.axes.map(|axis| axis.dot(wi));
        let [w, h] = self.softbox.half_size;
        let stands = if (z > 0.0) & (x.abs() <= w * z) & (y.abs() <= h * z) { 1.0 } else { 0.0 };
        // From the middle towards the edges, which are at 1.
        let (across, up) = (x.abs() / (w * z), y.abs() / (h * z));
        let softness = self.softbox.softness.max(1e-6);
        let fade = smooth_step((1.0 - across) / softness) * smooth_step((1.0 - up) / softness);
        (if stands > 0.0 { fade } else { 0.0 }, stands)
    }

    #[inline(always)]
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
#[inline(always)]
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
        let background = self.background.le(wi);
        self.lamps.iter().fold(background, |sum, lamp| sum + lamp.softbox.radiance * lamp.fade(wi).0)
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

    /// The weights of a softbox, or of the background where there is none, for eight receivers: the background counts for
    /// nothing where lobes look for it themselves.
    #[inline(always)]
    fn weights(&self, lamp: Option<&Lamp>, to: &Receivers) -> Floats {
        let mut weights = Floats::default();
        match lamp {
            Some(lamp) => {
                for lane in 0..LANES {
                    weights[lane] = lamp.weight(to.n.get(lane));
                }
            }
            None => {
                for lane in 0..LANES {
                    weights[lane] = if to.rivals[lane] == Rivals::None { self.background_power } else { 0.0 };
                }
            }
        }
        weights
    }

    /// The background and all softboxes.
    #[inline(always)]
    fn choices(&self) -> impl Iterator<Item = Option<&Lamp>> {
        std::iter::once(None).chain(self.lamps.iter().map(Some))
    }

    #[inline(always)]
    fn total_weights(&self, to: &Receivers) -> Floats {
        let mut total = Floats::default();
        for choice in self.choices() {
            let weights = self.weights(choice, to);
            for lane in 0..LANES {
                total[lane] += weights[lane];
            }
        }
        total
    }

    /// A direction for the receivers in `lanes`: to a softbox by what it may give to the receiver, or all over; the first
    /// of `u` chooses.
    #[inline(always)]
    pub(super) fn directions(&self, to: &Receivers, u: &[[f64; LANES]; 2], lanes: [bool; LANES]) -> Vectors {
        let mut picking = Picking::new(&self.total_weights(to), &u[0]);
        for (index, choice) in (0..).zip(self.choices()) {
            picking = picking.offer(index, &self.weights(choice, to));
        }
        let picked = picking.picked();
        let u = [picked.rest, u[1]];
        let mut wi = Vectors::default();
        if picked.index.contains(&0) {
            wi = broad::directions(&to.n, &u);
        }
        for lane in (0..LANES).filter(|&lane| lanes[lane] && picked.index[lane] > 0) {
            let lamp = &self.lamps[picked.index[lane] as usize - 1];
            wi.set(lane, lamp.sample([u[0][lane], u[1][lane]]));
        }
        wi
    }

    /// Radiance from eight unit directions, by channel.
    #[inline(always)]
    pub(super) fn le_eight(&self, wi: &Vectors) -> [Floats; 3] {
        let mut le = [Floats::default(); 3];
        for lane in 0..LANES {
            let [r, g, b] = self.background.le(wi.get(lane)).to_array();
            (le[0][lane], le[1][lane], le[2][lane]) = (r, g, b);
        }
        for lamp in &self.lamps {
            let radiance = lamp.softbox.radiance.to_array();
            for lane in 0..LANES {
                let (fade, _) = lamp.fade(wi.get(lane));
                for channel in 0..3 {
                    le[channel][lane] += radiance[channel] * fade;
                }
            }
        }
        le
    }

    /// The same, and the density of [`directions`](Self::directions) there, over solid angle.
    #[inline(always)]
    pub(super) fn le_and_pdf_eight(&self, to: &Receivers, wi: &Vectors) -> ([Floats; 3], Floats) {
        let (background, mut pdf) = (self.weights(None, to), Floats::default());
        for lane in 0..LANES {
            pdf[lane] = background[lane] * broad::pdf(to.n.get(lane), wi.get(lane));
        }
        for lamp in &self.lamps {
            let weights = self.weights(Some(lamp), to);
            let per_weight = 1.0 / lamp.seen.solid_angle() as f32;
            for lane in 0..LANES {
                pdf[lane] += lamp.fade(wi.get(lane)).1 * (weights[lane] * per_weight);
            }
        }
        let total = self.total_weights(to);
        for lane in 0..LANES {
            // Without softboxes there may be nothing that light samples go to.
            pdf[lane] = if total[lane] > 0.0 { pdf[lane] / total[lane] } else { 0.0 };
        }
        (self.le_eight(wi), pdf)
    }
}
