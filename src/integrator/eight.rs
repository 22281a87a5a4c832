//! What eight surfaces need, found side by side.

use super::bounce::{Dimension, Leaving};
use super::guided::Guide;
use super::lobes::Lobes;
use super::order::Order;
use super::path::Path;
use super::portals::Portal;
use super::powers::Powers;
use super::wave::Integrator;
use crate::bxdf::{Bsdf, Bxdf, Conductor, Diffuse, Drawn, LobeKind};
use crate::core::lanes::{Floats, LANES, Vectors};
use crate::core::{Sampler, Wide, widely};
use crate::guiding::{Cell, CellNumbers, Guides};
use crate::scene::{DirectLight, Interactions, Needs, Rivals, Scene, SurfaceInteraction};
use std::borrow::Cow;

/// Eight surfaces that rays have hit, and what is drawn at nearly every one.
///
/// What is not at hand since none of the eight was thought to need it can be drawn for one alone: the numbers are the
/// same.
pub(super) struct Eight<'a> {
    /// Where they are.
    pub points: &'a Interactions,
    /// The paths that have come to them.
    pub from: [&'a Path; LANES],
    samplers: [Sampler; LANES],
    /// The direction of the first lobe's ray, where it is one; zeros where no ray leaves.
    pub lobe: Pairs,
    /// The numbers of the guides of rays.
    pub guides: [CellNumbers; LANES],
    /// Through which portals samples of lights look for the environment.
    pub portals: [Portal; LANES],
    /// Which lobe, and the direction of its ray; what lights want to know beyond their own pair.
    choice: Option<Pairs>,
    /// Which light, and the direction towards it.
    light: Option<Pairs>,
    /// Whether the path goes on, where the first lobe's ray is one.
    survival: Option<Pairs>,
}

/// A pair of numbers for each of eight surfaces: the first of all, then the second.
pub(super) type Pairs = [Floats; 2];

/// One of the eight.
#[derive(Clone, Copy)]
pub(super) struct Lane<'a> {
    pub eight: &'a Eight<'a>,
    pub lane: usize,
}

impl<'a> Lane<'a> {
    /// The path that has come to it.
    #[inline(always)]
    pub(super) fn path(self) -> &'a Path {
        self.eight.from[self.lane]
    }

    /// The numbers of the path's pixel.
    #[inline(always)]
    pub(super) fn sampler(self) -> &'a Sampler {
        &self.eight.samplers[self.lane]
    }

    /// Where it is.
    #[inline(always)]
    pub(super) fn point(self) -> SurfaceInteraction {
        self.eight.points.get(self.lane)
    }

    /// The numbers for the direction of the first lobe's ray, where it is one.
    #[inline(always)]
    pub(super) fn lobe(self) -> [f32; 2] {
        let [x, y] = &self.eight.lobe;
        [x[self.lane], y[self.lane]]
    }

    /// The numbers of the guides of rays.
    #[inline(always)]
    pub(super) fn guide(self) -> CellNumbers {
        self.eight.guides[self.lane]
    }

    /// Through which portals samples of lights look for the environment.
    #[inline(always)]
    pub(super) fn portal(self) -> Portal {
        self.eight.portals[self.lane]
    }

    /// Which lobe, and the direction of its ray.
    #[inline(always)]
    pub(super) fn choice(self) -> [f32; 2] {
        self.pair(&self.eight.choice, Dimension::Choice)
    }

    /// Whether the path goes on, where the first lobe's ray is one.
    #[inline(always)]
    pub(super) fn survival(self) -> f32 {
        self.pair(&self.eight.survival, Dimension::Survival)[0]
    }

    #[inline(always)]
    fn pair(self, drawn: &Option<Pairs>, dimension: Dimension) -> [f32; 2] {
        match drawn {
            Some([x, y]) => [x[self.lane], y[self.lane]],
            None => self.sampler().pair(self.path().index, dimension.at(self.path().depth)),
        }
    }
}

