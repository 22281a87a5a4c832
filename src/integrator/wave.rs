//! The wave loop: all paths of a wave take one step together.

use super::alike::Group;
use super::bounce::{Leaving, Reached};
use super::edges::{EmitterEdges, Looks};
use super::eight::{Lane, Likely};
use super::guide::Trail;
use super::order::{Order, kind_of};
use super::path::{Path, Rays, Vertex, Wave};
use super::roots::Roots;
use super::start::Start;
use super::tally::{RayClass, RayLog, Tally};
use super::vertex::{Outgoing, Seen};
use crate::accel::{Accelerator, Coherence};
use crate::bxdf::{Bsdf, Bxdf};
use crate::core::lanes::LANES;
use crate::core::{Hit, Ray, Rgb, Wide, widely};
use crate::film::Film;
use crate::guiding::{GuideMap, Guides};
use crate::scene::{
    AtMaxDepth, EightSamples, IndirectGuiding, LightSamples, Material, Plan, Rivals, Scene, Settings,
};
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

/// Paths in a wave, at most.
///
/// Memory is bounded by this times the depth, whatever the numbers of samples.
const CAPACITY: usize = 4096;

/// Radiance of camera samples, by waves of rays.
pub struct Integrator<'a> {
    pub(super) scene: &'a Scene,
    pub(super) accel: &'a dyn Accelerator,
    /// Whether surfaces sample lights beside each kind of [`Rivals`].
    pub(super) samples_lights: [bool; 3],
    /// The lobes of each material, where they are the same at all points.
    pub(super) bsdfs: Vec<Option<Bsdf>>,
    /// The kind of each geometry: see [`kind_of`].
    kinds: Vec<u8>,
    /// The first two lobes of each geometry, where they are the same everywhere.
    pub(super) lobes: Vec<[Option<Bxdf>; 2]>,
    /// Whether there is a material that shows ambient light.
    pub(super) has_ambient: bool,
    /// Whether surfaces that are alike may be shaded side by side.
    pub(super) alike: bool,
    /// What surfaces are likely to need.
    pub(super) likely: Likely,
    /// Where surfaces look for light, if guides are any.
    pub(super) guides: Option<&'a Guides>,
    /// Whether they look for all light that surfaces reflect, and not for caustics alone.
    pub(super) guides_indirect: bool,
    /// Where samples of lights look for the environment through portals, if there are any.
    pub(super) portals: Option<&'a GuideMap>,
    /// Where edges of emitters are seen, if any are to be found by rays of their own.
    pub(super) edges: Option<&'a EmitterEdges>,
    pub(super) capacity: usize,
    /// Which of all sequences the samplers draw.
    pub(super) seed: u32,
    /// Whether the first hit on anything but a mirror splits, and not the first glossy one.
    pub(super) splits_any: bool,
    /// Whether a hit that splits takes as many samples of lights as rays leave it.
    pub(super) splits_lights: bool,
    /// Candidates of which each sample of lights at a glossy hit is one.
    pub(super) light_candidates: u32,
    /// Reflections from which on paths end by chance.
    pub(super) roulette_from: u32,
    pub(super) log: Option<&'a dyn RayLog>,
}

/// Samples to be taken.
#[derive(Clone, Debug)]
pub struct Work<'a> {
    /// Of which pixels of the image, in the order of [`z_order`](super::z_order).
    pub pixels: &'a [(u32, u32)],
    /// Which samples of each.
    pub samples: Range<u32>,
    /// Rays that leave a path's first glossy hit, or its first hit on anything but a mirror where the settings say
    /// [so](crate::scene::GlossySamples::splits_any).
    pub split: u32,
}

/// Buffers that one thread keeps from tile to tile, so that nothing is allocated per ray.
#[derive(Default)]
pub struct Scratch {
    roots: Roots,
    wave: Wave,
    next: Wave,
    hits: Vec<Option<Hit>>,
    order: Order,
    shadows: Shadows,
    looks: Looks,
    waiting: Waiting,
    /// What denoisers are told of each root; empty where nobody asks.
    trails: Vec<Trail>,
}

