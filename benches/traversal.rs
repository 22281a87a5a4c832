//! Rays per second of the pure-Rust hierarchy over Embree's.
//!
//! ```text
//! cargo bench --bench traversal -- [--scenes knot,terrain,...] [--mesh FILE,...] [--rounds 5] [--size 512x384]
//!     [--quality fast|medium|high] [--classes primary,...] [--threads 1]
//! ```
//!
//! The candidates take turns in every round, and a cell is the median over the rounds of the ratio of CPU seconds
//! to those of `rtcIntersect1` / `rtcOccluded1` in the same round: other work on the machine hits both.
//!
//! Rows are traversal against traversal: hits as f32 finds them on both sides. In the rows named `exact` both sides
//! compute each hit anew in f64 from its primitive, as a renderer has it.

mod support;

use gloss::accel::bvh::{Bvh, Isa};
use gloss::accel::{Accelerator, BuildOptions, Coherence, Quality, SkipSupport};
use gloss::geometry::Shape;
use rayon::prelude::*;
use support::rays::{self, Class};
use support::{argument, clock, geomean, median, number, scenes};

struct Candidate {
    name: &'static str,
    accel: Box<dyn Accelerator>,
    /// What it is told of the rays in place of the class's own hint.
    hint: Option<Coherence>,
}

impl Candidate {
    fn new(name: &'static str, accel: impl Accelerator + 'static) -> Self {
        Self { name, accel: Box::new(accel), hint: None }
    }
}

/// Names of candidates whose fastest stands above the line, and of the one below it: the aims.
const COMPARISONS: [(&str, &[&str], &[&str]); 11] = [
    ("bvh single / rtcIntersect1", &["bvh single"], &["embree single"]),
    ("bvh batch / rtcIntersect1", &["bvh batch"], &["embree single"]),
    ("Embree's best call / rtcIntersect1", EMBREE_CALLS, &["embree single"]),
    ("bvh batch / Embree's best call", &["bvh batch"], EMBREE_CALLS),
    ("bvh single, watertight / rtcIntersect1, ROBUST", &["bvh single robust"], &["embree single robust"]),
    ("bvh batch, watertight / rtcIntersect1, ROBUST", &["bvh batch robust"], &["embree single robust"]),
    ("bvh single on SSE2 / rtcIntersect1", &["bvh single sse2"], &["embree single"]),
    ("bvh batch on SSE2 / rtcIntersect1", &["bvh batch sse2"], &["embree single"]),
    ("bvh single, Fast tree / its own", &["bvh single fast tree"], &["bvh single"]),
    ("bvh batch, Fast tree / its own", &["bvh batch fast tree"], &["bvh batch"]),
    ("bvh exact / Embree auto exact", &["bvh batch exact"], &["embree auto robust exact"]),
];

const EMBREE_CALLS: &[&str] = &[
    "embree single",
    "embree packet8",
    "embree stream",
    "embree packet8 coherent",
    "embree stream coherent",
];

fn main() {
    let rounds = number("--rounds", 5);
    let size = argument("--size").unwrap_or("512x384".into());
    let (width, height) = size.split_once('x').expect("--size WxH");
    let (width, height) = (width.parse().expect("a width"), height.parse().expect("a height"));
    let wanted = argument("--classes");
    let tracer = Tracer::new(number("--threads", 1));
    let mut all = vec![];
    for scene in scenes::wanted() {
        let candidates = candidates(&scene.shapes);
        let mut classes = rays::classes(&scene, &*candidates[0].accel, width, height);
        classes.retain(|c| wanted.as_ref().is_none_or(|w| w.split(',').any(|w| c.name.starts_with(w))));
        let table = Table::measure(&candidates, &classes, rounds, &tracer);
        println!("\n### {} ({} triangles)\n", scene.name, scene.triangles());
        table.print(&classes);
        all.push(table);
    }
    print_comparisons(&all);
}

fn candidates(shapes: &[Shape]) -> Vec<Candidate> {
    let quality = match argument("--quality").as_deref() {
        Some("fast") => Quality::Fast,
        Some("high") => Quality::High,
        _ => Quality::Medium,
    };
    let options = BuildOptions { quality, skip: SkipSupport::None, robust: false, ..Default::default() };
    let bvh = |robust| Bvh::new(shapes, &BuildOptions { robust, ..options }).expect("the hierarchy builds");
    let mut candidates = embree_candidates(shapes, &options);
    let raw = bvh(false);
    candidates.push(Candidate::new("bvh single", raw.clone().with_single_rays()));
    if let Some(sse2) = raw.clone().with_isa(Isa::Sse2) {
        candidates.push(Candidate::new("bvh single sse2", sse2.clone().with_single_rays()));
        candidates.push(Candidate::new("bvh batch sse2", sse2));
    }
    candidates.push(Candidate::new("bvh batch", raw));
    let fast_tree = Bvh::new(shapes, &BuildOptions { quality: Quality::Fast, ..options });
    let raw = fast_tree.expect("the hierarchy builds");
    candidates.push(Candidate::new("bvh single fast tree", raw.clone().with_single_rays()));
    candidates.push(Candidate::new("bvh batch fast tree", raw));
    let robust = bvh(true);
    let raw = robust.clone().with_raw_hits();
    candidates.push(Candidate::new("bvh single robust", raw.clone().with_single_rays()));
    candidates.push(Candidate::new("bvh batch robust", raw));
    candidates.push(Candidate::new("bvh batch exact", robust));
    candidates
}

