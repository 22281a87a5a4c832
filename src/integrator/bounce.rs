//! Which rays leave a surface: the choice among its lobes, splitting, and the end of a path.

use super::eight::Lane;
use super::guided::{self, GuidedSample};
use super::path::{Path, Wave};
use super::portals::Portal;
use super::tally::{RayClass, Tally};
use super::wave::Integrator;
use crate::bxdf::{Bsdf, Bxdf, Drawn, Incidence, LobeKind};
use crate::core::lanes::{Floats, LANES};
use crate::core::{Rgb, Sampler, warp};
use crate::guiding::CellNumbers;
use crate::scene::{AtMaxDepth, DirectLight, Rivals, SurfaceInteraction};

/// Pairs of random numbers, by the depth of the surface and what they decide there.
///
/// Pair 0 belongs to the camera; each surface has [`Dimension::PER_VERTEX`] of its own.
#[derive(Clone, Copy)]
pub(super) enum Dimension {
    /// The direction drawn from the lobe of this number: three of them.
    Lobe(usize),
    /// Which lobe is chosen among several, and the direction drawn from it.
    Choice,
    /// Which light, and the direction towards it.
    LightDirection,
    /// Whether the path goes on.
    Survival,
    /// The rays that stand for the visibility of the environment.
    Occlusion,
    /// The camera rays that look for emitters: at no surface, of depth 0.
    Emitters,
    /// Which candidate becomes a sample of lights.
    Candidate,
}

impl Dimension {
    const PER_VERTEX: u32 = 6;

    /// The pair's number at a surface at `depth`.
    #[inline]
    pub(super) fn at(self, depth: u32) -> u32 {
        let offset = match self {
            Self::Lobe(lobe) => lobe as u32,
            Self::Choice => 3,
            Self::LightDirection => 4,
            Self::Survival => 5,
            // Beyond all others, so that they stay what they are.
            Self::Occlusion => return 0x8000_0000 + depth,
            Self::Emitters => return 0x4000_0000 + depth,
            Self::Candidate => return 0x2000_0000 + depth,
        };
        1 + depth * Self::PER_VERTEX + offset
    }

    /// The pairs of eight surfaces, each at its own depth.
    #[inline(always)]
    pub(super) fn draw(
        self,
        samplers: &[Sampler; LANES],
        indices: [u32; LANES],
        depths: [u32; LANES],
    ) -> [Floats; 2] {
        let mut dimensions = [0; LANES];
        for lane in 0..LANES {
            dimensions[lane] = self.at(depths[lane]);
        }
        Sampler::pairs(samplers.each_ref(), indices, dimensions)
    }
}

/// A surface that a path has reached.
#[derive(Clone, Copy)]
pub(super) struct Reached<'a> {
    /// The path that came.
    pub path: &'a Path,
    /// Where it came to.
    pub point: &'a SurfaceInteraction,
    /// What is there.
    pub bsdf: &'a Bsdf,
}

/// The rays that leave a surface, lobe by lobe.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Leaving {
    /// Rays of each lobe.
    pub count: [u32; Bsdf::MAX_LOBES],
    /// Expected number of rays of each lobe: what their weight is divided by. Zero for a lobe without rays.
    pub rate: [f32; Bsdf::MAX_LOBES],
    /// Whether each lobe's rays look for lights only.
    pub emission_only: [bool; Bsdf::MAX_LOBES],
    /// The numbers for the ray of the lobe that was chosen, if one was.
    chosen: Option<[f32; 2]>,
    /// Samples of lights.
    pub light_samples: u32,
    /// Candidates of which each of them is one.
    pub light_candidates: u32,
    /// Who looks for light beside samples of lights: the lobes, where each that takes light from lights has rays that may
    /// find it.
    pub rivals: Rivals,
    /// The lobe whose first ray shows what the camera sample shows.
    pub followed: Option<usize>,
    /// The guides of the rays, if they have any.
    pub guide: CellNumbers,
    /// Through which portals samples of lights look for the environment.
    pub portal: Portal,
    /// The next ray to be made: its lobe and its number there.
    next: (usize, u32),
}

impl Leaving {
    fn trace(&mut self, lobe: usize, count: u32, rate: f32) {
        self.count[lobe] = count;
        self.rate[lobe] = rate;
    }

