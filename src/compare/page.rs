//! A comparison as one HTML file.

use super::answers::Answer;
use super::explain::{Explanation, Right};
use super::job::{Comparison, Pair};
use super::text::{explained, letter, picture, samples};
use super::verdict::Verdict;
use crate::report::raster::Raster;
use crate::report::{Bar, bars, escape, figure, page, section, slider, table};

/// The report; `scene` is how the user calls the scene, `command` what was typed, `exposure` the pictures' in stops.
pub fn to_html(comparison: &Comparison, scene: &str, command: &str, exposure: f32) -> String {
    let c = comparison;
    let title = format!("{} against {}", c.subjects[1].name, c.subjects[0].name);
    let title = if c.subjects.len() > 2 { format!("{} backends", c.subjects.len()) } else { title };
    let mut body = header(c, &title, scene);
    for pair in &c.pairs {
        body += &pictures(c, pair, exposure);
    }
    body += &section("speed", "Rays per second", &speed(c));
    body += &section("costs", "What it costs", &costs(c));
    for pair in &c.pairs {
        body += &answers(c, pair);
    }
    body += &section("method", "How this was measured", &method(c, command));
    page(&format!("{title}: {}", c.verdict.name()), &body)
}

fn header(c: &Comparison, title: &str, scene: &str) -> String {
    let [width, height] = c.resolution;
    let reasons: String =
        c.pairs.iter().flat_map(|p| &p.reasons).map(|r| format!("<li>{}</li>", escape(r))).collect();
    let reasons =
        if reasons.is_empty() { reasons } else { format!("<ul class=\"reasons\">{reasons}</ul>\n") };
    format!(
        "<header>\n<h1>{}</h1>\n<p class=\"quiet\">{}: {} primitives, {width} × {height} pixels, {}</p>\n\
         {}{reasons}</header>\n{}",
        escape(title),
        escape(scene),
        grouped(c.primitives as u64),
        samples(c),
        badge(c.verdict),
        tiles(c)
    )
}

/// The verdict as a sign and a word: colour alone would not do.
fn badge(verdict: Verdict) -> String {
    let (class, path) = match verdict {
        Verdict::Differs => ("bad", "M6 6l12 12M18 6L6 18"),
        Verdict::Identical | Verdict::StatisticallyEqual => ("good", "M5 13l5 5L19 7"),
    };
    format!(
        "<p class=\"verdict {class}\"><svg viewBox=\"0 0 24 24\" aria-hidden=\"true\" fill=\"none\" \
         stroke=\"currentColor\" stroke-width=\"3\" stroke-linecap=\"round\"><path d=\"{path}\"/></svg>{}</p>\n",
        verdict.name()
    )
}

/// The numbers to see first: of the last backend against the first.
fn tiles(c: &Comparison) -> String {
    let pair = &c.pairs[c.pairs.len() - 1];
    let (a, b) = (&c.subjects[0], &c.subjects[pair.second]);
    let (name_a, name_b) = (letter(0), letter(pair.second));
    let logs: Vec<f64> = b.rates.iter().zip(&a.rates).map(|(b, a)| (b.median / a.median).ln()).collect();
    let speed = (logs.iter().sum::<f64>() / logs.len().max(1) as f64).exp();
    let rays: u64 = pair.answers.iter().map(|class| class.rays).sum();
    let differ: u64 = pair.answers.iter().map(|class| class.all()).sum();
    let equal = 100.0 * pair.picture.equal_pixels as f64 / pair.picture.pixels.max(1) as f64;
    let versus = format!("{name_b} to {name_a}");
    let all = [
        ("Speed of rays", format!("×{speed:.2}"), format!("{versus}, mean of the classes")),
        ("Time to build", format!("×{:.2}", b.build_seconds / a.build_seconds.max(1e-9)), versus.clone()),
        ("Answers that differ", grouped(differ), format!("of {} rays", grouped(rays))),
        (
            "Pixels with the same bits",
            format!("{} %", percent(equal)),
            format!("of {}", grouped(pair.picture.pixels)),
        ),
    ];
    let tile = |(name, value, note): (&str, String, String)| {
        format!("<div><dt>{name}</dt><dd>{value}<small>{note}</small></dd></div>\n")
    };
    format!("<dl class=\"tiles\">\n{}</dl>\n", all.into_iter().map(tile).collect::<String>())
}

