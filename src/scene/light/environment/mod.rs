//! Radiance from beyond everything.

mod broad;
mod cumulative;
mod gradient;
mod image;
mod studio;

pub use gradient::Gradient;
pub use image::{EnvironmentImage, EnvironmentImageError};
pub use studio::{Softbox, Studio};

use super::{EightSamples, Receiver, Receivers, Rivals};
use crate::core::Rgb;
use crate::core::lanes::{Floats, LANES, Vectors};
use glam::Vec3;
use std::f32::consts::PI;
use std::sync::Arc;

/// Radiance from beyond everything.
#[derive(Clone, Debug)]
pub enum Environment {
    /// The same from everywhere.
    Constant(Rgb),
    /// Between a horizon and two poles.
    Gradient(Gradient),
    /// Softboxes before a gradient.
    Studio(Arc<Studio>),
    /// A photograph of all directions.
    Image(Arc<EnvironmentImage>),
}

impl Environment {
    /// The same radiance from everywhere.
    pub fn constant(radiance: Rgb) -> Self {
        Self::Constant(radiance)
    }

    /// Radiance that is linear in the cosine to `up`: `horizon` at right angles to it, `zenith` along it, `nadir`
    /// against it. `max(0, up . w) colour` has a black horizon and nadir. `up` need not have unit length.
    pub fn gradient(up: Vec3, zenith: Rgb, horizon: Rgb, nadir: Rgb) -> Self {
        Self::Gradient(Gradient { up: up.try_normalize().unwrap_or(Vec3::Y), zenith, horizon, nadir })
    }

    /// Softboxes before a gradient.
    pub fn studio(background: Gradient, softboxes: Vec<Softbox>) -> Self {
        Self::Studio(Arc::new(Studio::new(background, softboxes)))
    }

    /// The studio of a product shot: see [`Studio::product_shot`].
    pub fn product_shot(scale: f32, rotation_deg: f32) -> Self {
        Self::Studio(Arc::new(Studio::product_shot(scale, rotation_deg)))
    }

    /// A lat-long image, row by row from the zenith (+y) down: see [`EnvironmentImage::new`].
    ///
    /// # Errors
    /// If there is no pixel, their count is not `width * height`, or one is not a finite number.
    pub fn image(
        width: usize,
        height: usize,
        pixels: Vec<Rgb>,
        rotation_deg: f32,
        scale: f32,
    ) -> Result<Self, EnvironmentImageError> {
        EnvironmentImage::new(width, height, pixels, rotation_deg, scale).map(|i| Self::Image(Arc::new(i)))
    }

    /// Radiance from the unit direction `wi`, which points towards the environment.
    #[inline]
    pub fn le(&self, wi: Vec3) -> Rgb {
        match self {
            Self::Constant(le) => *le,
            Self::Gradient(gradient) => gradient.le(wi),
            Self::Studio(studio) => studio.le(wi),
            Self::Image(image) => image.le(wi),
        }
    }

    /// About how much arrives on a surface of what samples of it are to find beside these rivals: nothing, where it is about as
    /// bright all around as they can see it.
    pub(super) fn irradiance_beside(&self, rivals: Rivals) -> Rgb {
        let is_broad = match self {
            Self::Constant(_) | Self::Gradient(_) => rivals != Rivals::None,
            Self::Studio(studio) => rivals != Rivals::None && studio.is_bare(),
            Self::Image(image) => image.is_even(rivals),
        };
        if is_broad { Rgb::BLACK } else { self.irradiance() }
    }

    /// About how much arrives on a surface: pi times the mean radiance of all directions.
    pub fn irradiance(&self) -> Rgb {
        let mean = match self {
            Self::Constant(le) => *le,
            Self::Gradient(gradient) => gradient.mean(),
            Self::Studio(studio) => studio.mean(),
            Self::Image(image) => image.mean(),
        };
        mean * PI
    }

    /// Luminance above which samples find it beside any [`Rivals`].
    pub fn sun(&self) -> f32 {
        match self {
            Self::Image(image) => image.sun(),
            _ => f32::INFINITY,
        }
    }

    /// Whether telling its radiance takes so long that eight directions are told together.
    #[inline(always)]
    pub(super) fn is_detailed(&self) -> bool {
        matches!(self, Self::Studio(_) | Self::Image(_))
    }

    /// Radiance from eight unit directions, by channel; of a lane without a receiver, anything.
    #[inline(always)]
    pub fn le_eight(&self, to: &Receivers, wi: &Vectors) -> [Floats; 3] {
        match self {
            Self::Studio(studio) => studio.le_eight(wi),
            _ => self.le_and_pdf_eight(to, wi).0,
        }
    }

    /// Radiance from eight unit directions, by channel, and the density of [`sample_eight`](Self::sample_eight) there.
    #[inline(always)]
    pub(super) fn le_and_pdf_eight(&self, to: &Receivers, wi: &Vectors) -> ([Floats; 3], Floats) {
        let (mut le, mut pdf) = ([Floats::default(); 3], Floats::default());
        match self {
            Self::Image(image) => return image.le_and_pdf_eight(to, wi),
            Self::Studio(studio) => return studio.le_and_pdf_eight(to, wi),
            Self::Constant(_) | Self::Gradient(_) => {}
        }
        for lane in 0..LANES {
            pdf[lane] = broad::pdf(to.n.get(lane), wi.get(lane));
            let [r, g, b] = self.le(wi.get(lane)).to_array();
            (le[0][lane], le[1][lane], le[2][lane]) = (r, g, b);
        }
        (le, pdf)
    }

    /// A direction with its radiance for the receivers in `lanes`; none where there is none. `u` is in `[0, 1)`.
    #[inline(always)]
    pub(super) fn sample_eight(
        &self,
        to: &Receivers,
        u: &[[f64; LANES]; 2],
        lanes: [bool; LANES],
    ) -> EightSamples {
        let wi = match self {
            Self::Image(image) => return image.sample_eight(to, u, lanes),
            Self::Studio(studio) => studio.directions(to, u, lanes),
            Self::Constant(_) | Self::Gradient(_) => broad::directions(&to.n, u),
        };
        let (mut le_over_pdf, pdf) = self.le_and_pdf_eight(to, &wi);
        let mut there = [false; LANES];
        for lane in 0..LANES {
            for le in &mut le_over_pdf {
                le[lane] /= pdf[lane];
            }
            there[lane] = pdf[lane] > 0.0;
        }
        EightSamples { wi, t_max: [f32::INFINITY; LANES], le_over_pdf, pdf, shadow: [true; LANES], there }
    }

    /// The density of [`sample_eight`](Self::sample_eight) at `wi` over solid angle.
    #[inline]
    pub(super) fn pdf(&self, to: &Receiver, wi: Vec3) -> f32 {
        if !self.is_detailed() {
            return broad::pdf(to.n, wi);
        }
        let (mut receivers, mut directions) = (Receivers::default(), Vectors::default());
        receivers.set(0, to);
        directions.set(0, wi);
        self.le_and_pdf_eight(&receivers, &directions).1[0]
    }
}
