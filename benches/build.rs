//! Build time and memory of the pure-Rust hierarchy beside Embree's.
//!
//! ```text
//! cargo bench --bench build -- [--scenes knot,terrain,...] [--mesh FILE,...] [--rounds 5] [--threads 1]
//! ```
//!
//! Seconds are CPU seconds of the process (medians over interleaved rounds), so with one thread other work on the
//! machine does not count. Fast, medium and high are Embree's LOW, MEDIUM and HIGH.

mod support;

use gloss::accel::{AccelError, Accelerator, Backend, BuildOptions, Quality, build};
use gloss::geometry::Shape;
use support::{clock, geomean, median, number, scenes};

fn main() {
    let (rounds, threads) = (number("--rounds", 5), number("--threads", 1));
    println!(
        "| scene | quality | Embree s | BVH s | BVH / Embree | Embree bytes/triangle | BVH bytes/triangle |\n\
         |---|---|---|---|---|---|---|"
    );
    const QUALITIES: [Quality; 3] = [Quality::Fast, Quality::Medium, Quality::High];
    let mut ratios = QUALITIES.map(|_| vec![]);
    for scene in scenes::wanted() {
        for (quality, ratios) in QUALITIES.into_iter().zip(&mut ratios) {
            let options = BuildOptions { quality, threads, robust: false, ..Default::default() };
            let mut seconds = [vec![], vec![]];
            let mut bytes = [f64::NAN; 2];
            for _ in 0..rounds {
                for (i, backend) in [Backend::Embree, Backend::Bvh].into_iter().enumerate() {
                    let (time, built) = timed(backend, &scene.shapes, &options);
                    if let Ok(built) = built {
                        seconds[i].push(time);
                        bytes[i] = built.info().memory_bytes as f64 / scene.triangles() as f64;
                    }
                }
            }
            let times = seconds[0].iter().zip(&seconds[1]).map(|(embree, bvh)| bvh / embree).collect();
            let ratio = median(times);
            let [embree, bvh] = seconds.map(median);
            let [embree_bytes, bvh_bytes] = bytes;
            println!(
                "| {} | {quality:?} | {embree:.3} | {bvh:.3} | {ratio:.2} | {embree_bytes:.0} | {bvh_bytes:.0} |",
                scene.name
            );
            ratios.push(ratio);
        }
    }
    let most = |r: &[f64]| r.iter().copied().fold(0.0, f64::max);
    for (quality, ratios) in QUALITIES.into_iter().zip(&ratios) {
        println!("| all | {quality:?} | | | {:.2} (most {:.2}) | | |", geomean(ratios), most(ratios));
    }
}

type Built = Result<Box<dyn Accelerator>, AccelError>;

fn timed(backend: Backend, shapes: &[Shape], options: &BuildOptions) -> (f64, Built) {
    clock::process_seconds(|| build(backend, shapes, options))
}
