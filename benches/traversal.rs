//! Rays per second of the pure-Rust hierarchy over Embree's, on one thread.
//!
//! ```text
//! cargo bench --bench traversal -- [--scenes knot,terrain,...] [--obj FILE] [--rounds 5] [--size 768x576]
//!     [--quality fast|medium|high] [--classes primary,...]
//! ```
//!
//! The candidates take turns in every round, and a cell is the median over the rounds of the ratio of CPU seconds
//! to those of `rtcIntersect1` / `rtcOccluded1` in the same round: other work on the machine hits both.

mod support;

use gloss::accel::bvh::{Bvh, Isa};
use gloss::accel::{Accelerator, BuildOptions, Quality, SkipSupport};
use support::rays::{self, Class};
use support::{argument, clock, geomean, median, scenes};

struct Candidate {
    name: &'static str,
    accel: Box<dyn Accelerator>,
}

fn main() {
    let names = argument("--scenes").unwrap_or("knot,terrain,stadium,sticks".into());
    let rounds = argument("--rounds").map_or(5, |r| r.parse().expect("--rounds N"));
    let size = argument("--size").unwrap_or("768x576".into());
    let (width, height) = size.split_once('x').expect("--size WxH");
    let (width, height) = (width.parse().expect("a width"), height.parse().expect("a height"));
    let wanted = argument("--classes");
    let mut ratios: Vec<Vec<Vec<f64>>> = vec![];
    let mut labels = (vec![], vec![]);
    for name in names.split(',') {
        let scene = scenes::by_name(name, argument("--obj").as_deref());
        let candidates = candidates(&scene.shapes);
        if let Some(path) = argument("--dump") {
            dump(&path, &scene, &rays::classes(&scene, &*candidates[0].accel, width, height));
            return;
        }
        let mut classes = rays::classes(&scene, &*candidates[0].accel, width, height);
        classes.retain(|c| wanted.as_ref().is_none_or(|w| w.split(',').any(|w| c.name.starts_with(w))));
        println!("\n### {} ({} triangles)\n", scene.name, scene.triangles());
        print_header(&classes);
        let table = measure(&candidates, &classes, rounds);
        let base: Vec<f64> = table[0].iter().map(|seconds| median(seconds.clone())).collect();
        let rates: Vec<String> = classes
            .iter()
            .zip(&base)
            .map(|(c, s)| format!("{:.2}", c.rays.len() as f64 / s * 1e-6))
            .collect();
        println!("| {} (Mray/s) | {} |", candidates[0].name, rates.join(" | "));
        let scene_ratios: Vec<Vec<f64>> = table.iter().map(|rows| over(&table[0], rows)).collect();
        for (candidate, row) in candidates.iter().zip(&scene_ratios).skip(1) {
            print_row(candidate.name, row);
        }
        ratios.push(scene_ratios);
        labels =
            (candidates.iter().map(|c| c.name).collect(), classes.iter().map(|c| c.name.clone()).collect());
    }
    println!("\n### geometric mean over the scenes\n");
    println!("| over {} | {} |\n|{}", labels.0[0], labels.1.join(" | "), "---|".repeat(labels.1.len() + 1));
    for (i, name) in labels.0.iter().enumerate().skip(1) {
        let cell = |class: usize| geomean(&ratios.iter().map(|scene| scene[i][class]).collect::<Vec<_>>());
        print_row(name, &(0..labels.1.len()).map(cell).collect::<Vec<_>>());
    }
}

fn candidates(shapes: &[gloss::geometry::Shape]) -> Vec<Candidate> {
    let quality = match argument("--quality").as_deref() {
        Some("fast") => Quality::Fast,
        Some("high") => Quality::High,
        _ => Quality::Medium,
    };
    let options = BuildOptions { quality, skip: SkipSupport::None, threads: 1, ..Default::default() };
    let mut candidates = embree_candidates(shapes, &options);
    let bvh = || Bvh::new(shapes, &options).expect("the hierarchy builds");
    let boxed = |bvh: Option<Bvh>| bvh.map(|b| Box::new(b) as Box<dyn Accelerator>);
    let mut add = |name, accel: Option<Box<dyn Accelerator>>| {
        candidates.extend(accel.map(|accel| Candidate { name, accel }));
    };
    add("bvh single", boxed(Some(bvh().with_single_rays())));
    add("bvh auto", boxed(Some(bvh())));
    add("bvh single sse2", boxed(bvh().with_single_rays().with_isa(Isa::Sse2)));
    candidates
}

