//! Choosing in proportion to weights so that near numbers choose near things.

use crate::core::prefetch;

/// Running sums of rows of weights, inverted by a guided search.
///
/// Source of the guide: Chen and Asau 1974, *On Generating Random Variates from an Empirical Distribution*.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Cumulative {
    /// Entries of a row.
    width: usize,
    /// Share of its row's weight up to and with each entry.
    sums: Vec<f64>,
    /// Intervals into which a row's guide divides `[0, 1]`.
    steps: usize,
    /// For each row and each interval the entry that its lower end falls into; and the last entry.
    guide: Vec<u32>,
}

/// Entries per interval of the guide, on average.
const GUIDED: usize = 4;

impl Cumulative {
    /// Of rows of `width` weights, with the total weight of each row. Weights are at least 0.
    pub(super) fn new(mut weights: Vec<f64>, width: usize) -> (Self, Vec<f64>) {
        let steps = width.div_ceil(GUIDED);
        let mut guide = Vec::with_capacity(weights.len() / width * (steps + 1));
        let mut totals = Vec::with_capacity(weights.len() / width);
        for row in weights.chunks_exact_mut(width) {
            let mut total = 0.0;
            for weight in &mut *row {
                total += *weight;
                *weight = total;
            }
            if total > 0.0 {
                row.iter_mut().for_each(|sum| *sum /= total);
            }
            let mut entry = 0;
            for step in 0..steps {
                while entry + 1 < width && row[entry] <= step as f64 / steps as f64 {
                    entry += 1;
                }
                guide.push(entry as u32);
            }
            guide.push(width as u32 - 1);
            totals.push(total);
        }
        (Self { width, sums: weights, steps, guide }, totals)
    }

    /// Asks for what [`between`](Self::between) will read.
    #[inline(always)]
    pub(super) fn prefetch_guide(&self, row: usize, x: f64) {
        prefetch(&self.guide[self.interval(row, x)]);
    }

    /// The first and the last entry of `row` that `x` in `[0, 1)` may fall into.
    #[inline(always)]
    pub(super) fn between(&self, row: usize, x: f64) -> [usize; 2] {
        let interval = self.interval(row, x);
        [self.guide[interval], self.guide[interval + 1]].map(|entry| entry as usize)
    }

    /// Asks for what [`find`](Self::find) will read.
    #[inline(always)]
    pub(super) fn prefetch_sums(&self, row: usize, [first, last]: [usize; 2]) {
        prefetch(&self.sums[row * self.width + first]);
        prefetch(&self.sums[row * self.width + (first + last) / 2]);
    }

    /// The entry of `row` that `x` falls into, which is one of these, and what is left of `x`: uniform in `[0, 1]` again.
    #[inline(always)]
    pub(super) fn find(&self, row: usize, [first, last]: [usize; 2], x: f64) -> (usize, f64) {
        let sums = &self.sums[row * self.width..][..self.width];
        let entry = first + sums[first..last].partition_point(|&sum| sum <= x);
        let before = if entry == 0 { 0.0 } else { sums[entry - 1] };
        (entry, ((x - before) / (sums[entry] - before)).clamp(0.0, 1.0))
    }

    /// Where the guide of `row` tells of `x`.
    #[inline(always)]
    fn interval(&self, row: usize, x: f64) -> usize {
        row * (self.steps + 1) + ((x * self.steps as f64) as usize).min(self.steps - 1)
    }

    /// Bytes of the tables.
    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(&self.sums[..]) + size_of_val(&self.guide[..])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_guided_search_finds_what_a_full_search_finds() {
        let weights = [[0.0, 3.0, 1e-9, 0.0, 5.0, 100.0, 0.0], [1.0; 7], [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0]];
        let (table, totals) = Cumulative::new(weights.concat(), 7);
        for (row, weights) in weights.iter().enumerate() {
            let total: f64 = weights.iter().sum();
            assert!((totals[row] - total).abs() < 1e-12);
            for i in 0..10_000 {
                let x = f64::from(i) / 10_000.0;
                let (entry, rest) = table.find(row, table.between(row, x), x);
                let before: f64 = weights[..entry].iter().sum();
                let back = (before + rest * weights[entry]) / total;
                assert!((back - x).abs() < 1e-9 && (0.0..=1.0).contains(&rest), "{row} {x} {entry} {rest}");
                assert!(weights[entry] > 0.0, "{row} {x} {entry}");
            }
        }
    }
}
