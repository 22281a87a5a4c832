//! Who makes pictures one after the other, and keeps what the next may need.

use super::picture::{Picture, PictureError};
use super::record::Record;
use crate::accel::{self, Accelerator, Backend, BuildOptions, SkipSupport};
use crate::film::Film;
use crate::geometry::Shape;
use crate::image_io::label::Canvas;
use crate::image_io::{ExrOptions, Format, Image, ImageError, write_exr, write_png};
use crate::render::{Outcome, Progress, RenderOptions, StopReason, aov_channels, render};
use crate::scene::{GeometryCache, Plan, Scene, load_with};
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// How all pictures are made.
#[derive(Clone, Debug)]
pub struct WorkshopOptions {
    /// Who answers rays.
    pub backend: Backend,
    /// How its structure is built; which skip rules it is ready for follows from each scene.
    pub build: BuildOptions,
    /// Brightness of PNGs in stops.
    pub exposure: f32,
    /// Bytes of geometry to keep beside that of the present picture.
    pub cache_bytes: usize,
    /// Largest edge of the small copy that is made for a contact sheet, if one is wanted.
    pub thumbnail: Option<u32>,
}

/// A structure and what it was built from.
struct Structure {
    shapes: Vec<Shape>,
    skip: SkipSupport,
    accel: Box<dyn Accelerator>,
    /// What it took to have it: load and build, in seconds.
    load_seconds: f64,
    build_seconds: f64,
}

/// Makes pictures, and keeps geometry and the last structure.
pub struct Workshop {
    options: WorkshopOptions,
    cache: GeometryCache,
    structure: Option<Structure>,
}

/// A picture that was made.
#[derive(Clone, Debug)]
pub struct Made {
    /// How.
    pub record: Record,
    /// A small copy.
    pub thumbnail: Option<Canvas>,
    /// What was odd about the scene.
    pub warnings: Vec<String>,
}

impl Workshop {
    /// An empty workshop.
    pub fn new(options: WorkshopOptions) -> Self {
        let cache = GeometryCache::new(options.cache_bytes);
        Self { options, cache, structure: None }
    }

    /// The record of a picture of which nothing is known yet.
    pub fn record_of(picture: &Picture) -> Record {
        Record {
            event: "picture".into(),
            name: picture.name.clone(),
            job: picture.job.clone(),
            frame: picture.frame,
            scene: picture.scene.display().to_string(),
            overrides: picture.overrides.iter().map(|o| (o.path.clone(), o.value.clone())).collect(),
            ..Record::default()
        }
    }

    /// Whether a record of an earlier run stands for this picture: the same scene by its hash, with the same samples,
    /// and all files are there.
    ///
    /// # Errors
    /// If the scene cannot be loaded.
    pub fn is_done(&mut self, picture: &Picture, record: &Record) -> Result<bool, PictureError> {
        let outputs: Vec<_> = picture.outputs.iter().map(|path| path.display().to_string()).collect();
        if record.error.is_some()
            || record.outputs != outputs
            || !picture.outputs.iter().all(|path| path.is_file())
        {
            return Ok(false);
        }
        let scene = load_with(&picture.scene, &picture.overrides, &mut self.cache)?;
        Ok((&scene.hash, scene.settings.spp) == (&record.scene_hash, record.spp))
    }

    /// Loads, builds, renders and writes.
    ///
    /// # Errors
    /// If any of it fails. Files are written whole or not at all, and the workshop is as good as before.
    pub fn make(
        &mut self,
        picture: &Picture,
        progress: &dyn Progress,
        stop: &AtomicBool,
    ) -> Result<Made, PictureError> {
        let mut record = Self::record_of(picture);
        make_directories(picture)?;

        let clock = Instant::now();
        let scene = load_with(&picture.scene, &picture.overrides, &mut self.cache)?;
        record.load_seconds = clock.elapsed().as_secs_f64();
        self.build(&scene, &mut record)?;
        let structure = self.structure.as_ref().expect("it was just built");

        let options = RenderOptions { threads: self.options.build.threads, ..RenderOptions::default() };
        let outcome = render(&scene, &*structure.accel, &options, progress, stop);
        if outcome.stopped_by == StopReason::Interrupted {
            return Err(PictureError::Interrupted);
        }
        describe(&mut record, &scene, &outcome);

        let clock = Instant::now();
        for path in &picture.outputs {
            self.write(path, &outcome.film, &record, &scene)?;
            record.outputs.push(path.display().to_string());
        }
        record.write_seconds = clock.elapsed().as_secs_f64();
        let thumbnail = self
            .options
            .thumbnail
            .map(|edge| Canvas::of_image(&image_of(&outcome.film), self.options.exposure).shrunk(edge, edge));
        Ok(Made { record, thumbnail, warnings: scene.warnings })
    }

