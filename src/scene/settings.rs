//! How to render: every policy with its name, its default and, where it trades truth for speed, its price.

use crate::bxdf::Horizon;
use crate::core::SamplerKind;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Against hitting the surface that a ray leaves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum SelfHit {
    /// Skip the whole geometry that the ray leaves: the lecture's rule, right for convex things.
    Geometry,
    /// Skip the primitive that the ray leaves, and start at an error-bounded offset: right for every mesh.
    #[default]
    Primitive,
    /// The error-bounded offset alone.
    Offset,
}

/// What a path that may not be continued sees.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum AtMaxDepth {
    /// Nothing: the lecture's. The light lost is reported.
    Black,
    /// The environment, as if nothing were in the way.
    Background,
    /// There is no last bounce: from `max_depth` on a path survives with a probability, and with a weight that
    /// makes up for those that do not. Unbiased.
    #[default]
    Roulette,
}

/// Into how many rays a hit splits.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(
    untagged,
    deny_unknown_fields,
    expecting = "a whole number, a list of them, { any = whole number }, { branch = whole number } or \"auto\""
)]
pub enum GlossySamples {
    /// So many at the first glossy hit of a path, one at those after it.
    First(u32),
    /// So many at the first, second, ... glossy hit, one beyond the end of the list.
    PerDepth(Vec<u32>),
    /// So many at the first hit of a path that is no mirror, glossy or diffuse, one at those after it.
    Any {
        /// Rays of the hit.
        any: u32,
    },
    /// As many at the first hit that is no mirror, glossy or diffuse, as a pilot finds to be worth their time for the picture
    /// as a whole, one at those after it. The pilot tries 1 and 4 in one pixel of 128, and in 2048 at most.
    Auto(Auto),
    /// So many at every glossy hit: the lecture's exponential tree.
    Branch {
        /// Rays per hit.
        branch: u32,
    },
}

/// More rays than these at a first hit are never worth it: what is gained is less than the pilot's own error.
pub const MAX_AUTO_SPLIT: u32 = 8;

/// Samples that every pixel has before any are shared out.
pub const EVEN_SAMPLES: u32 = 4;

/// The word `auto`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Auto {
    /// The word itself.
    Auto,
}

impl GlossySamples {
    /// Rays at the glossy hit that is number `glossy_depth` (from 0) on its path.
    #[inline]
    pub fn at(&self, glossy_depth: u32) -> u32 {
        match self {
            Self::First(m) | Self::Any { any: m } => {
                if glossy_depth == 0 {
                    *m
                } else {
                    1
                }
            }
            Self::PerDepth(list) => list.get(glossy_depth as usize).copied().unwrap_or(1),
            Self::Auto(_) => 1,
            Self::Branch { branch } => *branch,
        }
    }

    /// Whether the first hit that is no mirror splits, whatever its lobe, and not the first glossy one.
    pub fn splits_any(&self) -> bool {
        matches!(self, Self::Any { .. } | Self::Auto(_))
    }
}

/// How many samples of lights a hit takes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum LightSamples {
    /// One, however many rays leave it.
    One,
    /// As many as rays leave it.
    Split,
    /// As a pilot finds to be better, where one finds out into how many rays hits split; else one.
    #[default]
    Auto,
}

/// Whether diffuse surfaces send part of their rays where most of the light that other surfaces reflect comes from: unbiased.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum IndirectGuiding {
    /// Never.
    Never,
    /// Wherever the light comes from few directions.
    Always,
    /// There too, if a pilot finds it to be better.
    #[default]
    Auto,
}

/// Candidates of which each sample of lights is one, at hits where glossy lobes reflect most of the light; kept by what the hit
/// would reflect of it: unbiased.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "a whole number or \"auto\"")]
pub enum LightCandidates {
    /// So many; 1 for samples as they are drawn.
    Fixed(u32),
    /// One or [four](Self::TRIED), as a pilot finds to be better, where one finds out into how many rays hits split; else one.
    Auto(Auto),
}

impl LightCandidates {
    /// Candidates that a pilot tries.
    pub const TRIED: u32 = 4;

    /// The greatest number: that many samples bring hardly less than a choice among more.
    pub const MOST: u32 = 64;

    /// Their number where no pilot finds out.
    pub fn without_pilot(self) -> u32 {
        match self {
            Self::Fixed(count) => count,
            Self::Auto(_) => 1,
        }
    }
}

/// How light that comes straight from a light is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum DirectLight {
    /// By sampling lights and lobes, each weighted where it is the better (multiple importance sampling).
    #[default]
    Mis,
    /// By sampling lights only.
    Light,
    /// By sampling lobes only; point and directional lights are sampled all the same.
    Lobe,
}

/// A picture beside the picture: what denoisers and compositors ask for, from the same pass.
///
/// What a pixel shows in a mirror or in a sharp glossy surface is described instead of the mirror.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Aov {
    /// Fraction of light that the surface reflects, times the colours of the mirrors before it: `Albedo.{R,G,B}`.
    Albedo,
    /// Shading normal on the viewer's side, in the scene's axes: `N.{X,Y,Z}`.
    Normal,
    /// Length of the way from the camera, by way of the mirrors, in the scene's units: `Depth.Z`.
    Depth,
    /// Estimated variance of the pixel's value (that of one sample over the number of samples):
    /// `Variance.{R,G,B}`.
    Variance,
}

