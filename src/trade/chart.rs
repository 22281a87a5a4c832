//! Findings as points of error against time.

use super::findings::{Findings, Found, Verdict};
use crate::report::{Point, Scatter, scatter};

/// What the axes are.
const AXES: [&str; 2] = ["CPU seconds", "relMSE"];

/// All ways, with the front through those that no other beats; labels only there.
pub(super) fn all(f: &Findings) -> String {
    let points = f.ways.iter().enumerate().rev().map(|(number, found)| {
        let label = if found.on_front || number == 0 { found.way.name.clone() } else { String::new() };
        point(number, found, label)
    });
    let points: Vec<Point> = points.collect();
    let mut front: Vec<[f64; 2]> = f.ways.iter().filter(|found| found.on_front).map(place).collect();
    front.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let title = "Error of one picture against its CPU time";
    scatter(&Scatter { title, axes: AXES, points: &points, line: &front, size: [720.0, 420.0] })
}

/// The choices of one knob before the other ways.
pub(super) fn knob(f: &Findings, number: usize) -> String {
    let turned = &f.knobs[number];
    let is_chosen = |way: usize| turned.choices.iter().any(|choice| choice.way == way);
    let others = f.ways.iter().enumerate().filter(|(way, _)| !is_chosen(*way));
    let faint = others.map(|(way, found)| Point { class: "faint", ..point(way, found, String::new()) });
    let chosen =
        turned.choices.iter().map(|choice| point(choice.way, &f.ways[choice.way], choice.name.clone()));
    let points: Vec<Point> = faint.chain(chosen).collect();
    let title = format!("{}: error against CPU time", turned.question);
    scatter(&Scatter { title: &title, axes: AXES, points: &points, line: &[], size: [440.0, 300.0] })
}

fn place(found: &Found) -> [f64; 2] {
    [found.cpu_seconds.median, found.errors.relmse.value]
}

fn point(number: usize, found: &Found, label: String) -> Point {
    let [time, error] = place(found);
    let class = match (number, found.verdict, found.on_front) {
        (0, ..) => "base",
        (_, Verdict::Floor | Verdict::UnexpectedBias, _) => "floor",
        (_, _, true) => "front",
        _ => "other",
    };
    let e = found.errors.relmse;
    let t = found.cpu_seconds.mean;
    Point {
        at: [time, error],
        reach: [[t.low.max(0.3 * time), t.high.min(3.0 * time)], [e.low.max(0.1 * error), e.high]],
        label,
        name: format!(
            "{}: {time:.3} CPU seconds, relMSE {error:.2e}, {}",
            found.way.name,
            found.verdict.name()
        ),
        key: number,
        class,
    }
}
