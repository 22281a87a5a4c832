//! How fast backends answer the same rays: rounds in turn, so that a machine that slows down slows all of them.

use crate::accel::Accelerator;
use crate::integrator::RayClass;
use crate::trace::{Batch, ask_all};
use serde::Serialize;

/// Rays per second of CPU time of one class on one backend.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Rate {
    /// What the rays are for.
    pub class: RayClass,
    /// Of the median round.
    pub median: f64,
    /// Of the slowest round.
    pub least: f64,
    /// Of the fastest round.
    pub most: f64,
}

/// The rates of each backend for each class that has rays, by `rounds` rounds on one thread.
///
/// Each round asks every class of every backend, beginning with another backend than the round before.
pub fn rates(backends: &[&dyn Accelerator], batches: &[Batch], rounds: usize) -> Vec<Vec<Rate>> {
    let mut all = vec![Vec::new(); backends.len()];
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let one_thread = one_thread.expect("the operating system gives a thread");
    for class in RayClass::ALL {
        let of_class: Vec<&Batch> = batches.iter().filter(|b| b.class == class).collect();
        let rays: usize = of_class.iter().map(|b| b.rays.len()).sum();
        if rays == 0 {
            continue;
        }
        let mut measured = vec![Vec::new(); backends.len()];
        for round in 0..rounds.max(1) {
            for turn in 0..backends.len() {
                let number = (round + turn) % backends.len();
                let asked = one_thread.install(|| ask_all(backends[number], &of_class));
                measured[number].push(rays as f64 / asked.seconds.max(1e-9));
            }
        }
        for (rates, measured) in all.iter_mut().zip(measured) {
            rates.push(Rate::of(class, measured));
        }
    }
    all
}

impl Rate {
    fn of(class: RayClass, mut measured: Vec<f64>) -> Self {
        measured.sort_by(f64::total_cmp);
        let last = measured.len() - 1;
        Self { class, median: measured[measured.len() / 2], least: measured[0], most: measured[last] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::brute::Brute;
    use crate::core::{Ray, Vec3};

    #[test]
    fn there_is_a_rate_for_each_class_with_rays() {
        let rays = vec![Ray::new(Vec3::ZERO, Vec3::Z); 10];
        let batches = [RayClass::Primary, RayClass::Shadow].map(|class| Batch { class, rays: rays.clone() });
        let brute = Brute::new(&[]);
        let rates = rates(&[&brute, &brute, &brute], &batches, 2);
        assert_eq!(rates.len(), 3);
        for of_backend in rates {
            assert_eq!(
                of_backend.iter().map(|r| r.class).collect::<Vec<_>>(),
                [RayClass::Primary, RayClass::Shadow]
            );
            assert!(of_backend.iter().all(|r| 0.0 < r.least && r.least <= r.median && r.median <= r.most));
        }
    }

    #[test]
    fn the_median_is_the_middle_one() {
        let rate = Rate::of(RayClass::Glossy, vec![5.0, 1.0, 3.0]);
        assert_eq!((rate.least, rate.median, rate.most), (1.0, 3.0, 5.0));
    }
}
