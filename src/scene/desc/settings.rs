//! How to render, as far as the file says so.

use crate::bxdf::Horizon;
use crate::core::SamplerKind;
use crate::scene::preset::Preset;
use crate::scene::settings::{
    Aov, AtMaxDepth, DirectLight, GlossySamples, IndirectGuiding, LightCandidates, LightSamples, Occlusion,
    SelfHit, Settings,
};
use schemars::JsonSchema;
use serde::Deserialize;

/// How to render; what is left out is the preset's.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields, expecting = "a table")]
pub struct SettingsDesc {
    /// Where the rest comes from.
    pub preset: Preset,
    /// Camera samples per pixel.
    pub spp: Option<u32>,
    /// Reflected bounces.
    pub max_depth: Option<u32>,
    /// What a path sees beyond them.
    pub at_max_depth: Option<AtMaxDepth>,
    /// From this many reflections on dim paths end by chance, and those that go on stand for them; a number beyond
    /// `max_depth` for never.
    pub roulette_from: Option<u32>,
    /// Rays per glossy hit: a number for the first one on a path, a list for the first, second, ... or
    /// `{ branch = n }` for every one; `auto` measures how many pay.
    pub glossy_samples: Option<GlossySamples>,
    /// What becomes of glossy directions below the surface, for materials that do not say.
    pub horizon: Option<Horizon>,
    /// Against hitting the surface that a ray leaves.
    pub self_hit: Option<SelfHit>,
    /// How direct light is found.
    pub direct_light: Option<DirectLight>,
    /// Samples of lights per hit.
    pub light_samples: Option<LightSamples>,
    /// Candidates of which each sample of lights at a glossy hit is one; `auto` lets a pilot choose.
    pub light_candidates: Option<LightCandidates>,
    /// Whether diffuse surfaces see other surfaces or only lights.
    pub diffuse_bounces: Option<bool>,
    /// Whether surfaces send part of the rays of diffuse and of wide glossy lobes where photons say that caustics come from: unbiased.
    pub guiding: Option<bool>,
    /// Whether diffuse ones also send part of their rays where other light comes from that surfaces reflect; `auto` lets a pilot
    /// choose: unbiased.
    pub indirect_guiding: Option<IndirectGuiding>,
    /// Whether part of the samples of lights look for the environment through portals, where little of it is seen: unbiased.
    pub portals: Option<bool>,
    /// Whether edges of emitters that the camera sees get camera rays of their own, which are not shaded: unbiased.
    pub emitter_edges: Option<bool>,
    /// Whether paths go both ways at glass, as long as each way carries enough, and not by chance one: unbiased.
    pub split_glass: Option<bool>,
    /// Whether lights are sampled for glossy lobes; without, those show the mean of what their rays see.
    pub highlights: Option<bool>,
    /// The most radiance that light that was reflected more than once may bring a sample, per way that it took: less
    /// noise, and a picture that is too dark. Off where it is not given.
    pub clamp_indirect: Option<f32>,
    /// Whether noisy pixels get more of the samples than others: of those beyond 4 per pixel.
    pub adaptive: Option<bool>,
    /// Pictures beside the picture, in the EXR: `albedo`, `normal`, `depth`, `variance`.
    pub aovs: Option<Vec<Aov>>,
    /// How much of what hides the environment glossy reflections heed: all but `exact` are approximations.
    pub occlusion: Option<Occlusion>,
    /// Which numbers are drawn.
    pub sampler: Option<SamplerKind>,
    /// Which of all their sequences.
    pub seed: Option<u32>,
}

impl SettingsDesc {
    /// The preset's settings with all that is written put in their place.
    pub fn resolve(&self) -> Settings {
        let preset = self.preset.settings();
        Settings {
            spp: self.spp.unwrap_or(preset.spp),
            max_depth: self.max_depth.unwrap_or(preset.max_depth),
            at_max_depth: self.at_max_depth.unwrap_or(preset.at_max_depth),
            roulette_from: self.roulette_from.unwrap_or(preset.roulette_from),
            glossy_samples: self.glossy_samples.clone().unwrap_or(preset.glossy_samples),
            horizon: self.horizon.unwrap_or(preset.horizon),
            self_hit: self.self_hit.unwrap_or(preset.self_hit),
            direct_light: self.direct_light.unwrap_or(preset.direct_light),
            light_samples: self.light_samples.unwrap_or(preset.light_samples),
            light_candidates: self.light_candidates.unwrap_or(preset.light_candidates),
            diffuse_bounces: self.diffuse_bounces.unwrap_or(preset.diffuse_bounces),
            highlights: self.highlights.unwrap_or(preset.highlights),
            clamp_indirect: self.clamp_indirect.or(preset.clamp_indirect),
            guiding: self.guiding.unwrap_or(preset.guiding),
            indirect_guiding: self.indirect_guiding.unwrap_or(preset.indirect_guiding),
            portals: self.portals.unwrap_or(preset.portals),
            emitter_edges: self.emitter_edges.unwrap_or(preset.emitter_edges),
            split_glass: self.split_glass.unwrap_or(preset.split_glass),
            adaptive: self.adaptive.unwrap_or(preset.adaptive),
            aovs: self.aovs.clone().unwrap_or(preset.aovs),
            occlusion: self.occlusion.unwrap_or(preset.occlusion),
            sampler: self.sampler.unwrap_or(preset.sampler),
            seed: self.seed.unwrap_or(preset.seed),
        }
    }
}
