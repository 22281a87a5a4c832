//! The scene and what the command line changes of it.

use super::exit::{Failure, OrExit};
use super::files::Files;
use super::parse;
use crate::bxdf::Horizon;
use crate::scene::{
    self, Aov, AtMaxDepth, DirectLight, GlossySamples, IndirectGuiding, LightCandidates, LightSamples,
    Override, Scene, SelfHit,
};
use clap::ValueEnum;
use std::num::NonZeroU32;
use std::path::PathBuf;

/// A scene file, and flags that go before what it says.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct SceneArgs {
    /// Scene file: TOML, or JSON if its name ends in .json
    pub(super) scene: PathBuf,

    /// Named set of settings to start from: what neither the scene nor a flag says is the preset's
    #[arg(long, value_name = "NAME", help_heading = SETTINGS)]
    preset: Option<scene::Preset>,

    /// Camera samples per pixel
    #[arg(long, value_name = "N", help_heading = SETTINGS)]
    spp: Option<NonZeroU32>,

    /// Size of the picture in pixels
    #[arg(long, value_name = "WxH", value_parser = parse::resolution, help_heading = SETTINGS)]
    resolution: Option<[u32; 2]>,

    /// Reflected bounces: with N, the camera's hit and N more are shaded
    #[arg(long, value_name = "N", help_heading = SETTINGS)]
    max_depth: Option<u32>,

    /// What a path sees that may go no deeper
    #[arg(long, value_name = "POLICY", help_heading = SETTINGS)]
    at_max_depth: Option<AtMaxDepth>,

    /// Rays that a hit splits into: N at the first glossy one of a path, N,M,... at the first, second, ... glossy one,
    /// branch=N at every glossy one, any=N at the first that is no mirror, or auto to let a pilot in a few pixels choose
    /// that
    #[arg(long, value_name = "N", value_parser = parse::glossy_samples, help_heading = SETTINGS)]
    glossy_samples: Option<GlossySamples>,

    /// What becomes of glossy directions below the surface
    #[arg(long, value_name = "POLICY", help_heading = SETTINGS)]
    horizon: Option<Horizon>,

    /// What a ray must not hit again
    #[arg(long, value_name = "POLICY", help_heading = SETTINGS)]
    self_hit: Option<SelfHit>,

    /// How light straight from a light is found
    #[arg(long, value_name = "WAY", help_heading = SETTINGS)]
    direct_light: Option<DirectLight>,

    /// Give noisy parts of the picture more of the samples and clean ones fewer, beyond 4 per pixel: --spp is then their
    /// mean number. The default is true, but for presets and shards; --noise takes its place
    #[arg(long, value_name = "YES", num_args = 0..=1, default_missing_value = "true", help_heading = SETTINGS)]
    adaptive: Option<bool>,

    /// Samples of lights that a hit takes
    #[arg(long, value_name = "HOW", help_heading = SETTINGS)]
    light_samples: Option<LightSamples>,

    /// Choose each sample of lights at a glossy hit among N candidates by what the hit would reflect of them, which takes no
    /// rays: unbiased; auto lets a pilot choose between 1 and 4
    #[arg(long, value_name = "N", value_parser = parse::light_candidates, help_heading = SETTINGS)]
    light_candidates: Option<LightCandidates>,

    /// Send part of the rays of diffuse and rough glossy surfaces where photons say that caustics come from: unbiased, without
    /// the bright dots
    #[arg(long, value_name = "YES", num_args = 0..=1, default_missing_value = "true", help_heading = SETTINGS)]
    guiding: Option<bool>,

    /// Send part of the rays of diffuse surfaces where most of the light comes from that other surfaces reflect: unbiased; auto
    /// lets a pilot choose
    #[arg(long, value_name = "WHEN", help_heading = SETTINGS)]
    indirect_guiding: Option<IndirectGuiding>,

    /// Look for the environment through windows and doors, which rays find before the render: unbiased, and rooms with less noise
    #[arg(long, value_name = "YES", num_args = 0..=1, default_missing_value = "true", help_heading = SETTINGS)]
    portals: Option<bool>,

    /// Find edges of lamps that the camera sees by rays of their own, which are not shaded: unbiased, and clean edges
    #[arg(long, value_name = "YES", num_args = 0..=1, default_missing_value = "true", help_heading = SETTINGS)]
    emitter_edges: Option<bool>,

    /// Follow both what glass reflects and what it lets through, as long as each carries enough, and not by chance one: unbiased
    #[arg(long, value_name = "YES", num_args = 0..=1, default_missing_value = "true", help_heading = SETTINGS)]
    split_glass: Option<bool>,

    /// Let light that was reflected more than once bring no sample more than this much radiance: fewer bright dots, and
    /// biased, which the EXR says
    #[arg(long, value_name = "X", value_parser = parse::radiance, help_heading = SETTINGS)]
    clamp_indirect: Option<f32>,

    /// Pictures beside the picture, as layers of the EXR, of what is seen by way of mirrors and sharp gloss: 50 to 70 ns a
    /// sample, however many there are (7 % of the time of a room, 25 % of that of a sphere under a sky)
    #[arg(long, value_name = "LIST", value_delimiter = ',', help_heading = SETTINGS)]
    aov: Vec<Aov>,

    /// Which random numbers: another seed gives another, independent picture
    #[arg(long, value_name = "N", help_heading = SETTINGS)]
    seed: Option<u32>,

    /// Set any key of the scene file, such as settings.diffuse_bounces=false; may be given again, goes last
    #[arg(short = 'D', value_name = "PATH=VALUE", value_parser = parse::definition, help_heading = SETTINGS)]
    define: Vec<Override>,

    /// What goes before all flags.
    #[arg(skip)]
    pub(super) before: Vec<Override>,
}

