//! Findings as one HTML file: charts, pictures, tables, and all data as JSON.

use super::findings::{Findings, Found, Verdict, flip_of};
use super::state::State;
use super::{chart, text};
use crate::core::Rgb;
use crate::image_io::srgb;
use crate::report::raster::Raster;
use crate::report::{data, escape, scripted_page, section, table};
use serde_json::json;

/// Pixels along the longer side of the pictures in a page, at most: beyond, they are shrunk.
const LARGEST: u32 = 256;

/// The report; `command` is what was typed, `exposure` the pictures' in stops.
pub fn to_html(f: &Findings, state: &State, command: &str, exposure: f32) -> String {
    let title = format!("What shortcuts cost: {}", f.scene);
    let mut body = header(f, &title);
    body += &section("all", "Error against time", &overview(f));
    let knobs: String = (0..f.knobs.len()).map(|number| knob(f, number)).collect();
    body += &section("knobs", "Knob by knob", &format!("<div class=\"knobs\">\n{knobs}</div>\n"));
    body += &section("numbers", "All numbers", &numbers(f));
    body += &section("method", "How this was measured", &method(f, command));
    body += &data("findings", &json!(f).to_string());
    body += &data("pictures", &pictures(state, exposure));
    scripted_page(&title, &body, include_str!("page.js"))
}

fn header(f: &Findings, title: &str) -> String {
    let [width, height] = f.resolution;
    let best = f.ways.iter().filter(|w| w.way.noise.is_none() && w.verdict != Verdict::Floor);
    let best = best.max_by(|a, b| a.efficiency.total_cmp(&b.efficiency));
    let biased = f.ways.iter().filter(|w| w.verdict == Verdict::Floor).count();
    let unexpected = f.ways.iter().filter(|w| w.verdict == Verdict::UnexpectedBias).count();
    let tiles = [
        ("Ways", f.ways.len().to_string(), format!("{} rounds in {:.0} s", f.rounds, f.seconds)),
        (
            "Best without bias",
            best.map_or_else(String::new, |b| format!("×{:.2}", b.relative_efficiency)),
            best.map_or_else(String::new, |b| format!("{}, efficiency by that of the base", b.way.name)),
        ),
        ("With a bias", biased.to_string(), format!("{unexpected} more where none is expected")),
        (
            "Reference",
            format!("{:.0e}", f.reference_error.value),
            format!("its own relMSE, from {} spp", f.reference_spp),
        ),
    ];
    let tile = |(name, value, note): &(&str, String, String)| {
        format!("<div><dt>{name}</dt><dd>{}<small>{}</small></dd></div>\n", escape(value), escape(note))
    };
    let advice: String = f
        .advice
        .iter()
        .map(|a| format!("<p class=\"advice\">{}.</p>\n", escape(&text::sentence(a))))
        .collect();
    format!(
        "<header>\n<h1>{}</h1>\n<p class=\"quiet\">{width} × {height} pixels, {}, {}, gloss {}</p>\n{advice}</header>\n\
         <dl class=\"tiles\">\n{}</dl>\n",
        escape(title),
        escape(&f.backend),
        escape(&f.machine),
        escape(&f.version),
        tiles.iter().map(tile).collect::<String>()
    )
}

fn overview(f: &Findings) -> String {
    format!(
        "<p class=\"quiet\">Each point is the median CPU time and the mean relMSE of one picture, with 95 % intervals. \
         Samples move a way without bias along the dashed lines: twice the time, half the error. Point at a way, or \
         go through them with Tab and the arrow keys, to see its picture.</p>\n\
         <ul class=\"key\"><li><b class=\"ink\"></b>base</li><li><b class=\"s0\"></b>front: no other is both \
         faster and more exact</li><li><b class=\"s1\"></b>others</li><li><b class=\"ring\"></b>with a bias that more samples do \
         not take away</li></ul>\n\
         <div class=\"knob\" data-first=\"0\">\n{}{}</div>\n",
        chart::all(f),
        panel(true)
    )
}

