//! `gloss trace`: recorded rays asked again, and nothing else.

use super::accel_args::AccelArgs;
use super::exit::{Exit, Failure, OrExit};
use super::parse;
use super::terminal::{count, print, print_json};
use crate::scene::{self, Override};
use crate::trace::{Replay, clock, read, replay};
use serde_json::json;
use std::fmt::Write;
use std::num::NonZeroUsize;
use std::path::PathBuf;

/// Ask recorded rays again: what the rays alone cost
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Seconds are CPU time, summed over the threads, of the median round; Mray/s are per second of one thread.

Exit codes: 0 done, 1 failed, 2 bad usage, bad scene or a file that holds no rays.

Examples:
  gloss render scenes/lemon.toml -o lemon.png --dump-rays lemon.rays
  gloss trace lemon.rays --scene scenes/lemon.toml --backend bvh
  gloss trace lemon.rays --scene scenes/lemon.toml --backend embree --embree-mode packet8 --threads 1 --json")]
pub(super) struct Args {
    /// Rays, as --dump-rays of render or compare wrote them
    file: PathBuf,

    /// The scene that they were recorded in
    #[arg(long)]
    scene: PathBuf,

    /// Set a key of the scene file, as the recording did; may be given again
    #[arg(short = 'D', value_name = "PATH=VALUE", value_parser = parse::definition)]
    define: Vec<Override>,

    /// Times that all rays are asked
    #[arg(long, value_name = "N", default_value = "5")]
    rounds: NonZeroUsize,

    #[command(flatten)]
    accel: AccelArgs,

    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// Reads, builds, asks and tells.
pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let batches = read(&args.file).or_bad()?;
    let scene = scene::load(&args.scene, &args.define).or_bad()?;
    let accel = args.accel.build_for_any_rays(&scene)?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(args.accel.build.threads).build().or_failed()?;
    let replayed = pool.install(|| replay(&*accel, &batches, args.rounds.get()));
    if args.json {
        let mut value = json!(replayed);
        value["build_seconds"] = json!(accel.info().build_seconds);
        value["memory_bytes"] = json!(accel.info().memory_bytes);
        value["rounds"] = json!(args.rounds);
        value["clock"] = json!(clock::CLOCK);
        return print_json(&value);
    }
    print(&to_text(&replayed, args.rounds.get()))?;
    Ok(Exit::Done)
}

fn to_text(replayed: &Replay, rounds: usize) -> String {
    let Replay { backend, classes } = replayed;
    let clock = clock::CLOCK;
    let mut text = format!("{backend}, median of {rounds} rounds, {clock}\n");
    // Writing to a string cannot fail.
    let _ = writeln!(
        text,
        "{:<10}{:>10}{:>10}{:>11}{:>10}  spread",
        "class", "rays", "hits", "seconds", "Mray/s"
    );
    for timing in classes {
        let rate = |seconds: f64| 1e-6 * timing.rays as f64 / seconds.max(1e-9);
        let _ = writeln!(
            text,
            "{:<10}{:>10}{:>10}{:>11.4}{:>10.3}  {:.3} to {:.3}",
            timing.class.name(),
            count(timing.rays as f64),
            count(timing.hits as f64),
            timing.seconds,
            rate(timing.seconds),
            rate(timing.slowest_seconds),
            rate(timing.fastest_seconds),
        );
    }
    let seconds: f64 = classes.iter().map(|timing| timing.seconds).sum();
    let rays: u64 = classes.iter().map(|timing| timing.rays).sum();
    let _ = writeln!(
        text,
        "{:<10}{:>10}{:>10}{seconds:>11.4}{:>10.3}",
        "all",
        count(rays as f64),
        "",
        1e-6 * rays as f64 / seconds.max(1e-9)
    );
    text
}
