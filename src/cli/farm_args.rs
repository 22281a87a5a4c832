//! Breaking a render off, going on with it, and taking a share of it.

use super::accel_args::AccelArgs;
use super::exit::{Exit, Failure, OrExit};
use super::files::Files;
use super::output::{Output, check_writable};
use super::parse;
use super::signal::Interrupt;
use super::terminal::note;
use crate::farm::{self, Checkpoint, Header, Identity, Keeper, Part, Shard, ShardBy};
use crate::film::PixelRect;
use crate::image_io::Format;
use crate::render::{Outcome, Progress, State, StopReason, Tally, can_grow};
use crate::scene::Scene;
use clap::ArgGroup;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// Flags of `gloss render` for long and for shared renders.
#[derive(Clone, Debug, clap::Args)]
#[command(group = ArgGroup::new("kept").args(["checkpoint", "shard"]).multiple(true))]
pub(super) struct FarmArgs {
    /// Keep the exact state of the render in this file (an EXR that viewers show), every so often and at the end
    #[arg(long, value_name = "FILE", help_heading = FARM)]
    checkpoint: Option<PathBuf>,

    /// Time between checkpoints: 60s, 5m, 1.5h; 0s for after each tile
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = parse::duration, help_heading = FARM,
          requires = "kept")]
    checkpoint_every: Duration,

    /// Go on from the checkpoint if it is there: the picture is the same to the bit as that of an unbroken render
    #[arg(long, help_heading = FARM)]
    resume: bool,

    /// Render one of N shares, numbered from 0, into a file for `gloss merge`: I/N, or auto or auto/N to ask the
    /// scheduler's variables (Slurm, PBS, Grid Engine, LSF, AWS Batch, HyperQueue, Kubernetes, GNU parallel)
    #[arg(long, value_name = "I/N", value_parser = parse::shard, help_heading = FARM)]
    pub(super) shard: Option<ShardFlag>,

    /// Shares of what
    #[arg(long, value_name = "WHAT", default_value_t, value_enum, help_heading = FARM)]
    shard_by: ShardBy,
}

const FARM: &str = "Long and shared renders";

/// What `--shard` says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ShardFlag {
    /// This one of so many.
    Number(u32, u32),
    /// The one that the scheduler says, of so many if it does not say that.
    Auto(Option<u32>),
}

impl ShardFlag {
    /// The index and the number of shards.
    pub(super) fn resolve(self) -> Result<(u32, u32), Failure> {
        match self {
            Self::Number(index, count) => Ok((index, count)),
            Self::Auto(count) => farm::find_index(&|name| std::env::var(name).ok(), count).or_bad(),
        }
    }
}

/// Where a render begins, and where its state is kept.
pub(super) struct Job {
    header: Header,
    every: Duration,
    /// Where unfinished work is kept.
    checkpoint: Option<PathBuf>,
    /// Where a finished shard goes.
    shard_output: Option<PathBuf>,
    resume: Option<State>,
}

/// Whether there is anything to do.
pub(super) enum Begin {
    /// There is.
    Job(Box<Job>),
    /// The shard is finished already.
    Done(PathBuf),
}

impl FarmArgs {
    /// Finds out what there is to do and what has been done of it.
    pub(super) fn begin(&self, subject: &Subject<'_>, outputs: &[Output]) -> Result<Begin, Failure> {
        let identity = subject.identity();
        let (part, shard_output) = self.part(&identity, outputs)?;
        let header = Header::new(identity, part);

        if let Some(path) = &shard_output
            && let Some(found) = farm::find(path, &header, false).or_bad()?
            && found.header.is_finished()
        {
            return Ok(Begin::Done(path.clone()));
        }
        let checkpoint = self.checkpoint(outputs);
        let mut job = Job { header, every: self.checkpoint_every, checkpoint, shard_output, resume: None };
        self.find_checkpoint(&mut job)?;
        Ok(Begin::Job(Box::new(job)))
    }

    /// Checks that unfinished work can be kept, and is kept in no other file of the command's.
    pub(super) fn check_checkpoint(&self, outputs: &[Output], files: &mut Files) -> Result<(), Failure> {
        self.checkpoint(outputs).map_or(Ok(()), |path| check_writable(&path, "--checkpoint", files))
    }

    /// Where unfinished work is kept, if anywhere: that of a shard beside its output.
    fn checkpoint(&self, outputs: &[Output]) -> Option<PathBuf> {
        self.checkpoint.clone().or_else(|| {
            let output = self.shard.and(outputs.first())?;
            let mut name = output.path().as_os_str().to_owned();
            name.push(".part");
            Some(name.into())
        })
    }

    /// The samples to take, and the file that a shard goes to.
    fn part(&self, identity: &Identity, outputs: &[Output]) -> Result<(Part, Option<PathBuf>), Failure> {
        let Some(flag) = self.shard else {
            let (rect, end) = (identity.picture, identity.spp);
            return Ok((Part { rect, first: 0, end, shard: None, finished: false }, None));
        };
        if identity.adaptive {
            return Err(Failure::bad(
                "a shard's samples cannot depend on what the others find: leave --adaptive out".to_owned(),
            ));
        }
        let (index, count) = flag.resolve()?;
        let part =
            Shard::new(index, count, self.shard_by).and_then(|s| s.part(identity.picture, identity.spp));
        match outputs {
            [output] if output.format() == Format::Exr => {
                Ok((part.or_bad()?, Some(output.path().to_owned())))
            }
            _ => Err(Failure::bad(
                "a shard has one output, and it ends in .exr: `gloss merge` makes the picture".to_owned(),
            )),
        }
    }

