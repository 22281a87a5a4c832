//! Which of two answers is right, by f64 arithmetic on the scene's own triangles and spheres.
//!
//! Where the scene is small enough every primitive is tested; else those that either backend named, which cannot
//! tell of a hit that both missed.

use super::answers::{Answer, Disagreement, close};
use crate::accel::brute::Brute;
use crate::accel::{Accelerator, Coherence};
use crate::core::{Hit, Ray, Skip};
use crate::geometry::{Shape, TriangleMesh};
use crate::integrator::RayClass;
use rayon::prelude::*;
use serde::Serialize;

/// Disagreements that are looked into, at most; of more, an evenly spread part.
const MOST_JUDGED: usize = 2000;

/// Primitives tested for all rays together, at most: a few seconds.
const MOST_TESTS: usize = 400_000_000;

/// Examples that a report shows.
const EXAMPLES: usize = 12;

/// Whose answer is right.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Right {
    /// Both, within the tolerance: the point lies on two primitives, such as a shared edge or coincident surfaces.
    Both,
    /// The first.
    First,
    /// The second.
    Second,
    /// None of them.
    Neither,
}

/// A disagreement and the truth.
#[derive(Clone, Copy, Debug)]
pub struct Explanation {
    /// The ray and the two answers.
    pub disagreement: Disagreement,
    /// The closest hit in f64 arithmetic.
    pub exact: Option<Hit>,
    /// Whether every primitive of the scene was tested.
    pub exhaustive: bool,
    /// Whose answer is right.
    pub right: Right,
}

/// What became of the disagreements.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Explained {
    /// Disagreements in all.
    pub all: u64,
    /// Those that were looked into.
    pub judged: u64,
    /// Of those, how many against every primitive of the scene.
    pub exhaustive: u64,
    /// Both are right.
    pub both: u64,
    /// Only the first is right.
    pub first: u64,
    /// Only the second is right.
    pub second: u64,
    /// Neither is right.
    pub neither: u64,
    /// A few of them, the wrong ones first.
    #[serde(skip)]
    pub examples: Vec<Explanation>,
}

impl Explained {
    /// Wrong answers of the first and of the second backend, estimated from the part that was looked into.
    pub fn wrong(&self) -> [f64; 2] {
        let scale = self.all as f64 / (self.judged as f64).max(1.0);
        [self.second + self.neither, self.first + self.neither].map(|wrong| wrong as f64 * scale)
    }
}

/// Judges the disagreements of two backends over the shapes that both were built from.
///
/// `backends` are asked again for what hides a shadow ray. An answer is right if it finds something where there is
/// something, at the true distance within `tolerance` of it.
pub fn explain(
    shapes: &[Shape],
    backends: [&dyn Accelerator; 2],
    disagreements: &[Disagreement],
    tolerance: f32,
) -> Explained {
    let judged = disagreements.len().min(MOST_JUDGED);
    let primitives: usize = shapes.iter().map(Shape::primitive_count).sum();
    let exhaustive_for = MOST_TESTS / primitives.max(1);
    let brute = Brute::new(shapes);
    let explanations: Vec<Explanation> = (0..judged)
        .into_par_iter()
        .map(|i| {
            let disagreement = disagreements[i * disagreements.len() / judged];
            let exhaustive = i < exhaustive_for;
            let exact = if exhaustive {
                closest(&brute, &disagreement.ray)
            } else {
                closest_of_named(shapes, backends, &disagreement)
            };
            let right = judge(&disagreement, exact, tolerance);
            Explanation { disagreement, exact, exhaustive, right }
        })
        .collect();
    summary(disagreements.len(), explanations)
}

fn summary(all: usize, mut explanations: Vec<Explanation>) -> Explained {
    let number = |right| explanations.iter().filter(|e| e.right == right).count() as u64;
    let mut explained = Explained {
        all: all as u64,
        judged: explanations.len() as u64,
        exhaustive: explanations.iter().filter(|e| e.exhaustive).count() as u64,
        both: number(Right::Both),
        first: number(Right::First),
        second: number(Right::Second),
        neither: number(Right::Neither),
        examples: vec![],
    };
    explanations.sort_by_key(|e| e.right == Right::Both);
    explanations.truncate(EXAMPLES);
    explained.examples = explanations;
    explained
}

fn judge(disagreement: &Disagreement, exact: Option<Hit>, tolerance: f32) -> Right {
    let is_right = |answer: &Answer| match (answer, exact) {
        (Answer::Closest(Some(hit)), Some(exact)) => close(hit.t, exact.t, tolerance),
        (answer, exact) => answer.found() == exact.is_some(),
    };
    match (is_right(&disagreement.first), is_right(&disagreement.second)) {
        (true, true) => Right::Both,
        (true, false) => Right::First,
        (false, true) => Right::Second,
        (false, false) => Right::Neither,
    }
}

