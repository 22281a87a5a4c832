//! What can be turned: each knob's question and its choices.

use super::way::{Claim, Engine, Way};
use crate::accel::{Backend, EmbreeMode, Quality};
use crate::scene::{IndirectGuiding, Plan, Scene, Specular};
use clap::ValueEnum;

/// Something that can be turned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Knob {
    /// Camera samples against rays per glossy hit, at the same number of rays
    Split,
    /// Reflections after which a path ends in black
    Depth,
    /// What a path sees that ends after two reflections
    End,
    /// What becomes of glossy directions below the surface
    Horizon,
    /// What a ray must not hit again
    SelfHit,
    /// How light straight from a light is found
    DirectLight,
    /// One sample of lights for a hit that splits, or as many as rays
    LightSamples,
    /// Candidates for each sample of lights at a glossy hit
    LightCandidates,
    /// Which random numbers
    Sampler,
    /// Whether diffuse and rough glossy surfaces look where photons say that caustics come from
    Guiding,
    /// Whether diffuse surfaces look where most of the light comes from that others reflect
    IndirectGuiding,
    /// Whether lights are sampled through the windows by which little of the environment is seen
    Portals,
    /// Whether edges of lamps that the camera sees get rays of their own
    EmitterEdges,
    /// Whether paths go both ways at glass
    SplitGlass,
    /// The same samples everywhere, or where the noise is
    Adaptive,
    /// The most radiance that light reflected more than once brings a sample
    Clamp,
    /// How much of what hides the environment a glossy reflection heeds
    Occlusion,
    /// Which of Embree's calls are asked
    EmbreeMode,
    /// Watertight tests or not
    Robust,
    /// Time spent on the structure
    Quality,
    /// Who answers rays
    Backend,
}

/// A knob's choice: its name, and its way or why it is left out.
pub(super) type Choice = (String, Result<Way, String>);

impl Knob {
    /// All of them, in the order of reports.
    pub const ALL: [Self; 21] = [
        Self::Split,
        Self::Depth,
        Self::End,
        Self::Horizon,
        Self::SelfHit,
        Self::DirectLight,
        Self::LightSamples,
        Self::LightCandidates,
        Self::Sampler,
        Self::Guiding,
        Self::IndirectGuiding,
        Self::Portals,
        Self::EmitterEdges,
        Self::SplitGlass,
        Self::Adaptive,
        Self::Clamp,
        Self::Occlusion,
        Self::EmbreeMode,
        Self::Robust,
        Self::Quality,
        Self::Backend,
    ];

    /// Its name on the command line.
    pub fn name(self) -> String {
        let value = clap::ValueEnum::to_possible_value(&self).expect("no knob is hidden");
        value.get_name().to_owned()
    }

    /// What turning it answers.
    pub fn question(self) -> String {
        let value = clap::ValueEnum::to_possible_value(&self).expect("no knob is hidden");
        value.get_help().map(ToString::to_string).unwrap_or_default()
    }

