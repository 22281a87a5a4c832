//! Where the time of a render went: rays by class, and what they would take alone.

use super::exit::Failure;
use super::terminal::{count, print, print_json};
use crate::accel::Accelerator;
use crate::render::{Outcome, RayClass};
use crate::scene::Scene;
use crate::trace::{clock, record, replay};
use serde::Serialize;
use serde_json::json;
use std::fmt::Write;
use std::sync::atomic::AtomicBool;

/// In which form.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Form {
    /// A table
    Text,
    /// One JSON object
    Json,
}

/// Rays of the render that are recorded and asked again, about.
const RECORDED: usize = 400_000;

/// Rounds of asking them.
const ROUNDS: usize = 3;

/// One class of rays in a render.
#[derive(Debug, Serialize)]
struct Class {
    class: RayClass,
    rays: u64,
    /// Of the threads' time within tiles.
    share: f64,
    rays_per_second: f64,
    alone_rays_per_second: f64,
}

/// Where the time of a render went.
#[derive(Debug, Serialize)]
pub(super) struct Stats {
    classes: Vec<Class>,
    /// Wall seconds.
    render_seconds: f64,
    /// CPU seconds of all threads.
    render_cpu_seconds: f64,
    /// CPU seconds that the render's rays take when nothing else is done.
    rays_alone_seconds: f64,
    /// Their ratio.
    efficiency: f64,
}

impl Stats {
    /// Records some of the render's rays again and asks them alone, on as many threads.
    pub(super) fn measure(
        scene: &Scene,
        accel: &dyn Accelerator,
        outcome: &Outcome,
        render_cpu_seconds: f64,
        threads: usize,
        stop: &AtomicBool,
    ) -> Self {
        let batches = record(scene, accel, outcome.film.rect, RECORDED, stop);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.expect("the operating system gives threads, as it did to the render");
        let alone = pool.install(|| replay(accel, &batches, ROUNDS));
        let class = |class| {
            let asked = outcome.tally.class(class);
            let seconds = 1e-9 * asked.nanoseconds as f64;
            let timing = alone.class(class)?;
            (asked.rays > 0).then(|| Class {
                class,
                rays: asked.rays,
                share: seconds / outcome.thread_seconds.max(1e-9),
                rays_per_second: asked.rays as f64 / seconds.max(1e-9),
                alone_rays_per_second: timing.rays as f64 / timing.seconds.max(1e-9),
            })
        };
        let classes: Vec<Class> = RayClass::ALL.into_iter().filter_map(class).collect();
        let rays_alone_seconds = classes.iter().map(|c| c.rays as f64 / c.alone_rays_per_second).sum();
        let efficiency = rays_alone_seconds / render_cpu_seconds.max(1e-9);
        let render_seconds = outcome.seconds;
        Self { classes, render_seconds, render_cpu_seconds, rays_alone_seconds, efficiency }
    }

    /// Prints them.
    pub(super) fn tell(&self, form: Form) -> Result<(), Failure> {
        match form {
            Form::Text => print(&self.to_text()),
            Form::Json => print_json(&json!(self)).map(|_| ()),
        }
    }

    fn to_text(&self) -> String {
        let mut text =
            format!("{:<10}{:>10}{:>9}{:>10}{:>10}\n", "class", "rays", "share", "Mray/s", "alone");
        for class in &self.classes {
            // Writing to a string cannot fail.
            let _ = writeln!(
                text,
                "{:<10}{:>10}{:>7.1} %{:>10.3}{:>10.3}",
                class.class.name(),
                count(class.rays as f64),
                100.0 * class.share,
                class.rays_per_second / 1e6,
                class.alone_rays_per_second / 1e6,
            );
        }
        let shading = 1.0 - self.classes.iter().map(|class| class.share).sum::<f64>();
        let Self { rays_alone_seconds, render_cpu_seconds, efficiency, .. } = self;
        let _ = writeln!(text, "{:<10}{:>10}{:>7.1} %", "the rest", "", 100.0 * shading);
        let clock = clock::CLOCK;
        let _ = writeln!(
            text,
            "efficiency {efficiency:.3}: its rays alone take {rays_alone_seconds:.3} s of the render's \
             {render_cpu_seconds:.3} s of {clock}"
        );
        text
    }
}
