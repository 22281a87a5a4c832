//! Samples of lights of which each is one of several candidates, kept by what the surface reflects of it (Talbot et al. 2005,
//! *Importance Resampling for Global Illumination*).
//!
//! Lights are sampled by what they send, whatever the surface does with it: of a studio's many lamps most are outside of a
//! glossy lobe. Candidates cost no ray. The one that is kept stands for all: what they bring together, in its colour, so that
//! a surface without shadows has the mean of all of them.

use super::bounce::{Dimension, Leaving, Reached};
use super::eight::{Eight, Lane};
use super::path::Path;
use super::wave::Integrator;
use crate::bxdf::{Bsdf, Incidence, LobeKind};
use crate::core::Rgb;
use crate::core::lanes::{Colours, Floats, LANES};
use crate::scene::{EightSamples, Receivers};

/// Candidates of eight surfaces, of which one each is kept.
pub(super) struct Candidates {
    /// What is left of the numbers that choose.
    u: Floats,
    /// What all so far would bring.
    sum: Floats,
    /// What those that are kept would bring.
    weight: Floats,
    kept: EightSamples,
    reflected: Colours,
}

impl Candidates {
    /// None yet, for sample `number` of so many of lights of each surface.
    #[inline(always)]
    pub(super) fn of(drawn: &Eight, of: [u32; LANES], number: u32) -> Self {
        let mut indices = [0; LANES];
        for (lane, path) in drawn.from.iter().enumerate() {
            indices[lane] = path.index_of(number, of[lane]);
        }
        let [chooses, _] = drawn.draw_at(Dimension::Candidate, indices);
        Self::new(chooses)
    }

    /// None yet; the numbers `u` in `[0, 1)` will choose.
    fn new(u: Floats) -> Self {
        Self {
            u,
            sum: [0.0; LANES],
            weight: [0.0; LANES],
            kept: EightSamples::default(),
            reflected: Colours::default(),
        }
    }

    /// Takes note of a candidate of each surface, which reflects so much of it: kept with a chance in proportion to what it
    /// would bring.
    #[inline(always)]
    pub(super) fn offer(&mut self, lights: &EightSamples, reflected: &Colours) {
        let mut takes = [false; LANES];
        for lane in 0..LANES {
            let [r, g, b] = lights.le_over_pdf;
            let brings = reflected.get(lane) * Rgb::new(r[lane], g[lane], b[lane]);
            let weight = brings.luminance();
            let counts = lights.there[lane] & (weight > 0.0) & weight.is_finite();
            let weight = if counts { weight } else { 0.0 };
            self.sum[lane] += weight;
            let at = self.u[lane] * self.sum[lane];
            takes[lane] = at < weight;
            // What is left of the number is as good as a new one.
            let (above, width) =
                if takes[lane] { (at, weight) } else { (at - weight, self.sum[lane] - weight) };
            self.u[lane] =
                if width > 0.0 { (above / width).min(1.0 - 0.5 * f32::EPSILON) } else { self.u[lane] };
            self.weight[lane] = if takes[lane] { weight } else { self.weight[lane] };
        }
        self.kept.take(lights, takes);
        for (lane, takes) in takes.into_iter().enumerate() {
            let of = if takes { reflected } else { &self.reflected };
            self.reflected.set(lane, of.get(lane));
        }
    }

    /// Puts the candidates that are kept into some `lanes`, each with the light of all, and what surfaces reflect of them.
    #[inline(always)]
    pub(super) fn choose(self, lanes: [bool; LANES], lights: &mut EightSamples, reflected: &mut Colours) {
        let mut kept = self.kept;
        for lane in 0..LANES {
            let scale = if self.weight[lane] > 0.0 { self.sum[lane] / self.weight[lane] } else { 0.0 };
            for le in &mut kept.le_over_pdf {
                le[lane] *= scale;
            }
            let of = if lanes[lane] { &self.reflected } else { &*reflected };
            reflected.set(lane, of.get(lane));
        }
        lights.take(&kept, lanes);
    }
}

