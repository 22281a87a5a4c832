//! Rays that leave surfaces that are alike: their numbers, directions and weights, what guides do to them, and
//! which of them end.

use super::alike::{Arrived, Part};
use super::bounce::{Dimension, share_of_survivors};
use super::eight::{Directions, Eight, Lane, Pairs};
use super::guided::{Guide, mix};
use super::lobes::Lobes;
use super::path::Path;
use super::tally::RayClass;
use super::vertex::Outgoing;
use super::wave::Integrator;
use crate::bxdf::{Diffuse, LobeKind};
use crate::core::Rgb;
use crate::core::lanes::{Colours, Floats, LANES, Vectors};
use crate::core::{Wide, widely};
use crate::guiding::{CellNumbers, Guides};
use crate::scene::{EightSamples, Interactions};

/// The numbers of one ray of each of eight surfaces.
pub(super) struct Numbers {
    /// What they are indexed by: see [`Path::index`].
    index: [u32; LANES],
    lobe: Pairs,
    /// The number by which the path ends; negative where it does not end by chance.
    survival: Floats,
}

/// What guides do to rays that leave eight surfaces.
pub(super) struct Guidance {
    /// The share of rays that ask no guide: 1 where there is none.
    pub own: Floats,
    /// The density towards the light of rays that do, times their share, in 1/sr.
    pub towards_light: Floats,
    /// The same along the ray.
    along_ray: Floats,
}

/// Rays that leave eight surfaces.
pub(super) struct Bounced {
    wi: Vectors,
    /// The weights of what they will find; black where there is no ray.
    beta: Colours,
    favour: Floats,
    pub pdf: Floats,
}

impl Integrator<'_> {
    /// The numbers of ray `number` of a part of each surface.
    #[inline(always)]
    pub(super) fn numbers_alike(&self, eight: &Eight, part: &Part, number: u32) -> Numbers {
        let mut numbers =
            Numbers { index: [0; LANES], lobe: part.chosen.unwrap_or(eight.lobe), survival: [-1.0; LANES] };
        for (lane, path) in eight.from.iter().enumerate() {
            numbers.index[lane] = path.index_of(number, part.rays);
        }
        if part.rays > 1 || part.number > 0 && part.chosen.is_none() {
            numbers.lobe = eight.draw_at(Dimension::Lobe(part.number), numbers.index);
        }
        for (lane, path) in eight.from.iter().enumerate() {
            if path.depth >= self.roulette_from {
                let lane_drawn = Lane { eight, lane };
                numbers.survival[lane] = match part.rays {
                    1 => lane_drawn.survival(),
                    _ => lane_drawn.sampler().single(numbers.index[lane], Dimension::Survival.at(path.depth)),
                };
            }
        }
        numbers
    }

    /// The rays that leave by these `numbers`, and what guides have to do with them and with samples of `lights`.
    #[inline(always)]
    pub(super) fn bounced(
        &self,
        (eight, part): (&Eight, &Part),
        arrived: &Arrived,
        numbers: &Numbers,
        lights: &EightSamples,
    ) -> (Bounced, Guidance) {
        let mut guides = Guidance::NONE;
        if let Some(maps) = self.guides
            && part.lobes.kind() == LobeKind::Glossy
            && eight.guides != [CellNumbers::NONE; LANES]
        {
            let (lobes, rate) = (part.lobes, &part.rate);
            let (mut bounced, guides) =
                widely(FollowGlossy { maps, eight, lobes, arrived, rate, numbers, lights });
            bounced.end_by_chance(arrived, &numbers.survival);
            return (bounced, guides);
        }
        let [x, y] = &numbers.lobe;
        let mut of_lobe = *x;
        if let (Some(maps), Lobes::Diffuse(_)) = (self.guides, part.lobes) {
            for lane in 0..LANES {
                if eight.guides[lane] != CellNumbers::NONE && part.rate[lane] > 0.0 {
                    let guide = Guide { cells: maps.cells(eight.guides[lane]), p: eight.points.p.get(lane) };
                    (of_lobe[lane], guides.own[lane]) = (guide.unguided(x[lane]), guide.own());
                }
            }
        }
        let (directions, colours) = part.lobes.draw(eight.points, &[of_lobe, *y]);
        let mut bounced = Bounced::along(&directions, &colours, (arrived, &part.rate));
        if guides.own != Guidance::NONE.own
            && let (Some(maps), Lobes::Diffuse(reflectance)) = (self.guides, part.lobes)
        {
            let (bounced, guides, rate) = (&mut bounced, &mut guides, &part.rate);
            widely(Follow { maps, eight, reflectance, arrived, rate, numbers, lights, bounced, guides });
        }
        bounced.end_by_chance(arrived, &numbers.survival);
        (bounced, guides)
    }

    /// Finds the densities of guides along other directions to lights.
    #[inline(always)]
    pub(super) fn look_towards(&self, wi: &Vectors, (eight, part): (&Eight, &Part), guides: &mut Guidance) {
        for lane in 0..LANES {
            if let Some(maps) = self.guides
                && guides.own[lane] < 1.0
            {
                let guide = eight.guide(maps, part.lobes, lane);
                guides.towards_light[lane] = guide.densities([wi.get(lane); 2])[0];
            }
        }
    }

    /// Sends the rays that leave.
    #[inline(always)]
    pub(super) fn bounce_alike(
        &self,
        (eight, part): (&Eight, &Part),
        arrived: &Arrived,
        (numbers, bounced): (&Numbers, &Bounced),
        out: &mut Outgoing,
    ) {
        let (points, self_hit) = (eight.points, self.scene.settings.self_hit);
        let (class, glossy) = match part.lobes.kind() {
            LobeKind::Diffuse => (RayClass::Diffuse, 0),
            _ => (RayClass::Glossy, 1),
        };
        let origins = points.starts(&bounced.wi, self_hit);
        for lane in 0..arrived.count {
            let (path, beta) = (eight.from[lane], bounced.beta.get(lane));
            if !part.leave[lane] || beta.is_black() {
                continue;
            }
            let child = Path {
                beta,
                favour: bounced.favour[lane],
                index: numbers.index[lane],
                depth: path.depth + 1,
                glossy_depth: path.glossy_depth + glossy,
                split: if self.splits_any { 1 } else { path.split },
                rate: if part.takes_light { bounced.pdf[lane] * part.rate[lane] } else { f32::INFINITY },
                receiver_n: points.n.get(lane),
                rivals: arrived.rivals[lane],
                portal: eight.portals[lane],
                emission_only: false,
                emission_apart: false,
                followed: false,
                ..*path
            };
            let ray = points.ray(lane, origins.get(lane), bounced.wi.get(lane), self_hit);
            out.next.push(class, child, ray);
        }
    }
}

