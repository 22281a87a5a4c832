//! Surfaces that are diffuse and nothing else, eight side by side: the ordinary case, which takes none of the turns that
//! `vertex`, `bounce` and `direct` know of. What comes of a surface here is what would come of it there, to the bit.

use super::bounce::Dimension;
use super::bounce::{most_survivors, share_of_survivors};
use super::direct::{bounded_by, power_heuristic};
use super::eight::{Directions, Eight, Lane, Pairs};
use super::guided::{mix, unguided, within};
use super::order::Order;
use super::path::Path;
use super::tally::RayClass;
use super::vertex::Outgoing;
use super::wave::Integrator;
use crate::bxdf::{Diffuse, LobeKind};
use crate::core::Rgb;
use crate::core::lanes::{Colours, Floats, LANES};
use crate::scene::{DirectLight, EightSamples, Receivers, Scene};

/// The numbers of one ray of each of eight surfaces.
struct Numbers {
    /// What they are indexed by: see [`Path::index`].
    index: [u32; LANES],
    lobe: Pairs,
    /// The number by which the path ends; negative where it does not end by chance.
    survival: Floats,
}

/// What has come to up to eight diffuse surfaces.
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
    reflectance: Colours,
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
#[derive(Default)]
struct Bounced {
    /// The weights of what they will find; black where there is no ray.
    beta: Colours,
    favour: Floats,
    pdf: Floats,
}

