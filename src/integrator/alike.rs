//! Surfaces that are alike, eight side by side: diffuse and nothing else, rough metals or plastics. It is the ordinary case,
//! which takes none of the turns that `vertex`, `bounce` and `direct` know of. What comes of a surface here is what would
//! come of it there, to the bit.

use super::bounce::{Dimension, most_survivors, share_of_survivors};
use super::direct::{bounded_by, power_heuristic};
use super::eight::{Directions, Eight, Lane, Pairs};
use super::guided::{mix, unguided, within};
use super::metals::Metals;
use super::order::Order;
use super::path::Path;
use super::plastics::Plastics;
use super::tally::RayClass;
use super::vertex::Outgoing;
use super::wave::Integrator;
use crate::bxdf::{Bxdf, Diffuse, LobeKind};
use crate::core::lanes::{Colours, Floats, LANES, Vectors};
use crate::core::{Hit, Ray, Rgb};
use crate::scene::{DirectLight, EightSamples, Interactions, Receivers, Scene};
use glam::Vec3;

/// The lobes of eight surfaces, all of one kind.
pub(super) enum Lobes {
    /// Diffuse ones, by their reflectance.
    Diffuse(Colours),
    /// Those of rough metals.
    Metal(Metals),
    /// Those of plastics.
    Plastic(Plastics),
}

impl Lobes {
    /// The lobes of eight surfaces of a kind, if that kind is one of these: only then is each `lobe` asked for.
    #[inline(always)]
    fn of(kind: usize, lobe: impl Fn(usize) -> Bxdf) -> Option<Self> {
        match kind {
            Order::DIFFUSE => {
                let mut reflectances = Colours::default();
                for lane in 0..LANES {
                    let Bxdf::Diffuse(lobe) = lobe(lane) else { return None };
                    reflectances.set(lane, lobe.reflectance);
                }
                Some(Self::Diffuse(reflectances))
            }
            Order::METAL => Metals::of(lobe).map(Self::Metal),
            Order::PLASTIC => Plastics::of(lobe).map(Self::Plastic),
            _ => None,
        }
    }

    /// What is reflected of light from `wi`, and the density of rays there.
    #[inline(always)]
    fn evaluate(&self, points: &Interactions, wi: &Vectors) -> (Colours, Floats) {
        match self {
            Self::Diffuse(reflectance) => {
                let (mut f_cos, mut pdf) = (Colours::default(), Floats::default());
                for lane in 0..LANES {
                    pdf[lane] = Diffuse::density(points.n.get(lane), points.ng.get(lane), wi.get(lane));
                    f_cos.set(lane, reflectance.get(lane) * pdf[lane]);
                }
                (f_cos, pdf)
            }
            Self::Metal(metals) => metals.evaluate(points, wi),
            Self::Plastic(plastics) => plastics.evaluate(points, wi),
        }
    }

    /// The directions that the numbers `u` draw, and the colour of each one's weight.
    #[inline(always)]
    fn draw(&self, points: &Interactions, u: &Pairs) -> (Directions, Colours) {
        match self {
            Self::Diffuse(reflectance) => (Directions::diffuse(points, u), *reflectance),
            Self::Metal(metals) => metals.draw(points, u),
            Self::Plastic(plastics) => plastics.draw(points, u),
        }
    }

    /// Of all of them.
    fn kind(&self) -> LobeKind {
        match self {
            Self::Diffuse(_) => LobeKind::Diffuse,
            Self::Metal(_) | Self::Plastic(_) => LobeKind::Glossy,
        }
    }
}

/// The numbers of one ray of each of eight surfaces.
struct Numbers {
    /// What they are indexed by: see [`Path::index`].
    index: [u32; LANES],
    lobe: Pairs,
    /// The number by which the path ends; negative where it does not end by chance.
    survival: Floats,
}

/// What has come to up to eight surfaces.
#[derive(Default)]
struct Arrived {
    /// How many.
    count: usize,
    /// Rays that leave each where a path goes on.
    rays: u32,
    /// The paths' weights.
    beta: Colours,
    /// See [`Path::favour`].
    favour: Floats,
    /// Where a ray leaves.
    goes_on: [bool; LANES],
    /// Rays that leave.
    rate: Floats,
    /// The greatest share that survives.
    most: Floats,
    /// What no channel of reflected light may exceed.
    bound: Floats,
}