/// How much of what hides the environment a glossy reflection heeds.
///
/// All but [`Exact`](Self::Exact) are approximations of cosine-power lobes: no ray is traced along the lobe; the
/// reflection is that of the bare environment, drawn from the lobe and weighted by an estimate of the visibility V. Other
/// surfaces reflect nothing into it, and mirrors, metals and plastics are not changed. After Kozlowski and Kautz 2007, *Is Accurate Occlusion of
/// Glossy Reflections Necessary?*; the definitions are this project's own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Occlusion {
    /// Rays of the lobe are traced: nothing is approximated.
    #[default]
    Exact,
    /// V = 1.
    None,
    /// V = the ambient occlusion `(1 / pi) Int V max(0, n . w) dw`, by one ray per sample.
    Ao,
    /// V = what a cone of the lobe's width shares with a cone of visibility about the mean free direction, by 16 rays.
    Cone,
    /// V = whether the mirror direction is free, by one ray per sample.
    MirrorVisibility,
    /// V = the mean over the lobe of visibility in spherical harmonics up to band 2, by 16 rays.
    Sh,
}

impl Occlusion {
    /// Whether nothing is approximated.
    pub fn is_exact(&self) -> bool {
        *self == Self::Exact
    }
}

/// How to render; displayed as the lines of a scene file's `[settings]`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Settings {
    /// Camera samples per pixel.
    pub spp: u32,
    /// Reflected bounces: with D, the camera's hit and D more are shaded.
    pub max_depth: u32,
    /// What a path sees beyond them.
    pub at_max_depth: AtMaxDepth,
    /// From this many reflections on a path that no mirror reflects survives with a probability, its weight, and with a
    /// new weight that makes up for those that do not: unbiased, and what dim paths save pays for more samples. [`NEVER`](Self::NEVER) for no
    /// such number before `max_depth`.
    pub roulette_from: u32,
    /// Rays per glossy hit.
    pub glossy_samples: GlossySamples,
    /// Below the surface; what a material does not say for itself.
    pub horizon: Horizon,
    /// Against self-hits.
    pub self_hit: SelfHit,
    /// How direct light is found.
    pub direct_light: DirectLight,
    /// Samples of lights per hit.
    pub light_samples: LightSamples,
    /// Candidates for each of them at a glossy hit.
    pub light_candidates: LightCandidates,
    /// Whether diffuse surfaces see other surfaces (global illumination) or only lights (the textbook's).
    pub diffuse_bounces: bool,
    /// Whether surfaces send part of the rays of diffuse and of wide glossy lobes where photons say that caustics come from: unbiased.
    pub guiding: bool,
    /// Whether diffuse ones also send part of their rays where other light comes from that surfaces reflect: unbiased.
    pub indirect_guiding: IndirectGuiding,
    /// Whether part of the samples of lights look for the environment through portals, where little of it is seen: unbiased.
    pub portals: bool,
    /// Whether edges of emitters that the camera sees get camera rays of their own, which are not shaded: unbiased.
    pub emitter_edges: bool,
    /// Whether paths go both ways at glass, as long as each way carries enough, and not by chance one: unbiased.
    pub split_glass: bool,
    /// Whether lights are sampled for glossy lobes. Without, a glossy surface shows the mean of what its rays see, as
    /// the lecture has it, and point and directional lights, which no ray can hit, do not shine on it.
    pub highlights: bool,
    /// Light that was reflected more than once brings a sample no more than this much radiance per way that it took
    /// (the largest channel; the colour is kept). Biased: darker, without the bright dots of rare ways. Off by default.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clamp_indirect: Option<f32>,
    /// Whether noisy pixels get more of the samples than others, which then are the pixels' mean number: of those beyond
    /// [`EVEN_SAMPLES`] per pixel. A threshold of noise takes the place of this.
    pub adaptive: bool,
    /// Pictures beside the picture.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub aovs: Vec<Aov>,
    /// What glossy reflections of the environment heed; said where it is an approximation.
    #[serde(skip_serializing_if = "Occlusion::is_exact")]
    pub occlusion: Occlusion,
    /// Which numbers are drawn.
    pub sampler: SamplerKind,
    /// Which of all their sequences.
    pub seed: u32,
}

impl Settings {
    /// More reflections than any path has.
    pub const NEVER: u32 = u32::MAX;

    /// Reflections that a path may take; those of roulette go on without end.
    pub fn most_reflections(&self) -> u32 {
        if self.at_max_depth == AtMaxDepth::Roulette { u32::MAX } else { self.max_depth }
    }

    /// Whether of `count` samples per pixel those beyond [`EVEN_SAMPLES`] go where the noise is: where that is wanted, and
    /// numbers may end at any sample.
    pub fn shares_out(&self, count: u32) -> bool {
        self.adaptive && self.sampler.is_sequence() && count >= EVEN_SAMPLES
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            spp: 64,
            max_depth: 8,
            at_max_depth: AtMaxDepth::default(),
            roulette_from: 3,
            glossy_samples: GlossySamples::Auto(Auto::Auto),
            horizon: Horizon::default(),
            self_hit: SelfHit::default(),
            direct_light: DirectLight::default(),
            light_samples: LightSamples::default(),
            light_candidates: LightCandidates::Auto(Auto::Auto),
            diffuse_bounces: true,
            guiding: true,
            indirect_guiding: IndirectGuiding::default(),
            portals: true,
            emitter_edges: true,
            split_glass: true,
            highlights: true,
            clamp_indirect: None,
            adaptive: true,
            aovs: vec![],
            occlusion: Occlusion::default(),
            sampler: SamplerKind::default(),
            seed: 0,
        }
    }
}

impl std::fmt::Display for Settings {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let table = toml::Table::try_from(self).map_err(|_| std::fmt::Error)?;
        let lines: Vec<String> = table.iter().map(|(key, value)| format!("{key} = {value}")).collect();
        f.write_str(&lines.join("\n"))
    }
}
