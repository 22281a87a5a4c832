//! `gloss trade`: what each shortcut costs and saves.

use super::accel_args::AccelArgs;
use super::exit::{Exit, Failure, OrExit};
use super::output::check_writable;
use super::parse;
use super::scene_args::SceneArgs;
use super::signal::Interrupt;
use super::terminal::{note, print, typed};
use crate::image_io::write_atomically;
use crate::scene::Scene;
use crate::trade::bench::fitting_resolution;
use crate::trade::findings::About;
use crate::trade::run::{Listener, REFERENCE_SHOTS};
use crate::trade::{Bench, Catalogue, Findings, Knob, Options, State, Stopped, Target, Way};
use crate::trade::{catalogue, csv, page, run as measure, text};
use clap::ValueEnum;
use std::io::{IsTerminal, Write};
use std::num::NonZeroU32;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Measure what each shortcut costs and saves in a scene
#[derive(Debug, clap::Args)]
#[command(after_help = "\
A reference is rendered by a base that loses no light; then the base and every choice of every knob in turn, in rounds,
each round with a seed of its own. Of each way the table says: CPU seconds of a picture; relMSE, the expected mean of
its squared error by (reference + 0.01)^2; how much of that is noise, which more samples take away, and how much bias,
which they do not (`<` where none was found); how much light the picture has by that of the reference; FLIP; and
efficiency, 1 / (relMSE x CPU seconds), by that of the base.

Pictures have the scene's shape and as many pixels as the time allows, unless --resolution says how many; --spp are
those of the base (16). The run is kept in OUTPUT.state after each round, and --resume goes on from there.

Examples:
  gloss trade scenes/lemon.toml --time 60s -o trade.html --json trade.json --csv trade.csv
  gloss trade scenes/boxes.toml --knobs split,depth --rounds 10 --resolution 160x53
  gloss trade scenes/mesh.toml --time 5m --target-error 0.001 --target-time 10s
  gloss render scenes/lemon.toml -o lemon.png --like trade.json --target-error 0.001")]
pub(super) struct Args {
    #[command(flatten)]
    scene: SceneArgs,

    /// What to turn [default: all]
    #[arg(long, value_name = "A,B,...", value_delimiter = ',', value_enum)]
    knobs: Vec<Knob>,

    /// Pictures of each way, at least 2 [default: 8]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..))]
    rounds: Option<u32>,

    /// Wall time of the whole run, such as 90s or 5m; two rounds are done in any case
    #[arg(long, value_name = "TIME", value_parser = parse::duration)]
    time: Option<Duration>,

    /// Samples per pixel of the reference [default: 64 times those of the base]
    #[arg(long, value_name = "N")]
    reference_spp: Option<NonZeroU32>,

    /// Say which way has this relMSE with the least work; may be given again
    #[arg(long, value_name = "ERROR", value_parser = parse::error)]
    target_error: Vec<f64>,

    /// Say which way has the least error in so much CPU time of all threads; may be given again
    #[arg(long, value_name = "TIME", value_parser = parse::duration)]
    target_time: Vec<Duration>,

    /// Write a report: one HTML file that needs nothing else
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,

    /// Write all findings as JSON, for `gloss render --like` too
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,

    /// Write a table
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,

    /// Where the run is kept while it goes on, and after [default: OUTPUT.state, until it is done]
    #[arg(long, value_name = "FILE")]
    state: Option<PathBuf>,

    /// Go on with a run that was broken off, if there is one
    #[arg(long)]
    resume: bool,

    /// Brightness of the report's pictures in stops
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, value_parser = parse::exposure,
          allow_negative_numbers = true)]
    exposure: f32,

    #[command(flatten)]
    accel: AccelArgs,

    /// Print nothing but errors
    #[arg(short, long)]
    quiet: bool,
}

/// Samples per pixel of the base where nobody says otherwise.
const SPP: u32 = 16;

/// Pictures of each way where nobody says otherwise.
const ROUNDS: u32 = 8;

/// Wall time of a run for which no bound is given.
const USUAL_TIME: Duration = Duration::from_secs(300);

