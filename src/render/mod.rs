//! A whole picture: tiles on threads, progress, and stopping.

use crate::accel::Accelerator;
use crate::film::{Film, PixelRect};
use crate::integrator::{Integrator, Scratch};
use crate::scene::Scene;
use rayon::prelude::*;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

pub use crate::integrator::{ClassCount, RayClass, RayLog, Tally};

/// What of the picture to make, and with what.
#[derive(Clone, Copy, Default)]
pub struct RenderOptions<'a> {
    /// Threads; 0 for one per core.
    pub threads: usize,
    /// Only this part of the image.
    pub crop: Option<PixelRect>,
    /// Edge of a tile in pixels; 0 for the default. Changes no bit of the picture.
    pub tile_size: u32,
    /// Is told of every ray.
    pub log: Option<&'a dyn RayLog>,
}

/// Edge of a tile in pixels where none is asked for.
pub const DEFAULT_TILE_SIZE: u32 = 16;

/// Hears how a render is getting on; called from any thread.
pub trait Progress: Sync {
    /// `samples` more camera samples of `total` are done.
    fn advance(&self, samples: u64, total: u64);
}

/// Tells nobody.
pub struct Silent;

impl Progress for Silent {
    fn advance(&self, _: u64, _: u64) {}
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
    /// Whether it was stopped before its end.
    pub interrupted: bool,
}

/// Renders a scene with the structure built from its shapes.
///
/// `stop` is looked at often: once it is true, the render returns within a fraction of a second.
///
/// # Panics
/// If the crop is not within the image, or the operating system gives no thread.
pub fn render(
    scene: &Scene,
    accel: &dyn Accelerator,
    options: &RenderOptions<'_>,
    progress: &dyn Progress,
    stop: &AtomicBool,
) -> Outcome {
    let started = Instant::now();
    let [width, height] = scene.camera.resolution;
    let whole = PixelRect { x0: 0, y0: 0, x1: width, y1: height };
    let rect = options.crop.unwrap_or(whole);
    assert!(rect.x1 <= width && rect.y1 <= height, "the crop lies within the image");
    let spp = scene.settings.spp;
    let total = rect.area() as u64 * u64::from(spp);
    let integrator = Integrator::new(scene, accel).with_log(options.log);
    let result = Mutex::new((Film::new(scene.camera.resolution, rect), Tally::default()));
    let thread_nanoseconds = AtomicU64::new(0);
    let render_tile = |scratch: &mut Scratch, tile: PixelRect| {
        if stop.load(Ordering::Relaxed) {
            return;
        }
        let tile_started = Instant::now();
        let mut film = Film::new(scene.camera.resolution, tile);
        let mut tally = Tally::default();
        integrator.render(&mut film, 0..spp, scratch, &mut tally, stop);
        film.dropped = tally.dropped;
        thread_nanoseconds.fetch_add(tile_started.elapsed().as_nanos() as u64, Ordering::Relaxed);
        progress.advance(tally.samples, total);
        let mut result = result.lock().expect("a thread that panics ends the render");
        result.0.merge(&film);
        result.1.merge(&tally);
    };
    let tile_size = if options.tile_size == 0 { DEFAULT_TILE_SIZE } else { options.tile_size };
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(options.threads)
        .build()
        .expect("the operating system gives threads");
    pool.install(|| {
        tiles(rect, tile_size).into_par_iter().with_max_len(1).for_each_init(Scratch::default, render_tile);
    });
    let (film, tally) = result.into_inner().expect("a thread that panics ends the render");
    Outcome {
        interrupted: tally.samples < total,
        film,
        tally,
        seconds: started.elapsed().as_secs_f64(),
        thread_seconds: Duration::from_nanos(thread_nanoseconds.into_inner()).as_secs_f64(),
    }
}

/// The tiles of a rectangle, cut along multiples of `size` of the full image.
fn tiles(rect: PixelRect, size: u32) -> Vec<PixelRect> {
    let cuts = |from: u32, to: u32| {
        let mut cuts: Vec<u32> = (from / size + 1..to.div_ceil(size)).map(|k| k * size).collect();
        cuts.insert(0, from);
        cuts.push(to);
        cuts
    };
    let (xs, ys) = (cuts(rect.x0, rect.x1), cuts(rect.y0, rect.y1));
    let rows = ys.windows(2).flat_map(|y| xs.windows(2).map(move |x| (x, y)));
    rows.map(|(x, y)| PixelRect { x0: x[0], y0: y[0], x1: x[1], y1: y[1] }).collect()
}