impl Eight<'_> {
    /// Which light, and the direction towards it.
    #[inline(always)]
    pub(super) fn light(&self) -> Pairs {
        match self.light {
            Some(light) => light,
            None => draw(Dimension::LightDirection, self.from, &self.samplers),
        }
    }

    /// Which lobe, and the direction of its ray.
    #[inline(always)]
    pub(super) fn choice(&self) -> Pairs {
        match self.choice {
            Some(choice) => choice,
            None => draw(Dimension::Choice, self.from, &self.samplers),
        }
    }

    /// Other pairs: those of each sampler at these indices.
    #[inline(always)]
    pub(super) fn draw_at(&self, dimension: Dimension, indices: [u32; LANES]) -> Pairs {
        dimension.draw(&self.samplers, indices, self.from.map(|path| path.depth))
    }

    /// The guide of the rays of the lobe in a lane.
    #[inline(always)]
    pub(super) fn guide<'b>(&self, maps: &'b Guides, lobes: &Lobes, lane: usize) -> Guide<Cow<'b, Cell>> {
        let Interactions { p, n, wo, .. } = self.points;
        Guide::of(maps, self.guides[lane], lobes.width(lane), (p.get(lane), n.get(lane), wo.get(lane)))
    }

    /// What lights want to know beyond their own pair.
    #[inline(always)]
    pub(super) fn fine(&self) -> Floats {
        let [_, fine] = self.choice();
        fine
    }
}

/// The numbers of eight paths.
#[inline(always)]
fn draw(dimension: Dimension, from: [&Path; LANES], samplers: &[Sampler; LANES]) -> Pairs {
    let (mut indices, mut depths) = ([0; LANES], [0; LANES]);
    for (lane, path) in from.into_iter().enumerate() {
        (indices[lane], depths[lane]) = (path.index, path.depth);
    }
    dimension.draw(samplers, indices, depths)
}

/// What surfaces are likely to need.
pub(super) struct Likely {
    /// Which lobe.
    choice: bool,
    /// For lights: where the path goes on, and where it is at its end.
    lights: [Needs; 2],
}

impl Likely {
    /// At surfaces of a scene with the lobes `bsdfs`, where they are the same everywhere.
    pub(super) fn of(scene: &Scene, samples_lights: [bool; 3], bsdfs: &[Option<Bsdf>]) -> Self {
        let lobes = || bsdfs.iter().map(|bsdf| bsdf.as_ref().map(|bsdf| bsdf.lobes()));
        let lobes_look = scene.settings.direct_light == DirectLight::Mis;
        let rivals = if lobes_look { Rivals::Lobes } else { Rivals::None };
        let needs = |rivals| {
            if samples_lights[rivals as usize] { scene.lights.needs(rivals) } else { Needs::default() }
        };
        Self {
            choice: lobes().any(|lobes| lobes.is_none_or(|lobes| lobes.len() > 1)),
            lights: [needs(rivals), needs(Rivals::None)],
        }
    }
}

impl Integrator<'_> {
    /// What is needed at eight points of surfaces of a kind, to which the paths `from` have come.
    #[inline(always)]
    pub(super) fn draw_eight<'a>(
        &self,
        points: &'a Interactions,
        from: [&'a Path; LANES],
        samplers: [Sampler; LANES],
        kind: usize,
    ) -> Eight<'a> {
        let lasts = from.iter().filter(|path| self.is_last(path)).count();
        let goes_on = lasts < LANES && kind != Order::BLACK;
        let mut guides = [CellNumbers::NONE; LANES];
        if let Some(maps) = self.guides
            && goes_on
            && Order::may_be_guided(kind)
        {
            guides = widely(Find { maps, points, indirect: self.guides_indirect });
        }

        let mut portals = [Portal::default(); LANES];
        if let Some(map) = self.portals
            && Order::may_be_wide(kind)
        {
            portals = map.find(&points.p, &points.n).map(Portal::new);
        }

        let may_end = goes_on && from.iter().any(|path| path.depth >= self.roulette_from);
        let needs = if Order::takes_light(kind) {
            self.likely.lights[usize::from(lasts > 0)]
        } else {
            Needs::default()
        };
        let mut lobe = Pairs::default();
        if goes_on || self.scene.settings.direct_light == DirectLight::Lobe {
            lobe = draw(Dimension::Lobe(0), from, &samplers);
        }
        let [mut choice, mut light, mut survival] = [None; 3];
        if self.likely.choice && Order::may_choose(kind) || needs.fine {
            choice = Some(draw(Dimension::Choice, from, &samplers));
        }
        if needs.direction {
            light = Some(draw(Dimension::LightDirection, from, &samplers));
        }
        if may_end {
            survival = Some(draw(Dimension::Survival, from, &samplers));
        }
        Eight { points, from, samplers, lobe, guides, portals, choice, light, survival }
    }

    /// The directions of the rays that leave eight surfaces with these lobes, where each is the only one and its lobe is
    /// diffuse, a rough metal's or a cosine power.
    #[inline(always)]
    pub(super) fn draw_directions(
        &self,
        eight: &Eight,
        bsdfs: &[Option<&Bsdf>; LANES],
        leaving: &[Leaving; LANES],
    ) -> Directions {
        let ([mut x, mut y, mut alpha], mut powers) = ([Floats::default(); 3], Powers::default());
        let [mut diffuse, mut metal, mut power] = [[false; LANES]; 3];
        for (lane, leaving) in leaving.iter().enumerate() {
            let drawn = Lane { eight, lane };
            let Some(bsdf) = bsdfs[lane] else { continue };
            let Some((lobe, u)) = leaving.only(drawn.lobe()) else { continue };
            [x[lane], y[lane]] = u;
            match bsdf.lobe(lobe) {
                Bxdf::Diffuse(_) => diffuse[lane] = true,
                bxdf @ Bxdf::Conductor(lobe) if bxdf.kind() == LobeKind::Glossy => {
                    metal[lane] = true;
                    alpha[lane] = lobe.alpha;
                }
                Bxdf::CosinePower(lobe) if Powers::takes(lobe) => {
                    power[lane] = true;
                    powers.set(lane, lobe);
                }
                _ => continue,
            }
            // Where the number asks a guide, nobody looks at what it would draw from the lobe.
            let point = drawn.point();
            if let Some(guide) = self.guide(leaving.guide, bsdf.lobe(lobe), point.p, &point.at) {
                x[lane] = guide.unguided(x[lane]);
            }
        }
        let mut directions = Directions::default();
        if diffuse.contains(&true) {
            directions = Directions::diffuse(eight.points, &[x, y]);
        }
        if metal.contains(&true) {
            directions.take(&Directions::metal(eight.points, &alpha, &[x, y]), &metal);
        }
        if power.contains(&true) {
            let powers = powers.draw(eight.points, &[x, y]);
            directions.take(&powers, &power);
        }
        for lane in 0..LANES {
            directions.there[lane] = diffuse[lane] | metal[lane] | power[lane];
        }
        directions
    }
}