/// A percentage that says 100 only if it is.
fn percent(share: f64) -> String {
    if share == 100.0 { "100".into() } else { format!("{:.2}", share.min(99.99)) }
}

/// `1234567` as `1 234 567`.
fn grouped(n: u64) -> String {
    let digits = n.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            // A narrow space that does not break.
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    text
}

/// Both pictures and what is between them.
fn pictures(c: &Comparison, pair: &Pair, exposure: f32) -> String {
    let (a, b) = (letter(0), letter(pair.second));
    let id = format!("picture-{b}");
    let heading = format!("Pictures: {b} against {a}");
    let sentence = format!("<p>{}.</p>\n", escape(&picture(pair)));
    let numbers = noise(pair);
    // Of several backends with the same picture, one is enough to see.
    if pair.picture.verdict == Verdict::Identical && pair.second > 1 {
        return section(&id, &heading, &sentence);
    }
    let [width, height] = c.resolution;
    let [under, over] =
        [0, pair.second].map(|i| Raster::of_light(width, height, &c.films[i].image(), exposure));
    let names = [0, pair.second].map(|i| format!("{} {}", letter(i), c.subjects[i].name));
    let caption =
        format!("{a} on the left, {b} on the right. Drag the edge, or move it with the arrow keys.");
    let both = slider([&under, &over], [&names[0], &names[1]], &caption);

    let reach = reach_of(&pair.picture.difference);
    let difference = Raster::of_signed(width, height, &pair.picture.difference, reach);
    let z = Raster::of_signed(width, height, &pair.picture.z, Z_REACH);
    let ramp = |low: &str, high: &str| {
        format!("<span class=\"ramp\" data-low=\"{low}\" data-high=\"{high}\"><span></span></span>")
    };
    let difference = figure(
        &difference,
        "Signed difference of each pixel",
        &format!(
            "Signed difference in luminance, {b} − {a}{}",
            ramp(&format!("−{reach:.1e}"), &format!("+{reach:.1e}"))
        ),
    );
    let z = figure(
        &z,
        "z-score of each pixel",
        &format!(
            "z: the difference in standard errors of both pictures{}",
            ramp(&format!("−{Z_REACH}"), &format!("+{Z_REACH}"))
        ),
    );
    section(&id, &heading, &format!("<div class=\"pictures\">\n{both}{difference}{z}</div>\n{numbers}"))
}

/// Numbers of the difference, and what they may be among equals.
fn noise(pair: &Pair) -> String {
    let p = &pair.picture;
    let limited = |name: &str, found: String, limit: String| vec![name.to_owned(), found, limit];
    let free = |name: &str, found: String| limited(name, found, String::new());
    let rows = [
        free("Pixels with the same bits", format!("{} of {}", grouped(p.equal_pixels), grouped(p.pixels))),
        limited("Pixels with |z| beyond 3", grouped(p.outliers), format!("{:.0}", p.outliers_allowed)),
        free("Greatest |z|", format!("{:.2}", p.z_max)),
        limited("Bias |T| of the picture", format!("{:.2}", p.bias), format!("{:.2}", p.bias_allowed)),
        limited(
            "Bias |T| of a block",
            format!("{:.2}", p.block_bias),
            format!("{:.2}", p.block_bias_allowed),
        ),
        free("RMSE", format!("{:.2e}", p.rmse)),
        free("Greatest difference", format!("{:.2e}", p.max)),
        free("Mean difference", format!("{:+.2e}", p.mean)),
        free("FLIP", format!("{:.5}", p.flip)),
    ];
    let head = ["", "Found", "Equals have at most"].map(String::from);
    table("How the pictures differ", &head, &rows)
}

