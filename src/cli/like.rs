//! `--like`: rendering as the findings of `gloss trade` advise.

use super::accel_args::AccelArgs;
use super::exit::{Failure, OrExit};
use super::files::Files;
use super::parse;
use super::scene_args::SceneArgs;
use crate::scene::Override;
use crate::trade::{Findings, Target, text};
use anyhow::Context;
use std::path::PathBuf;
use std::time::Duration;

/// Whose findings, and what is wanted.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct LikeArgs {
    /// Render as the findings of `gloss trade --json` advise for a target: their settings and samples go before all
    /// flags
    #[arg(long, value_name = "FILE", help_heading = HEADING, requires = "target")]
    like: Option<PathBuf>,

    /// The least work that has this relMSE, such as 0.001
    #[arg(long, value_name = "ERROR", help_heading = HEADING, value_parser = parse::error, requires = "like",
          group = "target")]
    target_error: Option<f64>,

    /// The least error in so much CPU time of all threads, such as 10s
    #[arg(long, value_name = "TIME", help_heading = HEADING, value_parser = parse::duration, requires = "like",
          group = "target")]
    target_time: Option<Duration>,
}

const HEADING: &str = "Measured advice";

impl LikeArgs {
    /// Notes the file of findings.
    pub(super) fn note_file(&self, files: &mut Files) -> Result<(), Failure> {
        self.like.as_deref().map_or(Ok(()), |path| files.reads("the findings of --like", path))
    }

    /// Puts the advice before the flags; says what it is, if any is wanted.
    pub(super) fn apply(
        &self,
        scene: &mut SceneArgs,
        accel: &mut AccelArgs,
    ) -> Result<Option<String>, Failure> {
        let Some(path) = &self.like else { return Ok(None) };
        let text = std::fs::read_to_string(path);
        let text = text.with_context(|| format!("cannot read {}", path.display())).or_bad()?;
        let findings: Findings = serde_json::from_str(&text)
            .with_context(|| format!("{}: not the findings of `gloss trade --json`", path.display()))
            .or_bad()?;
        let target = match (self.target_error, self.target_time) {
            (Some(error), _) => Target::Error(error),
            (None, Some(time)) => Target::Time(time.as_secs_f64()),
            (None, None) => return Err(Failure::bad("--like needs --target-error or --target-time".into())),
        };
        let resolution = scene.resolution().unwrap_or(findings.full_resolution);
        let pixels = resolution.map(f64::from).iter().product();
        let Some(advice) = findings.advise(target, pixels) else {
            return Err(Failure::bad(format!("{}: no way that was measured reaches that", path.display())));
        };
        let way = &findings.ways[advice.way].way;
        scene.before = way.overrides();
        scene.before.push(Override::new("settings.spp", advice.spp));
        accel.set_engine(&way.engine);
        Ok(Some(text::sentence(&advice)))
    }
}