    /// Why turning it would change nothing in this scene.
    pub(super) fn idle(self, scene: &Scene, base: &Way) -> Option<&'static str> {
        let plan = Plan::of(scene);
        let embree = cfg!(feature = "embree");
        match self {
            Self::Split | Self::LightCandidates if !plan.has_glossy => Some("no surface is glossy"),
            Self::Horizon if !has_cosine_power(scene) => Some("no surface has a cosine-power lobe"),
            Self::Occlusion if !has_cosine_power(scene) => Some("no surface has a cosine-power lobe"),
            Self::Occlusion if scene.lights.environment.is_none() => Some("there is no environment"),
            Self::Depth | Self::End | Self::SelfHit | Self::Clamp if !plan.bounces => {
                Some("nothing reflects")
            }
            Self::DirectLight | Self::LightSamples | Self::LightCandidates if !plan.samples_lights => {
                Some("no light is sampled")
            }
            Self::LightSamples if !plan.bounces => Some("nothing reflects"),
            // What they would find is only known where they may look.
            Self::Guiding if !scene.settings.guiding => Some("the scene turns it off"),
            Self::IndirectGuiding if scene.settings.indirect_guiding == IndirectGuiding::Never => {
                Some("the scene turns it off")
            }
            Self::Portals if !scene.settings.portals => Some("the scene turns it off"),
            Self::Guiding if !plan.guides => Some("no surface can throw a caustic where rays would miss it"),
            Self::IndirectGuiding if !plan.guides_indirect => Some("no diffuse surface sees another"),
            Self::Portals if !plan.portals => Some("no diffuse surface sees an environment"),
            Self::EmitterEdges if !plan.has_emitters => Some("no shape emits"),
            Self::SplitGlass if !plan.has_glass => Some("there is no glass to go through"),
            Self::EmbreeMode if base.engine.backend != Backend::Embree => Some("the backend is not Embree"),
            Self::Backend if !embree => Some("this program was built without Embree"),
            _ => None,
        }
    }

    /// Its choices as changes of the base.
    pub(super) fn choices(self, scene: &Scene, base: &Way) -> Vec<Choice> {
        match self {
            Self::Split => splits(base),
            Self::Depth => depths(base),
            Self::End => ends(scene, base),
            Self::Horizon => horizons(scene, base),
            Self::SelfHit => named(base, "settings.self_hit", &["primitive", "offset", "!geometry"]),
            Self::DirectLight => named(base, "settings.direct_light", &["mis", "light", "lobe"]),
            Self::LightSamples => {
                // One ray takes one sample: only hits that split can take more.
                let splitting = base.clone().with("settings.glossy_samples", "\"auto\"");
                named(&splitting, "settings.light_samples", &["auto", "one", "split"])
            }
            Self::LightCandidates => candidates(scene, base),
            Self::Sampler => {
                named(base, "settings.sampler", &["sobol", "independent", "!regular", "!hammersley"])
            }
            Self::Guiding => on_and_off(base, "settings.guiding"),
            Self::IndirectGuiding => named(base, "settings.indirect_guiding", &["auto", "always", "never"]),
            Self::Portals => on_and_off(base, "settings.portals"),
            Self::EmitterEdges => on_and_off(base, "settings.emitter_edges"),
            Self::SplitGlass => on_and_off(base, "settings.split_glass"),
            Self::Adaptive => adaptive(base),
            Self::Clamp => clamps(base),
            Self::Occlusion => {
                let modes = ["exact", "!none", "!ao", "!cone", "!mirror-visibility", "!sh"];
                named(base, "settings.occlusion", &modes)
            }
            Self::EmbreeMode => engines(
                base,
                &EmbreeMode::value_variants()
                    .iter()
                    .map(|&mode| (name(&mode), Engine { embree_mode: mode, ..base.engine }))
                    .collect::<Vec<_>>(),
            ),
            Self::Robust => engines(
                base,
                &[true, false].map(|robust| {
                    (if robust { "robust" } else { "fast" }.to_owned(), Engine { robust, ..base.engine })
                }),
            ),
            Self::Quality => engines(
                base,
                &[Quality::Fast, Quality::Medium, Quality::High]
                    .map(|quality| (name(&quality), Engine { quality, ..base.engine })),
            ),
            Self::Backend => engines(
                base,
                &[Backend::Embree, Backend::Bvh]
                    .map(|backend| (name(&backend), Engine { backend, ..base.engine })),
            ),
        }
    }
}

fn name(value: &impl ValueEnum) -> String {
    value.to_possible_value().expect("none is hidden").get_name().to_owned()
}

/// Whether a surface has the lobe whose horizon has policies, and whose reflections have cheap occlusion.
fn has_cosine_power(scene: &Scene) -> bool {
    let mut used = scene.geometries.iter().map(|g| &scene.materials[g.material as usize]);
    used.any(|material| matches!(material.specular, Specular::CosinePower { .. }))
}

/// Policies by name; those with `!` before it may be biased.
fn named(base: &Way, path: &str, policies: &[&str]) -> Vec<Choice> {
    let choice = |policy: &&str| {
        let (name, claim) = match policy.strip_prefix('!') {
            Some(name) => (name, Claim::Biased),
            None => (*policy, Claim::Unbiased),
        };
        let way = Way { claim, ..base.clone().with(path, format!("\"{name}\"")) };
        (name.to_owned(), Ok(way))
    };
    policies.iter().map(choice).collect()
}