const SETTINGS: &str = "Settings (before what the scene file says)";

impl SceneArgs {
    /// What the flags set, in the order in which they apply.
    pub(super) fn overrides(&self) -> Vec<Override> {
        let named = [
            ("settings.preset", self.preset.map(name)),
            ("settings.spp", self.spp.map(|n| n.to_string())),
            ("camera.resolution", self.resolution.map(|[w, h]| format!("[{w}, {h}]"))),
            ("settings.max_depth", self.max_depth.map(|n| n.to_string())),
            ("settings.at_max_depth", self.at_max_depth.map(name)),
            ("settings.glossy_samples", self.glossy_samples.as_ref().map(glossy_samples)),
            ("settings.horizon", self.horizon.map(name)),
            ("settings.self_hit", self.self_hit.map(name)),
            ("settings.direct_light", self.direct_light.map(name)),
            ("settings.clamp_indirect", self.clamp_indirect.map(|x| format!("{x:?}"))),
            ("settings.adaptive", self.adaptive.map(|yes| yes.to_string())),
            ("settings.light_samples", self.light_samples.map(name)),
            ("settings.light_candidates", self.light_candidates.map(light_candidates)),
            ("settings.guiding", self.guiding.map(|yes| yes.to_string())),
            ("settings.indirect_guiding", self.indirect_guiding.map(name)),
            ("settings.portals", self.portals.map(|yes| yes.to_string())),
            ("settings.emitter_edges", self.emitter_edges.map(|yes| yes.to_string())),
            ("settings.split_glass", self.split_glass.map(|yes| yes.to_string())),
            ("settings.aovs", (!self.aov.is_empty()).then(|| names(&self.aov))),
            ("settings.seed", self.seed.map(|n| n.to_string())),
        ];
        let set = named.into_iter().filter_map(|(path, value)| Some((path.to_owned(), value?)));
        let flags = set.map(|(path, value)| Override { path, value }).chain(self.define.iter().cloned());
        self.before.iter().cloned().chain(flags).collect()
    }

    /// Gives each pixel as many samples, where no flag asks for more where there is noise: whoever renders a share knows
    /// nothing of the noise in the others. Whether they would have been shared out.
    pub(super) fn share_evenly(&mut self) -> Result<bool, Failure> {
        if self.adaptive.is_some() {
            return Ok(false);
        }
        let settings = scene::load_settings(&self.scene, &self.overrides()).or_bad()?;
        self.adaptive = Some(false);
        Ok(settings.shares_out(settings.spp))
    }

