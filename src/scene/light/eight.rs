//! Eight receivers side by side, and what eight lights send to them.

use super::{LightSample, Receiver, Rivals, density, shadow_end};
use crate::core::Rgb;
use crate::core::lanes::{Floats, LANES, Vectors};
use glam::Vec3;

/// Up to eight places where light is wanted.
#[derive(Clone, Copy, Debug, Default)]
pub struct Receivers {
    /// The points.
    pub p: Vectors,
    /// Their shading normals.
    pub n: Vectors,
    /// See [`Receiver::rivals`].
    pub rivals: [Rivals; LANES],
    /// In which lanes there is one.
    pub there: [bool; LANES],
}

impl Receivers {
    /// Puts one into a lane.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, to: &Receiver) {
        self.p.set(lane, to.p);
        self.n.set(lane, to.n);
        self.rivals[lane] = to.rivals;
        self.there[lane] = true;
    }

    /// What is in a lane; of no use where there is none.
    #[inline(always)]
    pub fn get(&self, lane: usize) -> Receiver {
        Receiver { p: self.p.get(lane), n: self.n.get(lane), rivals: self.rivals[lane] }
    }

    /// The lanes with a receiver.
    #[inline(always)]
    pub fn lanes(&self) -> impl Iterator<Item = usize> + use<> {
        let there = self.there;
        (0..LANES).filter(move |&lane| there[lane])
    }

    /// Whether there is none.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        !self.there.contains(&true)
    }
}

/// A light's sample for each of eight receivers, where there is one.
#[derive(Clone, Copy, Debug, Default)]
pub struct EightSamples {
    /// See [`LightSample`].
    pub wi: Vectors,
    /// See [`LightSample`].
    pub t_max: Floats,
    /// See [`LightSample`]; by channel.
    pub le_over_pdf: [Floats; 3],
    /// See [`LightSample`].
    pub pdf: Floats,
    /// See [`LightSample`].
    pub shadow: [bool; LANES],
    /// In which lanes there is a sample.
    pub there: [bool; LANES],
}

impl EightSamples {
    /// Puts one into a lane, if it is one.
    #[inline(always)]
    pub(super) fn put(&mut self, lane: usize, sample: Option<LightSample>) {
        self.there[lane] = sample.is_some();
        let Some(sample) = sample else { return };
        self.wi.set(lane, sample.wi);
        self.t_max[lane] = sample.t_max;
        let le = sample.le_over_pdf.to_array();
        for c in 0..3 {
            self.le_over_pdf[c][lane] = le[c];
        }
        self.pdf[lane] = sample.pdf;
        self.shadow[lane] = sample.shadow;
    }

    /// The sample in a lane.
    #[inline(always)]
    pub fn get(&self, lane: usize) -> Option<LightSample> {
        let [r, g, b] = self.le_over_pdf;
        self.there[lane].then(|| LightSample {
            wi: self.wi.get(lane),
            t_max: self.t_max[lane],
            le_over_pdf: Rgb::new(r[lane], g[lane], b[lane]),
            pdf: self.pdf[lane],
            shadow: self.shadow[lane],
        })
    }

    /// Puts a sample of a surface into a lane, for the receiver at `p`: one that is uniform over a solid angle, or that stands
    /// for it, at this distance.
    #[inline(always)]
    pub(super) fn set_surface(
        &mut self,
        lane: usize,
        p: Vec3,
        (wi, distance, solid_angle): (Vec3, f64, f64),
        radiance: Rgb,
    ) {
        self.wi.set(lane, wi);
        self.t_max[lane] = shadow_end(p, distance as f32);
        for (le, of_light) in self.le_over_pdf.iter_mut().zip(radiance.to_array()) {
            le[lane] = of_light * solid_angle as f32;
        }
        self.pdf[lane] = density(solid_angle);
        self.shadow[lane] = true;
    }

    /// Puts a direction to the environment into a lane, with the radiance from there, not divided by the density, and the density.
    #[inline(always)]
    pub fn set_environment(&mut self, lane: usize, wi: Vec3, radiance: Rgb, pdf: f32) {
        self.wi.set(lane, wi);
        self.t_max[lane] = f32::INFINITY;
        for (le, radiance) in self.le_over_pdf.iter_mut().zip(radiance.to_array()) {
            le[lane] = radiance;
        }
        self.pdf[lane] = pdf;
        self.shadow[lane] = true;
        self.there[lane] = !radiance.is_black();
    }

    /// Takes over what others are in some `lanes`.
    #[inline(always)]
    pub fn take(&mut self, others: &Self, lanes: [bool; LANES]) {
        for lane in 0..LANES {
            let taken = lanes[lane];
            self.wi.set(lane, if taken { others.wi.get(lane) } else { self.wi.get(lane) });
            self.t_max[lane] = if taken { others.t_max[lane] } else { self.t_max[lane] };
            for (le, other) in self.le_over_pdf.iter_mut().zip(&others.le_over_pdf) {
                le[lane] = if taken { other[lane] } else { le[lane] };
            }
            self.pdf[lane] = if taken { others.pdf[lane] } else { self.pdf[lane] };
            self.shadow[lane] = if taken { others.shadow[lane] } else { self.shadow[lane] };
            self.there[lane] = if taken { others.there[lane] } else { self.there[lane] };
        }
    }

    /// Takes the `probability` into account with which each lane's light was chosen, and leaves out what sends no light.
    #[inline(always)]
    pub(super) fn chosen_with(&mut self, probability: &[f64; LANES]) {
        for lane in 0..LANES {
            let probability = probability[lane] as f32;
            let (mut finite, mut black) = (true, true);
            for le in &mut self.le_over_pdf {
                le[lane] /= probability;
                finite &= le[lane].is_finite();
                black &= le[lane] == 0.0;
            }
            self.pdf[lane] *= probability;
            self.there[lane] &= finite & !black;
        }
    }
}