/// Shadow rays and the light that each lets through.
#[derive(Default)]
pub(super) struct Shadows {
    rays: Vec<Ray>,
    light: Vec<(u32, Rgb)>,
    occluded: Vec<bool>,
}

impl Shadows {
    /// Adds `radiance` to the camera sample `slot` if nothing is in the way of `ray`.
    #[inline]
    pub(super) fn push(&mut self, slot: u32, radiance: Rgb, ray: Ray) {
        self.rays.push(ray);
        self.light.push((slot, radiance));
    }
}

/// Vertices with more rays than the next wave had room for: a list per depth of splitting, the deepest last.
#[derive(Default)]
struct Waiting {
    lists: Vec<Vec<Vertex>>,
    /// Emptied lists, to be filled again.
    spare: Vec<Vec<Vertex>>,
}

impl Waiting {
    /// Forgets all vertices.
    fn clear(&mut self) {
        self.lists.iter_mut().for_each(Vec::clear);
        self.spare.append(&mut self.lists);
    }
}

impl<'a> Integrator<'a> {
    /// An integrator for a scene and the structure built from its shapes.
    pub fn new(scene: &'a Scene, accel: &'a dyn Accelerator) -> Self {
        let Settings { max_depth, at_max_depth, roulette_from, .. } = &scene.settings;
        let end = if *at_max_depth == AtMaxDepth::Roulette { *max_depth } else { Settings::NEVER };
        let bsdfs: Vec<_> = scene.materials.iter().map(Material::uniform_bsdf).collect();
        let planned = Plan::of(scene).samples_lights;
        let samples_lights = [Rivals::None, Rivals::Lobes, Rivals::Portals]
            .map(|rivals| planned && scene.lights.needs(rivals).direction);
        let of_geometries = || {
            let material = scene.geometries.iter().map(|geometry| geometry.material as usize);
            material.map(|material| (&scene.materials[material], bsdfs[material].as_ref()))
        };
        let kinds = of_geometries().map(|(material, _)| kind_of(material)).collect();
        let first_two = |bsdf: Option<&Bsdf>| [0, 1].map(|number| bsdf?.lobes().get(number).copied());
        let lobes = of_geometries().map(|(_, bsdf)| first_two(bsdf)).collect();
        Self {
            scene,
            accel,
            kinds,
            lobes,
            has_ambient: scene.materials.iter().any(|material| material.ambient.is_some()),
            alike: Self::shades_alike(scene),
            samples_lights,
            likely: Likely::of(scene, samples_lights, &bsdfs),
            bsdfs,
            guides: None,
            guides_indirect: scene.settings.indirect_guiding == IndirectGuiding::Always,
            portals: None,
            edges: None,
            capacity: CAPACITY,
            seed: scene.settings.seed,
            splits_any: scene.settings.glossy_samples.splits_any(),
            splits_lights: scene.settings.light_samples == LightSamples::Split,
            light_candidates: scene.settings.light_candidates.without_pilot(),
            roulette_from: (*roulette_from).min(end),
            log: None,
        }
    }

    /// Sends rays of wide lobes where `guides` lead.
    pub fn guided_by(mut self, guides: &'a Guides) -> Self {
        self.guides = Some(guides).filter(|guides| !guides.is_empty());
        self
    }

    /// Sends them to all light that surfaces reflect, or to caustics alone, whatever the settings say.
    pub fn guided_to_indirect(mut self, guided: bool) -> Self {
        self.guides_indirect = guided;
        self
    }

    /// Whether there are guides to all light that surfaces reflect.
    pub fn has_indirect_guides(&self) -> bool {
        self.guides.is_some_and(Guides::has_indirect)
    }

    /// Whether there are and they are followed.
    pub fn guides_indirect(&self) -> bool {
        self.guides_indirect && self.has_indirect_guides()
    }

