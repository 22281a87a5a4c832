//! The one ray-sphere test of every path, in f64: spheres are few, and far or large ones cancel badly in f32.

use super::data::{BLOCK, Child, Hierarchy, NO_ID, Place};
use super::mode::Mode;
use super::ray::{Best, Prepared, Weights};
use glam::{DVec3, Vec3};

/// First parameter in `[t_min, t_max]` at which the ray meets the sphere's surface.
fn first_root<M: Mode>(ray: &Prepared<M>, center: Vec3, radius: f32, t_max: f32) -> Option<f32> {
    let d = Vec3::from(ray.dir).as_dvec3();
    let to_center: DVec3 = center.as_dvec3() - Vec3::from(ray.origin).as_dvec3();
    let length_squared = d.length_squared();

    // The discriminant from the point of the line that is closest to the centre (Haines et al. 2019, "Precision
    // Improvements for Ray/Sphere Intersection").
    let t_closest = to_center.dot(d) / length_squared;
    let miss = to_center - t_closest * d;
    let discriminant = f64::from(radius) * f64::from(radius) - miss.length_squared();
    if discriminant < 0.0 {
        return None;
    }
    let half_chord = (discriminant / length_squared).sqrt();
    let near = (t_closest - half_chord) as f32;
    let t = if near >= ray.t_min { near } else { (t_closest + half_chord) as f32 };
    (t >= ray.t_min && t <= t_max).then_some(t)
}

/// The best of `best` and the spheres of a leaf. Out of line, so that rays that meet no sphere do not prepare for
/// them.
#[inline(never)]
pub(super) fn intersect_leaf<M: Mode>(
    data: &Hierarchy,
    ray: &Prepared<M>,
    leaf: Child,
    mut best: Best,
    weights: &mut Weights,
) -> Best {
    for index in leaf.blocks() {
        let block = &data.spheres[index];
        for lane in 0..BLOCK {
            if block.geom_ids[lane] == NO_ID {
                break;
            }
            let (sphere, place) = (block.spheres[lane], Place::sphere(index, lane));
            if let Some(t) = first_root(ray, sphere.center, sphere.radius, best.t)
                && best.loses_to(data, ray.skip, t, place)
            {
                best = Best { t, place };
                *weights = Weights::NONE;
            }
        }
    }
    best
}
