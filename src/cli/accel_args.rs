//! Who answers the rays.

use super::exit::{Failure, OrExit};
use crate::accel::{self, AccelError, Accelerator, Backend, BuildOptions, EmbreeMode, Quality, SkipSupport};
use crate::scene::{Plan, Scene};
use crate::trade::Engine;
use clap::builder::RangedU64ValueParser;

/// The backend and how it builds.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct AccelArgs {
    /// Who answers rays
    #[arg(long, default_value_t, value_enum, help_heading = BACKEND)]
    pub(super) backend: Backend,

    /// Which of Embree's calls are asked
    #[arg(long, value_name = "MODE", default_value_t, value_enum, help_heading = BACKEND)]
    embree_mode: EmbreeMode,

    #[command(flatten)]
    pub(super) build: BuildArgs,
}

/// How any backend builds.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct BuildArgs {
    /// Time spent on the structure against speed of the rays
    #[arg(long, default_value_t, value_enum, help_heading = BACKEND)]
    quality: Quality,

    /// Watertight: no ray slips through a shared edge (this is the default)
    #[arg(long, overrides_with = "fast", help_heading = BACKEND)]
    robust: bool,

    /// Not watertight: a render takes 7 to 14 % less time
    #[arg(long, overrides_with = "robust", help_heading = BACKEND)]
    fast: bool,

    /// Less memory, slower rays
    #[arg(long, help_heading = BACKEND)]
    compact: bool,

    /// Threads for all stages, at most 1024; 0 for one per core. Changes no bit of a picture
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = threads(), help_heading = BACKEND)]
    pub(super) threads: usize,
}

const BACKEND: &str = "Backend";

/// Numbers of threads that an operating system gives without complaint.
pub(super) fn threads() -> RangedU64ValueParser<usize> {
    RangedU64ValueParser::new().range(0..=1024)
}

impl BuildArgs {
    /// Options for rays that a render of the scene asks.
    pub(super) fn options(&self, scene: &Scene) -> BuildOptions {
        BuildOptions {
            skip: if Plan::of(scene).needs_skip { SkipSupport::Any } else { SkipSupport::None },
            ..self.any_options()
        }
    }

    /// Options for rays of any scene.
    pub(super) fn any_options(&self) -> BuildOptions {
        BuildOptions {
            quality: self.quality,
            robust: !self.fast,
            compact: self.compact,
            embree_mode: EmbreeMode::default(),
            skip: SkipSupport::Any,
            threads: self.threads,
        }
    }
}

impl AccelArgs {
    /// Who answers rays, as far as `gloss trade` chooses it.
    pub(super) fn engine(&self) -> Engine {
        let Self { backend, embree_mode, build: BuildArgs { quality, fast, .. } } = self;
        Engine { backend: *backend, embree_mode: *embree_mode, quality: *quality, robust: !fast }
    }

    /// Takes such a choice over.
    pub(super) fn set_engine(&mut self, engine: &Engine) {
        (self.backend, self.embree_mode) = (engine.backend, engine.embree_mode);
        (self.build.quality, self.build.fast, self.build.robust) =
            (engine.quality, !engine.robust, engine.robust);
    }

    /// How to build for pictures of any scene.
    pub(super) fn build_options(&self) -> BuildOptions {
        BuildOptions { embree_mode: self.embree_mode, ..self.build.any_options() }
    }

    /// Which of these flags the last bits of a picture may depend on, for people and to compare.
    pub(super) fn identity(&self) -> String {
        let name = |value: &dyn std::fmt::Debug| format!("{value:?}").to_ascii_lowercase();
        let [backend, mode, quality] =
            [name(&self.backend), name(&self.embree_mode), name(&self.build.quality)];
        let tests = if self.build.fast { "fast" } else { "robust" };
        let size = if self.build.compact { "compact" } else { "full" };
        match self.backend {
            Backend::Embree => format!("{backend} {mode} {quality} {tests} {size}"),
            Backend::Bvh | Backend::Brute => format!("{backend} {quality} {tests} {size}"),
        }
    }

    /// Builds the structure over the scene's shapes, for rays that a render of the scene asks.
    pub(super) fn build(&self, scene: &Scene) -> Result<Box<dyn Accelerator>, Failure> {
        build(self.backend, scene, &self.options(scene))
    }

    /// Builds the structure over the scene's shapes, for rays with any skip rule.
    pub(super) fn build_for_any_rays(&self, scene: &Scene) -> Result<Box<dyn Accelerator>, Failure> {
        build(self.backend, scene, &BuildOptions { skip: SkipSupport::Any, ..self.options(scene) })
    }

    fn options(&self, scene: &Scene) -> BuildOptions {
        BuildOptions { embree_mode: self.embree_mode, ..self.build.options(scene) }
    }
}

/// Builds a structure over the scene's shapes.
pub(super) fn build(
    backend: Backend,
    scene: &Scene,
    options: &BuildOptions,
) -> Result<Box<dyn Accelerator>, Failure> {
    let built = accel::build(backend, &scene.shapes, options);
    if matches!(built, Err(AccelError::NotCompiled)) { built.or_bad() } else { built.or_failed() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Alone {
        #[command(flatten)]
        accel: AccelArgs,
    }

    #[test]
    fn the_later_of_robust_and_fast_counts() {
        let fast = |flags: &[&str]| {
            let typed = ["gloss"].iter().chain(flags);
            Alone::try_parse_from(typed).unwrap_or_else(|e| panic!("{e}")).accel.build.fast
        };
        assert!(!fast(&[]) && fast(&["--fast"]) && fast(&["--robust", "--fast"]));
        assert!(!fast(&["--fast", "--robust"]));
    }
}