#[cfg(feature = "embree")]
fn embree_candidates(shapes: &[Shape], options: &BuildOptions) -> Vec<Candidate> {
    use gloss::accel::{EmbreeMode, embree::Embree};
    let build = |robust| {
        let embree_mode = EmbreeMode::Single;
        Embree::new(shapes, &BuildOptions { robust, embree_mode, ..*options }).expect("Embree builds")
    };
    let (fast, robust) = (build(false), build(true));
    let call = |name, mode, hint| Candidate { hint, ..Candidate::new(name, fast.clone().with_mode(mode)) };
    let coherent = Some(Coherence::Coherent);
    vec![
        call("embree single", EmbreeMode::Single, None),
        call("embree packet8", EmbreeMode::Packet8, None),
        call("embree packet8 coherent", EmbreeMode::Packet8, coherent),
        call("embree stream", EmbreeMode::Stream, None),
        call("embree stream coherent", EmbreeMode::Stream, coherent),
        Candidate::new("embree single robust", robust.clone().with_raw_hits()),
        Candidate::new("embree auto robust exact", robust.with_mode(EmbreeMode::Auto)),
    ]
}

#[cfg(not(feature = "embree"))]
fn embree_candidates(_: &[Shape], _: &BuildOptions) -> Vec<Candidate> {
    vec![]
}

/// Waves as the integrator cuts them.
const WAVE: usize = 4096;

/// Traces on this thread, or on the threads of a pool.
struct Tracer(Option<rayon::ThreadPool>);

impl Tracer {
    fn new(threads: usize) -> Self {
        let pool = || rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        Self((threads != 1).then(pool))
    }

    /// CPU seconds.
    fn trace(&self, candidate: &Candidate, class: &Class) -> f64 {
        let accel = &*candidate.accel;
        let hint = candidate.hint.unwrap_or(class.coherence);
        let buffers = || (vec![None; WAVE], vec![false; WAVE]);
        let wave = |(hits, occluded): &mut (Vec<_>, Vec<_>), rays: &[_]| {
            if class.any {
                accel.occluded(rays, hint, &mut occluded[..rays.len()]);
            } else {
                accel.intersect(rays, hint, &mut hits[..rays.len()]);
            }
            std::hint::black_box((hits, occluded));
        };
        match &self.0 {
            None => {
                let mut buffers = buffers();
                clock::thread_seconds(|| class.rays.chunks(WAVE).for_each(|rays| wave(&mut buffers, rays)))
            }
            Some(pool) => {
                let waves = || class.rays.par_chunks(WAVE).for_each_init(buffers, wave);
                clock::process_seconds(|| pool.install(waves)).0
            }
        }
    }
}

/// Ratios of the candidates' speeds to that of the first, by class.
struct Table {
    rows: Vec<(&'static str, Vec<f64>)>,
    classes: Vec<String>,
    /// Millions of rays per CPU second of the first candidate.
    base: Vec<f64>,
}

impl Table {
    fn measure(candidates: &[Candidate], classes: &[Class], rounds: usize, tracer: &Tracer) -> Self {
        let mut seconds = vec![vec![vec![]; classes.len()]; candidates.len()];
        for round in 0..=rounds {
            for (c, class) in classes.iter().enumerate() {
                for turn in 0..candidates.len() {
                    let i = (turn + round) % candidates.len();
                    let time = tracer.trace(&candidates[i], class);
                    // The first round warms up.
                    if round > 0 {
                        seconds[i][c].push(time);
                    }
                }
            }
        }
        let over = |own: &[Vec<f64>]| {
            let ratios =
                |(base, own): (&Vec<f64>, &Vec<f64>)| base.iter().zip(own).map(|(b, o)| b / o).collect();
            seconds[0].iter().zip(own).map(|pair| median(ratios(pair))).collect()
        };
        let rate =
            |(class, seconds): (&Class, &Vec<f64>)| class.rays.len() as f64 / median(seconds.clone()) * 1e-6;
        Self {
            rows: candidates.iter().zip(&seconds).map(|(c, own)| (c.name, over(own))).collect(),
            classes: classes.iter().map(|c| c.name.clone()).collect(),
            base: classes.iter().zip(&seconds[0]).map(rate).collect(),
        }
    }

    fn print(&self, classes: &[Class]) {
        print_header("", &self.classes);
        let number = |c: &Class| format!("{:.0}k", c.rays.len() as f64 * 1e-3);
        println!("| rays | {} |", classes.iter().map(number).collect::<Vec<_>>().join(" | "));
        print_row(&format!("{}, Mray/s", self.rows[0].0), self.base.iter().map(|r| format!("{r:.2}")));
        for (name, ratios) in &self.rows[1..] {
            print_row(name, ratios.iter().map(|r| format!("{r:.2}")));
        }
    }

    /// The best of some candidates in a class.
    fn best(&self, names: &[&str], class: usize) -> f64 {
        let rows = self.rows.iter().filter(|(name, _)| names.contains(name));
        rows.map(|(_, ratios)| ratios[class]).fold(f64::NAN, f64::max)
    }
}

fn print_comparisons(tables: &[Table]) {
    let Some(first) = tables.first() else { return };
    println!("\n### Geometric mean over the scenes (least)\n");
    print_header("", &first.classes);
    for (name, above, below) in COMPARISONS {
        let cells = (0..first.classes.len()).map(|class| {
            let ratios: Vec<f64> =
                tables.iter().map(|t| t.best(above, class) / t.best(below, class)).collect();
            let least = ratios.iter().copied().fold(f64::INFINITY, f64::min);
            format!("{:.2} ({least:.2})", geomean(&ratios))
        });
        print_row(name, cells);
    }
}

fn print_header(corner: &str, classes: &[String]) {
    println!("| {corner} | {} |\n|{}", classes.join(" | "), "---|".repeat(classes.len() + 1));
}

fn print_row(name: &str, cells: impl Iterator<Item = String>) {
    println!("| {name} | {} |", cells.collect::<Vec<_>>().join(" | "));
}
