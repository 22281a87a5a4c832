//! A comparison as lines for a terminal.

use super::job::{Comparison, Pair, Subject};
use std::fmt::Write;

/// Letters that stand for the backends, in their order.
pub fn letter(number: usize) -> char {
    char::from(b'A' + (number % 26) as u8)
}

/// The whole comparison; `scene` is how the user calls it.
pub fn to_text(comparison: &Comparison, scene: &str) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = write_all(&mut text, comparison, scene);
    text
}

fn write_all(out: &mut String, c: &Comparison, scene: &str) -> std::fmt::Result {
    let [width, height] = c.resolution;
    writeln!(out, "scene     {scene} ({})", c.scene_hash.get(..16).unwrap_or(&c.scene_hash))?;
    writeln!(out, "          {} primitives, {width} x {height} pixels, {}", c.primitives, samples(c))?;
    for (number, subject) in c.subjects.iter().enumerate() {
        writeln!(out, "{}         {}", letter(number), subject.name)?;
    }
    write_costs(out, c)?;
    write_rates(out, c)?;
    for pair in &c.pairs {
        write_pair(out, c, pair)?;
    }
    writeln!(out, "\nverdict   {}", c.verdict.name())
}

/// `64 spp, seed 0`.
pub fn samples(c: &Comparison) -> String {
    let seeds = if c.independent { "independent seeds from" } else { "seed" };
    format!("{} spp, {seeds} {}", c.spp, c.seed)
}

fn write_costs(out: &mut String, c: &Comparison) -> std::fmt::Result {
    writeln!(
        out,
        "\n          {:>12} {:>12} {:>12} {:>14} {:>12}",
        "build s", "MB", "B/primitive", "render CPU s", "wall s"
    )?;
    for (number, subject) in c.subjects.iter().enumerate() {
        let Subject { build_seconds, memory_bytes, render_seconds, render_cpu_seconds, .. } = subject;
        writeln!(
            out,
            "{}         {build_seconds:>12.4} {:>12.3} {:>12.1} {render_cpu_seconds:>14.3} {render_seconds:>12.3}",
            letter(number),
            *memory_bytes as f64 / 1e6,
            *memory_bytes as f64 / c.primitives.max(1) as f64,
        )?;
    }
    Ok(())
}

fn write_rates(out: &mut String, c: &Comparison) -> std::fmt::Result {
    let rounds = c.rounds;
    writeln!(
        out,
        "\nMray/s of one thread's {}: median of {rounds} rounds, (least to most)",
        crate::trace::clock::CLOCK
    )?;
    write!(out, "{:<10}{:>10}", "class", "rays")?;
    for number in 0..c.subjects.len() {
        write!(out, "  {:>24}", letter(number))?;
    }
    writeln!(out)?;
    for (row, (class, rays)) in c.rays.iter().enumerate() {
        write!(out, "{:<10}{rays:>10}", class.name())?;
        for subject in &c.subjects {
            let rate = &subject.rates[row];
            let spread = format!("({:.2} to {:.2})", rate.least / 1e6, rate.most / 1e6);
            write!(out, "  {:>7.3} {spread:>16}", rate.median / 1e6)?;
        }
        for subject in &c.subjects[1..] {
            write!(out, "  x{:.2}", subject.rates[row].median / c.subjects[0].rates[row].median)?;
        }
        writeln!(out)?;
    }
    Ok(())
}

fn write_pair(out: &mut String, c: &Comparison, pair: &Pair) -> std::fmt::Result {
    let (a, b) = (letter(0), letter(pair.second));
    writeln!(out, "\n{b} against {a}: {}", pair.verdict.name())?;
    for reason in &pair.reasons {
        writeln!(out, "  because {reason}")?;
    }
    let missed = [a, b].map(|side| format!("missed by {side}"));
    let apart = format!("dt > {:.0e}", c.tolerance);
    writeln!(
        out,
        "  {:<10}{:>10} {:>12} {:>12} {:>16} {:>12}",
        "answers", "rays", missed[0], missed[1], "other primitive", apart
    )?;
    for answers in &pair.answers {
        writeln!(
            out,
            "  {:<10}{:>10} {:>12} {:>12} {:>16} {:>12}",
            answers.class.name(),
            answers.rays,
            answers.missed_by_first,
            answers.missed_by_second,
            answers.other_primitive,
            answers.distance
        )?;
    }
    if pair.explained.all > 0 {
        writeln!(out, "  {}", explained(pair))?;
    }
    writeln!(out, "  picture   {}", picture(pair))
}

/// What f64 arithmetic says of the disagreements, in a sentence.
pub fn explained(pair: &Pair) -> String {
    let e = &pair.explained;
    let (a, b) = (letter(0), letter(pair.second));
    let how = if e.exhaustive == e.judged {
        "against every primitive".to_owned()
    } else {
        format!(
            "{} of them against every primitive, the others against those that {a} or {b} named",
            e.exhaustive
        )
    };
    format!(
        "of {} answers that differ, {} were judged in f64 ({how}): both right {}, only {a} right {}, \
         only {b} right {}, neither {}",
        e.all, e.judged, e.both, e.first, e.second, e.neither
    )
}

/// How the pictures differ, in a sentence.
pub fn picture(pair: &Pair) -> String {
    let p = &pair.picture;
    if p.equal_pixels == p.pixels {
        return format!("all {} pixels have the same bits", p.pixels);
    }
    format!(
        "{} of {} pixels have the same bits; rmse {:.3e}, max {:.3e}, mean {:+.3e}, FLIP {:.5}; greatest |z| {:.2}, \
         {} beyond 3 (at most {:.0}); bias |T| {:.2} (at most {:.2}), of a block {:.2} (at most {:.2})",
        p.equal_pixels,
        p.pixels,
        p.rmse,
        p.max,
        p.mean,
        p.flip,
        p.z_max,
        p.outliers,
        p.outliers_allowed,
        p.bias,
        p.bias_allowed,
        p.block_bias,
        p.block_bias_allowed
    )
}
