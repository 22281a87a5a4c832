//! Directions for radiance that comes from all over.

use crate::core::{Frame, warp};
use glam::Vec3;
use std::f32::consts::PI;

/// How often the direction follows the cosine. The rest is uniform over the whole sphere: glossy lobes want light at
/// grazing angles, and below a shading normal's horizon, as much as elsewhere.
const COSINE_SHARE: f32 = 0.875;

/// A direction, mostly with the cosine to the receiver's normal `n`.
#[inline]
pub(super) fn sample(n: Vec3, u: [f32; 2]) -> Vec3 {
    if u[0] < COSINE_SHARE {
        Frame::new(n).to_world(warp::cosine_hemisphere([u[0] / COSINE_SHARE, u[1]])).normalize()
    } else {
        warp::uniform_sphere([(u[0] - COSINE_SHARE) / (1.0 - COSINE_SHARE), u[1]])
    }
}

/// The density of [`sample`] over solid angle.
#[inline]
pub(super) fn pdf(n: Vec3, wi: Vec3) -> f32 {
    COSINE_SHARE * warp::cosine_hemisphere_pdf(n.dot(wi)) + (1.0 - COSINE_SHARE) / (4.0 * PI)
}