impl Integrator<'_> {
    /// Candidates of which each sample of lights is one, at a hit of `path`: where glossy lobes reflect most of the light.
    ///
    /// Samples of diffuse lobes are spread better as they are drawn.
    #[inline(always)]
    pub(super) fn light_candidates_at(&self, path: &Path, at: &Incidence, bsdf: &Bsdf) -> u32 {
        if self.light_candidates == 1 || self.is_last(path) {
            return 1;
        }
        let is_glossy = |number: usize| bsdf.lobe(number).kind() == LobeKind::Glossy;
        let lobes = || (0..bsdf.lobes().len()).filter(|&number| self.takes_light(bsdf.lobe(number)));
        let albedo = |number: usize| bsdf.lobe(number).albedo(at).max_channel();
        let glossy = || lobes().filter(|&number| is_glossy(number));
        let others = || lobes().filter(|&number| !is_glossy(number));
        let shine = || glossy().map(albedo).sum::<f32>() >= others().map(albedo).sum::<f32>();
        let chooses = glossy().next().is_some() && (others().next().is_none() || shine());
        if chooses { self.light_candidates } else { 1 }
    }

    /// Chooses sample `number` of lights of each of eight surfaces among its candidates, of which `lights` has the first;
    /// `counts` are samples of each surface and candidates of each sample.
    #[inline(never)]
    pub(super) fn choose_lights(
        &self,
        (drawn, bsdfs): (&Eight, &[Option<&Bsdf>; LANES]),
        (leaving, number): (&[Leaving; LANES], u32),
        (to, counts): (&Receivers, &[[u32; 2]; LANES]),
        lights: &mut EightSamples,
    ) {
        let reflect = |lights: &EightSamples, reflected: &mut Colours| {
            for lane in to.lanes() {
                if let (Some(bsdf), Some(light)) = (bsdfs[lane], lights.get(lane)) {
                    let point = &Lane { eight: drawn, lane }.point();
                    let from = Reached { path: drawn.from[lane], point, bsdf };
                    reflected.set(lane, self.reflected(&from, &leaving[lane], &light));
                }
            }
        };
        let mut reflected = Colours::default();
        reflect(lights, &mut reflected);
        self.choose_among((drawn, to), (counts, number), (lights, &mut reflected), reflect);
    }

    /// Chooses among candidates that are drawn here but for the first, `chosen` with what surfaces reflect of it, and puts
    /// in its place what was chosen; `counts` as for [`choose_lights`](Self::choose_lights), and `reflect` says what surfaces
    /// reflect of others.
    #[inline(always)]
    pub(super) fn choose_among(
        &self,
        (drawn, to): (&Eight, &Receivers),
        (counts, number): (&[[u32; 2]; LANES], u32),
        chosen: (&mut EightSamples, &mut Colours),
        mut reflect: impl FnMut(&EightSamples, &mut Colours),
    ) {
        let mut candidates = Candidates::of(drawn, counts.map(|[samples, _]| samples), number);
        candidates.offer(chosen.0, chosen.1);
        for candidate in 1..counts.iter().fold(1, |most, [_, n]| most.max(*n)) {
            let mut to = *to;
            for (there, [_, n]) in to.there.iter_mut().zip(counts) {
                *there &= candidate < *n;
            }
            let (mut lights, mut reflected) = (EightSamples::default(), Colours::default());
            let numbers =
                (counts.map(|[samples, n]| samples * n), counts.map(|[_, n]| number * n + candidate));
            self.sample_lights_at(drawn, &to, numbers, &mut lights);
            reflect(&lights, &mut reflected);
            candidates.offer(&lights, &reflected);
        }
        candidates.choose(counts.map(|[_, n]| n > 1), chosen.0, chosen.1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sample that is there in all lanes, with so much light.
    fn sample(le: f32) -> EightSamples {
        EightSamples { le_over_pdf: [[le; LANES]; 3], there: [true; LANES], ..EightSamples::default() }
    }

    fn grey(reflected: f32) -> Colours {
        let mut colours = Colours::default();
        (0..LANES).for_each(|lane| colours.set(lane, Rgb::WHITE * reflected));
        colours
    }

    fn chosen(candidates: Candidates) -> (EightSamples, Colours) {
        let (mut lights, mut reflected) = (EightSamples::default(), Colours::default());
        candidates.choose([true; LANES], &mut lights, &mut reflected);
        (lights, reflected)
    }

    #[test]
    fn the_kept_candidate_brings_what_all_would_and_is_kept_as_often_as_it_brings() {
        let offered = [(1.0, 0.5), (4.0, 0.0), (3.0, 0.5), (0.5, 4.0)];
        let count = 1 << 12;
        let mut kept_as = [0u32; 4];
        for i in 0..count {
            let mut candidates = Candidates::new([(i as f32 + 0.5) / count as f32; LANES]);
            for (number, (le, reflected)) in offered.into_iter().enumerate() {
                let number = [number as f32; LANES];
                candidates.offer(&EightSamples { t_max: number, ..sample(le) }, &grey(reflected));
            }
            let (lights, reflected) = chosen(candidates);
            for lane in 0..LANES {
                let brings = reflected.get(lane).r * lights.le_over_pdf[0][lane];
                assert!((brings - 4.0).abs() < 1e-5, "{brings}");
            }
            kept_as[lights.t_max[0] as usize] += 1;
        }
        for (seen, share) in kept_as.into_iter().zip([0.125, 0.0, 0.375, 0.5]) {
            let expected = share * count as f32;
            assert!((seen as f32 - expected).abs() <= 2.0, "{seen} instead of {expected}");
        }
    }

    #[test]
    fn what_brings_nothing_or_no_number_is_never_kept() {
        for u in [0.0, 0.5, 1.0 - 0.5 * f32::EPSILON] {
            let mut candidates = Candidates::new([u; LANES]);
            candidates.offer(&EightSamples::default(), &grey(1.0));
            candidates.offer(&sample(f32::NAN), &grey(1.0));
            candidates.offer(&sample(f32::INFINITY), &grey(1.0));
            assert!(!candidates.kept.there.contains(&true));
            candidates.offer(&sample(2.0), &grey(0.25));
            candidates.offer(&sample(1.0), &grey(0.0));
            let (lights, reflected) = chosen(candidates);
            assert!(lights.there == [true; LANES] && lights.le_over_pdf[1] == [2.0; LANES]);
            assert_eq!(reflected.get(3), Rgb::WHITE * 0.25);
        }
    }
}