    /// Keeps one of the lobes whose rays go on, chosen in proportion to its albedo by the first number of `choice`.
    ///
    /// What is left of that number and the second one draw the direction: so those of each lobe are spread as well as
    /// the pairs are.
    #[inline(never)]
    fn choose_one(&mut self, at: &Incidence, bsdf: &Bsdf, choice: [f32; 2]) {
        let mut weight = [0.0; Bsdf::MAX_LOBES];
        for (lobe, bxdf) in bsdf.lobes().iter().enumerate() {
            if self.count[lobe] > 0 && !self.emission_only[lobe] {
                weight[lobe] = bxdf.albedo(at).max_channel();
                self.trace(lobe, 0, 0.0);
            }
        }
        let total: f32 = weight.iter().sum();
        if total > 0.0 {
            self.rate =
                std::array::from_fn(
                    |lobe| {
                        if weight[lobe] > 0.0 { weight[lobe] / total } else { self.rate[lobe] }
                    },
                );
            let (lobe, rest) = choose(&weight, choice[0] * total);
            self.count[lobe] = 1;
            self.chosen = Some([rest, choice[1]]);
        }
    }

    /// The lobe of the only ray and its numbers, where they are `first`, those of the first lobe, or were left by the choice.
    #[inline(always)]
    pub(super) fn only(&self, first: [f32; 2]) -> Option<(usize, [f32; 2])> {
        let lobe = match self.count {
            [1, 0, 0] => 0,
            [0, 1, 0] => 1,
            [0, 0, 1] => 2,
            _ => return None,
        };
        match self.chosen {
            Some(chosen) if !self.emission_only[lobe] => Some((lobe, chosen)),
            _ => (lobe == 0).then_some((lobe, first)),
        }
    }

    /// Rays not yet made.
    #[inline(always)]
    pub(super) fn remaining(&self) -> usize {
        self.count.iter().skip(self.next.0).sum::<u32>() as usize - self.next.1 as usize
    }

    /// Lobe and number of the next ray.
    #[inline(always)]
    fn take(&mut self) -> Option<(usize, u32)> {
        while self.next.0 < Bsdf::MAX_LOBES {
            let (lobe, number) = self.next;
            if number < self.count[lobe] {
                self.next.1 += 1;
                return Some((lobe, number));
            }
            self.next = (lobe + 1, 0);
        }
        None
    }
}