    /// Looks for the environment through `portals`.
    pub fn through(mut self, portals: &'a GuideMap) -> Self {
        self.portals = Some(portals).filter(|portals| !portals.is_empty());
        self
    }

    /// Finds emitters by rays of their own in pixels where `edges` of some are seen.
    pub fn with_edges(mut self, edges: &'a EmitterEdges) -> Self {
        self.edges = Some(edges).filter(|edges| !edges.is_empty());
        self
    }

    /// Whether a hit that splits takes as many samples of lights as rays leave it, whatever the settings say.
    pub fn splitting_lights(mut self, splits: bool) -> Self {
        self.splits_lights = splits;
        self
    }

    /// Whether a hit that splits takes as many samples of lights as rays leave it.
    pub fn splits_lights(&self) -> bool {
        self.splits_lights
    }

    /// Chooses each sample of lights at a glossy hit among so many, whatever the settings say.
    pub fn with_light_candidates(mut self, count: u32) -> Self {
        self.light_candidates = count;
        self
    }

    /// Candidates of which each sample of lights at a glossy hit is one.
    pub fn light_candidates(&self) -> u32 {
        self.light_candidates
    }

    /// Whether lights are sampled at hits whose lobes look for light themselves.
    pub fn samples_lights(&self) -> bool {
        self.samples_lights[Rivals::Lobes as usize] || self.portals.is_some()
    }

    /// Draws other numbers than those of the settings' seed.
    pub fn with_seed(mut self, seed: u32) -> Self {
        self.seed = seed;
        self
    }

    /// Tells `log` of every ray.
    pub fn with_log(mut self, log: Option<&'a dyn RayLog>) -> Self {
        self.log = log;
        self
    }

    /// Adds the samples of `work` to a film that holds its pixels.
    ///
    /// Each sample's radiance depends on the scene, the settings, the pixel, the sample's number and the splitting
    /// alone. Returns early, with some of the samples done in full, when `stop` becomes true: the samples of a pixel
    /// are always done in the order of their numbers, and one that is not finished is taken back, since what
    /// follows from one camera ray may take hours where every hit splits.
    pub fn render(
        &self,
        film: &mut Film,
        work: &Work,
        scratch: &mut Scratch,
        tally: &mut Tally,
        stop: &AtomicBool,
    ) {
        // So that the rays of first hits that split find room together.
        let roots = (self.capacity / work.split.max(1) as usize / LANES).max(1) * LANES;
        let per_wave = (roots / work.pixels.len().max(1)).max(1) as u32;
        let mut first = work.samples.start;
        while first < work.samples.end {
            let last = work.samples.end.min(first.saturating_add(per_wave));
            for block in work.pixels.chunks(roots) {
                if stop.load(Ordering::Relaxed) {
                    return;
                }
                let block = Work { pixels: block, samples: first..last, ..*work };
                let Scratch { roots, wave, looks, .. } = &mut *scratch;
                widely(Start { integrator: self, rect: film.rect, work: &block, roots, wave, looks });
                self.find_emitters(looks, roots, tally);
                scratch.trails.clear();
                if !film.guides.is_empty() {
                    scratch.trails.resize(scratch.roots.len(), Trail::default());
                }
                if !self.trace(scratch, tally, stop) {
                    return;
                }
                tally.samples += scratch.roots.len() as u64;
                for (pixel, sum) in scratch.roots.sums() {
                    film.pixels[pixel].add(sum);
                }
                for ((pixel, sum), trail) in scratch.roots.sums().zip(&scratch.trails) {
                    film.guides[pixel].add(&trail.guide, sum);
                }
            }
            first = last;
        }
    }

    /// Follows the paths of the first wave to their ends, depth first where they split; false if `stop` came first.
    fn trace(&self, scratch: &mut Scratch, tally: &mut Tally, stop: &AtomicBool) -> bool {
        loop {
            if stop.load(Ordering::Relaxed) {
                scratch.next.clear();
                scratch.waiting.clear();
                return false;
            }
            widely(Step { integrator: self, scratch, tally });
            std::mem::swap(&mut scratch.wave, &mut scratch.next);
            scratch.next.clear();
            if scratch.wave.len() == 0 && !self.refill(scratch) {
                return true;
            }
        }
    }

