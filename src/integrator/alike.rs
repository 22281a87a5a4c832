//! Surfaces that are alike, eight side by side: diffuse, rough metals, plastics, cosine powers, or diffuse with a cosine power.
//! It is the ordinary case, which takes none of the turns that `vertex`, `bounce` and `direct` know of. What comes of a
//! surface here is what would come of it there, to the bit.

use super::bounce::most_survivors;
use super::bounced::Guidance;
use super::direct::{bounded_by, power_heuristic};
use super::eight::{Eight, Pairs};
use super::guided::mix;
use super::lobes::Lobes;
use super::order::Order;
use super::vertex::Outgoing;
use super::wave::Integrator;
use crate::bxdf::{Bxdf, LobeKind};
use crate::core::lanes::{Colours, Floats, LANES};
use crate::core::warp::within;
use crate::core::{Hit, Ray, Rgb, Wide, widely};
use crate::scene::{DirectLight, EightSamples, Interactions, Receivers, Rivals, Scene};
use glam::Vec3;

/// What has come to up to eight surfaces.
#[derive(Default)]
pub(super) struct Arrived {
    /// How many.
    pub count: usize,
    /// The paths' weights.
    pub beta: Colours,
    /// See [`Path::favour`].
    pub favour: Floats,
    /// Where it goes no further.
    ends: [bool; LANES],
    /// The greatest share that survives.
    pub most: Floats,
    /// What no channel of reflected light may exceed.
    bound: Floats,
    /// Who looks for light beside samples of lights: the lobes, where each that takes light from lights has rays that may
    /// find it.
    pub rivals: [Rivals; LANES],
}

/// One lobe of each of eight surfaces, and its rays.
pub(super) struct Part<'a> {
    /// Its number among the lobes.
    pub number: usize,
    pub lobes: &'a Lobes,
    /// Rays of each surface where any leave.
    pub rays: u32,
    /// Where they leave.
    pub leave: [bool; LANES],
    /// Their expected number.
    pub rate: Floats,
    /// Whether samples of lights are taken for it.
    pub takes_light: bool,
    /// The numbers of the only ray, where they are what was left by the choice of the lobe.
    pub chosen: Option<Pairs>,
}

/// Eight surfaces, what has come to them, and where what leaves them goes.
pub(super) struct Group<'a, 'b> {
    /// Of all of them.
    pub kind: usize,
    /// The rays and their hits.
    pub seen: [(&'a Ray, &'a Hit); LANES],
    pub eight: &'a Eight<'a>,
    /// How many of the eight there are.
    pub count: usize,
    pub out: &'a mut Outgoing<'b>,
}

/// [`Integrator::reflect_two`], to be compiled for wide instructions.
struct Two<'a, 'b, 'c> {
    integrator: &'a Integrator<'a>,
    group: &'a mut Group<'b, 'c>,
}

impl Wide for Two<'_, '_, '_> {
    type Output = bool;

    #[inline(always)]
    fn run(self) -> bool {
        self.integrator.reflect_two(self.group)
    }
}

/// The choice of samples of lights among candidates, to be compiled for wide instructions: apart from what is more ordinary.
struct Choose<'a, 'b, const N: usize> {
    integrator: &'a Integrator<'b>,
    eight: &'a Eight<'a>,
    to: &'a Receivers,
    /// The lobes, and their guides.
    parts: (&'a [Part<'a>; N], &'a mut [Guidance; N]),
    /// Samples of lights of each surface and candidates of each of them, and which sample.
    numbers: ([[u32; 2]; LANES], u32),
    /// The first candidates and what surfaces reflect of them; then those that are chosen.
    chosen: (&'a mut EightSamples, &'a mut Colours),
}

impl<const N: usize> Wide for Choose<'_, '_, N> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { integrator, eight, to, parts: (parts, guides), numbers: (counts, number), chosen } = self;
        integrator.choose_among((eight, to), (&counts, number), chosen, |lights, reflected| {
            let takes_light = |part: &Part| part.takes_light && number < part.rays;
            for (part, guides) in parts.iter().zip(&mut *guides).filter(|(part, _)| takes_light(part)) {
                integrator.look_towards(&lights.wi, (eight, part), guides);
                part.reflect(eight.points, guides, lights, reflected);
            }
        });
    }
}

