//! Choosing one of many things with fixed weights in constant time.

/// Walker's alias table.
///
/// Source: Walker 1977, *An Efficient Method for Generating Discrete Random Variables with General Distributions*;
/// built by Vose's method (1991), which is linear in the number of weights.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct AliasTable {
    /// How often bin i is itself, and what it is otherwise.
    bins: Vec<(f32, u32)>,
}

impl AliasTable {
    /// A table that gives index i with probability `weights[i] / total`; `None` if the total is not a positive
    /// finite number.
    pub(super) fn new(weights: &[f64]) -> Option<Self> {
        let total: f64 = weights.iter().sum();
        if !(total.is_finite() && total > 0.0) {
            return None;
        }
        let scale = weights.len() as f64 / total;
        let mut share: Vec<f64> = weights.iter().map(|w| w * scale).collect();
        let (mut small, mut large): (Vec<usize>, Vec<usize>) =
            (0..weights.len()).partition(|&i| share[i] < 1.0);
        let mut bins: Vec<(f32, u32)> = (0..weights.len()).map(|i| (1.0, i as u32)).collect();
        while let Some(&giver) = large.last() {
            let Some(taker) = small.pop() else { break };
            bins[taker] = (share[taker] as f32, giver as u32);
            share[giver] -= 1.0 - share[taker];
            if share[giver] < 1.0 {
                large.pop();
                small.push(giver);
            }
        }
        // Rounding may leave small bins without a giver: their share is 1 but for rounding, unless it is nothing.
        let greatest = (0..weights.len()).max_by(|&a, &b| weights[a].total_cmp(&weights[b])).unwrap_or(0);
        for left in small.into_iter().filter(|&i| weights[i] == 0.0) {
            bins[left] = (0.0, greatest as u32);
        }
        Some(Self { bins })
    }

    /// The index that `x` in `[0, 1)` falls on, and what is left of `x`: uniform in `[0, 1)` again.
    #[inline]
    pub(super) fn sample(&self, x: f64) -> (usize, f64) {
        let scaled = x * self.bins.len() as f64;
        let bin = (scaled as usize).min(self.bins.len() - 1);
        let (rest, (share, alias)) = (scaled - bin as f64, self.bins[bin]);
        let share = f64::from(share);
        if rest < share {
            (bin, below_one(rest / share))
        } else {
            (alias as usize, below_one((rest - share) / (1.0 - share)))
        }
    }
}

/// The greatest number below 1 for what rounding made 1.
#[inline]
pub(super) fn below_one(x: f64) -> f64 {
    x.clamp(0.0, 1.0 - 0.5 * f64::EPSILON)
}

/// Two numbers as the warps of `core` take them.
#[inline]
pub(super) fn narrow(u: [f64; 2]) -> [f32; 2] {
    u.map(|u| (u as f32).min(1.0 - 0.5 * f32::EPSILON))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn indices_come_as_often_as_they_weigh() {
        let weights = [0.0, 3.0, 1e-3, 5.0, 0.0, 0.5, 1e-9, 7.0];
        let table = AliasTable::new(&weights).unwrap();
        let (n, total) = (1 << 20, weights.iter().sum::<f64>());
        let (mut count, mut rests) = ([0.0; 8], [0.0; 8]);
        for i in 0..n {
            let (index, rest) = table.sample((f64::from(i) + 0.5) / f64::from(n));
            assert!((0.0..1.0).contains(&rest));
            count[index] += 1.0;
            rests[index] += rest;
        }
        for i in 0..weights.len() {
            // Equally spaced numbers miss each end of at most 8 bins' two intervals by less than one.
            assert!((count[i] - f64::from(n) * weights[i] / total).abs() <= 16.0, "{i}: {}", count[i]);
            if count[i] > 1e4 {
                assert!((rests[i] / count[i] - 0.5).abs() < 1e-3, "{i}: {}", rests[i] / count[i]);
            }
        }
        assert_eq!((count[0], count[4]), (0.0, 0.0));
    }

    #[test]
    fn weights_without_a_positive_total_make_no_table() {
        for weights in [&[][..], &[0.0, 0.0], &[1.0, f64::NAN], &[f64::INFINITY]] {
            assert_eq!(AliasTable::new(weights), None);
        }
    }
}