/// Where the script puts the pictures of a way.
fn panel(with_reference: bool) -> String {
    let figure = |class: &str, caption: &str| {
        format!(
            "<figure><img class=\"{class}\" alt=\"{caption}\" src=\"{EMPTY}\"><figcaption>{caption}</figcaption></figure>"
        )
    };
    let reference = if with_reference { figure("reference", "Reference") } else { String::new() };
    format!(
        "<div class=\"panel{}\"><p aria-live=\"polite\"></p>{reference}{}{}</div>\n",
        if with_reference { " three" } else { "" },
        figure("shot", "One picture"),
        figure("map", "FLIP to the reference")
    )
}

/// One clear pixel.
const EMPTY: &str = "data:image/gif;base64,R0lGODlhAQABAIAAAAAAAP///yH5BAEAAAAALAAAAAABAAEAAAIBRAA7";

fn knob(f: &Findings, number: usize) -> String {
    let turned = &f.knobs[number];
    let button = |choice: &super::catalogue::Choice| {
        format!(
            "<button type=\"button\" data-key=\"{}\" aria-pressed=\"false\">{}</button>",
            choice.way,
            escape(&choice.name)
        )
    };
    let buttons: String = turned.choices.iter().map(button).collect();
    let rows: Vec<Vec<String>> =
        turned.choices.iter().map(|choice| short_row(&choice.name, &f.ways[choice.way])).collect();
    let head = ["", "CPU s", "relMSE", "Bias", "Eff."].map(String::from);
    let first = turned.choices.first().map_or(0, |choice| choice.way);
    format!(
        "<div class=\"knob\" data-first=\"{first}\">\n<h3>{}</h3>\n<p class=\"quiet\">{}</p>\n{}\
         <div class=\"choices\" role=\"group\" aria-label=\"Choices of {}\">{buttons}</div>\n{}{}</div>\n",
        escape(&turned.knob.name()),
        escape(&turned.question),
        chart::knob(f, number),
        escape(&turned.knob.name()),
        panel(false),
        table(&format!("Choices of {}", turned.knob.name()), &head, &rows)
    )
}

fn bias(found: &Found) -> String {
    let bias = found.errors.bias;
    if bias.is_positive() { format!("{:.1e}", bias.value) } else { format!("&lt; {:.0e}", bias.bound()) }
}

fn short_row(name: &str, found: &Found) -> Vec<String> {
    vec![
        escape(name),
        format!("{:.3}", found.cpu_seconds.median),
        format!("{:.2e}", found.errors.relmse.value),
        bias(found),
        format!("{:.2}", found.relative_efficiency),
    ]
}

fn numbers(f: &Findings) -> String {
    let head = [
        "Way",
        "spp",
        "CPU s",
        "least, most",
        "Wall s",
        "relMSE",
        "95 %",
        "Noise",
        "Bias",
        "Light",
        "FLIP",
        "Rays",
        "MB",
        "Eff.",
        "",
    ];
    let row = |found: &Found| {
        let e = &found.errors;
        let (front, beaten) = (found.on_front, found.dominated_by);
        vec![
            escape(&found.way.name),
            format!("{:.4}", found.cost.spp).trim_end_matches('0').trim_end_matches('.').to_owned(),
            format!("{:.3}", found.cpu_seconds.median),
            format!("{:.3}, {:.3}", found.cpu_seconds.least, found.cpu_seconds.most),
            format!("{:.3}", found.wall_seconds.median),
            format!("{:.2e}", e.relmse.value),
            format!("{:.1e}, {:.1e}", e.relmse.low, e.relmse.high),
            format!("{:.1e}", e.noise.value),
            bias(found),
            format!("{:+.2} %", 100.0 * e.brightness.value),
            format!("{:.4} ± {:.4}", found.flip.value, 0.5 * (found.flip.high - found.flip.low)),
            format!("{:.2e}", found.cost.rays as f64),
            format!("{:.1}", found.cost.memory_bytes as f64 / 1e6),
            format!("{:.2}", found.relative_efficiency),
            match (front, beaten) {
                (true, _) => "front".to_owned(),
                (_, Some(by)) => format!("beaten by {}", escape(&f.ways[by].way.name)),
                _ => String::new(),
            },
        ]
    };
    let rows: Vec<Vec<String>> = f.ways.iter().map(row).collect();
    let left = |l: &super::catalogue::LeftOut| {
        let which = l.choice.as_deref().unwrap_or_default();
        format!("<li>{} {}: {}</li>", escape(&l.knob.name()), escape(which), escape(&l.why))
    };
    let left_out: String = f.left_out.iter().map(left).collect();
    let left_out = if left_out.is_empty() {
        left_out
    } else {
        format!("<h3>Left out</h3>\n<ul class=\"reasons\">{left_out}</ul>\n")
    };
    table("All ways", &head.map(String::from), &rows) + &left_out
}

