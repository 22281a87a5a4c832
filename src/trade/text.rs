//! Findings for a terminal: a small plot, a table by knob, advice.

use super::advice::{Advice, Target};
use super::findings::{Findings, Found};
use std::fmt::Write;

/// Columns and rows of the plot.
const PLOT: [usize; 2] = [64, 16];

/// All of it.
pub fn to_text(f: &Findings) -> String {
    let [width, height] = f.resolution;
    let mut out = format!(
        "{}: {} ways in {} rounds, {width} x {height} pixels, {:.0} s\n\
         reference: {} spp, its own relMSE {:.1e}\n\n",
        f.scene,
        f.ways.len(),
        f.rounds,
        f.seconds,
        f.reference_spp,
        f.reference_error.value
    );
    out += &plot(&f.ways);
    for turned in &f.knobs {
        // Writing to a string cannot fail.
        let _ = writeln!(out, "\n{}: {}", turned.knob.name(), turned.question);
        let _ = writeln!(
            out,
            "  {:<20}{:>9} {:>10} {:>9} {:>9} {:>8} {:>7} {:>6}  ",
            "", "CPU s", "relMSE", "noise", "bias", "light", "FLIP", "eff."
        );
        for choice in &turned.choices {
            out += &row(&choice.name, &f.ways[choice.way]);
        }
    }
    for left in &f.left_out {
        let which = left.choice.as_ref().map_or(String::new(), |choice| format!(" {choice}"));
        let _ = writeln!(out, "\nleft out: {}{which}: {}", left.knob.name(), left.why);
    }
    if !f.advice.is_empty() {
        out.push('\n');
    }
    f.advice.iter().for_each(|advice| out += &format!("{}\n", sentence(advice)));
    out
}

fn row(name: &str, f: &Found) -> String {
    let e = &f.errors;
    let bias = if e.bias.is_positive() {
        format!("{:.1e}", e.bias.value)
    } else {
        format!("<{:.0e}", e.bias.bound())
    };
    format!(
        "  {:<20}{:>9.3} {:>10.2e} {:>9.1e} {:>9} {:>+7.1}% {:>7.4} {:>6.2}  {}{}\n",
        name,
        f.cpu_seconds.median,
        e.relmse.value,
        e.noise.value,
        bias,
        100.0 * e.brightness.value,
        f.flip.value,
        f.relative_efficiency,
        if f.on_front { "front " } else { "" },
        if f.verdict == super::findings::Verdict::UnexpectedBias { "UNEXPECTED BIAS" } else { "" }
    )
}

/// What to take, in a sentence.
pub fn sentence(advice: &Advice) -> String {
    let what = match advice.target {
        Target::Error(error) => format!("for a relMSE of {error}"),
        Target::Time(seconds) => format!("in {seconds} CPU s"),
    };
    let times = match advice.times_the_base {
        Some(times) if advice.way != 0 => format!("; the base would take {times:.2} times as long"),
        _ => String::new(),
    };
    format!(
        "{what}: {} with {} spp: relMSE {:.2e} in {:.1} CPU s{times}",
        advice.name, advice.spp, advice.error, advice.seconds
    )
}

/// Error against time, both logarithmic: `o` a way, `*` one on the front, `B` the base.
fn plot(ways: &[Found]) -> String {
    let points: Vec<(f64, f64, char)> = ways
        .iter()
        .enumerate()
        .map(|(number, f)| {
            let sign = match (number, f.on_front) {
                (0, _) => 'B',
                (_, true) => '*',
                _ => 'o',
            };
            (f.cpu_seconds.median.max(1e-9).log10(), f.errors.relmse.value.max(1e-12).log10(), sign)
        })
        .collect();
    let ends = |of: &dyn Fn(&(f64, f64, char)) -> f64| {
        let (low, high) = points.iter().map(of).fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(x), h.max(x)));
        (low - 0.02, (high - low).max(0.1) + 0.04)
    };
    let ((x0, dx), (y0, dy)) = (ends(&|p| p.0), ends(&|p| p.1));
    let mut grid = vec![vec![' '; PLOT[0]]; PLOT[1]];
    for &(x, y, sign) in points.iter().rev() {
        let column = ((x - x0) / dx * (PLOT[0] - 1) as f64).round() as usize;
        let row = PLOT[1] - 1 - ((y - y0) / dy * (PLOT[1] - 1) as f64).round() as usize;
        let cell = &mut grid[row.min(PLOT[1] - 1)][column.min(PLOT[0] - 1)];
        if *cell != '*' || sign == 'B' {
            *cell = sign;
        }
    }
    let mut out = String::new();
    for (row, line) in grid.iter().enumerate() {
        let label = match row {
            0 => format!("{:8.1e}", 10f64.powf(y0 + dy)),
            r if r == PLOT[1] - 1 => format!("{:8.1e}", 10f64.powf(y0)),
            r if r == PLOT[1] / 2 => "  relMSE".to_owned(),
            _ => " ".repeat(8),
        };
        let _ = writeln!(out, "{label} |{}", line.iter().collect::<String>().trim_end());
    }
    let _ = writeln!(out, "{} +{}", " ".repeat(8), "-".repeat(PLOT[0]));
    let middle = format!("CPU s      {:>40}", "B base  * front  o others");
    let _ = writeln!(out, "{:10}{:<8.3}{middle:>50}{:>8.3}", "", 10f64.powf(x0), 10f64.powf(x0 + dx),);
    out
}
