//! Which way to take for an error or for a time.

use super::findings::Found;
use serde::{Deserialize, Serialize};

/// What the user has or wants.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Target {
    /// A relMSE that the picture should have.
    Error(f64),
    /// CPU seconds that it may take.
    Time(f64),
}

/// What is needed of a way to say how it does with more or fewer samples.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Law {
    /// Samples per pixel that were measured.
    pub spp: f64,
    /// Noise, as relMSE, with these.
    pub noise: f64,
    /// Squared bias: what no number of samples takes away. Where none was found, 0 if none is claimed, else the most that
    /// it may well be.
    pub floor: f64,
    /// CPU seconds per pixel with these samples.
    pub seconds_per_pixel: f64,
    /// How uncertain the product of time and noise is: half of its relative 95 % interval.
    pub uncertainty: f64,
}

impl Law {
    /// relMSE with `spp` samples per pixel: noise falls with their number, bias stays.
    pub fn error(&self, spp: f64) -> f64 {
        self.floor + self.noise * self.spp / spp
    }

    /// CPU seconds of a picture of so many pixels with `spp` samples each.
    pub fn seconds(&self, spp: f64, pixels: f64) -> f64 {
        self.seconds_per_pixel * pixels * spp / self.spp
    }

    /// The least samples per pixel that reach an error even if the noise is as large as its interval allows, or the
    /// most that a time allows for so many pixels; `None` if there are none.
    pub fn spp_for(&self, target: Target, pixels: f64) -> Option<u32> {
        let spp = match target {
            Target::Error(error) if error <= self.floor => return None,
            Target::Error(error) => {
                let noise = self.noise * (1.0 + self.uncertainty.min(MOST_CAUTION));
                (noise * self.spp / (error - self.floor)).ceil().max(1.0)
            }
            Target::Time(seconds) => (seconds / self.seconds(1.0, pixels)).floor(),
        };
        (1.0..=MOST_SPP).contains(&spp).then_some(spp as u32)
    }
}

/// Two rounds know next to nothing of their own uncertainty: no more than this much of the noise is added for it.
const MOST_CAUTION: f64 = 0.5;

/// More samples per pixel than these are no advice.
const MOST_SPP: f64 = 16_777_216.0;

/// What to take.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Advice {
    /// For what.
    pub target: Target,
    /// Number of the way.
    pub way: usize,
    /// Its name.
    pub name: String,
    /// Samples per pixel.
    pub spp: u32,
    /// relMSE to be expected.
    pub error: f64,
    /// CPU seconds to be expected.
    pub seconds: f64,
    /// How many times as long the base takes for the same error; `None` if it cannot have it.
    pub times_the_base: Option<f64>,
}

/// The best way for a target and a picture of so many pixels: the fastest to an error, the most exact in a time.
///
/// Ways whose samples follow the noise, and patterns of a fixed number of points, are no candidates: they have no such law.
/// Nor are ways that are better than the base by no more than chance may show: of many that are no better, the luckiest would
/// always win.
pub fn advise(found: &[Found], target: Target, pixels: f64) -> Option<Advice> {
    let base = &found.first()?.law;
    let is_better = |law: &Law| {
        let (Some(mine), Some(other)) = (law.spp_for(target, pixels), base.spp_for(target, pixels)) else {
            return true;
        };
        let [mine, other] = [(law, mine), (base, other)].map(|(law, spp)| match target {
            Target::Error(_) => law.seconds(f64::from(spp), pixels),
            Target::Time(_) => law.error(f64::from(spp)),
        });
        (other / mine).ln() > law.uncertainty.hypot(base.uncertainty)
    };
    let candidates = found.iter().enumerate().filter(|(number, f)| {
        let has_a_law = f.way.noise.is_none() && !f.way.has_a_pattern();
        has_a_law && (*number == 0 || is_better(&f.law))
    });
    let advice = candidates.filter_map(|(number, f)| {
        let spp = f.law.spp_for(target, pixels)?;
        let (error, seconds) = (f.law.error(f64::from(spp)), f.law.seconds(f64::from(spp), pixels));
        let name = f.way.name.clone();
        Some(Advice { target, way: number, name, spp, error, seconds, times_the_base: None })
    });
    let cost = |a: &Advice| match target {
        Target::Error(_) => a.seconds,
        Target::Time(_) => a.error,
    };
    let mut best = advice.min_by(|a, b| cost(a).total_cmp(&cost(b)))?;
    if best.error > base.floor {
        let spp = base.noise * base.spp / (best.error - base.floor);
        best.times_the_base = Some(base.seconds(spp, pixels) / best.seconds.max(1e-12));
    }
    Some(best)
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAW: Law = Law { spp: 16.0, noise: 0.04, floor: 0.01, seconds_per_pixel: 1e-3, uncertainty: 0.1 };

    #[test]
    fn samples_follow_from_the_law() {
        assert_eq!(LAW.spp_for(Target::Error(0.02), 100.0), Some(71));
        let certain = Law { uncertainty: 0.0, ..LAW };
        assert_eq!(certain.spp_for(Target::Error(0.02), 100.0), Some(64));
        assert!((LAW.error(64.0) - 0.02).abs() < 1e-12);
        assert!((LAW.seconds(64.0, 100.0) - 0.4).abs() < 1e-12);
        assert_eq!(LAW.spp_for(Target::Error(0.01), 100.0), None, "the bias stays");
        assert_eq!(LAW.spp_for(Target::Time(0.4), 100.0), Some(64));
        assert_eq!(LAW.spp_for(Target::Time(1e-3), 100.0), None, "no time for one sample");
    }
}