/// Standard errors at which the map of z has its full colour.
const Z_REACH: f32 = 5.0;

/// Differences far below these are roundings that should not look like more.
const LEAST_REACH: f32 = 1e-4;

/// The difference that has the full colour: all but one in a thousand of those that are not zero lie within it.
fn reach_of(difference: &[f32]) -> f32 {
    let mut sizes: Vec<f32> = difference.iter().map(|d| d.abs()).filter(|d| *d > 0.0).collect();
    sizes.sort_by(f32::total_cmp);
    sizes
        .get(sizes.len().saturating_sub(1 + sizes.len() / 1000))
        .copied()
        .unwrap_or(LEAST_REACH)
        .max(LEAST_REACH)
}

/// Which colour is which backend.
fn key(c: &Comparison) -> String {
    let item = |(i, name): (usize, &str)| {
        format!("<li><b class=\"s{}\"></b>{} {}</li>", i % 8, letter(i), escape(name))
    };
    let items: String = c.subjects.iter().map(|s| &*s.name).enumerate().map(item).collect();
    format!("<ul class=\"key\">{items}</ul>\n")
}

fn speed(c: &Comparison) -> String {
    let chart = |row: usize| {
        let (class, rays) = c.rays[row];
        let of_backend = |(i, subject): (usize, &super::Subject)| {
            let rate = &subject.rates[row];
            let ratio = rate.median / c.subjects[0].rates[row].median;
            let times = if i == 0 { String::new() } else { format!(" ×{ratio:.2}") };
            Bar {
                name: letter(i).to_string(),
                value: format!("{:.2} M/s{times}", rate.median / 1e6),
                length: rate.median,
                spread: Some([rate.least, rate.most]),
                series: i,
            }
        };
        let all: Vec<Bar> = c.subjects.iter().enumerate().map(of_backend).collect();
        format!("<div>{}</div>\n", bars(&format!("{}: {} rays", class.name(), grouped(rays)), &all))
    };
    let charts: String = (0..c.rays.len()).map(chart).collect();
    format!(
        "<p class=\"quiet\">Millions of rays per second of one thread's {}: the bar is the median of {} rounds, the \
         line goes from the slowest to the fastest.</p>\n{}<div class=\"charts\">\n{charts}</div>\n",
        crate::trace::clock::CLOCK,
        c.rounds,
        key(c)
    )
}

fn costs(c: &Comparison) -> String {
    let chart = |heading: &str, number: &dyn Fn(&super::Subject) -> f64, text: &dyn Fn(f64) -> String| {
        let bar = |(i, subject): (usize, &super::Subject)| {
            let length = number(subject);
            Bar { name: letter(i).to_string(), value: text(length), length, spread: None, series: i }
        };
        let all: Vec<Bar> = c.subjects.iter().enumerate().map(bar).collect();
        format!("<div>{}</div>\n", bars(heading, &all))
    };
    let seconds = |s: f64| if s < 1.0 { format!("{:.2} ms", 1e3 * s) } else { format!("{s:.2} s") };
    let bytes = |n: f64| if n < 1e6 { format!("{:.1} kB", n / 1e3) } else { format!("{:.1} MB", n / 1e6) };
    let charts = [
        chart("Build, wall time", &|s| s.build_seconds, &seconds),
        chart("Memory of the structure", &|s| s.memory_bytes as f64, &bytes),
        chart("Render, CPU time of all threads", &|s| s.render_cpu_seconds, &seconds),
        chart("Render, wall time", &|s| s.render_seconds, &seconds),
    ];
    format!("{}<div class=\"charts\">\n{}</div>\n", key(c), charts.concat())
}

