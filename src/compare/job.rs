//! The whole comparison: record rays, ask, judge, time, render, judge.

use super::answers::{ClassAnswers, Disagreement, compare_answers};
use super::explain::{Explained, explain};
use super::picture::{PictureDifference, compare_pictures};
use super::rate::{Rate, rates};
use super::verdict::Verdict;
use crate::accel::{AccelInfo, Accelerator};
use crate::film::{Film, PixelRect};
use crate::geometry::Shape;
use crate::integrator::RayClass;
use crate::render::{RenderOptions, Silent, StopReason, render};
use crate::scene::Scene;
use crate::trace::{Batch, clock, record};
use serde::Serialize;
use std::sync::atomic::{AtomicBool, Ordering};

/// How to compare.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Rays to record, about.
    pub rays: usize,
    /// Rounds of timing.
    pub rounds: usize,
    /// Distances may be apart by this fraction.
    pub tolerance: f32,
    /// Share of wrong answers up to which backends are statistically equal.
    pub max_wrong: f64,
    /// Render with different seeds.
    pub independent: bool,
    /// Threads of the renders; 0 for all.
    pub threads: usize,
}

/// One of the backends that are compared, and what it cost.
#[derive(Clone, Debug, Serialize)]
pub struct Subject {
    /// Its own name.
    pub name: String,
    /// Wall seconds of the build.
    pub build_seconds: f64,
    /// Bytes of the structure.
    pub memory_bytes: usize,
    /// Wall seconds of the render.
    pub render_seconds: f64,
    /// CPU seconds of the render, of all threads.
    pub render_cpu_seconds: f64,
    /// Rays per CPU second by class.
    pub rates: Vec<Rate>,
}

/// A backend against the first.
#[derive(Clone, Debug, Serialize)]
pub struct Pair {
    /// Index of the backend among the subjects.
    pub second: usize,
    /// What it comes to.
    pub verdict: Verdict,
    /// Why it is not better.
    pub reasons: Vec<String>,
    /// Answers that differ, by class.
    pub answers: Vec<ClassAnswers>,
    /// Which of those are right.
    pub explained: Explained,
    /// How the pictures differ.
    pub picture: PictureDifference,
    /// The rays with answers that differ.
    #[serde(skip)]
    pub disagreements: Vec<Disagreement>,
}

/// Everything that was found.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    /// The worst of the pairs' verdicts.
    pub verdict: Verdict,
    /// Hash of the scene.
    pub scene_hash: String,
    /// Triangles and spheres.
    pub primitives: usize,
    /// Columns and rows of the picture.
    pub resolution: [u32; 2],
    /// Samples per pixel.
    pub spp: u32,
    /// Seed of the first render.
    pub seed: u32,
    /// Whether the others have different seeds.
    pub independent: bool,
    /// Distances may be apart by this fraction.
    pub tolerance: f32,
    /// Share of wrong answers up to which backends are statistically equal.
    pub max_wrong: f64,
    /// Rounds of timing.
    pub rounds: usize,
    /// Rays recorded, by class.
    pub rays: Vec<(RayClass, u64)>,
    /// The backends; the first is what the others are held against.
    pub subjects: Vec<Subject>,
    /// The others against the first.
    pub pairs: Vec<Pair>,
    /// Their pictures.
    #[serde(skip)]
    pub films: Vec<Film>,
}

/// A backend to compare, built from the scene's shapes.
pub struct Contender<'a> {
    /// Its name for people.
    pub name: String,
    /// Who answers.
    pub accel: &'a dyn Accelerator,
}

/// A comparison in work.
struct Job<'a> {
    scene: Scene,
    backends: &'a [Contender<'a>],
    options: &'a Options,
    tell: &'a dyn Fn(&str),
    stop: &'a AtomicBool,
}