impl Integrator<'_> {
    /// Whether surfaces may be shaded side by side, as far as the scene's settings can tell.
    pub(super) fn shades_alike(scene: &Scene) -> bool {
        scene.settings.direct_light == DirectLight::Mis && scene.settings.occlusion.is_exact()
    }

    /// Does what surfaces reflect, if they can be shaded side by side: not where denoisers are told of them, where rays may have
    /// to wait, nor where a glossy hit ends a path. All must split into as many rays. False if they cannot.
    #[inline(always)]
    pub(super) fn reflect_alike(&self, group: &mut Group) -> bool {
        if !self.alike || !group.out.trails.is_empty() {
            return false;
        }
        if group.kind == Order::DIFFUSE_AND_POWER {
            return self.reflect_two_apart(group);
        }
        let Some(lobes) = Lobes::of(group.kind, |lane| self.lobe(group, lane, 0)) else { return false };
        if !self.are_ordinary([&lobes], group) {
            return false;
        }
        let arrived = self.arrived(group);
        let only = self.part((0, &lobes), &arrived, group);
        self.reflect_parts(arrived, [only], group);
        true
    }

    /// Runs what is rarer apart from the ordinary, which is the faster for being small.
    #[inline(never)]
    fn reflect_two_apart(&self, group: &mut Group) -> bool {
        widely(Two { integrator: self, group })
    }

    /// [`reflect_alike`](Self::reflect_alike) for surfaces with a diffuse lobe and a cosine power.
    #[inline(always)]
    fn reflect_two(&self, group: &mut Group) -> bool {
        let lobes = [0, 1].map(|number| {
            let lobe = |lane| self.lobe(group, lane, number);
            Lobes::of(if number == 0 { Order::DIFFUSE } else { Order::POWER }, lobe)
        });
        let [Some(first), Some(second)] = &lobes else { return false };
        if !self.are_ordinary([first, second], group) {
            return false;
        }
        let arrived = self.arrived(group);
        let [mut first, mut second] =
            [(0, first), (1, second)].map(|lobes| self.part(lobes, &arrived, group));
        Part::choose(group.eight, &mut first, &mut second);
        self.reflect_parts(arrived, [first, second], group);
        true
    }

    /// The lobe of this number of a surface.
    #[inline(always)]
    fn lobe(&self, group: &Group, lane: usize, number: usize) -> Bxdf {
        let (_, Hit { geom_id, .. }) = group.seen[lane];
        let everywhere = self.lobes[*geom_id as usize][number];
        everywhere.unwrap_or_else(|| self.lobe_at(*geom_id, group.eight.points.p.get(lane), number))
    }

    /// The lobe of this number at a point of a geometry whose lobes differ from point to point.
    #[inline(never)]
    fn lobe_at(&self, geom_id: u32, p: Vec3, number: usize) -> Bxdf {
        *self.scene.bsdf(geom_id, p).lobe(number)
    }

    /// Whether rays of all these lobes leave all surfaces, as many of each, and find room.
    #[inline(always)]
    fn are_ordinary<const N: usize>(&self, lobes: [&Lobes; N], group: &Group) -> bool {
        let (from, mut most) = (&group.eight.from, 0);
        for kind in lobes.map(Lobes::kind) {
            let rays = self.rays_of(from[0], kind);
            let splits_so = from.iter().all(|path| self.rays_of(path, kind) == rays);
            let goes_on = kind == LobeKind::Diffuse || !from.iter().any(|path| self.is_last(path));
            if !splits_so || !goes_on {
                return false;
            }
            most += rays as usize;
        }
        group.out.next.len() + LANES * most <= self.capacity
    }

    /// What the lobes of eight surfaces reflect.
    #[inline(always)]
    fn reflect_parts<const N: usize>(&self, mut arrived: Arrived, parts: [Part; N], group: &mut Group) {
        if self.has_ambient {
            self.add_ambient(group);
        }
        let Group { eight, out, .. } = group;
        let mut lobes_look = [true; LANES];
        for part in parts.iter().filter(|part| part.takes_light) {
            for lane in 0..LANES {
                lobes_look[lane] &= part.rate[lane] > 0.0;
            }
        }

        let takes_light = parts.iter().any(|part| part.takes_light);
        let samples = self.light_samples_of(parts.iter().map(|part| part.rays));
        let most = parts.iter().map(|part| part.rays).fold(1, u32::max);
        let candidates = self.light_candidates_alike(&parts, eight);
        let chooses = candidates != [1; LANES];
        let mut there = [false; LANES];
        for lane in 0..arrived.count {
            arrived.rivals[lane] = Self::rivals(lobes_look[lane], eight.portals[lane]);
            there[lane] = takes_light && self.asks_lights(arrived.rivals[lane], eight.portals[lane]);
        }
        let to = Receivers { p: eight.points.p, n: eight.points.n, rivals: arrived.rivals, there };
        for number in 0..most {
            let mut lights = EightSamples::default();
            let asks = number < samples && !to.is_empty();
            if asks {
                let numbers = (candidates.map(|n| samples * n), candidates.map(|n| number * n));
                self.sample_lights_at(eight, &to, numbers, &mut lights);
            }
            let mut reflected = Colours::default();
            let mut all_guides = [const { Guidance::NONE }; N];
            let with_guides = parts.iter().zip(&mut all_guides);
            for (part, guides_of_part) in with_guides.filter(|(part, _)| number < part.rays) {
                let numbers = self.numbers_alike(eight, part, number);
                let (mut bounced, guides) = self.bounced((eight, part), &arrived, &numbers, &lights);
                if asks && part.takes_light {
                    part.reflect(eight.points, &guides, &lights, &mut reflected);
                }
                for (pdf, n) in bounced.pdf.iter_mut().zip(candidates) {
                    *pdf /= (samples * n) as f32;
                }
                self.bounce_alike((eight, part), &arrived, (&numbers, &bounced), out);
                *guides_of_part = guides;
            }
            if asks && chooses {
                widely(Choose {
                    integrator: self,
                    eight,
                    to: &to,
                    parts: (&parts, &mut all_guides),
                    numbers: (candidates.map(|n| [samples, n]), number),
                    chosen: (&mut lights, &mut reflected),
                });
            }
            if asks {
                self.light_alike(eight, &arrived, &reflected, &lights, out);
            }
        }
        if chooses {
            for lane in to.lanes() {
                out.tally.candidates += u64::from((candidates[lane] - 1) * samples);
            }
        }
    }

    /// Candidates of which each surface's samples of lights are one: as where each surface is by itself.
    #[inline(always)]
    fn light_candidates_alike(&self, parts: &[Part], eight: &Eight) -> [u32; LANES] {
        if self.light_candidates == 1 {
            return [1; LANES];
        }
        let chooses = match parts {
            [only] => [only.takes_light && only.lobes.kind() == LobeKind::Glossy; LANES],
            [
                Part { lobes: Lobes::Diffuse(reflectance), .. },
                Part { lobes: Lobes::Power(powers), takes_light, .. },
            ] => {
                let albedo = powers.albedo(eight.points);
                std::array::from_fn(|lane| {
                    *takes_light && albedo[lane] >= reflectance.get(lane).max_channel()
                })
            }
            _ => [false; LANES],
        };
        chooses.map(|chooses| if chooses { self.light_candidates } else { 1 })
    }

    /// Adds what surfaces show of the scene's ambient light.
    #[inline(never)]
    fn add_ambient(&self, Group { seen, eight, count, out, .. }: &mut Group) {
        for lane in 0..*count {
            let (path, (_, hit)) = (eight.from[lane], seen[lane]);
            let material = self.scene.material(hit.geom_id);
            self.reflect_ambient(path, material, eight.points.p.get(lane), out);
        }
    }

    /// What has come to the surfaces.
    #[inline(always)]
    fn arrived(&self, group: &Group) -> Arrived {
        let (settings, count) = (&self.scene.settings, group.count);
        let mut arrived = Arrived { count, ends: [true; LANES], ..Arrived::default() };
        for lane in 0..count {
            let path = group.eight.from[lane];
            arrived.beta.set(lane, path.beta);
            arrived.favour[lane] = path.favour;
            arrived.ends[lane] = self.is_last(path);
            arrived.most[lane] = most_survivors(path.depth >= settings.max_depth);
            arrived.bound[lane] = match settings.clamp_indirect {
                Some(most) if path.depth > 0 => most,
                _ => f32::INFINITY,
            };
        }
        arrived
    }

    /// The lobes of this number with the rays that leave; what ends there is counted.
    #[inline(always)]
    fn part<'a>(
        &self,
        (number, lobes): (usize, &'a Lobes),
        arrived: &Arrived,
        Group { eight, out, .. }: &mut Group,
    ) -> Part<'a> {
        let settings = &self.scene.settings;
        let (rays, mut leave) = (self.rays_of(eight.from[0], lobes.kind()), arrived.ends.map(|ends| !ends));
        if let Lobes::Diffuse(reflectance) = lobes {
            if !settings.diffuse_bounces {
                leave = [false; LANES];
            } else if arrived.ends.contains(&true) {
                for lane in (0..arrived.count).filter(|&lane| arrived.ends[lane]) {
                    out.tally.lose(arrived.beta.get(lane) * reflectance.get(lane));
                }
            }
        }
        let rate = leave.map(|leaves| if leaves { rays as f32 } else { 0.0 });
        let takes_light = lobes.kind() == LobeKind::Diffuse || settings.highlights;
        Part { number, lobes, rays, leave, rate, takes_light, chosen: None }
    }

    /// Adds what samples of lights bring, of which all lobes together reflect so much.
    #[inline(always)]
    fn light_alike(
        &self,
        eight: &Eight,
        arrived: &Arrived,
        reflected: &Colours,
        lights: &EightSamples,
        out: &mut Outgoing,
    ) {
        let (points, self_hit) = (eight.points, self.scene.settings.self_hit);
        let [r, g, b] = &lights.le_over_pdf;
        let mut reflected = *reflected;
        for lane in 0..LANES {
            let le_over_pdf = Rgb::new(r[lane], g[lane], b[lane]);
            let seen = arrived.beta.get(lane) * reflected.get(lane);
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
}

impl Part<'_> {
    /// Keeps one ray of one of two lobes, where each has one that goes on, chosen in proportion to their albedos: as where each
    /// surface is by itself.
    #[inline(always)]
    fn choose(eight: &Eight, first: &mut Self, second: &mut Self) {
        let (Lobes::Diffuse(reflectance), Lobes::Power(powers)) = (first.lobes, second.lobes) else { return };
        if first.rays > 1 || second.rays > 1 || !first.leave.contains(&true) {
            return;
        }
        let ([x, y], of_second) = (eight.choice(), powers.albedo(eight.points));
        let mut rest = [Floats::default(); 2];
        for lane in 0..LANES {
            let weight = [reflectance.get(lane).max_channel(), of_second[lane]];
            let total = weight[0] + weight[1];
            let at = x[lane] * total;
            let is_second = (weight[1] > 0.0) & !((weight[0] > 0.0) & (at < weight[0]));
            for (number, part) in [&mut *first, &mut *second].into_iter().enumerate() {
                let is_this = (is_second == (number == 1)) & (total > 0.0);
                part.rate[lane] = if part.leave[lane] && total > 0.0 { weight[number] / total } else { 0.0 };
                part.leave[lane] &= is_this;
            }
            rest[0][lane] = within(at, 0.0, weight[0]);
            rest[1][lane] = within(at, weight[0], weight[1]);
        }
        (first.chosen, second.chosen) = (Some([rest[0], y]), Some([rest[1], y]));
    }

    /// Adds what the lobe reflects of samples of lights, by how much that counts beside its rays.
    #[inline(always)]
    fn reflect(
        &self,
        points: &Interactions,
        guides: &Guidance,
        lights: &EightSamples,
        reflected: &mut Colours,
    ) {
        let (f_cos, pdf) = self.lobes.evaluate(points, &lights.wi);
        let mut sum = *reflected;
        for lane in 0..LANES {
            let pdf = mix(guides.towards_light[lane], guides.own[lane], pdf[lane]);
            let weight = power_heuristic(lights.pdf[lane], pdf * self.rate[lane]);
            sum.set(lane, sum.get(lane) + f_cos.get(lane) * weight);
        }
        *reflected = sum;
    }
}

#[cfg(test)]
#[path = "alike_tests.rs"]
mod tests;