#[cfg(feature = "embree")]
fn embree_candidates(shapes: &[gloss::geometry::Shape], options: &BuildOptions) -> Vec<Candidate> {
    use gloss::accel::{EmbreeMode, embree::Embree};
    let embree = |name, robust, embree_mode| Candidate {
        name,
        accel: Box::new(
            Embree::new(shapes, &BuildOptions { robust, embree_mode, ..*options }).expect("Embree builds"),
        ),
    };
    vec![
        embree("embree single", false, EmbreeMode::Single),
        embree("embree auto", false, EmbreeMode::Auto),
        embree("embree single robust", true, EmbreeMode::Single),
    ]
}

#[cfg(not(feature = "embree"))]
fn embree_candidates(_: &[gloss::geometry::Shape], _: &BuildOptions) -> Vec<Candidate> {
    vec![]
}

/// CPU seconds by candidate, class and round.
fn measure(candidates: &[Candidate], classes: &[Class], rounds: usize) -> Vec<Vec<Vec<f64>>> {
    let mut table = vec![vec![vec![]; classes.len()]; candidates.len()];
    for round in 0..=rounds {
        for (c, class) in classes.iter().enumerate() {
            for (i, candidate) in candidates.iter().enumerate() {
                let seconds = trace(&*candidate.accel, class);
                // The first round warms up.
                if round > 0 {
                    table[i][c].push(seconds);
                }
            }
        }
    }
    table
}

/// Waves as the integrator cuts them.
const WAVE: usize = 4096;

fn trace(accel: &dyn Accelerator, class: &Class) -> f64 {
    let mut hits = vec![None; WAVE];
    let mut occluded = vec![false; WAVE];
    clock::thread_seconds(|| {
        for rays in class.rays.chunks(WAVE) {
            if class.any {
                accel.occluded(rays, class.coherence, &mut occluded[..rays.len()]);
            } else {
                accel.intersect(rays, class.coherence, &mut hits[..rays.len()]);
            }
            std::hint::black_box((&hits, &occluded));
        }
    })
}

/// Median ratio of speed over the base, by class.
fn over(base: &[Vec<f64>], rows: &[Vec<f64>]) -> Vec<f64> {
    let ratio =
        |(base, own): (&Vec<f64>, &Vec<f64>)| median(base.iter().zip(own).map(|(b, o)| b / o).collect());
    base.iter().zip(rows).map(ratio).collect()
}

fn print_header(classes: &[Class]) {
    let names: Vec<&str> = classes.iter().map(|c| c.name.as_str()).collect();
    println!("| | {} |\n|{}", names.join(" | "), "---|".repeat(names.len() + 1));
}

fn print_row(name: &str, ratios: &[f64]) {
    let cells: Vec<String> = ratios.iter().map(|r| format!("{r:.2}")).collect();
    println!("| {name} | {} |", cells.join(" | "));
}

fn dump(path: &str, scene: &scenes::Scene, classes: &[Class]) {
    let mut w: Vec<u8> = vec![];
    w.extend((scene.triangles() as u32).to_le_bytes());
    for s in &scene.shapes {
        let gloss::geometry::Shape::Mesh(m) = s else { continue };
        for i in 0..m.triangle_count() {
            for p in m.triangle(i as u32) {
                for k in 0..3 {
                    w.extend(p[k].to_le_bytes());
                }
            }
        }
    }
    for c in classes {
        w.extend((c.any as u32).to_le_bytes());
        w.extend((c.rays.len() as u32).to_le_bytes());
        for r in &c.rays {
            for x in [r.origin.x, r.origin.y, r.origin.z, r.t_min, r.dir.x, r.dir.y, r.dir.z, r.t_max] {
                w.extend(x.to_le_bytes());
            }
        }
    }
    std::fs::write(path, w).unwrap();
}