    /// One step of all paths of the wave: where their rays go, what is there, and which rays leave.
    #[inline(always)]
    fn step(&self, scratch: &mut Scratch, tally: &mut Tally) {
        scratch.shadows.rays.clear();
        scratch.shadows.light.clear();
        let empty = scratch.waiting.spare.pop().unwrap_or_default();
        scratch.waiting.lists.push(empty);
        for class in [RayClass::Primary, RayClass::Glossy, RayClass::Diffuse] {
            self.ask(class, scratch, tally);
            self.shade_all(class, scratch, tally);
        }
        let Waiting { lists, spare } = &mut scratch.waiting;
        spare.extend(lists.pop_if(|list| list.is_empty()));
        self.let_light_through(&mut scratch.shadows, &mut scratch.roots, tally);
    }

    /// Asks for the hits of one class of the wave.
    fn ask(&self, class: RayClass, scratch: &mut Scratch, tally: &mut Tally) {
        let Scratch { wave, hits, .. } = scratch;
        self.intersect(class, &wave.classes[class as usize].rays, hits, tally);
    }

    /// Finds the hits of rays of a class.
    pub(super) fn intersect(
        &self,
        class: RayClass,
        rays: &[Ray],
        hits: &mut Vec<Option<Hit>>,
        tally: &mut Tally,
    ) {
        hits.clear();
        hits.resize(rays.len(), None);
        if rays.is_empty() {
            return;
        }
        let coherence = if class == RayClass::Primary { Coherence::Coherent } else { Coherence::Incoherent };
        self.log.inspect(|log| log.record(class, rays));
        tally.time(class, rays.len(), || self.accel.intersect(rays, coherence, hits));
    }

    /// Shades the hits of one class of the wave.
    #[inline(always)]
    fn shade_all(&self, class: RayClass, scratch: &mut Scratch, tally: &mut Tally) {
        let Scratch { roots, wave, next, hits, order, shadows, waiting, trails, .. } = scratch;
        let Rays { paths, rays } = &wave.classes[class as usize];
        let waiting = waiting.lists.last_mut().expect("each step begins with a list");
        let mut out = Outgoing { roots, next, waiting, shadows, trails, tally };
        order.sort(hits, &self.kinds);
        for (kind, rays_of_kind) in order.by_kind() {
            for (k, group) in rays_of_kind.chunks(LANES).enumerate() {
                if kind == Order::MISSED {
                    self.miss(group, paths, rays, &mut out);
                } else {
                    let next = &rays_of_kind[k * LANES + group.len()..];
                    self.scene.prefetch(|i| hits[*next.get(i)? as usize].as_ref());
                    self.shade_group((kind, group), paths, rays, hits, &mut out);
                }
            }
        }
    }