fn closest(accel: &dyn Accelerator, ray: &Ray) -> Option<Hit> {
    let mut hit = [None];
    accel.intersect(&[*ray], Coherence::Incoherent, &mut hit);
    hit[0]
}

/// The closest of the primitives that either backend names, in f64.
fn closest_of_named(
    shapes: &[Shape],
    backends: [&dyn Accelerator; 2],
    disagreement: &Disagreement,
) -> Option<Hit> {
    let ray = &disagreement.ray;
    let named = match disagreement.class {
        RayClass::Shadow => backends.map(|backend| closest(backend, ray)),
        _ => [disagreement.first, disagreement.second].map(|answer| match answer {
            Answer::Closest(hit) => hit,
            Answer::Occluded(_) => None,
        }),
    };
    let exact = named.into_iter().flatten().filter_map(|hit| exact_on(shapes, ray, &hit));
    exact.min_by(|a, b| a.t.total_cmp(&b.t))
}

/// Where a ray meets the primitive of a hit, in f64; `None` where it does not, or may not.
fn exact_on(shapes: &[Shape], ray: &Ray, hit: &Hit) -> Option<Hit> {
    let Hit { geom_id, prim_id, .. } = *hit;
    let shape = shapes.get(geom_id as usize)?;
    if prim_id as usize >= shape.primitive_count() || ray.skip.rejects(geom_id, prim_id) {
        return None;
    }
    let alone = match shape {
        Shape::Mesh(mesh) => {
            let corners = mesh.triangle(prim_id).to_vec();
            Shape::Mesh(TriangleMesh::new(corners, vec![[0, 1, 2]], vec![], vec![]).ok()?.into())
        }
        Shape::Spheres(spheres) => Shape::Spheres([spheres[prim_id as usize]].into()),
    };
    let found = closest(&Brute::new(&[alone]), &Ray { skip: Skip::None, ..*ray })?;
    Some(Hit { geom_id, prim_id, ..found })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compare::answers::Kind;
    use crate::core::Vec3;
    use crate::geometry::Sphere;

    fn spheres() -> [Shape; 1] {
        let sphere = |z| Sphere { center: Vec3::new(0.0, 0.0, z), radius: 1.0 };
        [Shape::Spheres([sphere(5.0), sphere(9.0)].into())]
    }

    fn hit(t: f32, prim_id: u32) -> Option<Hit> {
        Some(Hit { t, u: 0.0, v: 0.0, geom_id: 0, prim_id })
    }

    fn disagreement(first: Option<Hit>, second: Option<Hit>) -> Disagreement {
        let ray = Ray::new(Vec3::ZERO, Vec3::Z);
        let [first, second] = [first, second].map(Answer::Closest);
        Disagreement { class: RayClass::Glossy, ray, first, second, kind: Kind::Distance }
    }

    #[test]
    fn the_truth_is_found_by_all_primitives_and_by_those_named() {
        let shapes = spheres();
        let brute = Brute::new(&shapes);
        let cases = [
            (hit(4.0, 0), hit(8.0, 1), Right::First),
            (None, hit(4.0, 0), Right::Second),
            (hit(4.0, 0), hit(4.0, 1), Right::Both),
            (hit(4.5, 0), None, Right::Neither),
        ];
        for (first, second, expected) in cases {
            let d = disagreement(first, second);
            let explained = explain(&shapes, [&brute, &brute], &[d], 1e-5);
            assert_eq!(explained.examples[0].right, expected, "{d:?}");
            let named = closest_of_named(&shapes, [&brute, &brute], &d);
            assert_eq!(judge(&d, named, 1e-5), expected, "{d:?}");
        }
    }

    #[test]
    fn of_many_disagreements_a_part_is_judged_and_scaled() {
        let shapes = spheres();
        let brute = Brute::new(&shapes);
        let many = vec![disagreement(hit(4.0, 0), None); 2 * MOST_JUDGED];
        let explained = explain(&shapes, [&brute, &brute], &many, 1e-5);
        assert_eq!((explained.judged, explained.first), (MOST_JUDGED as u64, MOST_JUDGED as u64));
        assert_eq!(explained.wrong(), [0.0, 2.0 * MOST_JUDGED as f64]);
    }

    #[test]
    fn what_a_ray_must_not_hit_is_no_answer() {
        let shapes = spheres();
        let skip = Skip::Primitive { geom: 0, prim: 0 };
        let ray = Ray { skip, ..Ray::new(Vec3::ZERO, Vec3::Z) };
        assert_eq!(exact_on(&shapes, &ray, &hit(4.0, 0).unwrap()), None);
        assert_eq!(exact_on(&shapes, &ray, &hit(1.0, 7).unwrap()), None);
        assert_eq!(exact_on(&shapes, &ray, &hit(1.0, 1).unwrap()), hit(8.0, 1));
    }
}
