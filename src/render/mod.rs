//! A whole picture: tiles on threads, rounds of samples, progress, and stopping.
//!
//! Read [`render`]; [`rounds`](self) below it decides how many samples come next, `noise` where they are wanted. [`Prepared`] is
//! what comes before the first sample; its `pilot` tells what is best for the picture, of which `split` says into how many rays a
//! first hit goes.

mod adaptive;
mod aov;
mod cost;
mod decisions;
mod noise;
mod pilot;
mod prepared;
mod split;
mod tile;
mod trial;

use crate::accel::Accelerator;
use crate::film::{Film, PixelRect};
use crate::integrator::{Integrator, Scratch, Work};
use crate::scene::Scene;
use rayon::ThreadPool;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};
use tile::{Lack, Tile, tiles};

pub use adaptive::can_grow;
pub use aov::aov_channels;
pub use decisions::Decisions;
pub use prepared::Prepared;

pub use crate::integrator::{ClassCount, RayClass, RayLog, Tally};

/// What of the picture to make, with what, and when to stop.
#[derive(Clone, Default)]
pub struct RenderOptions<'a> {
    /// Threads; 0 for one per core.
    pub threads: usize,
    /// Only this part of the image.
    pub crop: Option<PixelRect>,
    /// Edge of a tile in pixels; 0 for the default. Changes no bit of the picture: where splitting or
    /// sampling is decided from part to part, it is not heeded.
    pub tile_size: u32,
    /// Only these of the pixels' samples: a shard's share of the scene's `0..spp`.
    pub samples: Option<Range<u32>>,
    /// Stop after this long.
    pub time: Option<Duration>,
    /// Stop where the estimated relative error is below this: samples go where it is not.
    pub noise: Option<f64>,
    /// Go on from here, where a render of the same scene and settings was broken off: the picture is the same to the
    /// bit as that of a render that was not.
    pub resume: Option<State>,
    /// Is told of every ray.
    pub log: Option<&'a dyn RayLog>,
}

/// Edge of a tile in pixels where none is asked for.
pub const DEFAULT_TILE_SIZE: u32 = 16;

/// Hears how a render is getting on; called from any thread.
pub trait Progress: Sync {
    /// `samples` more camera samples of at most `total` are done.
    fn advance(&self, samples: u64, total: u64);

    /// Called after each tile with the picture so far, whose pixels each hold a whole number of samples.
    ///
    /// No other tile is added meanwhile: take what you need and return soon.
    fn state(&self, _state: &State) {}
}

/// Tells nobody.
pub struct Silent;

impl Progress for Silent {
    fn advance(&self, _: u64, _: u64) {}
}

/// Which rule ended a render.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum StopReason {
    /// All samples were taken.
    Samples,
    /// The time was up.
    Time,
    /// The error was small enough.
    Noise,
    /// It was told to stop.
    Interrupted,
}

impl StopReason {
    /// Its name for people and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Samples => "samples",
            Self::Time => "time",
            Self::Noise => "noise",
            Self::Interrupted => "interrupted",
        }
    }
}

/// A picture in work: all that a render needs to go on.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// The picture so far.
    pub film: Film,
    /// What was counted on the way: rays by class and their time, throughput lost at the greatest depth.
    pub tally: Tally,
    /// What was decided on the way.
    pub decisions: Decisions,
}

impl From<Film> for State {
    /// A film of nothing but samples: for a render whose settings leave no decisions to it.
    fn from(film: Film) -> Self {
        Self { film, tally: Tally::default(), decisions: Decisions::default() }
    }
}

/// A finished or interrupted render.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The picture.
    pub film: Film,
    /// What was counted on the way, with that of the state from which the render went on.
    pub tally: Tally,
    /// What was decided on the way.
    pub decisions: Decisions,
    /// Wall time.
    pub seconds: f64,
    /// Time within tiles and for what comes before them, summed over the threads: what the rays' times are shares of.
    pub thread_seconds: f64,
    /// What ended it.
    pub stopped_by: StopReason,
    /// Rays into which first hits were split.
    pub split: u32,
    /// Whether such hits took as many samples of lights, in place of one.
    pub splits_lights: bool,
    /// Candidates of which each sample of lights at a glossy hit was one.
    pub light_candidates: u32,
    /// Whether diffuse surfaces looked for all light that others reflect, and not for caustics alone.
    pub guides_indirect: bool,
}

/// Renders a scene with the structure built from its shapes.
///
/// `stop` is looked at often: once it is true, the render returns within a fraction of a second.
///
/// # Panics
/// If the crop is not within the image, the film to go on from has another rectangle, or the operating system gives
/// no thread.
pub fn render(
    scene: &Scene,
    accel: &dyn Accelerator,
    options: &RenderOptions<'_>,
    progress: &dyn Progress,
    stop: &AtomicBool,
) -> Outcome {
    let started = Instant::now();
    let pool = pool(options.threads);
    let prepared = pool.install(|| Prepared::new(scene, accel, stop));
    let preparing = started.elapsed() * pool.current_num_threads() as u32;
    let mut outcome = prepared.picture(&pool, started, options, progress, stop);
    outcome.thread_seconds += preparing.as_secs_f64();
    outcome
}