impl Integrator<'_> {
    /// Decides which rays leave a surface that `path` has reached, of which `leaving` has none yet.
    ///
    /// A lobe that splits gets its rays and every other lobe one, as do both ways of glass while each [carries
    /// enough](Self::goes_all_ways); otherwise one lobe is chosen, by the two numbers of `choice` in `[0, 1)`, in proportion to
    /// its albedo.
    #[inline(always)]
    pub(super) fn plan_rays(
        &self,
        path: &Path,
        at: &Incidence,
        bsdf: &Bsdf,
        choice: impl FnOnce() -> [f32; 2],
        leaving: &mut Leaving,
    ) {
        let (mut lobes, mut split) = (0, 1);
        for (lobe, bxdf) in bsdf.lobes().iter().enumerate() {
            if self.continues(path, bxdf) {
                lobes += 1;
                let rays = self.rays_of(path, bxdf.kind());
                split = split.max(rays);
                leaving.trace(lobe, rays, rays as f32);
            } else if bxdf.kind() == LobeKind::Diffuse
                && self.scene.settings.direct_light == DirectLight::Lobe
            {
                leaving.trace(lobe, 1, 1.0);
                leaving.emission_only[lobe] = true;
            }
        }
        leaving.light_samples =
            self.light_samples_of(bsdf.lobes().iter().map(|bxdf| self.rays_of(path, bxdf.kind())));
        leaving.light_candidates = self.light_candidates_at(path, at, bsdf);
        if lobes > 1 && split == 1 && !self.goes_all_ways(path, at, bsdf) {
            leaving.choose_one(at, bsdf, choice());
        }
        let lobes_look = self.scene.settings.direct_light == DirectLight::Mis
            && bsdf
                .lobes()
                .iter()
                .zip(leaving.rate)
                .all(|(bxdf, rate)| rate > 0.0 || !self.takes_light(bxdf));
        leaving.rivals = Self::rivals(lobes_look, leaving.portal);
    }

    /// Rays of a lobe of this kind that leave a hit of `path`.
    #[inline(always)]
    pub(super) fn rays_of(&self, path: &Path, kind: LobeKind) -> u32 {
        match kind {
            LobeKind::Delta => 1,
            LobeKind::Diffuse => {
                if self.splits_any {
                    path.split
                } else {
                    1
                }
            }
            LobeKind::Glossy if self.splits_any || path.glossy_depth == 0 => path.split,
            LobeKind::Glossy => self.scene.settings.glossy_samples.at(path.glossy_depth),
        }
    }

    /// Whether a ray of each lobe leaves a surface without splitting: of glass, as long as each way carries enough.
    #[inline]
    fn goes_all_ways(&self, path: &Path, at: &Incidence, bsdf: &Bsdf) -> bool {
        let carries = |bxdf: &Bxdf| (path.beta * bxdf.albedo(at)).max_channel() >= LEAST_WAY;
        self.scene.settings.split_glass
            && path.depth < LAST_TO_SPLIT
            && bsdf.lobes().iter().all(|bxdf| bxdf.kind() == LobeKind::Delta && carries(bxdf))
    }

    /// Whether a ray of this lobe may leave the surface that `path` has reached.
    fn continues(&self, path: &Path, bxdf: &Bxdf) -> bool {
        !self.is_last(path)
            && !self.approximates(bxdf)
            && (bxdf.kind() != LobeKind::Diffuse || self.scene.settings.diffuse_bounces)
    }

    /// Whether `path` may not go beyond the surface that it has reached.
    pub(super) fn is_last(&self, path: &Path) -> bool {
        let settings = &self.scene.settings;
        path.depth >= settings.max_depth && settings.at_max_depth != AtMaxDepth::Roulette
    }

    /// What a path sees that may not go on ([`is_last`](Self::is_last)): nothing, which is counted, or the environment.
    pub(super) fn end(
        &self,
        path: &Path,
        at: &Incidence,
        bsdf: &Bsdf,
        sampler: &Sampler,
        tally: &mut Tally,
    ) -> Rgb {
        let mut seen = Rgb::BLACK;
        let settings = &self.scene.settings;
        for (lobe, bxdf) in bsdf.lobes().iter().enumerate() {
            if bxdf.kind() == LobeKind::Diffuse {
                if settings.diffuse_bounces {
                    tally.lose(path.beta * bxdf.albedo(at));
                }
            } else if let (AtMaxDepth::Background, Some(environment)) =
                (settings.at_max_depth, &self.scene.lights.environment)
            {
                let u = sampler.pair(path.index, Dimension::Lobe(lobe).at(path.depth));
                if let Some(sample) = bxdf.sample(at, u) {
                    seen += path.beta * sample.weight * environment.le(sample.wi);
                }
            } else {
                tally.lose(path.beta * bxdf.albedo(at));
            }
        }
        seen
    }

    /// Makes rays that leave a surface until there are no more or the wave is full.
    ///
    /// `drawn` is what was drawn at the surface, and the direction of its [only](Leaving::only) ray, where they are at hand.
    #[inline(always)]
    pub(super) fn make_rays(
        &self,
        from: &Reached,
        leaving: &mut Leaving,
        sampler: &Sampler,
        drawn: Option<(Lane, Option<Drawn>)>,
        wave: &mut Wave,
    ) {
        let (drawn, direction) = drawn.unzip();
        let direction = direction.flatten();
        while wave.len() < self.capacity
            && let Some((lobe, number)) = leaving.take()
        {
            let index = from.path.index_of(number, leaving.count[lobe]);
            let at_hand = drawn.filter(|_| lobe == 0 && leaving.count[0] == 1);
            let chosen = leaving.chosen.filter(|_| !leaving.emission_only[lobe]);
            let depth = from.path.depth;
            let u = match (chosen, at_hand) {
                (Some(chosen), _) => chosen,
                (None, Some(drawn)) => drawn.lobe(),
                (None, None) => sampler.pair(index, Dimension::Lobe(lobe).at(depth)),
            };
            let survival = || match at_hand {
                Some(drawn) => drawn.survival(),
                None => sampler.single(index, Dimension::Survival.at(depth)),
            };
            self.make_ray(from, leaving, (lobe, index), (u, direction), survival, wave);
        }
    }

    /// Adds the ray of a lobe that the numbers `u` stand for, unless it ends here; see [`guided::sample`] for `drawn`.
    #[inline(always)]
    fn make_ray(
        &self,
        from: &Reached,
        leaving: &Leaving,
        (lobe, index): (usize, u32),
        (u, drawn): ([f32; 2], Option<Drawn>),
        survival: impl FnOnce() -> f32,
        wave: &mut Wave,
    ) {
        let Reached { path, point, bsdf } = from;
        let settings = &self.scene.settings;
        let (bxdf, rate) = (bsdf.lobe(lobe), leaving.rate[lobe]);
        let guide = self.guide(leaving.guide, bxdf, point.p, &point.at);
        let Some(GuidedSample { sample, favour }) = guided::sample(bxdf, &point.at, guide, u, drawn) else {
            return;
        };
        let mut beta = path.beta * sample.weight * rate.recip();
        let favour = path.favour * favour;
        // Before the greatest depth, what a mirror shows stays as clean as it is.
        let must_end = path.depth >= settings.max_depth;
        let may_end = path.depth >= self.roulette_from && (must_end || bxdf.kind() != LobeKind::Delta);
        if may_end && !leaving.emission_only[lobe] {
            // A survivor stands for those that were ended: Arvo and Kirk 1990.
            let share = share_of_survivors(beta, favour, most_survivors(must_end));
            if survival() >= share {
                return;
            }
            beta *= share.recip();
        }
        if beta.is_black() {
            return;
        }
        let glossy = bxdf.kind() == LobeKind::Glossy;
        let child = Path {
            beta,
            favour,
            slot: path.slot,
            index,
            depth: path.depth + 1,
            glossy_depth: path.glossy_depth + u32::from(glossy),
            split: if self.splits_any && bxdf.kind() != LobeKind::Delta { 1 } else { path.split },
            rate: if glossy && !settings.highlights {
                f32::INFINITY
            } else {
                sample.pdf / (leaving.light_samples * leaving.light_candidates) as f32 * rate
            },
            receiver_n: point.at.n,
            rivals: leaving.rivals,
            portal: leaving.portal,
            emission_only: leaving.emission_only[lobe],
            emission_apart: false,
            followed: leaving.followed == Some(lobe) && index == path.index_of(0, leaving.count[lobe]),
        };
        let class = if bxdf.kind() == LobeKind::Diffuse { RayClass::Diffuse } else { RayClass::Glossy };
        wave.push(class, child, point.spawn(sample.wi, f32::INFINITY, settings.self_hit));
    }
}