/// What guides do to rays that leave eight surfaces.
#[derive(Default)]
struct Guides {
    /// The share of rays that ask the guide: 0 where there is none.
    share: Floats,
    /// The density of the guide towards the light, in 1/sr.
    towards_light: Floats,
    /// The density of the guide along the ray, in 1/sr.
    along_ray: Floats,
}

/// Rays that leave eight surfaces.
struct Bounced {
    wi: Vectors,
    /// The weights of what they will find; black where there is no ray.
    beta: Colours,
    favour: Floats,
    pdf: Floats,
}

impl Integrator<'_> {
    /// Whether surfaces may be shaded side by side, as far as the scene's settings can tell.
    pub(super) fn shades_alike(scene: &Scene) -> bool {
        scene.settings.direct_light == DirectLight::Mis && scene.settings.diffuse_bounces
    }

    /// The lobes of eight surfaces of a `kind` that paths have come to, if they can be shaded side by side: not where
    /// denoisers are told of them, where rays may have to wait, nor where a glossy hit ends a path. All must split into as many
    /// rays.
    #[inline(always)]
    pub(super) fn alike(
        &self,
        (kind, points): (usize, &Interactions),
        seen: [(&Ray, &Hit); LANES],
        from: [&Path; LANES],
        out: &Outgoing,
    ) -> Option<Lobes> {
        if !self.alike || !out.trails.is_empty() {
            return None;
        }
        let lobes = Lobes::of(kind, |lane| {
            let (_, Hit { geom_id, .. }) = seen[lane];
            let everywhere = self.only_lobes[*geom_id as usize];
            everywhere.unwrap_or_else(|| self.lobe_at(*geom_id, points.p.get(lane)))
        })?;
        let rays = self.rays_of(from[0], lobes.kind());
        let finds_room = out.next.len() + LANES * rays as usize <= self.capacity;
        let splits_so = from.iter().all(|path| self.rays_of(path, lobes.kind()) == rays);
        let is_ordinary = lobes.kind() == LobeKind::Diffuse
            || self.scene.settings.highlights && !from.iter().any(|path| self.is_last(path));
        (finds_room && splits_so && is_ordinary).then_some(lobes)
    }

    /// The first lobe at a point of a geometry whose lobes differ from point to point.
    #[inline(never)]
    fn lobe_at(&self, geom_id: u32, p: Vec3) -> Bxdf {
        *self.scene.bsdf(geom_id, p).lobe(0)
    }

    /// What the first `count` of eight surfaces with these `lobes` reflect.
    #[inline(always)]
    pub(super) fn reflect_alike(&self, eight: &Eight, lobes: &Lobes, count: usize, out: &mut Outgoing) {
        let arrived = self.arrived(eight, lobes, count, out);
        let mut lights = EightSamples::default();
        if self.samples_lights != [false; 2] {
            let mut there = [false; LANES];
            for lane in 0..count {
                there[lane] = self.samples_lights[usize::from(arrived.goes_on[lane])];
            }
            let lobes_look = arrived.goes_on;
            let to = Receivers { p: eight.points.p, n: eight.points.n, lobes_look, there };
            if !to.is_empty() {
                self.scene.lights.sample_eight(&to, || eight.fine(), &eight.light(), &mut lights);
            }
        }
        for number in 0..arrived.rays {
            let numbers = self.numbers_alike(eight, (number, arrived.rays));
            let (bounced, guides) = self.bounced((eight, lobes), &arrived, &numbers, &lights);
            if number == 0 {
                self.light_alike((eight, lobes), &arrived, &guides, &lights, out);
            }
            self.bounce_alike((eight, lobes), &arrived, (&numbers, &bounced), out);
        }
    }

    /// What has come to the surfaces; what ends there is counted.
    #[inline(always)]
    fn arrived(&self, eight: &Eight, lobes: &Lobes, count: usize, out: &mut Outgoing) -> Arrived {
        let settings = &self.scene.settings;
        let rays = self.rays_of(eight.from[0], lobes.kind());
        let mut arrived = Arrived { count, rays, ..Arrived::default() };
        for lane in 0..count {
            let path = eight.from[lane];
            let goes_on = !self.is_last(path);
            if let (false, Lobes::Diffuse(reflectance)) = (goes_on, lobes) {
                out.tally.lose(path.beta * reflectance.get(lane));
            }
            arrived.beta.set(lane, path.beta);
            arrived.favour[lane] = path.favour;
            arrived.goes_on[lane] = goes_on;
            arrived.rate[lane] = if goes_on { rays as f32 } else { 0.0 };
            arrived.most[lane] = most_survivors(path.depth >= settings.max_depth);
            arrived.bound[lane] = match settings.clamp_indirect {
                Some(most) if path.depth > 0 => most,
                _ => f32::INFINITY,
            };
        }
        arrived
    }

    /// The numbers of ray `number` of so many `rays` that leave each surface.
    #[inline(always)]
    fn numbers_alike(&self, eight: &Eight, (number, rays): (u32, u32)) -> Numbers {
        let mut numbers = Numbers { index: [0; LANES], lobe: eight.lobe, survival: [-1.0; LANES] };
        for (lane, path) in eight.from.iter().enumerate() {
            numbers.index[lane] = path.index.wrapping_mul(rays).wrapping_add(number);
        }
        if rays > 1 {
            numbers.lobe = eight.draw_at(Dimension::Lobe(0), numbers.index);
        }
        for (lane, path) in eight.from.iter().enumerate() {
            if path.depth >= self.roulette_from {
                let lane_drawn = Lane { eight, lane };
                numbers.survival[lane] = match rays {
                    1 => lane_drawn.survival(),
                    _ => lane_drawn.sampler().single(numbers.index[lane], Dimension::Survival.at(path.depth)),
                };
            }
        }
        numbers
    }

    /// The rays that leave by these `numbers`, and what guides have to do with them and with samples of `lights`.
    #[inline(always)]
    fn bounced(
        &self,
        (eight, lobes): (&Eight, &Lobes),
        arrived: &Arrived,
        numbers: &Numbers,
        lights: &EightSamples,
    ) -> (Bounced, Guides) {
        let (mut guides, mut cells) = (Guides::default(), [None; LANES]);
        if let Some(caustics) = self.caustics {
            for lane in 0..LANES {
                if let (Some(number), true) = (eight.guides[lane], arrived.goes_on[lane]) {
                    let cell = caustics.cell(number);
                    (cells[lane], guides.share[lane]) = (Some(cell), cell.share);
                }
            }
        }
        let [x, y] = &numbers.lobe;
        let mut of_lobe = Floats::default();
        for lane in 0..LANES {
            of_lobe[lane] = unguided(guides.share[lane], x[lane]);
        }
        let (directions, colours) = lobes.draw(eight.points, &[of_lobe, *y]);
        let mut bounced = Bounced {
            wi: directions.wi,
            beta: Colours::default(),
            favour: arrived.favour,
            pdf: directions.pdf,
        };
        for lane in 0..LANES {
            let weight = if directions.weight[lane] > 0.0 { directions.weight[lane] } else { 0.0 };
            let weight = colours.get(lane) * weight;
            bounced.beta.set(lane, arrived.beta.get(lane) * weight * arrived.rate[lane].recip());
        }
        if let (Lobes::Diffuse(reflectance), Some(_)) = (lobes, self.caustics) {
            for lane in 0..LANES {
                let Some(cell) = cells[lane] else { continue };
                let (p, mixture) = (eight.points.p.get(lane), &cell.mixture);
                if x[lane] < cell.share {
                    let wi = mixture.sample(p, [within(x[lane], 0.0, cell.share), y[lane]]);
                    bounced.wi.set(lane, wi);
                }
                [guides.towards_light[lane], guides.along_ray[lane]] =
                    mixture.pdfs(p, [lights.wi.get(lane), bounced.wi.get(lane)]);
            }
            guides.weigh(reflectance, eight.points, arrived, &mut bounced);
        }
        bounced.end_by_chance(arrived, &numbers.survival);
        (bounced, guides)
    }

    /// What is reflected of samples of lights.
    #[inline(always)]
    fn light_alike(
        &self,
        (eight, lobes): (&Eight, &Lobes),
        arrived: &Arrived,
        guides: &Guides,
        lights: &EightSamples,
        out: &mut Outgoing,
    ) {
        let (points, self_hit) = (eight.points, self.scene.settings.self_hit);
        let (f_cos, pdf) = lobes.evaluate(points, &lights.wi);
        let [r, g, b] = &lights.le_over_pdf;
        let mut reflected = Colours::default();
        for lane in 0..LANES {
            let pdf = mix(guides.share[lane], guides.towards_light[lane], pdf[lane]);
            let weight = power_heuristic(lights.pdf[lane], pdf * arrived.rate[lane]);
            let le_over_pdf = Rgb::new(r[lane], g[lane], b[lane]);
            let seen = arrived.beta.get(lane) * (f_cos.get(lane) * weight);
            reflected.set(lane, seen * le_over_pdf);
        }
        if self.scene.settings.clamp_indirect.is_some() {
            for lane in 0..LANES {
                reflected.set(lane, bounded_by(arrived.bound[lane], reflected.get(lane)));
            }
        }
        let origins = points.shadow_starts(&lights.wi, self_hit);
        for lane in 0..arrived.count {
            let (path, radiance) = (eight.from[lane], reflected.get(lane));
            if !lights.there[lane] || radiance.is_black() {
                continue;
            }
            if lights.shadow[lane] {
                let (wi, t_max) = (lights.wi.get(lane), lights.t_max[lane]);
                let ray = points.shadow_ray(lane, origins.get(lane), wi, t_max, self_hit);
                out.shadows.push(path.slot, radiance, ray);
            } else {
                out.add(path, radiance);
            }
        }
    }

    /// Sends the rays that leave.
    #[inline(always)]
    fn bounce_alike(
        &self,
        (eight, lobes): (&Eight, &Lobes),
        arrived: &Arrived,
        (numbers, bounced): (&Numbers, &Bounced),
        out: &mut Outgoing,
    ) {
        let (points, self_hit) = (eight.points, self.scene.settings.self_hit);
        let (class, glossy) = match lobes.kind() {
            LobeKind::Diffuse => (RayClass::Diffuse, 0),
            _ => (RayClass::Glossy, 1),
        };
        let origins = points.starts(&bounced.wi, self_hit);
        for lane in 0..arrived.count {
            let (path, beta) = (eight.from[lane], bounced.beta.get(lane));
            if !arrived.goes_on[lane] || beta.is_black() {
                continue;
            }
            let child = Path {
                beta,
                favour: bounced.favour[lane],
                index: numbers.index[lane],
                depth: path.depth + 1,
                glossy_depth: path.glossy_depth + glossy,
                split: if self.splits_any { 1 } else { path.split },
                rate: bounced.pdf[lane] * arrived.rate[lane],
                receiver_n: points.n.get(lane),
                lobes_look: true,
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

impl Guides {
    /// Weighs rays that have a guide by the densities of its mixture with the diffuse lobe.
    #[inline(always)]
    fn weigh(&self, reflectance: &Colours, points: &Interactions, arrived: &Arrived, bounced: &mut Bounced) {
        let Interactions { n, ng, .. } = *points;
        let (mut betas, mut favours, mut pdfs) = (bounced.beta, bounced.favour, bounced.pdf);
        for lane in 0..LANES {
            let alone = Diffuse::density(n.get(lane), ng.get(lane), bounced.wi.get(lane));
            let pdf = mix(self.share[lane], self.along_ray[lane], alone);
            let guided = self.share[lane] > 0.0;
            // Where nothing is reflected, the density may be zero too.
            let weight = reflectance.get(lane) * alone / if alone > 0.0 { pdf } else { 1.0 };
            let beta = arrived.beta.get(lane) * weight * arrived.rate[lane].recip();
            let favour = arrived.favour[lane] * (pdf / alone);
            betas.set(lane, if guided { beta } else { betas.get(lane) });
            favours[lane] = if guided { favour } else { favours[lane] };
            pdfs[lane] = if guided { pdf } else { pdfs[lane] };
        }
        (bounced.beta, bounced.favour, bounced.pdf) = (betas, favours, pdfs);
    }
}

impl Bounced {
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

#[cfg(test)]
#[path = "alike_tests.rs"]
mod tests;
