//! Named sets of settings.

use super::settings::{
    AtMaxDepth, DirectLight, GlossySamples, IndirectGuiding, LightCandidates, LightSamples, Occlusion,
    SelfHit, Settings,
};
use crate::bxdf::Horizon;
use crate::core::SamplerKind;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A named set of settings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Preset {
    /// The lecture's: 9 rays per pixel and 9 per glossy hit, however deep; depth 5, black beyond.
    Lecture,
    /// The textbook's: 100 rays per pixel and one per glossy hit; depth 5, black beyond (Suffern 2007, *Ray Tracing
    /// from the Ground Up*, chapter 25).
    Suffern,
    /// The default of each setting: no policy here darkens or loses light that the scene has.
    #[default]
    Accurate,
}

impl Preset {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Lecture, Self::Suffern, Self::Accurate];

    /// What it stands for.
    ///
    /// The lecture and the textbook light diffuse surfaces by lights only, and show a point light in a glossy
    /// surface by a Phong highlight that is a material of its own, so both switch the other off.
    pub fn settings(self) -> Settings {
        let textbook = Settings {
            spp: 100,
            max_depth: 5,
            at_max_depth: AtMaxDepth::Black,
            roulette_from: Settings::NEVER,
            glossy_samples: GlossySamples::First(1),
            horizon: Horizon::Fold,
            self_hit: SelfHit::Offset,
            direct_light: DirectLight::Mis,
            light_samples: LightSamples::One,
            light_candidates: LightCandidates::Fixed(1),
            diffuse_bounces: false,
            guiding: false,
            indirect_guiding: IndirectGuiding::Never,
            portals: false,
            emitter_edges: false,
            split_glass: false,
            highlights: false,
            clamp_indirect: None,
            adaptive: false,
            aovs: vec![],
            occlusion: Occlusion::Exact,
            sampler: SamplerKind::Sobol,
            seed: 0,
        };
        match self {
            Self::Lecture => Settings {
                spp: 9,
                glossy_samples: GlossySamples::Branch { branch: 9 },
                self_hit: SelfHit::Geometry,
                ..textbook
            },
            Self::Suffern => textbook,
            Self::Accurate => Settings::default(),
        }
    }
}
