//! `gloss compare`: the same rays and the same picture on several backends.

use super::accel_args::BuildArgs;
use super::contender::Contender;
use super::dump::Dump;
use super::exit::{Exit, Failure, OrExit};
use super::output::check_writable;
use super::parse;
use super::scene_args::SceneArgs;
use super::signal::Interrupt;
use super::terminal::{note, print, print_json, typed};
use crate::compare::{self, Comparison, Options, Verdict, page, text};
use crate::geometry::Shape;
use crate::image_io::write_atomically;
use crate::integrator::{RayClass, RayLog};
use crate::scene::Scene;
use serde_json::json;
use std::io::Write;
use std::num::NonZeroUsize;
use std::path::PathBuf;

/// Compare backends: their answers, their speed and their pictures
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Rays are recorded from tiles all over the picture and asked of every backend. Where answers differ, f64 arithmetic on
the scene's own primitives says which is right: against all of them for as many rays as a few seconds allow, else
against those that were named. Rounds of timing take turns and count one thread's CPU time.

The verdict on each backend, held against the first:
  identical            every pixel has the same bits and every ray the same answer
  statistically equal  at most --max-wrong of the answers are wrong, and the pictures differ by no more than noise:
                       - bias: T = sum d / sqrt(sum d^2) over differences d in luminance (none below 1e-5 of the
                         pixel), of the picture and of each block of 16 x 16 pixels, stays where random signs
                         leave it in all but one of 10^5 comparisons (Hoeffding's bound)
                       - outliers: |z| > 3 in no more pixels than 5 standard errors above their number among equals,
                         with z = d / sqrt(var A + var B)
  differs              anything else
All render with the same random numbers, so that the smallest bias shows. With --independent each has its own, and the
number of outliers among equals is measured by a second render of the first.

Exit codes: 0 identical or statistically equal, 1 differs or failed, 2 bad usage or bad scene, 75 interrupted.

Examples:
  gloss compare scenes/lemon.toml
  gloss compare scenes/boxes.toml --all --spp 16 --html boxes.html
  gloss compare scenes/mesh.toml --between embree:single,embree:packet8:not-robust,bvh:quality=high --json
  gloss compare scenes/boxes.toml --dump-rays wrong.rays && gloss trace wrong.rays --scene scenes/boxes.toml")]
pub(super) struct Args {
    #[command(flatten)]
    scene: SceneArgs,

    /// What to compare, the others with the first: embree, bvh or brute, each with words such as embree:packet8,
    /// bvh:quality=high, embree:not-robust [default: embree,bvh]
    #[arg(long, value_name = "A,B,...", value_delimiter = ',', value_parser = Contender::parse)]
    between: Vec<Contender>,

    /// Compare all that there is: every mode of Embree, and the BVH
    #[arg(long, conflicts_with = "between")]
    all: bool,

    /// Rays to record, about
    #[arg(long, value_name = "N", default_value = "500000")]
    rays: NonZeroUsize,

    /// Rounds of timing
    #[arg(long, value_name = "N", default_value = "5")]
    rounds: NonZeroUsize,

    /// Distances of the same hit may be apart by this fraction
    #[arg(long, value_name = "X", default_value_t = 1e-5, value_parser = parse::fraction)]
    tolerance: f64,

    /// Share of the answers that may be wrong
    #[arg(long, value_name = "X", default_value_t = 1e-4, value_parser = parse::fraction)]
    max_wrong: f64,

    /// Render with different seeds, and once more to learn what chance does
    #[arg(long)]
    independent: bool,

    #[command(flatten)]
    build: BuildArgs,

    /// Write a report with the pictures: one file that needs nothing else
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,

    /// Brightness of the report's pictures in stops
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, value_parser = parse::exposure,
          allow_negative_numbers = true)]
    exposure: f32,

    /// Write the rays whose answers differ, for `gloss trace`
    #[arg(long, value_name = "FILE")]
    dump_rays: Option<PathBuf>,

    /// Print JSON
    #[arg(long)]
    json: bool,

    /// Print nothing but errors
    #[arg(short, long)]
    quiet: bool,
}

/// Builds, compares, tells and judges.
pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    // Everything that can be refused is refused before the work.
    let mut files = args.scene.files()?;
    args.html.as_deref().map_or(Ok(()), |path| check_writable(path, "--html", &mut files))?;
    let dump = args.dump_rays.as_deref().map(|path| Dump::create(path, &mut files)).transpose()?;
    let interrupt = Interrupt::listen()?;
    let scene = args.scene.load_beside(&mut files)?;
    let tell = |line: &str| {
        if !args.quiet {
            note(line);
        }
    };
    let built = contenders(args, &scene, &tell)?
        .iter()
        .map(|contender| contender.build(&scene, args.build.options(&scene)))
        .collect::<Result<Vec<_>, _>>()?;
    let backends: Vec<compare::Contender<'_>> = built
        .iter()
        .map(|(name, accel)| compare::Contender { name: name.clone(), accel: &**accel })
        .collect();

    interrupt.stops_softly();
    let Some(found) = compare::run(scene, &backends, &options(args), &tell, interrupt.stop()) else {
        note("interrupted: nothing is written");
        return Ok(Exit::Interrupted);
    };
    if let Some(dump) = dump {
        dump_disagreements(&found, dump)?;
    }
    if let Some(path) = &args.html {
        let html = page::to_html(&found, &args.scene.name(), &typed(), args.exposure);
        write_atomically(path, |file| file.write_all(html.as_bytes()).map_err(|e| e.to_string()))
            .or_failed()?;
    }
    if args.json {
        print_json(&json!(found))?;
    } else if !args.quiet {
        print(&text::to_text(&found, &args.scene.name()))?;
    }
    Ok(exit(found.verdict))
}

fn contenders(args: &Args, scene: &Scene, tell: &dyn Fn(&str)) -> Result<Vec<Contender>, Failure> {
    if args.all {
        return Ok(Contender::all());
    }
    match args.between.len() {
        0 => {
            let primitives = scene.shapes.iter().map(Shape::primitive_count).sum();
            let (usual, why) = Contender::usual(primitives);
            why.inspect(|why| tell(why));
            Ok(usual)
        }
        1 => Err(Failure::bad("--between needs two backends at least, such as embree,bvh".to_owned())),
        _ => Ok(args.between.clone()),
    }
}

fn options(args: &Args) -> Options {
    Options {
        rays: args.rays.get(),
        rounds: args.rounds.get(),
        tolerance: args.tolerance as f32,
        max_wrong: args.max_wrong,
        independent: args.independent,
        threads: args.build.threads,
    }
}

fn exit(verdict: Verdict) -> Exit {
    match verdict {
        Verdict::Identical | Verdict::StatisticallyEqual => Exit::Done,
        Verdict::Differs => Exit::Failed,
    }
}

/// A batch per pair of backends and class of rays.
fn dump_disagreements(found: &Comparison, dump: Dump) -> Result<(), Failure> {
    for pair in &found.pairs {
        for class in RayClass::ALL {
            let of_class = pair.disagreements.iter().filter(|d| d.class == class);
            let rays: Vec<_> = of_class.map(|d| d.ray).collect();
            if !rays.is_empty() {
                dump.rays().record(class, &rays);
            }
        }
    }
    dump.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_difference_fails() {
        let exits = [Verdict::Identical, Verdict::StatisticallyEqual, Verdict::Differs].map(exit);
        assert_eq!(exits, [Exit::Done, Exit::Done, Exit::Failed]);
    }
}
