//! The workbench that renders: scenes and structures are made once and kept.

use super::run::{Shot, Task, Workbench};
use super::state::Cost;
use super::way::{Engine, Way};
use crate::accel::{self, AccelInfo, Accelerator, BuildOptions, SkipSupport};
use crate::geometry::Shape;
use crate::render::{RenderOptions, Silent, StopReason, render};
use crate::scene::{GeometryCache, Override, Plan, Scene, load_with};
use crate::trace::clock;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// Bytes of geometry that are kept beside that of the scenes themselves.
const CACHE_BYTES: usize = 4 << 30;

/// A structure and what it was built from.
struct Structure {
    engine: Engine,
    skip: SkipSupport,
    shapes: Vec<Shape>,
    accel: Box<dyn Accelerator>,
}

/// Renders ways of one scene file.
pub struct Bench<'a> {
    path: PathBuf,
    /// What is changed of the file whatever the way.
    overrides: Vec<Override>,
    resolution: [u32; 2],
    threads: usize,
    stop: &'a AtomicBool,
    began: Instant,
    cache: GeometryCache,
    scenes: HashMap<String, Scene>,
    structures: Vec<Structure>,
}

impl<'a> Bench<'a> {
    /// A workbench for a scene file with overrides; `threads` is 0 for all.
    pub fn new(
        path: &Path,
        overrides: Vec<Override>,
        resolution: [u32; 2],
        threads: usize,
        stop: &'a AtomicBool,
    ) -> Self {
        Self {
            path: path.to_owned(),
            overrides,
            resolution,
            threads,
            stop,
            began: Instant::now(),
            cache: GeometryCache::new(CACHE_BYTES),
            scenes: HashMap::new(),
            structures: vec![],
        }
    }

    /// Takes all pictures in this size from now on.
    pub fn set_resolution(&mut self, resolution: [u32; 2]) {
        self.resolution = resolution;
        self.scenes.clear();
    }

    /// Who answers the rays of the first structure that was built.
    pub fn backend(&self) -> String {
        self.structures.first().map_or_else(String::new, |structure| structure.accel.info().name)
    }

    /// Takes one picture of a way.
    ///
    /// # Errors
    /// If the scene cannot be loaded with the way's settings, or its structure cannot be built.
    pub fn shoot_way(&mut self, way: &Way, seed: u32, spp: u32) -> Result<Option<Shot>, String> {
        let key = serde_json::to_string(&way.settings).map_err(|e| e.to_string())?;
        if !self.scenes.contains_key(&key) {
            let scene = self.load(way)?;
            self.scenes.insert(key.clone(), scene);
        }
        let structure = self.structure(&key, way)?;
        let scene = self.scenes.get_mut(&key).expect("it was just loaded");
        (scene.settings.seed, scene.settings.spp) = (seed, spp);
        let Structure { accel, .. } = &self.structures[structure];
        let options = RenderOptions { threads: self.threads, noise: way.noise, ..RenderOptions::default() };
        let (cpu, wall) = (clock::process_seconds(), Instant::now());
        let outcome = render(scene, &**accel, &options, &Silent, self.stop);
        let (cpu, wall) = (clock::process_seconds() - cpu, wall.elapsed().as_secs_f64());
        if outcome.stopped_by == StopReason::Interrupted {
            return Ok(None);
        }
        let AccelInfo { memory_bytes, build_seconds, .. } = accel.info();
        let pixels = &outcome.film.pixels;
        let cost = Cost {
            cpu_seconds: cpu,
            wall_seconds: wall,
            rays: outcome.tally.all_rays().rays,
            spp: pixels.iter().map(|p| f64::from(p.count)).sum::<f64>() / pixels.len().max(1) as f64,
            memory_bytes: memory_bytes as u64,
            build_seconds,
            lost_throughput: outcome.tally.lost_throughput(),
        };
        Ok(Some(Shot { pixels: outcome.film.image(), cost }))
    }

    fn load(&mut self, way: &Way) -> Result<Scene, String> {
        let [width, height] = self.resolution;
        let mut overrides = self.overrides.clone();
        overrides.extend(way.overrides());
        overrides.push(Override::new("camera.resolution", format!("[{width}, {height}]")));
        load_with(&self.path, &overrides, &mut self.cache).map_err(|e| e.to_string())
    }

    /// The number of the structure for a scene, built if there is none yet.
    fn structure(&mut self, key: &str, way: &Way) -> Result<usize, String> {
        let scene = &self.scenes[key];
        let skip = if Plan::of(scene).needs_skip { SkipSupport::Any } else { SkipSupport::None };
        let known = self.structures.iter().position(|known| {
            known.engine == way.engine && known.skip == skip && known.shapes == scene.shapes
        });
        if let Some(known) = known {
            return Ok(known);
        }
        let Engine { backend, embree_mode, quality, robust } = way.engine;
        let threads = self.threads;
        let options = BuildOptions { quality, robust, compact: false, embree_mode, skip, threads };
        let accel = accel::build(backend, &scene.shapes, &options).map_err(|e| e.to_string())?;
        let shapes = scene.shapes.clone();
        self.structures.push(Structure { engine: way.engine, skip, shapes, accel });
        Ok(self.structures.len() - 1)
    }
}

impl Workbench for Bench<'_> {
    fn shoot(&mut self, task: &Task<'_>) -> Result<Option<Shot>, String> {
        self.shoot_way(task.way, task.seed, task.spp)
    }

    fn seconds(&self) -> f64 {
        self.began.elapsed().as_secs_f64()
    }
}

/// Columns and rows of the scene's shape with which one picture of the base takes about `seconds`, given what a
/// small one took; at least [`LEAST_EDGE`] on the longer side and at most the scene's own.
pub fn fitting_resolution(own: [u32; 2], seconds_per_pixel: f64, seconds: f64) -> [u32; 2] {
    let longest = f64::from(own[0].max(own[1]));
    let pixels = seconds / seconds_per_pixel.max(1e-12);
    let aspect = f64::from(own[0]) * f64::from(own[1]) / (longest * longest);
    let edge = (pixels / aspect).sqrt().clamp(LEAST_EDGE.min(longest), longest);
    own.map(|side| (f64::from(side) * edge / longest).round().max(1.0) as u32)
}

/// Pixels along the longer side below which a picture shows too little of a scene.
pub const LEAST_EDGE: f64 = 64.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_size_fits_the_time_and_keeps_the_shape() {
        assert_eq!(fitting_resolution([600, 300], 1e-4, 2.0), [200, 100]);
        assert_eq!(fitting_resolution([600, 300], 1e-4, 1e9), [600, 300]);
        assert_eq!(fitting_resolution([600, 300], 1e-4, 1e-9), [64, 32]);
        assert_eq!(fitting_resolution([20, 10], 1.0, 1e-9), [20, 10]);
    }
}