/// So many threads; 0 for one per core.
fn pool(threads: usize) -> ThreadPool {
    let builder = rayon::ThreadPoolBuilder::new().num_threads(threads);
    builder.build().expect("the operating system gives threads")
}

impl Prepared<'_> {
    /// The same as [`render`], without what comes before the first sample.
    ///
    /// # Panics
    /// As [`render`] does.
    pub fn render(&self, options: &RenderOptions<'_>, progress: &dyn Progress, stop: &AtomicBool) -> Outcome {
        self.picture(&pool(options.threads), Instant::now(), options, progress, stop)
    }

    /// The picture, begun at `started`, on the threads of a pool.
    fn picture(
        &self,
        pool: &ThreadPool,
        started: Instant,
        options: &RenderOptions<'_>,
        progress: &dyn Progress,
        stop: &AtomicBool,
    ) -> Outcome {
        let mut picture = Picture::new(self, options, progress, stop, started);
        let stopped_by = pool.install(|| picture.render());
        let state = picture.state.into_inner().expect(NO_PANIC);
        Outcome {
            film: state.film,
            tally: state.tally,
            decisions: state.decisions,
            seconds: started.elapsed().as_secs_f64(),
            thread_seconds: Duration::from_nanos(picture.thread_nanoseconds.into_inner()).as_secs_f64(),
            stopped_by,
            split: picture.split,
            splits_lights: picture.integrator.splits_lights(),
            light_candidates: picture.integrator.light_candidates(),
            guides_indirect: picture.integrator.guides_indirect(),
        }
    }
}

/// A pass over all tiles.
struct Round {
    /// Samples per pixel at its end.
    target: u32,
    /// How its samples are shared out, where they are not even.
    shares: Option<adaptive::Shares>,
}

const NO_PANIC: &str = "a thread that panics ends the render";

/// A render in work.
struct Picture<'a> {
    scene: &'a Scene,
    integrator: Integrator<'a>,
    options: &'a RenderOptions<'a>,
    progress: &'a dyn Progress,
    stop: &'a AtomicBool,
    deadline: Option<Instant>,
    samples: Range<u32>,
    /// Rays at first hits that split.
    split: u32,
    tiles: Vec<Tile>,
    state: Mutex<State>,
    /// Those that no thread is using.
    scratches: Mutex<Vec<Scratch>>,
    /// Samples of all pixels, if no rule ends the render before.
    total: u64,
    thread_nanoseconds: AtomicU64,
}

impl<'a> Picture<'a> {
    fn new(
        prepared: &'a Prepared<'a>,
        options: &'a RenderOptions<'a>,
        progress: &'a dyn Progress,
        stop: &'a AtomicBool,
        started: Instant,
    ) -> Self {
        let scene = prepared.scene;
        let [width, height] = scene.camera.resolution;
        let rect = options.crop.unwrap_or(PixelRect { x0: 0, y0: 0, x1: width, y1: height });
        assert!(rect.x1 <= width && rect.y1 <= height, "the crop lies within the image");
        let guides = !scene.settings.aovs.is_empty();
        let begin = || State::from(Film::new(scene.camera.resolution, rect).with_guides(guides));
        let state = options.resume.clone().unwrap_or_else(begin);
        assert_eq!(state.film.rect, rect, "a render goes on with the film that it began with");
        let samples = options.samples.clone().unwrap_or(0..scene.settings.spp);
        let by_tile = adaptive::shares_out(&scene.settings, options, samples.end - samples.start);
        let tile_size = if by_tile || options.tile_size == 0 { DEFAULT_TILE_SIZE } else { options.tile_size };
        let total = rect.area() as u64 * u64::from(samples.end - samples.start);
        Self {
            scene,
            integrator: prepared.integrator().with_log(options.log),
            options,
            progress,
            stop,
            deadline: options.time.map(|time| started + time),
            samples,
            split: prepared.split(),
            total,
            tiles: tiles(rect, tile_size),
            state: Mutex::new(state),
            scratches: Mutex::default(),
            thread_nanoseconds: AtomicU64::new(0),
        }
    }

