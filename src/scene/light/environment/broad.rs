//! Directions for radiance that comes from all over.

use super::super::unit::narrow;
use crate::core::lanes::{Floats, LANES, Vectors};
use crate::core::{Frame, warp};
use glam::Vec3;
use std::f32::consts::PI;

/// How often the direction follows the cosine. The rest is uniform over the whole sphere: glossy lobes want light at
/// grazing angles, and below a shading normal's horizon, as much as elsewhere.
const COSINE_SHARE: f32 = 0.875;

/// A direction, mostly with the cosine to the receiver's normal `n`: both ways and no branch, for several side by side.
#[inline(always)]
pub(super) fn sample(n: Vec3, u: [f32; 2]) -> Vec3 {
    let by_cosine = u[0] < COSINE_SHARE;
    let x = if by_cosine { u[0] / COSINE_SHARE } else { (u[0] - COSINE_SHARE) / (1.0 - COSINE_SHARE) };
    let about_n = Frame::new(n).to_world(warp::cosine_hemisphere([x, u[1]])).normalize();
    let anywhere = warp::uniform_sphere([x, u[1]]);
    if by_cosine { about_n } else { anywhere }
}

/// Such directions for eight receivers.
#[inline(always)]
pub(super) fn directions(n: &Vectors, u: &[[f64; LANES]; 2]) -> Vectors {
    let (mut narrowed, mut wi) = ([Floats::default(); 2], Vectors::default());
    for lane in 0..LANES {
        [narrowed[0][lane], narrowed[1][lane]] = narrow([u[0][lane], u[1][lane]]);
    }
    for lane in 0..LANES {
        wi.set(lane, sample(n.get(lane), [narrowed[0][lane], narrowed[1][lane]]));
    }
    wi
}

/// The density of [`sample`] over solid angle.
#[inline(always)]
pub(super) fn pdf(n: Vec3, wi: Vec3) -> f32 {
    COSINE_SHARE * warp::cosine_hemisphere_pdf(n.dot(wi)) + (1.0 - COSINE_SHARE) / (4.0 * PI)
}