/// The guides of eight points, to be compiled for wide instructions apart from what all scenes need.
struct Find<'a> {
    maps: &'a Guides,
    points: &'a Interactions,
    /// Whether those to other light than caustics are wanted.
    indirect: bool,
}

impl Wide for Find<'_> {
    type Output = [CellNumbers; LANES];

    #[inline(always)]
    fn run(self) -> Self::Output {
        self.maps.find(&self.points.p, &self.points.n, self.indirect)
    }
}

/// Directions of eight rays, where they are known.
#[derive(Clone, Copy, Default)]
pub(super) struct Directions {
    pub wi: Vectors,
    pub weight: Floats,
    pub cos_half: Floats,
    pub pdf: Floats,
    there: [bool; LANES],
}

impl Directions {
    /// Those that the numbers `u` draw from diffuse lobes of eight points.
    #[inline(always)]
    pub(super) fn diffuse(points: &Interactions, [x, y]: &Pairs) -> Self {
        let Interactions { n, ng, .. } = *points;
        let mut directions = Self::default();
        for lane in 0..LANES {
            let (n, ng) = (n.get(lane), ng.get(lane));
            directions.set(lane, Diffuse::draw(n, ng, [x[lane], y[lane]]));
        }
        directions
    }

    /// Those that the numbers `u` draw from rough metals at eight points.
    #[inline(always)]
    pub(super) fn metal(points: &Interactions, alpha: &Floats, [x, y]: &Pairs) -> Self {
        let (at, mut directions) = (points.incidences(), Self::default());
        for lane in 0..LANES {
            directions.set(lane, Conductor::draw(alpha[lane], &at.get(lane), [x[lane], y[lane]]));
        }
        directions
    }

    #[inline(always)]
    pub(super) fn set(&mut self, lane: usize, drawn: Drawn) {
        self.wi.set(lane, drawn.wi);
        (self.weight[lane], self.cos_half[lane], self.pdf[lane]) = (drawn.weight, drawn.cos_half, drawn.pdf);
    }

    #[inline(always)]
    fn of_lane(&self, lane: usize) -> Drawn {
        Drawn {
            wi: self.wi.get(lane),
            weight: self.weight[lane],
            cos_half: self.cos_half[lane],
            pdf: self.pdf[lane],
        }
    }

    /// Takes over what others are in some `lanes`.
    #[inline(always)]
    fn take(&mut self, others: &Self, lanes: &[bool; LANES]) {
        for lane in 0..LANES {
            let of = if lanes[lane] { others } else { &*self };
            self.set(lane, of.of_lane(lane));
        }
    }

    /// The direction in a lane.
    #[inline(always)]
    pub(super) fn get(&self, lane: usize) -> Option<Drawn> {
        self.there[lane].then(|| self.of_lane(lane))
    }
}
