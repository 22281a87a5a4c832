//! `gloss render`: a scene file in, pictures out.

use super::accel_args::AccelArgs;
use super::dump::Dump;
use super::exit::{Exit, Failure, OrExit};
use super::farm_args::{Begin, FarmArgs, Subject, Watch};
use super::like::LikeArgs;
use super::output::Output;
use super::progress::{Reporter, Style};
use super::scene_args::SceneArgs;
use super::signal::Interrupt;
use super::stats::{Form, Stats};
use super::terminal::{bytes, count, note, peak_memory_bytes};
use super::{parse, settings};
use crate::accel::AccelInfo;
use crate::core::memory;
use crate::film::{Film, PixelRect};
use crate::image_io::Format;
use crate::render::{Outcome, RayClass, RayLog, RenderOptions, StopReason, render};
use crate::scene::{Plan, Scene};
use crate::trace::clock;
use anyhow::Context;
use clap::ValueEnum;
use serde_json::json;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Render a scene
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
Files are written whole or not at all: an older file of the same name stays until the new one is complete.

With --checkpoint, Ctrl-C, SIGTERM and SIGHUP write one and end with code 75, SIGUSR1 writes one and goes on; the same command
with --resume goes on. A shard keeps its own checkpoint, OUTPUT.part, goes on from it by itself, and does nothing if its
output is finished; two processes at one shard do no harm.

Exit codes: 0 done, 1 failed, 2 bad usage, bad scene or another picture's checkpoint, 75 interrupted (no picture is
written).

Examples:
  gloss render scenes/lemon.toml -o lemon.png
  gloss render scenes/lemon.toml -o lemon.exr -o lemon.png --spp 1024 --exposure 0.5
  gloss render scenes/lemon.toml -o part.png --resolution 3840x2160 --crop 1600,900,2240,1260
  gloss render scenes/lemon.toml -o lecture.png --preset lecture --backend bvh
  gloss render scenes/lemon.toml -o dull.png -D materials.lemon.exponent=10
  gloss render scenes/lemon.toml -o lemon.png --checkpoint lemon.state.exr --resume
  gloss render scenes/lemon.toml -o lemon-3.exr --shard 3/8
  gloss render scenes/lemon.toml -o lemon.png --stats
  gloss render scenes/lemon.toml -o lemon.png --like trade.json --target-error 0.001")]
pub(super) struct Args {
    #[command(flatten)]
    scene: SceneArgs,

    /// Picture to write, by its ending: .exr (linear, float) or .png (sRGB, 8 bits); may be given again
    #[arg(short, long, value_name = "FILE", required = true)]
    output: Vec<PathBuf>,

    /// Brightness of the PNG in stops: each one doubles the light
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, value_parser = parse::exposure,
          allow_negative_numbers = true)]
    exposure: f32,

    /// Only this part of the picture, in pixels from the upper left
    #[arg(long, value_name = "X0,Y0,X1,Y1", value_parser = parse::crop)]
    crop: Option<PixelRect>,

    /// Edge of a tile in pixels, a multiple of 8; 0 for the default, which is taken too where samples are shared out.
    /// Changes no bit of the picture
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = parse::tile_size)]
    tile_size: u32,

    /// Stop after this long, such as 90s or 1.5h, with the samples taken so far
    #[arg(long, value_name = "TIME", value_parser = parse::duration, conflicts_with = "shard")]
    time: Option<Duration>,

    /// Stop where the estimated relative error of a part of the picture is below this, such as 0.02: the other samples
    /// go where it is not; the scene's samples per pixel are the most that any pixel gets
    #[arg(long, value_name = "ERROR", value_parser = parse::noise, conflicts_with = "shard")]
    noise: Option<f64>,

    #[command(flatten)]
    accel: AccelArgs,

    #[command(flatten)]
    like: LikeArgs,

    #[command(flatten)]
    farm: FarmArgs,

    /// Say where the time went: rays, Mray/s and share of time by class, and the time of the rays alone by that of the
    /// render. Takes a few seconds more, to record some rays and to ask them alone
    #[arg(long, value_name = "FORM", num_args = 0..=1, default_missing_value = "text", value_enum)]
    stats: Option<Form>,

    /// Write all rays to a file, 44 bytes each, for `gloss trace`
    #[arg(long, value_name = "FILE", conflicts_with = "stats")]
    dump_rays: Option<PathBuf>,

    /// How to tell about progress on stderr
    #[arg(long, value_name = "STYLE", default_value_t, value_enum)]
    progress: Style,

    /// Say nothing but errors
    #[arg(short, long)]
    quiet: bool,

    /// Say more: settings, plan, rays by class, size of the structure
    #[arg(short, long, conflicts_with = "quiet")]
    verbose: bool,
}