fn answers(c: &Comparison, pair: &Pair) -> String {
    let (a, b) = (letter(0), letter(pair.second));
    let head = ["Class", "Rays"].map(String::from).into_iter().chain([
        format!("Missed by {a}"),
        format!("Missed by {b}"),
        "Other primitive".into(),
        format!("Distance (by > {:.0e})", c.tolerance),
    ]);
    let rows = pair.answers.iter().map(|class| {
        let numbers = [
            class.rays,
            class.missed_by_first,
            class.missed_by_second,
            class.other_primitive,
            class.distance,
        ];
        [class.class.name().to_owned()].into_iter().chain(numbers.map(grouped)).collect()
    });
    let caption = format!("Answers of {b} that are not those of {a}");
    let mut body = table(&caption, &head.collect::<Vec<_>>(), &rows.collect::<Vec<_>>());
    if pair.explained.all > 0 {
        body += &format!("<p>{}.</p>\n", escape(&explained(pair)));
        body += &examples(pair);
    }
    section(&format!("answers-{b}"), &format!("Answers: {b} against {a}"), &body)
}

/// A few rays, for those who want to know.
fn examples(pair: &Pair) -> String {
    let (a, b) = (letter(0), letter(pair.second));
    let head = ["Ray", &a.to_string(), &b.to_string(), "f64", "Right"].map(String::from);
    let row = |e: &Explanation| {
        let d = &e.disagreement;
        let ray = format!(
            "{} from <code>{:?}</code> along <code>{:?}</code>",
            d.class.name(),
            d.ray.origin.to_array(),
            d.ray.dir.to_array()
        );
        let right = match e.right {
            Right::Both => "both".to_owned(),
            Right::First => a.to_string(),
            Right::Second => b.to_string(),
            Right::Neither => "neither".to_owned(),
        };
        vec![ray, told(&d.first), told(&d.second), told(&Answer::Closest(e.exact)), right]
    };
    let rows: Vec<_> = pair.explained.examples.iter().map(row).collect();
    format!(
        "<details><summary>Some of these rays</summary>\n{}</details>\n",
        table("Rays and answers", &head, &rows)
    )
}

fn told(answer: &Answer) -> String {
    match answer {
        Answer::Closest(None) => "nothing".into(),
        Answer::Closest(Some(hit)) => format!("t {} on {}/{}", hit.t, hit.geom_id, hit.prim_id),
        Answer::Occluded(true) => "hidden".into(),
        Answer::Occluded(false) => "free".into(),
    }
}

fn method(c: &Comparison, command: &str) -> String {
    let seeds = if c.independent {
        "Every backend but the first rendered with another seed, and the first once more with a third, whose difference \
         from its own first picture says how many outliers there are by chance."
    } else {
        "All backends rendered with the same random numbers, so that what differs is their own."
    };
    format!(
        "<p>The rays are those that a render of the scene asks, in its own batches: of tiles spread over the picture, \
         recorded once and asked of every backend. Rounds took turns. An answer is wrong if f64 arithmetic on the \
         scene's own primitives finds something else, or the same more than {:.0e} of the distance away; up to \
         {:.0e} of the answers may be wrong.</p>\n\
         <p>{seeds} The pictures are statistically equal if no more pixels than by chance differ by more than three \
         standard errors, and if neither the whole picture nor a block of 16 × 16 pixels differs more to one side \
         than random signs would.</p>\n<pre><code>{}</code></pre>\n<p class=\"quiet\">Scene hash <code>{}</code>, \
         gloss {}</p>\n",
        c.tolerance,
        c.max_wrong,
        escape(command),
        escape(&c.scene_hash),
        env!("CARGO_PKG_VERSION")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_well() {
        assert_eq!(grouped(7), "7");
        assert_eq!(grouped(1_234_567), "1\u{202f}234\u{202f}567");
        assert_eq!(percent(99.999_9), "99.99");
        assert_eq!(percent(100.0), "100");
        assert_eq!(reach_of(&[0.0, -3.0, 1.0]), 3.0);
        assert_eq!(reach_of(&[0.0]), LEAST_REACH);
    }
}