    /// Samples per pixel, if they were asked for.
    pub(super) fn spp(&self) -> Option<u32> {
        self.spp.map(NonZeroU32::get)
    }

    /// Size of the picture, if it was asked for.
    pub(super) fn resolution(&self) -> Option<[u32; 2]> {
        self.resolution
    }

    /// The file's name for people.
    pub(super) fn name(&self) -> String {
        self.scene.display().to_string()
    }

    /// The files of a command that reads the scene's.
    pub(super) fn files(&self) -> Result<Files, Failure> {
        let mut files = Files::default();
        files.reads("the scene", &self.scene)?;
        Ok(files)
    }

    /// The scene as the file and the flags describe it; refused if a file that it names will be written.
    pub(super) fn load_beside(&self, files: &mut Files) -> Result<Scene, Failure> {
        let scene = self.load()?;
        files.reads_files_of(&scene)?;
        Ok(scene)
    }

    /// The scene as the file and the flags describe it.
    pub(super) fn load(&self) -> Result<Scene, Failure> {
        scene::load(&self.scene, &self.overrides()).or_bad()
    }
}

/// The name that scene files use, as a TOML string.
fn name(value: impl ValueEnum) -> String {
    let value = value.to_possible_value().expect("no policy is hidden");
    format!("\"{}\"", value.get_name())
}

/// As a list of TOML.
fn names(values: &[impl ValueEnum + Copy]) -> String {
    format!("[{}]", values.iter().map(|&value| name(value)).collect::<Vec<_>>().join(", "))
}

/// As TOML.
fn light_candidates(value: LightCandidates) -> String {
    match value {
        LightCandidates::Auto(_) => "\"auto\"".to_owned(),
        LightCandidates::Fixed(n) => n.to_string(),
    }
}

/// As TOML.
fn glossy_samples(value: &GlossySamples) -> String {
    match value {
        GlossySamples::Auto(_) => "\"auto\"".to_owned(),
        GlossySamples::First(n) => n.to_string(),
        GlossySamples::PerDepth(list) => format!("{list:?}"),
        GlossySamples::Any { any } => format!("{{ any = {any} }}"),
        GlossySamples::Branch { branch } => format!("{{ branch = {branch} }}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Alone {
        #[command(flatten)]
        scene: SceneArgs,
    }

    fn overrides(flags: &[&str]) -> Vec<(String, String)> {
        let typed = ["gloss", "a.toml"].iter().chain(flags);
        let parsed = Alone::try_parse_from(typed).unwrap_or_else(|e| panic!("{e}")).scene.overrides();
        parsed.into_iter().map(|o| (o.path, o.value)).collect()
    }

    #[test]
    fn flags_become_overrides_in_the_words_of_the_scene_file() {
        let pair = |path: &str, value: &str| (path.to_owned(), value.to_owned());
        assert_eq!(overrides(&[]), []);
        assert_eq!(overrides(&["--resolution", "64x48"]), [pair("camera.resolution", "[64, 48]")]);
        assert_eq!(
            overrides(&["--horizon", "fold-weighted"]),
            [pair("settings.horizon", "\"fold-weighted\"")]
        );
        assert_eq!(
            overrides(&["--aov", "albedo,depth", "--clamp-indirect", "10"]),
            [pair("settings.clamp_indirect", "10.0"), pair("settings.aovs", "[\"albedo\", \"depth\"]")]
        );
        assert_eq!(overrides(&["--glossy-samples", "8,2"]), [pair("settings.glossy_samples", "[8, 2]")]);
        assert_eq!(
            overrides(&["--glossy-samples", "branch=9"]),
            [pair("settings.glossy_samples", "{ branch = 9 }")]
        );
    }

    #[test]
    fn definitions_go_after_flags_and_presets_before_them() {
        let paths: Vec<_> = overrides(&["-D", "settings.spp=3", "--spp", "4", "--preset", "lecture"]);
        let paths: Vec<_> = paths.iter().map(|(path, value)| (&**path, &**value)).collect();
        assert_eq!(paths, [("settings.preset", "\"lecture\""), ("settings.spp", "4"), ("settings.spp", "3")]);
    }
}