/// Measures, tells and writes.
pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    // Everything that can be refused is refused before the work.
    let mut files = args.scene.files()?;
    let outputs = [("--output", &args.output), ("--json", &args.json), ("--csv", &args.csv)];
    for (flag, path) in outputs.into_iter().chain([("--state", &args.state_path())]) {
        path.as_deref().map_or(Ok(()), |path| check_writable(path, flag, &mut files))?;
    }
    let interrupt = Interrupt::listen()?;
    let started = Instant::now();
    let scene = args.scene.load_beside(&mut files)?;
    let full = scene.camera.resolution;
    let threads = args.accel.build.threads;
    let mut bench = Bench::new(&args.scene.scene, args.scene.overrides(), full, threads, interrupt.stop());
    let spp = args.scene.spp().unwrap_or(SPP);
    let base = catalogue::base(&scene, args.accel.engine(), spp);
    let catalogue = Catalogue::new(&scene, &base, &args.knobs());

    interrupt.stops_softly();
    let mut state = match args.broken_off(&scene)? {
        Some(state) => state,
        None => {
            let resolution = args.size(&mut bench, &base, full, catalogue.ways.len())?;
            let Some(resolution) = resolution else { return Ok(interrupted(None)) };
            State::new(args.identity(&scene), resolution, catalogue)
        }
    };
    bench.set_resolution(state.resolution);
    // Loading and sizing are part of the time.
    state.seconds += started.elapsed().as_secs_f64();
    let mut teller = Teller::new(args.quiet, args.state_path());
    let options = args.options(&scene, spp);
    let stopped = measure(&mut state, &options, &mut bench, &mut teller);
    teller.clear();
    if stopped.map_err(Failure::failed)? == Stopped::Interrupted {
        return Ok(interrupted(teller.state.as_deref()));
    }
    let findings = Findings::of(&state, &args.about(full, bench.backend()), &args.targets());
    let findings = findings.ok_or_else(|| Failure::failed("no round was finished".into()))?;
    write(args, &findings, &state)?;
    if let (None, Some(path)) = (&args.state, &teller.state) {
        // What is done need not be gone on with; a file that will not go does no harm.
        let _ = std::fs::remove_file(path);
    }
    if !args.quiet {
        print(&text::to_text(&findings))?;
    }
    Ok(Exit::Done)
}

fn interrupted(state: Option<&Path>) -> Exit {
    match state {
        Some(path) => note(&format!("interrupted: go on with --resume ({})", path.display())),
        None => note("interrupted: nothing is written"),
    }
    Exit::Interrupted
}

fn write(args: &Args, findings: &Findings, state: &State) -> Result<(), Failure> {
    let text = |path: &Path, text: &str| {
        write_atomically(path, |file| file.write_all(text.as_bytes()).map_err(|e| e.to_string())).or_failed()
    };
    if let Some(path) = &args.json {
        let json = serde_json::to_string_pretty(findings).or_failed()?;
        text(path, &format!("{json}\n"))?;
    }
    if let Some(path) = &args.csv {
        text(path, &csv::to_csv(findings))?;
    }
    if let Some(path) = &args.output {
        text(path, &page::to_html(findings, state, &typed(), args.exposure))?;
    }
    Ok(())
}

impl Args {
    fn knobs(&self) -> Vec<Knob> {
        if self.knobs.is_empty() { Knob::value_variants().to_vec() } else { self.knobs.clone() }
    }

    fn options(&self, scene: &Scene, spp: u32) -> Options {
        let reference = self.reference_spp.map_or(64 * spp, NonZeroU32::get);
        Options {
            rounds: self.rounds(),
            time: self.bound(),
            reference_spp: reference.max(REFERENCE_SHOTS),
            seed: scene.settings.seed,
        }
    }

    /// The bound on the time: none if only the rounds were given a number.
    fn bound(&self) -> Option<Duration> {
        self.time.or(self.rounds.is_none().then_some(USUAL_TIME))
    }

    fn rounds(&self) -> u32 {
        self.rounds.unwrap_or(ROUNDS)
    }

    fn targets(&self) -> Vec<Target> {
        let errors = self.target_error.iter().map(|error| Target::Error(*error));
        errors.chain(self.target_time.iter().map(|time| Target::Time(time.as_secs_f64()))).collect()
    }

    /// Where the run is kept.
    fn state_path(&self) -> Option<PathBuf> {
        self.state.clone().or_else(|| {
            let output = self.output.as_ref().or(self.json.as_ref())?;
            let mut name = output.as_os_str().to_owned();
            name.push(".state");
            Some(name.into())
        })
    }

