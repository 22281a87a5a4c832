//! Rays of a scene's own render, recorded to be asked again.

mod common;

use common::scene;
use gloss::accel::{self, AccelInfo, Accelerator, Backend, BuildOptions, Coherence};
use gloss::core::{Hit, Ray};
use gloss::film::PixelRect;
use gloss::render::Prepared;
use gloss::trace::record;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Counts the rays that a backend is asked.
struct Counting {
    backend: Box<dyn Accelerator>,
    asked: AtomicUsize,
}

impl Counting {
    /// Rays asked since it was called last.
    fn take(&self) -> usize {
        self.asked.swap(0, Ordering::Relaxed)
    }
}

impl Accelerator for Counting {
    fn intersect(&self, rays: &[Ray], coherence: Coherence, hits: &mut [Option<Hit>]) {
        self.asked.fetch_add(rays.len(), Ordering::Relaxed);
        self.backend.intersect(rays, coherence, hits);
    }

    fn occluded(&self, rays: &[Ray], coherence: Coherence, occluded: &mut [bool]) {
        self.asked.fetch_add(rays.len(), Ordering::Relaxed);
        self.backend.occluded(rays, coherence, occluded);
    }

    fn info(&self) -> AccelInfo {
        self.backend.info()
    }
}

/// A chrome ball on a floor under a lamp, which has photons, edges and a pilot before its six tiles.
const SCENE: &str = r#"
[settings]
spp = 1
[camera]
eye = [0, 1.5, 5]
look_at = [0, 0.5, 0]
fov_deg = 35
resolution = [48, 32]
[materials.chrome]
type = "cosine-power"
exponent = 1000
[materials.chalk]
type = "diffuse"
kd = 0.7
[[shapes]]
type = "sphere"
center = [0, 0.5, 0]
radius = 0.5
material = "chrome"
[[shapes]]
type = "rect"
corner = [-3, 0, 3]
u = [6, 0, 0]
v = [0, 0, -6]
material = "chalk"
[[lights]]
type = "rect"
corner = [-1, 3, -1]
u = [2, 0, 0]
v = [0, 0, 2]
radiance = 5
"#;

#[test]
fn what_comes_before_the_picture_is_found_out_once_for_all_recorded_tiles() {
    let (scene, stop) = (scene(SCENE), AtomicBool::new(false));
    let backend = accel::build(Backend::Bvh, &scene.shapes, &BuildOptions::default()).expect("a structure");
    let counting = Counting { backend, asked: AtomicUsize::new(0) };
    Prepared::new(&scene, &counting, &stop);
    let preparing = counting.take();
    let [width, height] = scene.camera.resolution;
    let picture = PixelRect { x0: 0, y0: 0, x1: width, y1: height };
    let batches = record(&scene, &counting, picture, usize::MAX, &stop);
    let recorded: usize = batches.iter().map(|batch| batch.rays.len()).sum();
    assert!(recorded.min(preparing) >= picture.area(), "{recorded} recorded, {preparing} before");
    assert_eq!(counting.take(), preparing + recorded);
}