/// Rays that follow guides, where they do, and what guides have to do with samples of lights: to be compiled for wide
/// instructions apart from what all scenes need.
struct Follow<'a> {
    maps: &'a Guides,
    eight: &'a Eight<'a>,
    reflectance: &'a Colours,
    arrived: &'a Arrived,
    rate: &'a Floats,
    numbers: &'a Numbers,
    lights: &'a EightSamples,
    /// As lobes alone draw them.
    bounced: &'a mut Bounced,
    /// With the shares of rays that ask no guide.
    guides: &'a mut Guidance,
}

impl Wide for Follow<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { maps, eight, reflectance, arrived, rate, numbers, lights, bounced, guides } = self;
        let [x, y] = &numbers.lobe;
        for lane in 0..LANES {
            if guides.own[lane] < 1.0 {
                let guide = Guide { cells: maps.cells(eight.guides[lane]), p: eight.points.p.get(lane) };
                if let Some(wi) = guide.draw([x[lane], y[lane]]) {
                    bounced.wi.set(lane, wi);
                }
                [guides.towards_light[lane], guides.along_ray[lane]] =
                    guide.densities([lights.wi.get(lane), bounced.wi.get(lane)]);
            }
        }
        guides.weigh(reflectance, eight.points, (arrived, rate), bounced);
    }
}

/// Rays that leave glossy surfaces, of which some have guides, and what those have to do with samples of lights: as [`Follow`], whose
/// cells are borrowed. One loop for both takes rooms where many diffuse rays follow guides 4 % longer.
struct FollowGlossy<'a> {
    maps: &'a Guides,
    eight: &'a Eight<'a>,
    lobes: &'a Lobes,
    arrived: &'a Arrived,
    rate: &'a Floats,
    numbers: &'a Numbers,
    lights: &'a EightSamples,
}