/// Renders, writes and tells.
pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let args = &args.with_advice()?;
    // Everything that can be refused is refused before the work.
    if args.farm.shard.is_some() {
        // Whoever shares a picture among machines should not have to visit each for this.
        make_directories(&args.output)?;
    }
    let mut files = args.scene.files()?;
    args.like.note_file(&mut files)?;
    let outputs = Output::check(&args.output, &mut files)?;
    args.farm.check_checkpoint(&outputs, &mut files)?;
    let dump = args.dump_rays.as_deref().map(|path| Dump::create(path, &mut files)).transpose()?;
    let interrupt = Interrupt::listen()?;

    let started = Instant::now();
    let scene = args.scene.load_beside(&mut files)?;
    let load_seconds = started.elapsed().as_secs_f64();
    check_crop(args.crop, scene.camera.resolution)?;
    if !scene.settings.aovs.is_empty() && outputs.iter().all(|output| output.format() != Format::Exr) {
        return Err(Failure::bad("AOVs are layers of an EXR: add -o NAME.exr".to_owned()));
    }
    tell_before(args, &scene);
    let mut job = match args.farm.begin(&args.subject(&scene), &outputs)? {
        Begin::Job(job) => job,
        Begin::Done(path) => {
            if !args.quiet {
                note(&format!("{}: this shard is finished", path.display()));
            }
            return Ok(Exit::Done);
        }
    };

    check_memory(job.rect(), &scene)?;

    let started = Instant::now();
    let accel = args.accel.build(&scene)?;
    let build_seconds = started.elapsed().as_secs_f64();

    let style = if args.quiet { Style::None } else { args.progress };
    let samples_before = job.samples_before();
    let options = RenderOptions {
        threads: args.accel.build.threads,
        crop: Some(job.rect()),
        samples: Some(job.samples()),
        resume: job.take_resume(),
        time: args.time,
        noise: args.noise,
        tile_size: args.tile_size,
        log: dump.as_ref().map(|dump| dump.rays() as &dyn RayLog),
    };
    interrupt.stops_softly();
    let reporter = Reporter::resume(style, samples_before);
    let keeper = job.keep(&interrupt)?;
    let watch = Watch { reporter: &reporter, keeper: keeper.as_ref() };
    let cpu_seconds = clock::process_seconds();
    let outcome = render(&scene, &*accel, &options, &watch, interrupt.stop());
    let cpu_seconds = clock::process_seconds() - cpu_seconds;
    reporter.finish();
    if outcome.stopped_by == StopReason::Interrupted {
        return job.break_off(keeper, &outcome);
    }
    let all_written = job.finish(keeper, &outcome)?;

    let report = Report { args, scene: &scene, accel: accel.info(), outcome, load_seconds, build_seconds };
    let attributes = report.attributes();
    for output in outputs.iter().filter(|_| !all_written) {
        output.write(&report.outcome.film, args.exposure, &attributes, &scene.settings.aovs).or_failed()?;
    }
    dump.map_or(Ok(()), Dump::finish)?;
    report.tell(&outputs);
    if let Some(form) = args.stats {
        let Report { scene, outcome, .. } = &report;
        Stats::measure(scene, &*accel, outcome, cpu_seconds, args.accel.build.threads, interrupt.stop())
            .tell(form)?;
    }
    Ok(Exit::Done)
}

impl Args {
    /// These flags after what `--like` brings.
    fn with_advice(&self) -> Result<Self, Failure> {
        let mut args = self.clone();
        if let Some(sentence) = self.like.apply(&mut args.scene, &mut args.accel)?
            && !self.quiet
        {
            note(&sentence);
        }
        if self.farm.shard.is_some() && args.scene.share_evenly()? && !self.quiet {
            note(
                "each pixel gets as many samples as the others: a shard does not know where the whole is noisy",
            );
        }
        Ok(args)
    }

    /// What checkpoints and shards are of.
    fn subject<'a>(&'a self, scene: &'a Scene) -> Subject<'a> {
        Subject { name: &self.scene.scene, scene, accel: &self.accel, crop: self.crop, noise: self.noise }
    }
}