/// Compares backends with the first of them; `None` if `stop` was raised.
///
/// `tell` hears what is done next.
///
/// # Panics
/// If there are fewer than two backends.
pub fn run(
    scene: Scene,
    backends: &[Contender<'_>],
    options: &Options,
    tell: &dyn Fn(&str),
    stop: &AtomicBool,
) -> Option<Comparison> {
    assert!(backends.len() > 1, "it takes two to compare");
    Job { scene, backends, options, tell, stop }.run()
}

/// A render's film, wall seconds and CPU seconds.
type Rendered = (Film, f64, f64);

/// A backend's answers by class, the rays that it answers differently, and who is right.
type Asked = (Vec<ClassAnswers>, Vec<Disagreement>, Explained);

impl Job<'_> {
    fn run(mut self) -> Option<Comparison> {
        (self.tell)("recording rays");
        let [x1, y1] = self.scene.camera.resolution;
        let picture = PixelRect { x0: 0, y0: 0, x1, y1 };
        let batches = record(&self.scene, self.backends[0].accel, picture, self.options.rays, self.stop);
        let answers = self.ask(&batches)?;
        (self.tell)(&format!("timing {} rounds", self.options.rounds));
        let accels: Vec<_> = self.backends.iter().map(|backend| backend.accel).collect();
        let rates = rates(&accels, &batches, self.options.rounds);
        let rays = RayClass::ALL.map(|class| (class, rays_of(&batches, class)));
        drop(batches);

        let seed = self.scene.settings.seed;
        let rendered = self.render_all()?;
        let control =
            if self.options.independent { Some(self.render(0, seed.wrapping_add(2))?.0) } else { None };
        let subjects = self.subjects(&rendered, rates);
        let films: Vec<Film> = rendered.into_iter().map(|(film, ..)| film).collect();
        let pairs = answers.into_iter().enumerate().map(|(i, (answers, disagreements, explained))| {
            let picture = compare_pictures(&films[0], &films[i + 1], control.as_ref());
            self.pair(i + 1, answers, disagreements, explained, picture)
        });
        let pairs: Vec<Pair> = pairs.collect();
        Some(Comparison {
            verdict: pairs.iter().map(|pair| pair.verdict).max().expect("there are two backends at least"),
            scene_hash: self.scene.hash.clone(),
            primitives: self.scene.shapes.iter().map(Shape::primitive_count).sum(),
            resolution: self.scene.camera.resolution,
            spp: self.scene.settings.spp,
            seed,
            independent: self.options.independent,
            tolerance: self.options.tolerance,
            max_wrong: self.options.max_wrong,
            rounds: self.options.rounds,
            rays: rays.into_iter().filter(|(_, rays)| *rays > 0).collect(),
            subjects,
            pairs,
            films,
        })
    }

    fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Answers of each backend but the first held against the first's.
    fn ask(&self, batches: &[Batch]) -> Option<Vec<Asked>> {
        let tolerance = self.options.tolerance;
        let first = self.backends[0].accel;
        let mut all = vec![];
        for second in &self.backends[1..] {
            if self.is_stopped() {
                return None;
            }
            (self.tell)(&format!("asking {}", second.name));
            let second = second.accel;
            let (answers, disagreements) = compare_answers(first, second, batches, tolerance);
            let explained = explain(&self.scene.shapes, [first, second], &disagreements, tolerance);
            all.push((answers, disagreements, explained));
        }
        Some(all)
    }

    /// The picture of each backend: of the scene's seed, or with the next one for all but the first.
    fn render_all(&mut self) -> Option<Vec<Rendered>> {
        let seed = self.scene.settings.seed;
        let other = if self.options.independent { seed.wrapping_add(1) } else { seed };
        (0..self.backends.len()).map(|i| self.render(i, if i == 0 { seed } else { other })).collect()
    }

    fn render(&mut self, backend: usize, seed: u32) -> Option<Rendered> {
        let Contender { name, accel } = &self.backends[backend];
        (self.tell)(&format!("rendering with {name}"));
        let own_seed = std::mem::replace(&mut self.scene.settings.seed, seed);
        let options = RenderOptions { threads: self.options.threads, ..RenderOptions::default() };
        let started = clock::process_seconds();
        let outcome = render(&self.scene, *accel, &options, &Silent, self.stop);
        let cpu_seconds = clock::process_seconds() - started;
        self.scene.settings.seed = own_seed;
        (outcome.stopped_by != StopReason::Interrupted).then_some((
            outcome.film,
            outcome.seconds,
            cpu_seconds,
        ))
    }

    fn subjects(&self, rendered: &[Rendered], rates: Vec<Vec<Rate>>) -> Vec<Subject> {
        let all = self.backends.iter().zip(rendered).zip(rates);
        let subject = |((backend, rendered), rates): ((&Contender<'_>, &Rendered), Vec<Rate>)| {
            let AccelInfo { memory_bytes, build_seconds, .. } = backend.accel.info();
            let (_, render_seconds, render_cpu_seconds) = *rendered;
            let name = backend.name.clone();
            Subject { name, build_seconds, memory_bytes, render_seconds, render_cpu_seconds, rates }
        };
        all.map(subject).collect()
    }

    fn pair(
        &self,
        second: usize,
        answers: Vec<ClassAnswers>,
        disagreements: Vec<Disagreement>,
        explained: Explained,
        picture: PictureDifference,
    ) -> Pair {
        let mut reasons = picture.broken_rules();
        let rays: u64 = answers.iter().map(|class| class.rays).sum();
        for (wrong, number) in explained.wrong().into_iter().zip([0, second]) {
            let share = wrong / (rays as f64).max(1.0);
            if share > self.options.max_wrong {
                let name = &self.backends[number].name;
                let limit = self.options.max_wrong;
                reasons.push(format!(
                    "{name} answers {share:.1e} of the rays wrongly; the limit is {limit:.1e}"
                ));
            }
        }
        let verdict = if !reasons.is_empty() {
            Verdict::Differs
        } else if disagreements.is_empty() {
            picture.verdict
        } else {
            Verdict::StatisticallyEqual
        };
        Pair { second, verdict, reasons, answers, explained, picture, disagreements }
    }
}

fn rays_of(batches: &[Batch], class: RayClass) -> u64 {
    batches.iter().filter(|batch| batch.class == class).map(|batch| batch.rays.len() as u64).sum()
}