impl Wide for FollowGlossy<'_> {
    type Output = (Bounced, Guidance);

    #[inline(always)]
    fn run(self) -> Self::Output {
        let Self { maps, eight, lobes, arrived, rate, numbers, lights } = self;
        let mut guidance = Guidance::NONE;
        let [x, y] = &numbers.lobe;
        let mut of_lobe = *x;
        let mut guides = [const { None }; LANES];
        for lane in 0..LANES {
            if eight.guides[lane] != CellNumbers::NONE && rate[lane] > 0.0 && lobes.width(lane).is_wide() {
                let guide = eight.guide(maps, lobes, lane);
                (of_lobe[lane], guidance.own[lane]) = (guide.unguided(x[lane]), guide.own());
                guides[lane] = Some(guide);
            }
        }
        let (directions, colours) = lobes.draw(eight.points, &[of_lobe, *y]);
        let mut bounced = Bounced::along(&directions, &colours, (arrived, rate));
        let mut there = directions.weight.map(|weight| weight > 0.0);
        for lane in 0..LANES {
            if let Some(guide) = &guides[lane] {
                if let Some(wi) = guide.draw([x[lane], y[lane]]) {
                    bounced.wi.set(lane, wi);
                    there[lane] = true;
                }
                [guidance.towards_light[lane], guidance.along_ray[lane]] =
                    guide.densities([lights.wi.get(lane), bounced.wi.get(lane)]);
            }
        }
        let (f_cos, alone) = lobes.evaluate(eight.points, &bounced.wi);
        for lane in 0..LANES {
            if guides[lane].is_some() {
                let pdf = mix(guidance.along_ray[lane], guidance.own[lane], alone[lane]);
                let f_cos = f_cos.get(lane);
                let weight = if f_cos.is_black() | !there[lane] { Rgb::BLACK } else { f_cos / pdf };
                bounced.beta.set(lane, arrived.beta.get(lane) * weight * rate[lane].recip());
                bounced.favour[lane] = arrived.favour[lane] * (pdf / alone[lane]);
                bounced.pdf[lane] = pdf;
            }
        }
        (bounced, guidance)
    }
}

impl Guidance {
    /// None anywhere.
    pub(super) const NONE: Self =
        Self { own: [1.0; LANES], towards_light: [0.0; LANES], along_ray: [0.0; LANES] };

    /// Weighs rays that have a guide by the densities of its mixture with the diffuse lobe.
    #[inline(always)]
    fn weigh(
        &self,
        reflectance: &Colours,
        points: &Interactions,
        (arrived, rate): (&Arrived, &Floats),
        bounced: &mut Bounced,
    ) {
        let Interactions { n, ng, .. } = *points;
        let (mut betas, mut favours, mut pdfs) = (bounced.beta, bounced.favour, bounced.pdf);
        for lane in 0..LANES {
            let alone = Diffuse::density(n.get(lane), ng.get(lane), bounced.wi.get(lane));
            let pdf = mix(self.along_ray[lane], self.own[lane], alone);
            let guided = self.own[lane] < 1.0;
            // Where nothing is reflected, the density may be zero too.
            let weight = reflectance.get(lane) * alone / if alone > 0.0 { pdf } else { 1.0 };
            let beta = arrived.beta.get(lane) * weight * rate[lane].recip();
            let favour = arrived.favour[lane] * (pdf / alone);
            betas.set(lane, if guided { beta } else { betas.get(lane) });
            favours[lane] = if guided { favour } else { favours[lane] };
            pdfs[lane] = if guided { pdf } else { pdfs[lane] };
        }
        (bounced.beta, bounced.favour, bounced.pdf) = (betas, favours, pdfs);
    }
}

impl Bounced {
    /// Rays that lobes alone have drawn, with the colours of their weights.
    #[inline(always)]
    fn along(directions: &Directions, colours: &Colours, (arrived, rate): (&Arrived, &Floats)) -> Self {
        let mut beta = Colours::default();
        for lane in 0..LANES {
            let weight = if directions.weight[lane] > 0.0 { directions.weight[lane] } else { 0.0 };
            let weight = colours.get(lane) * weight;
            beta.set(lane, arrived.beta.get(lane) * weight * rate[lane].recip());
        }
        Self { wi: directions.wi, beta, favour: arrived.favour, pdf: directions.pdf }
    }

    /// Ends rays by chance, where they may end; the others stand for them.
    #[inline(always)]
    fn end_by_chance(&mut self, arrived: &Arrived, survival: &Floats) {
        let mut betas = self.beta;
        for lane in 0..LANES {
            let (beta, number) = (betas.get(lane), survival[lane]);
            let share = share_of_survivors(beta, self.favour[lane], arrived.most[lane]);
            let ends = number >= share;
            let scale = if number < 0.0 { 1.0 } else { share.recip() };
            betas.set(lane, if ends { Rgb::BLACK } else { beta * scale });
        }
        self.beta = betas;
    }
}
