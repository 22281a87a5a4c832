//! How a render is getting on, on stderr.

use super::terminal::{count, note};
use crate::render::Progress;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use serde_json::json;
use std::io::IsTerminal;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// In which form.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Style {
    /// A bar on a terminal, else plain lines
    #[default]
    Auto,
    /// A line every five seconds
    Plain,
    /// A JSON object a line, every half second and at the end
    Json,
    /// Nothing but the last line
    None,
}

/// Tells the user about samples done.
pub(super) struct Reporter {
    face: Face,
    /// Samples that earlier runs have taken.
    before: u64,
    done: AtomicU64,
    start: Instant,
}

enum Face {
    Bar(ProgressBar),
    Lines { json: bool, every: Duration, last: Mutex<Instant> },
    Nothing,
}

impl Reporter {
    /// Starts the clock.
    pub(super) fn start(style: Style) -> Self {
        Self::resume(style, 0)
    }

    /// Starts the clock of a render of which so many samples are there already.
    pub(super) fn resume(style: Style, before: u64) -> Self {
        let now = Instant::now();
        let lines = |json, every| Face::Lines { json, every, last: Mutex::new(now) };
        let face = match style {
            Style::Auto if std::io::stderr().is_terminal() => Face::Bar(bar()),
            Style::Auto | Style::Plain => lines(false, Duration::from_secs(5)),
            Style::Json => lines(true, Duration::from_millis(500)),
            Style::None => Face::Nothing,
        };
        Self { face, before, done: AtomicU64::new(before), start: now }
    }

    /// Takes the bar away.
    pub(super) fn finish(&self) {
        if let Face::Bar(bar) = &self.face {
            bar.finish_and_clear();
        }
    }
}

impl Progress for Reporter {
    fn advance(&self, samples: u64, total: u64) {
        let done = self.done.fetch_add(samples, Ordering::Relaxed) + samples;
        match &self.face {
            Face::Bar(bar) => {
                bar.set_length(total);
                bar.set_position(done);
            }
            Face::Lines { json, every, last } => {
                // Whoever finds the clock taken leaves the line to its holder.
                if let Ok(mut last) = last.try_lock()
                    && last.elapsed() >= *every
                {
                    *last = Instant::now();
                    note(&line(*json, self.before, done, total, self.start.elapsed().as_secs_f64()));
                }
            }
            Face::Nothing => {}
        }
    }
}

fn bar() -> ProgressBar {
    let style = ProgressStyle::with_template(
        "{bar:30} {percent:>3} %  {rate} samples/s  {elapsed} gone, {eta} to go",
    );
    let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr_with_hz(10));
    let rate = |state: &ProgressState, out: &mut dyn std::fmt::Write| {
        // A line that cannot be drawn is not drawn.
        let _ = out.write_str(&count(state.per_sec()));
    };
    bar.set_style(style.expect("the template is well-formed").with_key("rate", rate));
    bar
}

/// One line: how much is done, how fast, and how long the rest may take.
fn line(json: bool, before: u64, done: u64, total: u64, seconds: f64) -> String {
    let rate = (done - before) as f64 / seconds.max(1e-9);
    let left = total.saturating_sub(done) as f64 / rate.max(1e-9);
    if json {
        let event = json!({
            "event": "progress", "samples": done, "total": total, "seconds": seconds, "seconds_left": left,
        });
        return event.to_string();
    }
    let percent = 100.0 * done as f64 / total.max(1) as f64;
    format!("{percent:3.0} %  {} samples/s  {seconds:.0} s gone, {left:.0} s to go", count(rate))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_says_how_much_how_fast_and_how_long() {
        assert_eq!(line(false, 0, 25_000, 100_000, 10.0), " 25 %  2.50 k samples/s  10 s gone, 30 s to go");
        let event: serde_json::Value = serde_json::from_str(&line(true, 0, 1, 4, 2.0)).unwrap();
        assert_eq!(event["seconds_left"], 6.0);
        assert!(
            line(false, 25_000, 50_000, 100_000, 5.0).ends_with("5.00 k samples/s  5 s gone, 10 s to go")
        );
        // The very beginning and an empty picture.
        for (done, total, seconds) in [(0, 0, 0.0), (0, 7, 0.0), (9, 7, 1.0)] {
            assert!(!line(false, 0, done, total, seconds).contains("NaN"));
        }
    }

    #[test]
    fn samples_add_up_whatever_the_face() {
        for style in [Style::Plain, Style::Json, Style::None] {
            let reporter = Reporter::start(style);
            reporter.advance(3, 10);
            reporter.advance(4, 10);
            assert_eq!(reporter.done.load(Ordering::Relaxed), 7);
        }
    }

    #[test]
    fn the_bar_has_a_template() {
        bar().finish();
    }
}
