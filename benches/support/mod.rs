//! Scenes, rays and clocks that the benchmarks share.

#![allow(dead_code)] // Each benchmark uses its part.

pub mod clock;
pub mod rays;
pub mod scenes;

/// A small generator of reproducible numbers (SplitMix64, Steele, Lea and Flood 2014).
pub struct Random(pub u64);

impl Random {
    pub fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ z >> 31) >> 40) as f32 / (1u32 << 24) as f32
    }

    pub fn signed(&mut self) -> f32 {
        2.0 * self.unit() - 1.0
    }
}

/// The value after `--name`, if it was given.
pub fn argument(name: &str) -> Option<String> {
    let mut arguments = std::env::args().skip_while(|a| a != name);
    arguments.next()?;
    arguments.next()
}

/// The number after `--name`, or another.
pub fn number(name: &str, default: usize) -> usize {
    argument(name).map_or(default, |n| n.parse().unwrap_or_else(|_| panic!("{name} takes a number")))
}

/// The middle one; the mean of the two in the middle of an even number.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    if n == 0 { f64::NAN } else { 0.5 * (values[(n - 1) / 2] + values[n / 2]) }
}

/// The geometric mean.
pub fn geomean(values: &[f64]) -> f64 {
    (values.iter().map(|v| v.ln()).sum::<f64>() / values.len() as f64).exp()
}