impl Integrator<'_> {
    /// Whether diffuse surfaces may be shaded side by side, as far as the scene's settings can tell.
    pub(super) fn shades_alike(scene: &Scene) -> bool {
        scene.settings.direct_light == DirectLight::Mis && scene.settings.diffuse_bounces
    }

    /// Whether hits of paths on surfaces of a kind are shaded side by side: not where denoisers are told of them, nor where
    /// rays may have to wait. All must split into as many rays.
    #[inline(always)]
    pub(super) fn are_alike(&self, kind: usize, from: &[&Path; LANES], out: &Outgoing) -> bool {
        let rays = self.rays_of(from[0], LobeKind::Diffuse);
        kind == Order::DIFFUSE
            && self.alike
            && out.trails.is_empty()
            && from.iter().all(|path| self.rays_of(path, LobeKind::Diffuse) == rays)
            && out.next.len() + LANES * rays as usize <= self.capacity
    }

    /// What the first `count` of eight surfaces reflect that are [alike](Self::are_alike), by their `reflectance`.
    #[inline(always)]
    pub(super) fn reflect_alike(
        &self,
        eight: &Eight,
        (count, reflectance): (usize, Colours),
        out: &mut Outgoing,
    ) {
        let arrived = self.arrived(eight, (count, reflectance), out);
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
            let (directions, guides) = self.directions_alike(eight, &numbers, &arrived.goes_on, &lights);
            if number == 0 {
                self.light_alike(eight, &arrived, &guides, &lights, out);
            }
            self.bounce_alike(eight, &arrived, &guides, (&numbers, &directions), out);
        }
    }

    /// What has come to the surfaces; what ends there is counted.
    #[inline(always)]
    fn arrived(&self, eight: &Eight, (count, reflectance): (usize, Colours), out: &mut Outgoing) -> Arrived {
        let settings = &self.scene.settings;
        let rays = self.rays_of(eight.from[0], LobeKind::Diffuse);
        let mut arrived = Arrived { count, rays, reflectance, ..Arrived::default() };
        for lane in 0..count {
            let path = eight.from[lane];
            let goes_on = !self.is_last(path);
            if !goes_on {
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

    /// The directions of the rays that leave where a path `goes_on`, and what guides have to do with them.
    #[inline(always)]
    fn directions_alike(
        &self,
        eight: &Eight,
        numbers: &Numbers,
        goes_on: &[bool; LANES],
        lights: &EightSamples,
    ) -> (Directions, Guides) {
        let (points, [x, y]) = (eight.points, &numbers.lobe);
        let Some(caustics) = self.caustics else {
            return (Directions::diffuse(points, &numbers.lobe), Guides::default());
        };
        let mut guides = Guides::default();
        let mut cells = [None; LANES];
        for lane in 0..LANES {
            if let (Some(number), true) = (eight.guides[lane], goes_on[lane]) {
                let cell = caustics.cell(number);
                (cells[lane], guides.share[lane]) = (Some(cell), cell.share);
            }
        }
        let mut of_lobe = Floats::default();
        for lane in 0..LANES {
            of_lobe[lane] = unguided(guides.share[lane], x[lane]);
        }
        let mut directions = Directions::diffuse(points, &[of_lobe, *y]);
        for lane in 0..LANES {
            let Some(cell) = cells[lane] else { continue };
            let (p, mixture) = (points.p.get(lane), &cell.mixture);
            if x[lane] < cell.share {
                let wi = mixture.sample(p, [within(x[lane], 0.0, cell.share), y[lane]]);
                directions.wi.set(lane, wi);
            }
            [guides.towards_light[lane], guides.along_ray[lane]] =
                mixture.pdfs(p, [lights.wi.get(lane), directions.wi.get(lane)]);
        }
        (directions, guides)
    }

    /// What is reflected of samples of lights.
    #[inline(always)]
    fn light_alike(
        &self,
        eight: &Eight,
        arrived: &Arrived,
        guides: &Guides,
        lights: &EightSamples,
        out: &mut Outgoing,
    ) {
        let (points, self_hit) = (eight.points, self.scene.settings.self_hit);
        let [r, g, b] = &lights.le_over_pdf;
        let mut reflected = Colours::default();
        for lane in 0..LANES {
            let alone = Diffuse::density(points.n.get(lane), points.ng.get(lane), lights.wi.get(lane));
            let pdf = mix(guides.share[lane], guides.towards_light[lane], alone);
            let f_cos = arrived.reflectance.get(lane) * alone;
            let weight = power_heuristic(lights.pdf[lane], pdf * arrived.rate[lane]);
            let le_over_pdf = Rgb::new(r[lane], g[lane], b[lane]);
            reflected.set(lane, arrived.beta.get(lane) * (f_cos * weight) * le_over_pdf);
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

    /// The rays that leave.
    #[inline(always)]
    fn bounce_alike(
        &self,
        eight: &Eight,
        arrived: &Arrived,
        guides: &Guides,
        (numbers, directions): (&Numbers, &Directions),
        out: &mut Outgoing,
    ) {
        let (points, self_hit) = (eight.points, self.scene.settings.self_hit);
        let bounced = self.bounced(eight, arrived, guides, (numbers, directions));
        let origins = points.starts(&directions.wi, self_hit);
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
                split: if self.splits_any { 1 } else { path.split },
                rate: bounced.pdf[lane] * arrived.rate[lane],
                receiver_n: points.n.get(lane),
                lobes_look: true,
                emission_only: false,
                followed: false,
                ..*path
            };
            let ray = points.ray(lane, origins.get(lane), directions.wi.get(lane), self_hit);
            out.next.push(RayClass::Diffuse, child, ray);
        }
    }

    /// What the rays that leave weigh, and which of them survive.
    #[inline(always)]
    fn bounced(
        &self,
        eight: &Eight,
        arrived: &Arrived,
        guides: &Guides,
        (numbers, directions): (&Numbers, &Directions),
    ) -> Bounced {
        let points = eight.points;
        let mut bounced = Bounced { favour: arrived.favour, pdf: directions.pdf, ..Bounced::default() };
        for lane in 0..LANES {
            let weight = arrived.reflectance.get(lane) * directions.weight[lane];
            bounced.beta.set(lane, arrived.beta.get(lane) * weight * arrived.rate[lane].recip());
        }
        if self.caustics.is_some() {
            for lane in 0..LANES {
                let (n, ng) = (points.n.get(lane), points.ng.get(lane));
                let alone = Diffuse::density(n, ng, directions.wi.get(lane));
                let pdf = mix(guides.share[lane], guides.along_ray[lane], alone);
                let guided = guides.share[lane] > 0.0;
                // Where nothing is reflected, the density may be zero too.
                let weight = arrived.reflectance.get(lane) * alone / if alone > 0.0 { pdf } else { 1.0 };
                let beta = arrived.beta.get(lane) * weight * arrived.rate[lane].recip();
                let favour = arrived.favour[lane] * (pdf / alone);
                bounced.beta.set(lane, if guided { beta } else { bounced.beta.get(lane) });
                bounced.favour[lane] = if guided { favour } else { bounced.favour[lane] };
                bounced.pdf[lane] = if guided { pdf } else { bounced.pdf[lane] };
            }
        }
        for lane in 0..LANES {
            let (beta, number) = (bounced.beta.get(lane), numbers.survival[lane]);
            let share = share_of_survivors(beta, bounced.favour[lane], arrived.most[lane]);
            let ends = number >= share;
            let scale = if number < 0.0 { 1.0 } else { share.recip() };
            bounced.beta.set(lane, if ends { Rgb::BLACK } else { beta * scale });
        }
        bounced
    }
}

#[cfg(test)]
#[path = "alike_tests.rs"]
mod tests;