fn method(f: &Findings, command: &str) -> String {
    format!(
        "<p>The reference has {} samples per pixel with all policies that lose no light, in two halves with independent \
         random numbers. Then {} rounds took one picture of each way, each round with a seed of its own; rounds begin with \
         another way each and every other one goes backwards. Time is the process's {}.</p>\n\
         <p>relMSE is the mean over pixels and channels of the squared error by <code>(reference + 0.01)²</code>. Noise is \
         the variance of the pictures of a way. Squared bias is the mean product of errors of two different pictures, each against \
         another half of the reference: no noise enters it, neither the pictures' nor the reference's. Intervals come from the \
         spread over pixels, which have independent random numbers. A bias is called one where chance would show it once \
         in a thousand times. Light is the mean of the picture by that of the reference. FLIP is that of single pictures as \
         a display shows them. Efficiency is 1 / (relMSE × CPU seconds) by that of the base.</p>\n\
         <pre><code>{}</code></pre>\n",
        f.reference_spp,
        f.rounds,
        crate::trace::clock::CLOCK,
        escape(command)
    )
}

/// Addresses of the pictures and their FLIP maps by way, and of the reference, as JSON.
fn pictures(state: &State, exposure: f32) -> String {
    let [width, height] = state.resolution;
    let light = |pixels: &[Rgb]| {
        let (size, pixels) = shrunk([width, height], pixels);
        Raster::of_light(size[0], size[1], &pixels, exposure).data_uri()
    };
    let of_way = |measured: &super::state::Measured| {
        let picture = measured.pictures.first().map_or(&[][..], |picture| &picture[..]);
        let map = flip_of(picture, state).1;
        let map: Vec<Rgb> =
            map.chunks_exact(3).map(|c| Rgb::new(of_byte(c[0]), of_byte(c[1]), of_byte(c[2]))).collect();
        let (size, map) = shrunk([width, height], &map);
        [light(picture), Raster::of_light(size[0], size[1], &map, 0.0).data_uri()]
    };
    let ways: Vec<[String; 2]> = state.measured.iter().map(of_way).collect();
    json!({ "reference": light(&state.reference.picture()), "ways": ways }).to_string()
}

/// Linear light of an sRGB byte.
fn of_byte(byte: u8) -> f32 {
    srgb::decode(f32::from(byte) / 255.0)
}

/// Means of blocks of pixels, as large as bring the longer side below [`LARGEST`].
fn shrunk([width, height]: [u32; 2], pixels: &[Rgb]) -> ([u32; 2], Vec<Rgb>) {
    let block = width.max(height).div_ceil(LARGEST).max(1);
    let size = [width.div_ceil(block), height.div_ceil(block)];
    let mean = |bx: u32, by: u32| {
        let (mut sum, mut count) = (Rgb::BLACK, 0.0);
        for y in by * block..(by * block + block).min(height) {
            for x in bx * block..(bx * block + block).min(width) {
                sum += pixels[(y * width + x) as usize];
                count += 1.0;
            }
        }
        sum / count
    };
    (size, (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y))).map(|(x, y)| mean(x, y)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_pictures_are_shrunk_and_small_ones_stay() {
        let pixels: Vec<Rgb> = (0..600 * 2).map(|i| Rgb::grey((i % 3) as f32)).collect();
        let (size, small) = shrunk([600, 2], &pixels);
        assert_eq!(size, [200, 1]);
        assert!(small.iter().all(|p| (p.g - 1.0).abs() < 1e-6));
        assert_eq!(shrunk([3, 1], &pixels[..3]).1, pixels[..3]);
    }

    #[test]
    fn bytes_come_back() {
        for byte in [0, 1, 10, 11, 128, 255] {
            assert_eq!(srgb::encode_8_bit(Rgb::grey(of_byte(byte)))[0], byte);
        }
    }
}
