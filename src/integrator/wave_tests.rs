//! Memory of the wave loop, whatever the numbers.

use super::*;
use crate::accel::AccelInfo;
use crate::accel::bvh::Bvh;
use crate::film::PixelRect;
use crate::integrator::z_order;
use crate::scene::load::{Format, load_str};
use std::path::Path;
use std::sync::atomic::AtomicUsize;

/// Asks another, notes the longest slice, and says stop after so many rays.
struct Watched<'a> {
    inner: Bvh,
    longest: AtomicUsize,
    rays_left: AtomicUsize,
    stop: &'a AtomicBool,
}

impl Watched<'_> {
    fn note(&self, rays: usize) {
        self.longest.fetch_max(rays, Ordering::Relaxed);
        let left = self.rays_left.load(Ordering::Relaxed).saturating_sub(rays);
        self.rays_left.store(left, Ordering::Relaxed);
        if left == 0 {
            self.stop.store(true, Ordering::Relaxed);
        }
    }
}

impl Accelerator for Watched<'_> {
    fn intersect(&self, rays: &[Ray], coherence: Coherence, hits: &mut [Option<Hit>]) {
        self.note(rays.len());
        self.inner.intersect(rays, coherence, hits);
    }

    fn occluded(&self, rays: &[Ray], coherence: Coherence, occluded: &mut [bool]) {
        self.note(rays.len());
        self.inner.occluded(rays, coherence, occluded);
    }

    fn info(&self) -> AccelInfo {
        self.inner.info()
    }
}

/// A closed room in which every hit is glossy, seen from within, and lit by a lamp.
const ROOM: &str = r#"
    [settings]
    spp = 9
    max_depth = 12
    roulette_from = 13
    at_max_depth = "black"
    glossy_samples = { branch = 9 }
    [camera]
    eye = [0, 0, 0]
    look_at = [0, 0, -1]
    resolution = [16, 16]
    [materials.glossy]
    type = "cosine-power"
    kr = 0.9
    exponent = 20
    kd = 0.05
    [[shapes]]
    type = "box"
    min = [-1, -1, -1]
    max = [1, 1, 1]
    material = "glossy"
    [[lights]]
    type = "sphere"
    center = [0, 0.8, 0]
    radius = 0.1
    radiance = [5, 5, 5]
"#;

/// Bytes of vertices that a scratch has room for, and the number of its lists.
fn waiting(scratch: &Scratch) -> (usize, usize) {
    let lists = || scratch.waiting.lists.iter().chain(&scratch.waiting.spare);
    (lists().map(Vec::capacity).sum(), lists().count())
}

#[test]
fn nine_rays_at_each_of_twelve_hits_wait_in_a_list_per_depth() {
    let scene = load_str(ROOM, Format::Toml, Path::new(""), &[]).expect("the room loads");
    let stop = AtomicBool::new(false);
    let accel = Watched {
        inner: Bvh::new(&scene.shapes, &Default::default()).expect("the room is built"),
        longest: AtomicUsize::new(0),
        rays_left: AtomicUsize::new(400_000),
        stop: &stop,
    };
    let integrator = Integrator { capacity: 512, ..Integrator::new(&scene, &accel) };
    let rect = PixelRect { x0: 0, y0: 0, x1: 16, y1: 16 };
    let mut film = Film::new([16, 16], rect);
    let (mut scratch, mut tally) = (Scratch::default(), Tally::default());
    let pixels = z_order(rect);
    let work = Work { pixels: &pixels, samples: 0..9, split: 9 };
    integrator.render(&mut film, &work, &mut scratch, &mut tally, &stop);

    // The tree of the first wave alone has 512 * 9^12 rays: it was cut off, and no half sample is in the film.
    assert!(tally.all_rays().rays > 400_000);
    assert!(film.pixels.iter().all(|p| p.count == 0) && tally.samples == 0);
    assert!(accel.longest.into_inner() <= 512, "a wave holds no more than its capacity");
    // Growing doubles: a list of up to 512 vertices has room for at most 1023.
    let (vertices, lists) = waiting(&scratch);
    assert!(lists > 6 && lists <= 13, "{lists} lists");
    assert!(vertices < 1024 * lists, "{vertices} vertices in {lists} lists");

    // What is left behind does not disturb the next picture.
    assert!(scratch.waiting.lists.is_empty());
    let shallow = Work { pixels: &pixels[..4], samples: 0..1, split: 1 };
    let mut scene = scene.clone();
    scene.settings.max_depth = 2;
    let render = |scratch: &mut Scratch| {
        let mut film = Film::new([16, 16], rect);
        let integrator = Integrator::new(&scene, &accel.inner);
        integrator.render(&mut film, &shallow, scratch, &mut Tally::default(), &AtomicBool::new(false));
        film
    };
    assert_eq!(render(&mut scratch), render(&mut Scratch::default()));
}