    /// Sees to it that there is a structure over the scene's shapes.
    fn build(&mut self, scene: &Scene, record: &mut Record) -> Result<(), PictureError> {
        let skip = if Plan::of(scene).needs_skip { SkipSupport::Any } else { SkipSupport::None };
        if let Some(kept) = &mut self.structure
            && (kept.skip == SkipSupport::Any || kept.skip == skip)
            && kept.shapes == scene.shapes
        {
            record.backend = kept.accel.info().name;
            record.structure_kept = true;
            record.saved_seconds = kept.build_seconds + (kept.load_seconds - record.load_seconds).max(0.0);
            // The older shapes may be copies: one of the two is enough.
            kept.shapes.clone_from(&scene.shapes);
            return Ok(());
        }
        // One structure at a time is in memory.
        self.structure = None;
        let clock = Instant::now();
        let options = BuildOptions { skip, ..self.options.build };
        let accel = accel::build(self.options.backend, &scene.shapes, &options)?;
        let build_seconds = clock.elapsed().as_secs_f64();
        record.build_seconds = build_seconds;
        record.backend = accel.info().name;
        let (shapes, load_seconds) = (scene.shapes.clone(), record.load_seconds);
        self.structure = Some(Structure { shapes, skip, accel, load_seconds, build_seconds });
        Ok(())
    }

    fn write(&self, path: &Path, film: &Film, record: &Record, scene: &Scene) -> Result<(), ImageError> {
        let image = image_of(film);
        match Format::of(path)? {
            Format::Png => write_png(path, &image, self.options.exposure),
            Format::Exr => {
                let channels = aov_channels(&scene.settings.aovs, film);
                write_exr(
                    path,
                    &image,
                    &ExrOptions { attributes: attributes(record, scene), channels, crop: None },
                )
            }
        }
    }
}

/// The directories that the outputs go to.
fn make_directories(picture: &Picture) -> Result<(), ImageError> {
    for output in &picture.outputs {
        let Some(parent) = output.parent().filter(|parent| !parent.as_os_str().is_empty()) else { continue };
        std::fs::create_dir_all(parent).map_err(|e| ImageError::Write {
            path: output.clone(),
            reason: format!("its directory {}: {e}", parent.display()),
        })?;
    }
    Ok(())
}

fn image_of(film: &Film) -> Image {
    Image::new(film.rect.width(), film.rect.height(), film.image())
}

fn describe(record: &mut Record, scene: &Scene, outcome: &Outcome) {
    let dropped = outcome.film.dropped;
    record.scene_hash.clone_from(&scene.hash);
    record.spp = scene.settings.spp;
    record.seed = scene.settings.seed;
    record.rays = outcome.tally.all_rays().rays;
    record.dropped = dropped.nan + dropped.infinite + dropped.negative;
    record.render_seconds = outcome.seconds;
}

/// What an EXR remembers of how it was made: the words of `gloss render`, and what was changed of the scene.
fn attributes(record: &Record, scene: &Scene) -> Vec<(String, String)> {
    let overrides = serde_json::to_string(&record.overrides).expect("texts by texts");
    let all = [
        ("version", env!("CARGO_PKG_VERSION").to_owned()),
        ("scene", record.scene.clone()),
        ("scene_hash", record.scene_hash.clone()),
        ("settings", scene.settings.to_string()),
        ("backend", record.backend.clone()),
        ("seed", record.seed.to_string()),
        ("spp", record.spp.to_string()),
        ("seconds", format!("{:.3}", record.render_seconds)),
        ("rays", record.rays.to_string()),
        ("dropped_samples", record.dropped.to_string()),
        ("name", record.name.clone()),
        ("overrides", overrides),
    ];
    all.into_iter().map(|(name, value)| (format!("gloss.{name}"), value)).collect()
}