/// What of the scene is not rendered as it is, but nearly.
fn approximation(scene: &Scene) -> Option<String> {
    let mode = scene.settings.occlusion.to_possible_value().expect("no mode is hidden");
    let said =
        format!("glossy reflections of the environment by `{}`, after Kozlowski and Kautz", mode.get_name());
    (!scene.settings.occlusion.is_exact()).then_some(said)
}

fn make_directories(outputs: &[PathBuf]) -> Result<(), Failure> {
    for directory in outputs.iter().filter_map(|output| output.parent()) {
        let made = std::fs::create_dir_all(directory);
        made.with_context(|| format!("cannot make the directory {}", directory.display())).or_failed()?;
    }
    Ok(())
}

fn check_crop(crop: Option<PixelRect>, [width, height]: [u32; 2]) -> Result<(), Failure> {
    match crop {
        Some(crop) if crop.x1 > width || crop.y1 > height => {
            Err(Failure::bad(format!("--crop goes beyond the picture, which has {width} x {height} pixels")))
        }
        _ => Ok(()),
    }
}

fn check_memory(rect: PixelRect, scene: &Scene) -> Result<(), Failure> {
    let needed = Film::bytes(rect.area(), !scene.settings.aovs.is_empty());
    if memory::gives(needed) {
        return Ok(());
    }
    Err(Failure::failed(format!(
        "the picture's {} pixels take {}, more than this machine gives: lower `resolution`, or render parts of it \
         with --crop",
        rect.area(),
        bytes(needed)
    )))
}

fn tell_before(args: &Args, scene: &Scene) {
    if args.quiet {
        return;
    }
    for warning in &scene.warnings {
        note(&format!("warning: {warning}"));
    }
    if args.verbose {
        note(&format!("settings: {}", settings::to_text(&scene.settings)));
        for sentence in Plan::of(scene).lines() {
            note(&format!("plan: {sentence}"));
        }
    }
}

/// A finished render and what it took.
struct Report<'a> {
    args: &'a Args,
    scene: &'a Scene,
    accel: AccelInfo,
    outcome: Outcome,
    load_seconds: f64,
    build_seconds: f64,
}