/// The throughput below which paths end by chance. At 1 each path would be in danger, and in bright rooms the few that
/// survive make more noise than the others save time.
const DIM: f32 = 1.0 / 3.0;

/// What a way from glass must carry of what the camera sample shows, for both ways to be followed: since the ways share it,
/// there are about a hundred at most.
const LEAST_WAY: f32 = 0.01;

/// The reflections after which paths go one way at glass, whatever it carries: where glass gives back more light than arrives, as
/// some is said to, ways would never get less.
const LAST_TO_SPLIT: u32 = 10;

/// However bright a path is, some of its kind must end, or a closed room of perfect mirrors would hold it for ever.
const MAX_SURVIVAL: f32 = 0.99;

/// The greatest share of paths that survives, where some must end or where none must.
#[inline(always)]
pub(super) fn most_survivors(must_end: bool) -> f32 {
    if must_end { MAX_SURVIVAL } else { 1.0 }
}

/// The share of paths of a weight that survives: what a guide has chosen for being bright is no less worth following for
/// being light.
#[inline(always)]
pub(super) fn share_of_survivors(beta: Rgb, favour: f32, most: f32) -> f32 {
    (beta.max_channel() * favour / DIM).min(most)
}

/// The first index at which the running sum of the weights exceeds `x`, the last that has a weight if none does; and how
/// far into its weight `x` is, in `[0, 1)`.
fn choose(weights: &[f32], x: f32) -> (usize, f32) {
    let mut before = 0.0;
    let mut chosen = (0, 0.0);
    for (i, &w) in weights.iter().enumerate().filter(|(_, w)| **w > 0.0) {
        chosen = (i, warp::within(x, before, w));
        before += w;
        if x < before {
            break;
        }
    }
    chosen
}