    /// Of what and how the run is; how long it takes is no part of it.
    fn identity(&self, scene: &Scene) -> String {
        let knobs: Vec<String> = self.knobs().iter().map(|knob| knob.name()).collect();
        format!(
            "{} {} {} {:?} {:?} {} gloss {}",
            scene.hash,
            self.scene.spp().unwrap_or(SPP),
            knobs.join(","),
            self.reference_spp,
            self.scene.resolution(),
            self.accel.identity(),
            env!("CARGO_PKG_VERSION")
        )
    }

    /// The run that was broken off, if it is to be gone on with and there is one.
    fn broken_off(&self, scene: &Scene) -> Result<Option<State>, Failure> {
        let Some(path) = self.state_path().filter(|path| self.resume && path.exists()) else {
            return Ok(None);
        };
        let state = State::read(&path).map_err(Failure::bad)?;
        if state.identity != self.identity(scene) {
            return Err(Failure::bad(format!(
                "{}: the state of a run of another scene, or with other flags",
                path.display()
            )));
        }
        Ok(Some(state))
    }

    /// Columns and rows to measure with: those that were asked for, or as many as the time allows. `None` if
    /// interrupted.
    fn size(
        &self,
        bench: &mut Bench<'_>,
        base: &Way,
        full: [u32; 2],
        ways: usize,
    ) -> Result<Option<[u32; 2]>, Failure> {
        if let Some(asked) = self.scene.resolution() {
            return Ok(Some(asked));
        }
        let small = fitting_resolution(full, 1.0, 0.0);
        bench.set_resolution(small);
        let trial = bench.shoot_way(base, 0, base.spp.div_ceil(4)).map_err(Failure::failed)?;
        let Some(trial) = trial else { return Ok(None) };
        let samples = trial.cost.spp * f64::from(small[0] * small[1]);
        let seconds_per_pixel = trial.cost.wall_seconds / samples * f64::from(base.spp);
        // So that the wanted rounds fit into what the reference leaves, with some room: other ways may take longer.
        let seconds = match self.bound() {
            Some(time) => 0.4 * time.as_secs_f64() / (ways as f64 * f64::from(self.rounds())),
            None => f64::INFINITY,
        };
        let fitting = fitting_resolution(full, seconds_per_pixel, seconds);
        let longest = f64::from(fitting[0].max(fitting[1]));
        let shrink = (f64::from(LARGEST) / longest).min(1.0);
        Ok(Some(fitting.map(|side| (f64::from(side) * shrink).round().max(1.0) as u32)))
    }

    fn about(&self, full_resolution: [u32; 2], backend: String) -> About {
        About { scene: self.scene.name(), full_resolution, machine: machine(), backend }
    }
}

/// Pixels along the longer side beyond which a larger picture teaches nothing new.
const LARGEST: u32 = 320;

/// The processor and how many threads it runs, as far as the system says.
fn machine() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    let model = model.map_or(std::env::consts::ARCH, |(_, name)| name.trim());
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    format!("{model}, {threads} threads")
}

/// Tells what is measured and keeps the run.
struct Teller {
    quiet: bool,
    /// Whether a line may be written over the one before.
    terminal: bool,
    state: Option<PathBuf>,
    last: Option<Instant>,
}

impl Teller {
    fn new(quiet: bool, state: Option<PathBuf>) -> Self {
        Self { quiet, terminal: std::io::stderr().is_terminal(), state, last: None }
    }

    fn clear(&self) {
        if self.terminal && !self.quiet {
            let _ = write!(std::io::stderr(), "\r\x1b[K");
        }
    }
}

impl Listener for Teller {
    fn tell(&mut self, line: &str) {
        let is_due = self.last.is_none_or(|last| last.elapsed() > Duration::from_secs(5));
        if self.quiet {
        } else if self.terminal {
            let _ = write!(std::io::stderr(), "\r\x1b[K{line}");
        } else if is_due {
            self.last = Some(Instant::now());
            note(line);
        }
    }

    fn keep(&mut self, state: &State) -> Result<(), String> {
        self.state.as_deref().map_or(Ok(()), |path| state.write(path))
    }
}
