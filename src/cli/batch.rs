//! `gloss batch`: a file of jobs.

use super::exit::{Exit, Failure, OrExit};
use super::farm_args::ShardFlag;
use super::files::Files;
use super::parse;
use super::series::{self, SeriesArgs};
use crate::batch::{Frames, Jobs, share};
use crate::scene::Override;
use std::path::PathBuf;

/// Render a file of jobs: many scenes, many frames
#[derive(Debug, clap::Args)]
#[command(after_help = "\
A file of jobs is TOML; paths in it are relative to it:

  output = \"out/{job}-{frame:4}.exr\"          # for jobs that do not say it; a list writes several
  set = { \"settings.spp\" = 64 }               # changed of every scene

  [[job]]
  scene = \"lemon.toml\"
  name = \"turn\"                               # what {job} is; the scene's name if it is left out
  frames = \"1-100x3\"                          # every third of 100; or 7, or 1-3,8; no frame if it is left out
  set = { \"materials.lemon.exponent\" = 100 }
  animate = { \"camera.eye\" = [[1, [0, 1, 5]], [100, [5, 1, 0]]], \"shapes.0.transform.0.rotate.deg\" = [[1, 0], [100, 360]] }

A key of `animate` is a path in the scene file, its value a list of [frame, number or list of numbers]: straight lines
between them, the first and the last value outside. In an output's name, {job}, {frame}, {scene}, {index} and the last
key of any path that is set stand for their values; {frame:4} has at least four digits.

Geometry is known by its contents and read once, and a structure is kept as long as the shapes stay. A job that fails
does not stop the others.

Exit codes: 0 done, 1 failed, 2 bad usage, 3 some pictures were not made, 75 interrupted.

Examples:
  gloss batch jobs.toml --records done.jsonl
  gloss batch jobs.toml --frames 1-100x10 -D settings.spp=4 --sheet overview.png
  gloss batch jobs.toml --shard 0/4")]
pub(super) struct Args {
    /// File of jobs
    jobs: PathBuf,

    /// Frames in the place of those of all jobs that have some: 7, 1-100, 1-100x3
    #[arg(long, value_name = "LIST")]
    frames: Option<Frames>,

    /// Set a key of all scenes, after what the jobs set; may be given again
    #[arg(short = 'D', value_name = "PATH=VALUE", value_parser = parse::definition)]
    define: Vec<Override>,

    /// Make one of N shares of the pictures: I/N, or auto or auto/N to ask the scheduler's variables
    #[arg(long, value_name = "I/N", value_parser = parse::shard)]
    shard: Option<ShardFlag>,

    #[command(flatten)]
    series: SeriesArgs,
}

/// Makes the pictures of all jobs.
pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let jobs = Jobs::read(&args.jobs).or_bad()?;
    let mut pictures = jobs.pictures(args.frames.as_ref(), &args.define).or_bad()?;
    if let Some(shard) = args.shard {
        let (index, count) = shard.resolve()?;
        if index >= count {
            return Err(Failure::bad(format!("there is no share {index}/{count}: they are numbered from 0")));
        }
        pictures = share(pictures, index, count);
    }
    if args.series.dry_run {
        return series::dry_run(&pictures);
    }
    let mut files = Files::default();
    files.reads("the file of jobs", &args.jobs)?;
    series::make_all(&args.series, &pictures, files)
}
