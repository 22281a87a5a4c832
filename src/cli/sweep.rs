//! `gloss sweep`: one scene, some of its values varied.

use super::exit::{Exit, Failure, OrExit};
use super::files::Files;
use super::scene_args::SceneArgs;
use super::series::{self, SeriesArgs};
use crate::sweep::{Sweep, Vary, default_output};

/// Render a scene with some of its values varied
#[derive(Debug, clap::Args)]
#[command(after_help = "\
A picture is made for each combination of the values (with --zip: of the first values, the second values, ...). What the
pictures share is read and built once: where only materials, lights' colours, the camera or settings vary, that is all
of the geometry, and the lines say how much time it saved.

In an output's name, {exponent} is the value of a path that ends in `exponent`, {materials.lemon.exponent} that of the
whole path; {index:3} is the picture's number from 0, with at least three digits; {scene} the name of the scene file.

Exit codes: 0 done, 1 failed, 2 bad usage, 3 some pictures were not made, 75 interrupted.

Examples:
  gloss sweep scenes/lemon.toml --vary materials.lemon.exponent=1,10,100,1000 --sheet lemons.png
  gloss sweep scenes/lemon.toml --vary settings.spp=1,4,16,64 --vary settings.seed=1,2,3 -o 'out/{spp}-{seed}.exr'
  gloss sweep scenes/lemon.toml --zip --vary settings.spp=64,256 --vary settings.max_depth=2,8 --dry-run")]
pub(super) struct Args {
    #[command(flatten)]
    scene: SceneArgs,

    /// A key of the scene file and the values that it takes; may be given again
    #[arg(long, value_name = "PATH=A,B,C", required = true)]
    vary: Vec<Vary>,

    /// Take the lists side by side instead of all combinations
    #[arg(long)]
    zip: bool,

    /// Names of the pictures, by their ending: .exr or .png; may be given again. SCENE-{VALUE}.png if it is left out
    #[arg(short, long, value_name = "TEMPLATE")]
    output: Vec<String>,

    #[command(flatten)]
    series: SeriesArgs,
}

/// Makes the pictures of a sweep.
pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let outputs = match &args.output[..] {
        [] => vec![default_output(&args.scene.scene, &args.vary)],
        given => given.to_vec(),
    };
    let sweep = Sweep {
        scene: args.scene.scene.clone(),
        overrides: args.scene.overrides(),
        vary: args.vary.clone(),
        zip: args.zip,
        outputs,
    };
    let pictures = sweep.pictures().or_bad()?;
    if args.series.dry_run {
        return series::dry_run(&pictures);
    }
    series::make_all(&args.series, &pictures, Files::default())
}