    /// Takes up what an earlier run has left.
    fn find_checkpoint(&self, job: &mut Job) -> Result<(), Failure> {
        let Some(path) = &job.checkpoint else {
            if self.resume {
                return Err(Failure::bad(
                    "--resume goes on from a file: say which by --checkpoint FILE".to_owned(),
                ));
            }
            return Ok(());
        };
        // A shard that the scheduler starts again goes on by itself.
        let is_own = self.checkpoint.is_none();
        if !(self.resume || is_own) {
            if path.exists() {
                let message =
                    format!("{} is there: add --resume to go on from it, or remove it", path.display());
                return Err(Failure::bad(message));
            }
            return Ok(());
        }
        if let Some(Checkpoint { header, film }) =
            farm::find(path, &job.header, job.shard_output.is_none()).or_bad()?
        {
            job.header.tally = header.tally;
            job.header.seconds = header.seconds;
            job.resume = Some(State { film, tally: Tally::default(), decisions: header.decisions });
        }
        Ok(())
    }
}

/// What is rendered.
pub(super) struct Subject<'a> {
    /// The scene's file.
    pub(super) name: &'a Path,
    pub(super) scene: &'a Scene,
    pub(super) accel: &'a AccelArgs,
    pub(super) crop: Option<PixelRect>,
    /// The error at which pixels are left alone.
    pub(super) noise: Option<f64>,
}

impl Subject<'_> {
    /// All that must agree between the runs of one picture.
    fn identity(&self) -> Identity {
        let Self { name, scene, accel, crop, noise } = *self;
        let [width, height] = scene.camera.resolution;
        Identity {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            scene: name.display().to_string(),
            scene_hash: scene.hash.clone(),
            settings: scene.settings.to_string(),
            seed: scene.settings.seed,
            backend: accel.identity(),
            resolution: scene.camera.resolution,
            picture: crop.unwrap_or(PixelRect { x0: 0, y0: 0, x1: width, y1: height }),
            spp: scene.settings.spp,
            aovs: scene.settings.aovs.clone(),
            noise,
            adaptive: noise.is_some() || scene.settings.adaptive,
            grows: noise.is_none() && can_grow(&scene.settings),
        }
    }
}

impl Job {
    /// The pixels to render.
    pub(super) fn rect(&self) -> PixelRect {
        self.header.rect()
    }

    /// Which of their samples.
    pub(super) fn samples(&self) -> std::ops::Range<u32> {
        let part = self.header.parts[0];
        part.first..part.end
    }

    /// The state to go on from; can be taken once.
    pub(super) fn take_resume(&mut self) -> Option<State> {
        self.resume.take()
    }

    /// Starts to keep checkpoints, if there is a file for them.
    pub(super) fn keep(&self, interrupt: &Interrupt) -> Result<Option<Keeper>, Failure> {
        let Some(path) = &self.checkpoint else { return Ok(None) };
        let name = path.display().to_string();
        let told = move |written: Result<(), crate::image_io::ImageError>| {
            // The render is worth more than one of its checkpoints.
            if let Err(error) = written {
                note(&format!("warning: {error}; {name} is as old as it was"));
            }
        };
        let asked = Arc::clone(interrupt.checkpoint_asked());
        Keeper::start(path.clone(), self.every, self.header.clone(), asked, told).map(Some).or_failed()
    }

    /// Writes what an interrupted render has, and says where it is.
    pub(super) fn break_off(&self, keeper: Option<Keeper>, outcome: &Outcome) -> Result<Exit, Failure> {
        let seconds = outcome.seconds;
        let (Some(keeper), Some(path)) = (keeper, &self.checkpoint) else {
            note(&format!("interrupted after {seconds:.1} s of rendering: nothing is written"));
            return Ok(Exit::Interrupted);
        };
        keeper.finish(outcome, false, None).or_failed()?;
        note(&format!(
            "interrupted after {seconds:.1} s of rendering: {} has all of it, go on by the same command with --resume",
            path.display()
        ));
        Ok(Exit::Interrupted)
    }

    /// Writes the last checkpoint, or the shard's file; whether that was all there is to write.
    pub(super) fn finish(&self, keeper: Option<Keeper>, outcome: &Outcome) -> Result<bool, Failure> {
        let Some(keeper) = keeper else { return Ok(false) };
        // A time limit ends a render before all of its samples are there.
        let finished = outcome.stopped_by != StopReason::Time;
        keeper.finish(outcome, finished, self.shard_output.as_deref()).or_failed()?;
        if self.shard_output.is_some()
            && let Some(unfinished) = &self.checkpoint
        {
            // Another attempt at this shard may have removed it; what is left over is harmless.
            let _ = std::fs::remove_file(unfinished);
        }
        Ok(self.shard_output.is_some())
    }

    /// Samples that the runs before have taken.
    pub(super) fn samples_before(&self) -> u64 {
        let pixels = self.resume.iter().flat_map(|state| &state.film.pixels);
        pixels.map(|pixel| u64::from(pixel.count)).sum()
    }
}

/// Tells both the user and the keeper of checkpoints.
pub(super) struct Watch<'a> {
    pub(super) reporter: &'a dyn Progress,
    pub(super) keeper: Option<&'a Keeper>,
}

impl Progress for Watch<'_> {
    fn advance(&self, samples: u64, total: u64) {
        self.reporter.advance(samples, total);
    }

    fn state(&self, state: &State) {
        if let Some(keeper) = self.keeper {
            keeper.offer(state);
        }
    }
}
