//! The same rays asked of two backends: which answers differ, and how.

use crate::accel::Accelerator;
use crate::core::{Hit, Ray};
use crate::integrator::RayClass;
use crate::trace::{Batch, ask};
use rayon::prelude::*;
use serde::Serialize;

/// How two answers to a ray differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// The second found something, the first nothing.
    MissedByFirst,
    /// The first found something, the second nothing.
    MissedBySecond,
    /// Both hit, but not the same primitive.
    OtherPrimitive,
    /// Both hit the same primitive, at distances that differ by more than the tolerance.
    Distance,
}

/// What a backend says of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Answer {
    /// The closest hit.
    Closest(Option<Hit>),
    /// Whether anything is in the way.
    Occluded(bool),
}

impl Answer {
    /// Whether it found anything.
    pub fn found(&self) -> bool {
        match self {
            Self::Closest(hit) => hit.is_some(),
            Self::Occluded(occluded) => *occluded,
        }
    }

    /// How `second` differs, if it does: distances may be apart by `tolerance` of the greater one.
    pub fn differs(&self, second: &Self, tolerance: f32) -> Option<Kind> {
        match (self.found(), second.found()) {
            (false, true) => return Some(Kind::MissedByFirst),
            (true, false) => return Some(Kind::MissedBySecond),
            (false, false) => return None,
            (true, true) => {}
        }
        let (Self::Closest(Some(a)), Self::Closest(Some(b))) = (self, second) else { return None };
        if (a.geom_id, a.prim_id) != (b.geom_id, b.prim_id) {
            Some(Kind::OtherPrimitive)
        } else if !close(a.t, b.t, tolerance) {
            Some(Kind::Distance)
        } else {
            None
        }
    }
}

/// Whether two distances are apart by at most `tolerance` of the greater one; NaN is close to nothing.
pub fn close(a: f32, b: f32, tolerance: f32) -> bool {
    (a - b).abs() <= tolerance * a.abs().max(b.abs())
}

/// A ray that two backends answer differently.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disagreement {
    /// What the ray is for.
    pub class: RayClass,
    /// The ray.
    pub ray: Ray,
    /// What the first backend says.
    pub first: Answer,
    /// What the second backend says.
    pub second: Answer,
    /// How they differ.
    pub kind: Kind,
}

/// How the answers to the rays of one class differ.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ClassAnswers {
    /// What the rays are for.
    pub class: RayClass,
    /// How many there are.
    pub rays: u64,
    /// Number of [`Kind::MissedByFirst`].
    pub missed_by_first: u64,
    /// Number of [`Kind::MissedBySecond`].
    pub missed_by_second: u64,
    /// Number of [`Kind::OtherPrimitive`].
    pub other_primitive: u64,
    /// Number of [`Kind::Distance`].
    pub distance: u64,
}

impl ClassAnswers {
    /// Answers that differ in any way.
    pub fn all(&self) -> u64 {
        self.missed_by_first + self.missed_by_second + self.other_primitive + self.distance
    }

    fn of(class: RayClass, rays: u64, disagreements: &[Disagreement]) -> Self {
        let number =
            |kind| disagreements.iter().filter(|d| d.class == class && d.kind == kind).count() as u64;
        Self {
            class,
            rays,
            missed_by_first: number(Kind::MissedByFirst),
            missed_by_second: number(Kind::MissedBySecond),
            other_primitive: number(Kind::OtherPrimitive),
            distance: number(Kind::Distance),
        }
    }
}

/// Asks both backends all batches, on the calling thread pool: counts by class, and the rays themselves.
pub fn compare_answers(
    first: &dyn Accelerator,
    second: &dyn Accelerator,
    batches: &[Batch],
    tolerance: f32,
) -> (Vec<ClassAnswers>, Vec<Disagreement>) {
    let of_batch = |batch: &Batch| {
        let answers = answers(first, batch).into_iter().zip(answers(second, batch)).zip(&batch.rays);
        let different = answers.filter_map(|((first, second), ray)| {
            let kind = first.differs(&second, tolerance)?;
            Some(Disagreement { class: batch.class, ray: *ray, first, second, kind })
        });
        different.collect::<Vec<_>>()
    };
    let disagreements: Vec<_> = batches.par_iter().flat_map_iter(of_batch).collect();
    let classes = RayClass::ALL.into_iter().filter_map(|class| {
        let rays = batches.iter().filter(|b| b.class == class).map(|b| b.rays.len() as u64).sum();
        (rays > 0).then(|| ClassAnswers::of(class, rays, &disagreements))
    });
    (classes.collect(), disagreements)
}

fn answers(accel: &dyn Accelerator, batch: &Batch) -> Vec<Answer> {
    let (mut hits, mut occluded) = (Vec::new(), Vec::new());
    if batch.class == RayClass::Shadow {
        occluded.resize(batch.rays.len(), false);
    } else {
        hits.resize(batch.rays.len(), None);
    }
    ask(accel, batch, &mut hits, &mut occluded);
    if batch.class == RayClass::Shadow {
        occluded.into_iter().map(Answer::Occluded).collect()
    } else {
        hits.into_iter().map(Answer::Closest).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hit(t: f32, prim_id: u32) -> Answer {
        Answer::Closest(Some(Hit { t, u: 0.0, v: 0.0, geom_id: 0, prim_id }))
    }

    #[test]
    fn answers_differ_in_four_ways() {
        let miss = Answer::Closest(None);
        let cases = [
            (miss, hit(1.0, 0), Some(Kind::MissedByFirst)),
            (hit(1.0, 0), miss, Some(Kind::MissedBySecond)),
            (hit(1.0, 0), hit(1.0, 1), Some(Kind::OtherPrimitive)),
            (hit(1.0, 0), hit(1.1, 0), Some(Kind::Distance)),
            (hit(1.0, 0), hit(f32::NAN, 0), Some(Kind::Distance)),
            (hit(1.0, 0), hit(1.0 + 1e-6, 0), None),
            (hit(0.0, 0), hit(0.0, 0), None),
            (miss, miss, None),
            (Answer::Occluded(true), Answer::Occluded(false), Some(Kind::MissedBySecond)),
            (Answer::Occluded(true), Answer::Occluded(true), None),
        ];
        for (first, second, expected) in cases {
            assert_eq!(first.differs(&second, 1e-5), expected, "{first:?} {second:?}");
        }
    }
}
