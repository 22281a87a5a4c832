//! Choosing among weighted things for eight receivers side by side.

use super::unit::below_one;
use crate::core::lanes::{Floats, LANES};

/// The choice among several things for each of eight receivers: those that are [offered](Self::offer) one after the other.
pub(super) struct Picking {
    total: Floats,
    /// What the choices come to, of the total.
    at: [f64; LANES],
    /// Weights so far.
    sum: Floats,
    index: [u32; LANES],
    /// Weights before the one that was picked, and its own.
    before: Floats,
    weight: Floats,
}

/// What was picked for eight receivers.
#[derive(Default)]
pub(super) struct Picked {
    pub index: [u32; LANES],
    /// Its share of the total.
    pub share: [f64; LANES],
    /// What is left of the choice: uniform in `[0, 1)` again.
    pub rest: [f64; LANES],
    /// Whether anything has a weight there.
    pub there: [bool; LANES],
}

impl Picking {
    /// By a `choice` in `[0, 1)`, where all weights together are `total`, added in the order of offers.
    #[inline(always)]
    pub(super) fn new(total: &Floats, choice: &[f64; LANES]) -> Self {
        let mut at = [0.0; LANES];
        for lane in 0..LANES {
            at[lane] = choice[lane] * f64::from(total[lane]);
        }
        let none = Floats::default();
        Self { total: *total, at, sum: none, index: [0; LANES], before: none, weight: none }
    }

    /// Offers the thing number `index` with its weights.
    #[inline(always)]
    pub(super) fn offer(self, index: u32, weights: &Floats) -> Self {
        let mut next = self;
        for lane in 0..LANES {
            let falls = (weights[lane] > 0.0) & (next.sum[lane] <= next.at[lane] as f32);
            next.index[lane] = if falls { index } else { next.index[lane] };
            next.before[lane] = if falls { next.sum[lane] } else { next.before[lane] };
            next.weight[lane] = if falls { weights[lane] } else { next.weight[lane] };
            next.sum[lane] += weights[lane];
        }
        next
    }

    /// What was picked, once all were offered.
    #[inline(always)]
    pub(super) fn picked(self) -> Picked {
        let Self { total, at, index, before, weight, .. } = self;
        let mut picked = Picked { index, ..Default::default() };
        for lane in 0..LANES {
            let weight = f64::from(weight[lane]);
            picked.share[lane] = weight / f64::from(total[lane]);
            picked.rest[lane] = below_one((at[lane] - f64::from(before[lane])) / weight);
            picked.there[lane] = total[lane] > 0.0;
        }
        picked
    }
}
