//! `gloss merge`: shards in, a picture out.

use super::exit::{Exit, Failure, OrExit};
use super::files::{self, Files};
use super::output::{Output, check_writable};
use super::parse;
use super::terminal::{count, note};
use crate::farm::{self, Header, Merged};
use crate::image_io::atomic;
use std::io::BufRead;
use std::path::{Path, PathBuf};

/// Add the shards of a picture
#[derive(Debug, clap::Args)]
#[command(after_help = "\
The files may come in any order and more than once: the picture is the same to the bit as that of one render. Shards of
another scene, other settings or another cut are refused. If some are missing, each is named and nothing is written,
unless --partial is given. An EXR has the layers that the shards' --aov asked for.

The file of --checkpoint may be one of those that are merged: the others are then added to it. Any other file stays.

Exit codes: 0 done, 1 failed or parts are missing, 2 bad usage, damaged files or files of different pictures.

Examples:
  gloss merge -o lemon.png -o lemon.exr lemon-*.exr
  find shards -name '*.exr' | gloss merge -o lemon.png -
  gloss merge --checkpoint half.exr --partial lemon-0.exr lemon-1.exr")]
pub(super) struct Args {
    /// Files that `gloss render --shard` or --checkpoint wrote; - for a list of them on stdin, a line each
    #[arg(required = true)]
    shards: Vec<PathBuf>,

    /// Picture to write, by its ending: .exr (linear, float) or .png (sRGB, 8 bits); may be given again
    #[arg(short, long, value_name = "FILE", required_unless_present = "checkpoint")]
    output: Vec<PathBuf>,

    /// Keep the exact sums in this file, to be merged with others later
    #[arg(long, value_name = "FILE")]
    checkpoint: Option<PathBuf>,

    /// Brightness of the PNG in stops: each one doubles the light
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, value_parser = parse::exposure,
          allow_negative_numbers = true)]
    exposure: f32,

    /// Write what is there even if parts are missing
    #[arg(long)]
    partial: bool,

    /// Say nothing but errors
    #[arg(short, long)]
    quiet: bool,
}

/// Merges, writes and tells.
pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let mut files = Files::default();
    let outputs = Output::check(&args.output, &mut files)?;
    let paths = paths(&args.shards)?;
    paths.iter().try_for_each(|path| files.reads("one of the shards", path))?;
    if let Some(path) = &args.checkpoint {
        check_checkpoint(path, &paths, &mut files)?;
    }
    let Merged { checkpoint, missing, repeated } = farm::merge(&paths).or_bad()?;

    for (path, other) in repeated.iter().filter(|_| !args.quiet) {
        note(&format!("{} is left out: {} has the same samples", path.display(), other.display()));
    }
    for line in &missing {
        note(&format!("{}: {line}", if args.partial { "warning" } else { "missing" }));
    }
    if !(missing.is_empty() || args.partial) {
        note("error: the picture is not whole, nothing is written (--partial writes what is there)");
        return Ok(Exit::Failed);
    }

    if let Some(path) = &args.checkpoint {
        checkpoint.write(path).or_failed()?;
    }
    let attributes = attributes(&checkpoint.header);
    for output in &outputs {
        let aovs = &checkpoint.header.identity.aovs;
        output.write(&checkpoint.film, args.exposure, &attributes, aovs).or_failed()?;
    }
    if !args.quiet {
        tell(args, &paths, &checkpoint.header);
    }
    Ok(Exit::Done)
}

/// The files named, those on stdin in the place of `-`.
fn paths(named: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut paths = vec![];
    for path in named {
        if path != Path::new("-") {
            paths.push(path.clone());
            continue;
        }
        for line in std::io::stdin().lock().lines() {
            let line = line.or_failed()?;
            if !line.is_empty() {
                paths.push(line.into());
            }
        }
    }
    Ok(paths)
}

/// Checks that the sums can be kept, and take the place of no others but those that they hold.
fn check_checkpoint(path: &Path, shards: &[PathBuf], files: &mut Files) -> Result<(), Failure> {
    if shards.iter().any(|shard| files::are_same(shard, path)) {
        return atomic::check_writable(path).or_failed();
    }
    check_writable(path, "--checkpoint", files)?;
    if path.exists() {
        let message = "is there: name it among the shards to add to it, or give --checkpoint another name";
        return Err(Failure::bad(format!("{} {message}", path.display())));
    }
    Ok(())
}

/// What an EXR remembers of how it was made, in the words of `gloss render`.
fn attributes(header: &Header) -> Vec<(String, String)> {
    let identity = &header.identity;
    let dropped = header.dropped;
    let all = [
        ("version", identity.version.clone()),
        ("scene", identity.scene.clone()),
        ("scene_hash", identity.scene_hash.clone()),
        ("settings", identity.settings.clone()),
        ("backend", identity.backend.clone()),
        ("seed", identity.seed.to_string()),
        ("spp", identity.spp.to_string()),
        ("seconds", format!("{:.3}", header.seconds)),
        ("rays", header.tally.all_rays().rays.to_string()),
        ("dropped_samples", (dropped.nan + dropped.infinite + dropped.negative).to_string()),
    ];
    all.into_iter().map(|(name, value)| (format!("gloss.{name}"), value)).collect()
}

fn tell(args: &Args, paths: &[PathBuf], header: &Header) {
    let outputs = args.output.iter().chain(&args.checkpoint).map(|path| path.display().to_string());
    note(&format!(
        "{}: {} files, {} samples, {} rays, {:.2} s of rendering",
        outputs.collect::<Vec<_>>().join(", "),
        paths.len(),
        count(header.tally.samples as f64),
        count(header.tally.all_rays().rays as f64),
        header.seconds,
    ));
}
