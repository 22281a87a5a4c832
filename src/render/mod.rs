//! A whole picture: tiles on threads, rounds of samples, progress, and stopping.
//!
//! Read [`render`]; [`rounds`](self) below it decides how many samples come next, `noise` where they are wanted,
//! `split` into how many rays a glossy hit is worth splitting.

mod noise;
mod split;
mod tile;

use crate::accel::Accelerator;
use crate::film::{Film, PixelRect};
use crate::integrator::{Integrator, Scratch, Work};
use crate::scene::{GlossySamples, Scene};
use noise::Convergence;
use rayon::prelude::*;
use split::SplitMap;
use std::ops::Range;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};
use tile::{Tile, tiles};

pub use crate::integrator::{ClassCount, RayClass, RayLog, Tally};

/// What of the picture to make, with what, and when to stop.
#[derive(Clone, Default)]
pub struct RenderOptions<'a> {
    /// Threads; 0 for one per core.
    pub threads: usize,
    /// Only this part of the image.
    pub crop: Option<PixelRect>,
    /// Edge of a tile in pixels; 0 for the default. Changes no bit of the picture: where splitting is chosen tile by
    /// tile, it is not heeded.
    pub tile_size: u32,
    /// Only these of the pixels' samples: a shard's share of the scene's `0..spp`.
    pub samples: Option<Range<u32>>,
    /// Stop after this long.
    pub time: Option<Duration>,
    /// Stop where the estimated relative error is below this: samples go where it is not.
    pub noise: Option<f64>,
    /// Go on from this film, made by the same scene and settings.
    pub resume: Option<Film>,
    /// Is told of every ray.
    pub log: Option<&'a dyn RayLog>,
}

/// Edge of a tile in pixels where none is asked for.
pub const DEFAULT_TILE_SIZE: u32 = 16;

/// Hears how a render is getting on; called from any thread.
pub trait Progress: Sync {
    /// `samples` more camera samples of at most `total` are done.
    fn advance(&self, samples: u64, total: u64);

    /// Called after each tile with the film so far, whose pixels each hold a whole number of samples.
    ///
    /// No other tile is added meanwhile.
    fn film(&self, _film: &Film) {}
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

/// A finished or interrupted render.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The picture.
    pub film: Film,
    /// What was counted on the way: rays by class and their time, throughput lost at the greatest depth.
    pub tally: Tally,
    /// Wall time.
    pub seconds: f64,
    /// Time within tiles, summed over the threads: what the rays' times are shares of.
    pub thread_seconds: f64,
    /// What ended it.
    pub stopped_by: StopReason,
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
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(options.threads)
        .build()
        .expect("the operating system gives threads");
    let mut picture = Picture::new(scene, accel, options, progress, stop, started);
    let stopped_by = pool.install(|| picture.render());
    let state = picture.state.into_inner().expect("a thread that panics ends the render");
    Outcome {
        film: state.film,
        tally: state.tally,
        seconds: started.elapsed().as_secs_f64(),
        thread_seconds: Duration::from_nanos(picture.thread_nanoseconds.into_inner()).as_secs_f64(),
        stopped_by,
    }
}

/// What the threads add to.
struct State {
    film: Film,
    tally: Tally,
}

/// A render in work.
struct Picture<'a> {
    scene: &'a Scene,
    integrator: Integrator<'a>,
    options: &'a RenderOptions<'a>,
    progress: &'a dyn Progress,
    stop: &'a AtomicBool,
    deadline: Option<Instant>,
    samples: Range<u32>,
    tiles: Vec<Tile>,
    state: Mutex<State>,
    thread_nanoseconds: AtomicU64,
}