    /// Takes rounds of samples until a rule says that it is enough.
    fn render(&mut self) -> StopReason {
        let count = self.samples.end - self.samples.start;
        let even = match self.find_noise(count) {
            Ok(even) => even,
            Err(reason) => return reason,
        };
        // A render that goes on is in the middle of a round.
        let mut target = match self.state().decisions.target {
            0 => self.next_round(even.unwrap_or(0), count),
            in_work => in_work,
        };
        loop {
            self.state().decisions.target = target;
            if self.all_clean() {
                return StopReason::Noise;
            }
            let shares = even.map(|even| self.shares(even, target));
            self.round(&Round { target, shares });
            if let Some(reason) = self.must_stop() {
                return reason;
            }
            if let Some(threshold) = self.options.noise {
                let state = self.state.get_mut().expect(NO_PANIC);
                noise::judge(threshold, &state.film, &self.tiles, &mut state.decisions);
            }
            if target >= count {
                return if self.all_clean() { StopReason::Noise } else { StopReason::Samples };
            }
            target = self.next_round(target, count);
        }
    }

    /// Whether a threshold was asked for and is met everywhere; pixels where it is get no more samples.
    fn all_clean(&mut self) -> bool {
        let state = self.state.get_mut().expect(NO_PANIC);
        self.options.noise.is_some() && noise::leave_clean(&state.decisions, &mut self.tiles)
    }

    fn state(&mut self) -> &mut State {
        self.state.get_mut().expect(NO_PANIC)
    }

    /// Samples per pixel after the next round: all of them, unless there is a rule to be looked at on the way.
    fn next_round(&self, done: u32, count: u32) -> u32 {
        if self.options.noise.is_none() && self.deadline.is_none() {
            return count;
        }
        count.min(done + (done / 2).max(FIRST_ROUND))
    }

    /// Brings every pixel that is still in work to the round's number of samples.
    fn round(&self, round: &Round) {
        self.each_tile(|_, tile, scratch| self.tile(round, tile, scratch));
    }

    /// Calls `work` with the number of each tile, on all threads.
    fn each_tile(&self, work: impl Fn(usize, &Tile, &mut Scratch) + Sync) {
        let tiles = self.tiles.par_iter().enumerate().with_max_len(1);
        tiles.for_each(|(number, tile)| {
            // As many as there are threads, each kept from tile to tile.
            let mut scratch = self.scratches.lock().expect(NO_PANIC).pop().unwrap_or_default();
            work(number, tile, &mut scratch);
            self.scratches.lock().expect(NO_PANIC).push(scratch);
        });
    }

    /// Brings a tile's pixels to what the round wants of them, a part at a time, so that what is done is soon seen.
    fn tile(&self, round: &Round, tile: &Tile, scratch: &mut Scratch) {
        let target = |pixel: &_| {
            let share = round.shares.as_ref().and_then(|shares| adaptive::share(shares, pixel));
            share.unwrap_or(round.target)
        };
        while self.must_stop().is_none() {
            let started = Instant::now();
            let groups = tile.pixels_by_lack(&self.lock().film, target);
            if groups.is_empty() {
                return;
            }
            let (mut film, mut tally) = (self.film(tile.rect), Tally::default());
            for (Lack { count, target }, pixels) in groups {
                let lack = Lack { count, target: target.min(count.saturating_add(PART)) };
                tally.merge(&self.take_samples(&mut film, &pixels, lack, scratch));
            }
            self.take(&[film], &tally, started, |_| {});
        }
    }

    /// Takes the samples that pixels of a tile lack, and what could not be added with them.
    fn take_samples(
        &self,
        film: &mut Film,
        pixels: &[(u32, u32)],
        Lack { count, target }: Lack,
        scratch: &mut Scratch,
    ) -> Tally {
        let samples = self.samples.start + count..self.samples.start + target;
        let mut tally = Tally::default();
        self.integrator.render(
            film,
            &Work { pixels, samples, split: self.split },
            scratch,
            &mut tally,
            self.stop,
        );
        film.dropped.merge(tally.dropped);
        tally
    }

    /// An empty film for a part of the picture.
    fn film(&self, rect: PixelRect) -> Film {
        Film::new(self.scene.camera.resolution, rect).with_guides(!self.scene.settings.aovs.is_empty())
    }

    /// Adds the samples of a tile, and what was found out by them, to the picture.
    fn take(&self, films: &[Film], tally: &Tally, started: Instant, decide: impl FnOnce(&mut Decisions)) {
        self.thread_nanoseconds.fetch_add(started.elapsed().as_nanos() as u64, Ordering::Relaxed);
        let mut state = self.lock();
        films.iter().for_each(|film| state.film.merge(film));
        state.tally.merge(tally);
        decide(&mut state.decisions);
        self.progress.advance(tally.samples, self.total);
        self.progress.state(&state);
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, State> {
        self.state.lock().expect(NO_PANIC)
    }

    fn must_stop(&self) -> Option<StopReason> {
        if self.stop.load(Ordering::Relaxed) {
            return Some(StopReason::Interrupted);
        }
        self.deadline.is_some_and(|deadline| Instant::now() >= deadline).then_some(StopReason::Time)
    }
}

/// Samples per pixel of the first round where there are several.
const FIRST_ROUND: u32 = 16;

/// Samples per pixel, at most, after which a tile hands over what it has: to checkpoints, and to whoever watches.
const PART: u32 = 256;