impl Report<'_> {
    /// What an EXR remembers of how it was made.
    fn attributes(&self) -> Vec<(String, String)> {
        let Self { args, scene, accel, outcome, .. } = self;
        let all = [
            ("version", env!("CARGO_PKG_VERSION").to_owned()),
            ("scene", args.scene.scene.display().to_string()),
            ("scene_hash", scene.hash.clone()),
            ("settings", settings::to_json(&scene.settings).to_string()),
            ("backend", accel.name.clone()),
            ("seed", scene.settings.seed.to_string()),
            ("spp", scene.settings.spp.to_string()),
            ("samples_per_pixel", format!("{:.3}", self.samples_per_pixel())),
            ("split", outcome.split.to_string()),
            ("splits_lights", outcome.splits_lights.to_string()),
            ("light_candidates", outcome.light_candidates.to_string()),
            ("guides_indirect", outcome.guides_indirect.to_string()),
            ("stopped_by", outcome.stopped_by.name().to_owned()),
            ("seconds", format!("{:.3}", outcome.seconds)),
            ("rays", outcome.tally.all_rays().rays.to_string()),
            ("dropped_samples", self.dropped().to_string()),
        ];
        let approximation = approximation(scene).map(|what| ("approximation", what));
        let all = all.into_iter().chain(approximation);
        all.map(|(name, value)| (format!("gloss.{name}"), value)).collect()
    }

    fn dropped(&self) -> u64 {
        let dropped = self.outcome.film.dropped;
        dropped.nan + dropped.infinite + dropped.negative
    }

    /// Whether all pixels have got as many samples.
    fn is_even(&self) -> bool {
        let mut counts = self.outcome.film.pixels.iter().map(|pixel| pixel.count);
        let first = counts.next();
        counts.all(|count| Some(count) == first)
    }

    /// Mean number of samples that the pixels have got.
    fn samples_per_pixel(&self) -> f64 {
        let pixels = &self.outcome.film.pixels;
        pixels.iter().map(|pixel| f64::from(pixel.count)).sum::<f64>() / pixels.len().max(1) as f64
    }

    fn rays_per_second(&self) -> f64 {
        self.outcome.tally.all_rays().rays as f64 / self.outcome.seconds.max(1e-9)
    }

    /// The last words.
    fn tell(&self, outputs: &[Output]) {
        if self.args.quiet {
            return;
        }
        if self.args.progress == Style::Json {
            return note(&self.json(outputs).to_string());
        }
        let Self { outcome, accel, .. } = self;
        if self.args.verbose {
            let rays = RayClass::ALL
                .map(|class| format!("{} {}", class.name(), count(outcome.tally.class(class).rays as f64)));
            note(&format!("rays: {}", rays.join(", ")));
            if outcome.split > 1 {
                let lights = if outcome.splits_lights { ", and take as many samples of lights" } else { "" };
                note(&format!("first hits split into {} rays{lights}", outcome.split));
            }
            if outcome.light_candidates > 1 {
                let count = outcome.light_candidates;
                note(&format!("samples of lights at glossy hits are chosen among {count} candidates"));
            }
            if outcome.guides_indirect {
                note("diffuse surfaces look where reflected light comes from");
            }
            note(&format!("structure: {}", bytes(accel.memory_bytes as u64)));
        }
        if let Some(what) = approximation(self.scene) {
            note(&format!("approximation: {what}"));
        }
        let lost = outcome.tally.lost_throughput();
        if lost > 0.0 {
            note(&format!("cut off at the greatest depth: {:.3} % of the throughput", 100.0 * lost));
        }
        if self.dropped() > 0 {
            let dropped = outcome.film.dropped;
            note(&format!(
                "warning: samples dropped: {} NaN, {} infinite, {} negative",
                dropped.nan, dropped.infinite, dropped.negative
            ));
        }
        note(&self.last_line(outputs));
    }

    fn last_line(&self, outputs: &[Output]) -> String {
        let names: Vec<_> = outputs.iter().map(|o| o.path().display().to_string()).collect();
        let samples = match self.outcome.stopped_by {
            StopReason::Samples if self.is_even() => format!("{} spp", self.scene.settings.spp),
            StopReason::Samples => {
                format!("{:.1} spp, more where there was noise", self.samples_per_pixel())
            }
            StopReason::Interrupted => {
                format!("{:.1} spp until it was told to stop", self.samples_per_pixel())
            }
            StopReason::Time => format!("{:.1} spp by the end of the time", self.samples_per_pixel()),
            StopReason::Noise => format!("{:.1} spp to the noise asked for", self.samples_per_pixel()),
        };
        let memory = peak_memory_bytes().map_or_else(|| "unknown".to_owned(), bytes);
        format!(
            "{} by {}: {}, {} rays/s, load {:.2} s, build {:.2} s, render {:.2} s, peak memory {memory}",
            names.join(", "),
            self.accel.name,
            samples,
            count(self.rays_per_second()),
            self.load_seconds,
            self.build_seconds,
            self.outcome.seconds,
        )
    }

    fn json(&self, outputs: &[Output]) -> serde_json::Value {
        let Self { outcome, accel, scene, .. } = self;
        let dropped = outcome.film.dropped;
        let rays: serde_json::Map<_, _> = RayClass::ALL
            .map(|class| (class.name().to_owned(), json!(outcome.tally.class(class).rays)))
            .into_iter()
            .collect();
        json!({
            "event": "done",
            "outputs": outputs.iter().map(|o| o.path().display().to_string()).collect::<Vec<_>>(),
            "backend": accel.name,
            "scene_hash": scene.hash,
            "spp": scene.settings.spp,
            "samples_per_pixel": self.samples_per_pixel(),
            "split": outcome.split,
            "splits_lights": outcome.splits_lights,
            "light_candidates": outcome.light_candidates,
            "guides_indirect": outcome.guides_indirect,
            "stopped_by": outcome.stopped_by,
            "seed": scene.settings.seed,
            "rays": rays,
            "rays_per_second": self.rays_per_second(),
            "load_seconds": self.load_seconds,
            "build_seconds": self.build_seconds,
            "render_seconds": outcome.seconds,
            "structure_bytes": accel.memory_bytes,
            "peak_memory_bytes": peak_memory_bytes(),
            "lost_throughput": outcome.tally.lost_throughput(),
            "dropped": { "nan": dropped.nan, "infinite": dropped.infinite, "negative": dropped.negative },
        })
    }
}