    /// Shades up to eight hits, by their numbers: what all of them need is computed side by side.
    #[inline(always)]
    fn shade_group(
        &self,
        (kind, group): (usize, &[u32]),
        paths: &[Path],
        rays: &[Ray],
        hits: &[Option<Hit>],
        out: &mut Outgoing,
    ) {
        let hit = |i: usize| hits[i].as_ref().expect("a group is of hits");
        // Lanes without a hit of their own repeat the first.
        let first = group[0] as usize;
        let (mut seen, mut from) = ([(&rays[first], hit(first)); LANES], [&paths[first]; LANES]);
        let mut samplers = [*out.roots.sampler(paths[first].slot); LANES];
        for (lane, &i) in group.iter().enumerate() {
            let i = i as usize;
            seen[lane] = (&rays[i], hit(i));
            from[lane] = &paths[i];
            samplers[lane] = *out.roots.sampler(paths[i].slot);
        }
        let points = self.scene.interactions(seen);
        let eight = self.draw_eight(&points, from, samplers, kind);
        let count = group.len();
        if self.reflect_alike(&mut Group { kind, seen, eight: &eight, count, out }) {
            return;
        }
        let drawn = |lane: usize| Lane { eight: &eight, lane };

        let (mut here, mut leaving) = ([const { None }; LANES], [Leaving::default(); LANES]);
        let mut bsdfs = [None; LANES];
        for ((lane, here), leaving) in (0..group.len()).zip(&mut here).zip(&mut leaving) {
            let (ray, hit) = seen[lane];
            bsdfs[lane] = self.look_at(&Seen { ray, hit, drawn: drawn(lane) }, here, leaving, out);
        }
        let mut lights = EightSamples::default();
        if self.samples_lights != [false; 3] || self.portals.is_some() {
            self.sample_lights(&eight, &bsdfs, (&leaving, 0), &mut lights);
            let most = leaving.iter().map(|leaving| leaving.light_samples).fold(1, u32::max);
            for number in 1..most {
                let mut more = EightSamples::default();
                self.sample_lights(&eight, &bsdfs, (&leaving, number), &mut more);
                for (lane, leaving) in leaving.iter().enumerate() {
                    if let Some(bsdf) = bsdfs[lane] {
                        let from = Reached { path: from[lane], point: &drawn(lane).point(), bsdf };
                        self.take_light(&from, leaving, more.get(lane), out);
                    }
                }
            }
        }
        for leaving in leaving.iter().filter(|leaving| leaving.light_candidates > 1) {
            out.tally.candidates += u64::from((leaving.light_candidates - 1) * leaving.light_samples);
        }
        let directions = self.draw_directions(&eight, &bsdfs, &leaving);
        for (lane, leaving) in leaving.iter_mut().enumerate() {
            if let Some(bsdf) = bsdfs[lane] {
                let ray = (drawn(lane), directions.get(lane));
                self.reflect(ray, bsdf, leaving, lights.get(lane), out);
            }
        }
    }

    /// Asks the shadow rays and adds the light of those that nothing stops.
    #[inline(always)]
    fn let_light_through(&self, shadows: &mut Shadows, roots: &mut Roots, tally: &mut Tally) {
        let Shadows { rays, light, occluded } = shadows;
        if rays.is_empty() {
            return;
        }
        occluded.clear();
        occluded.resize(rays.len(), false);
        self.log.inspect(|log| log.record(RayClass::Shadow, rays));
        tally.time(RayClass::Shadow, rays.len(), || {
            self.accel.occluded(rays, Coherence::Incoherent, occluded);
        });
        for (&(slot, radiance), &occluded) in light.iter().zip(&*occluded) {
            if !occluded {
                roots.add(slot, radiance, tally);
            }
        }
    }

    /// Fills an empty wave with rays that had to wait, the deepest first. Whether there were any.
    fn refill(&self, scratch: &mut Scratch) -> bool {
        let Scratch { roots, wave, waiting: Waiting { lists, spare }, .. } = scratch;
        while wave.len() < self.capacity
            && let Some(list) = lists.last_mut()
        {
            while wave.len() < self.capacity
                && let Some(vertex) = list.last_mut()
            {
                let (from, leaving) = vertex.parts();
                let sampler = roots.sampler(from.path.slot);
                self.make_rays(&from, leaving, sampler, None, wave);
                if vertex.leaving.remaining() == 0 {
                    list.pop();
                }
            }
            if list.is_empty() {
                spare.extend(lists.pop());
            }
        }
        wave.len() > 0
    }
}

/// [`Integrator::step`], to be compiled for wide instructions.
struct Step<'a, 'b> {
    integrator: &'a Integrator<'b>,
    scratch: &'a mut Scratch,
    tally: &'a mut Tally,
}

impl Wide for Step<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.integrator.step(self.scratch, self.tally);
    }
}

#[cfg(test)]
#[path = "wave_tests.rs"]
mod tests;