impl<'a> Picture<'a> {
    fn new(
        scene: &'a Scene,
        accel: &'a dyn Accelerator,
        options: &'a RenderOptions<'a>,
        progress: &'a dyn Progress,
        stop: &'a AtomicBool,
        started: Instant,
    ) -> Self {
        let [width, height] = scene.camera.resolution;
        let rect = options.crop.unwrap_or(PixelRect { x0: 0, y0: 0, x1: width, y1: height });
        assert!(rect.x1 <= width && rect.y1 <= height, "the crop lies within the image");
        let film = options.resume.clone().unwrap_or_else(|| Film::new(scene.camera.resolution, rect));
        assert_eq!(film.rect, rect, "a render goes on with the film that it began with");
        let by_tile = matches!(scene.settings.glossy_samples, GlossySamples::Auto(_));
        let tile_size = if by_tile || options.tile_size == 0 { DEFAULT_TILE_SIZE } else { options.tile_size };
        Self {
            scene,
            integrator: Integrator::new(scene, accel).with_log(options.log),
            options,
            progress,
            stop,
            deadline: options.time.map(|time| started + time),
            samples: options.samples.clone().unwrap_or(0..scene.settings.spp),
            tiles: tiles(rect, tile_size),
            state: Mutex::new(State { film, tally: Tally::default() }),
            thread_nanoseconds: AtomicU64::new(0),
        }
    }

    /// Takes rounds of samples until a rule says that it is enough.
    fn render(&mut self) -> StopReason {
        let mut splits = SplitMap::constant(self.scene.settings.glossy_samples.at(0), self.tiles.len());
        let mut done = 0;
        if matches!(self.scene.settings.glossy_samples, GlossySamples::Auto(_)) {
            splits = self.pilot(&mut done);
        }
        let mut convergence = self.options.noise.map(Convergence::new);
        let count = self.samples.end - self.samples.start;
        while done < count {
            done = self.next_round(done, count);
            self.round(done, &splits);
            if let Some(reason) = self.must_stop() {
                return reason;
            }
            if let Some(convergence) = &mut convergence {
                let film = &self.state.get_mut().expect("a thread that panics ends the render").film;
                if convergence.update(film, &mut self.tiles) {
                    return StopReason::Noise;
                }
            }
        }
        self.must_stop().unwrap_or(StopReason::Samples)
    }

    /// Samples per pixel after the next round: all of them, unless there is a rule to be looked at on the way.
    fn next_round(&self, done: u32, count: u32) -> u32 {
        if self.options.noise.is_none() && self.deadline.is_none() {
            return count;
        }
        count.min(done + (done / 2).max(FIRST_ROUND))
    }

    /// Two small rounds, of one ray per glossy hit and of several: what they cost and what they gain decides.
    fn pilot(&mut self, done: &mut u32) -> SplitMap {
        let per_pilot = split::pilot_samples(self.samples.end - self.samples.start);
        let measured = [1, split::PILOT_SPLIT].map(|m| {
            *done += per_pilot;
            self.round(*done, &SplitMap::constant(m, self.tiles.len()))
        });
        let [one, many] = measured;
        let top = self.tiles.first().map_or(0, |tile| tile.rect.y0);
        let columns = self.tiles.iter().take_while(|tile| tile.rect.y0 == top).count();
        SplitMap::choose(&one, &many, columns)
    }

    /// Brings every pixel that is still in work to `target` samples; what each tile's new samples were.
    fn round(&self, target: u32, splits: &SplitMap) -> Vec<split::Measured> {
        let tiles = self.tiles.par_iter().enumerate().with_max_len(1);
        let work = tiles.map_init(Scratch::default, |scratch, (number, tile)| {
            self.tile(tile, target, splits.of_tile(number), scratch)
        });
        work.collect()
    }

    fn tile(&self, tile: &Tile, target: u32, split: u32, scratch: &mut Scratch) -> split::Measured {
        let started = Instant::now();
        let mut film = Film::new(self.scene.camera.resolution, tile.rect);
        let mut tally = Tally::default();
        if self.must_stop().is_some() {
            return split::Measured::default();
        }
        let groups = tile.pixels_by_count(&self.lock().film, target);
        for (count, pixels) in groups {
            let samples = self.samples.start + count..self.samples.start + target;
            let work = Work { pixels: &pixels, samples, split };
            self.integrator.render(&mut film, &work, scratch, &mut tally, self.stop);
        }
        film.dropped = tally.dropped;
        self.thread_nanoseconds.fetch_add(started.elapsed().as_nanos() as u64, Ordering::Relaxed);

        let mut state = self.lock();
        state.film.merge(&film);
        state.tally.merge(&tally);
        let total = state.film.rect.area() as u64 * u64::from(self.samples.end - self.samples.start);
        self.progress.advance(tally.samples, total);
        self.progress.film(&state.film);
        split::Measured::new(&film, &tally)
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, State> {
        self.state.lock().expect("a thread that panics ends the render")
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
