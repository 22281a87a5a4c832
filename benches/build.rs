//! Build time and memory of the pure-Rust hierarchy beside Embree's.
//!
//! ```text
//! cargo bench --bench build -- [--scenes knot,terrain,...] [--obj FILE] [--rounds 5] [--threads 1]
//! ```
//!
//! Seconds are CPU seconds of the process (medians over interleaved rounds), so with one thread other work on the
//! machine does not count.

mod support;

use gloss::accel::{AccelError, Accelerator, Backend, BuildOptions, Quality, build};
use gloss::geometry::Shape;
use support::{argument, clock, median, scenes};

fn main() {
    let names = argument("--scenes").unwrap_or("knot,terrain,stadium,sticks".into());
    let rounds = argument("--rounds").map_or(5, |r| r.parse().expect("--rounds N"));
    let threads = argument("--threads").map_or(1, |t| t.parse().expect("--threads N"));
    println!(
        "| scene | quality | Embree s | BVH s | BVH / Embree | Embree MiB | BVH MiB |\n|---|---|---|---|---|---|---|"
    );
    for name in names.split(',') {
        let scene = scenes::by_name(name, argument("--obj").as_deref());
        for quality in [Quality::Fast, Quality::Medium, Quality::High] {
            let options = BuildOptions { quality, threads, ..Default::default() };
            let mut seconds = [vec![], vec![]];
            let mut mebibytes = [f64::NAN; 2];
            for _ in 0..rounds {
                for (i, backend) in [Backend::Embree, Backend::Bvh].into_iter().enumerate() {
                    let (time, built) = timed(backend, &scene.shapes, &options);
                    if let Ok(built) = built {
                        seconds[i].push(time);
                        mebibytes[i] = built.info().memory_bytes as f64 / (1u64 << 20) as f64;
                    }
                }
            }
            let [embree, bvh] = seconds.map(median);
            println!(
                "| {} | {quality:?} | {embree:.3} | {bvh:.3} | {:.2} | {:.1} | {:.1} |",
                scene.name,
                bvh / embree,
                mebibytes[0],
                mebibytes[1]
            );
        }
    }
}

type Built = Result<Box<dyn Accelerator>, AccelError>;

fn timed(backend: Backend, shapes: &[Shape], options: &BuildOptions) -> (f64, Built) {
    clock::process_seconds(|| build(backend, shapes, options))
}