fn engines(base: &Way, engines: &[(String, Engine)]) -> Vec<Choice> {
    engines.iter().map(|(name, engine)| (name.clone(), Ok(Way { engine: *engine, ..base.clone() }))).collect()
}

/// `p x m`, from one camera sample to one ray per hit, in even steps of the logarithm; and `auto`.
fn splits(base: &Way) -> Vec<Choice> {
    let total = f64::from(base.spp);
    let mut choices: Vec<Choice> = vec![];
    for exponent in [0.0, 0.25, 0.5, 0.75, 1.0] {
        let p = total.powf(exponent).round().max(1.0);
        let m = (total / p).round().max(1.0);
        let way = base.clone().with("settings.glossy_samples", m);
        let choice = (format!("{p}x{m}"), Ok(Way { spp: p as u32, ..way }));
        if choices.last() != Some(&choice) {
            choices.push(choice);
        }
    }
    choices.push(("auto".into(), Ok(base.clone().with("settings.glossy_samples", "\"auto\""))));
    choices
}

fn depths(base: &Way) -> Vec<Choice> {
    let cut = |depth: u32| {
        let way = base.clone().with("settings.at_max_depth", "\"black\"").with("settings.max_depth", depth);
        (depth.to_string(), Ok(Way { claim: Claim::Biased, ..way }))
    };
    let all = ("roulette".to_owned(), Ok(base.clone()));
    [1, 2, 3, 5, 8].map(cut).into_iter().chain([all]).collect()
}

fn ends(scene: &Scene, base: &Way) -> Vec<Choice> {
    let base = base.clone().with("settings.max_depth", END_DEPTH);
    let mut choices = named(&base, "settings.at_max_depth", &["!black", "!background", "roulette"]);
    if scene.lights.environment.is_none() {
        choices[1].1 = Err("there is no environment: it is black".into());
    }
    choices
}

/// Reflections after which `end` ends paths.
const END_DEPTH: u32 = 2;

/// What the scene itself says is the truth; of the others, those with the same mean are unbiased.
fn horizons(scene: &Scene, base: &Way) -> Vec<Choice> {
    use crate::bxdf::Horizon;
    let own = scene.settings.horizon;
    let clipped = |h: Horizon| matches!(h, Horizon::Clip | Horizon::FoldWeighted);
    let all = [Horizon::Fold, Horizon::FoldWeighted, Horizon::Clip, Horizon::Reject, Horizon::ModifiedPhong];
    let choice = |horizon: Horizon| {
        let same = horizon == own || (clipped(horizon) && clipped(own));
        let claim = if same { Claim::Unbiased } else { Claim::Biased };
        let way = base.clone().with("settings.horizon", format!("\"{}\"", name(&horizon)));
        (name(&horizon), Ok(Way { claim, ..way }))
    };
    all.map(choice).into()
}

fn clamps(base: &Way) -> Vec<Choice> {
    let clamp = |most: u32| {
        let way = Way { claim: Claim::Biased, ..base.clone().with("settings.clamp_indirect", most) };
        (most.to_string(), Ok(way))
    };
    let off = ("off".to_owned(), Ok(base.clone()));
    [1, 3, 10].map(clamp).into_iter().chain([off]).collect()
}

fn candidates(scene: &Scene, base: &Way) -> Vec<Choice> {
    let mut counts = vec![1, 2, 4, 8, scene.settings.light_candidates.without_pilot()];
    counts.sort_unstable();
    counts.dedup();
    let choice = |n: u32| (n.to_string(), Ok(base.clone().with("settings.light_candidates", n)));
    counts.into_iter().map(choice).collect()
}

fn on_and_off(base: &Way, setting: &str) -> Vec<Choice> {
    [true, false].map(|on| (on.to_string(), Ok(base.clone().with(setting, on)))).into()
}

fn adaptive(base: &Way) -> Vec<Choice> {
    let threshold = |noise: f64| {
        let way = Way { noise: Some(noise), spp: 4 * base.spp, claim: Claim::Biased, ..base.clone() };
        (format!("noise {noise}"), Ok(way))
    };
    let shared = |name: &str, on: bool| (name.to_owned(), Ok(base.clone().with("settings.adaptive", on)));
    vec![shared("by noise", true), shared("even", false), threshold(0.1), threshold(0.05)]
}
