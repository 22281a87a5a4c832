//! Transforms as the file gives them, composed in f64.

use super::SceneError;
use super::source::At;
use crate::scene::desc::TransformDesc;
use crate::scene::desc::shape::ScaleDesc;
use glam::{DAffine3, DMat4, DQuat, DVec3};

/// The steps, the first applied first; `at` is their list.
pub(super) fn compose(steps: &[TransformDesc], at: &At<'_>) -> Result<DAffine3, SceneError> {
    let mut whole = DAffine3::IDENTITY;
    for (i, step) in steps.iter().enumerate() {
        whole = one_step(step, &at.key(i))? * whole;
    }
    Ok(whole)
}

fn one_step(step: &TransformDesc, at: &At<'_>) -> Result<DAffine3, SceneError> {
    let given =
        [step.translate.is_some(), step.rotate.is_some(), step.scale.is_some(), step.matrix.is_some()];
    if given.into_iter().filter(|&g| g).count() != 1 {
        let message =
            "each step has exactly one of `translate`, `rotate`, `scale` and `matrix`: their order counts";
        return Err(at.fail(message));
    }
    if let Some(by) = step.translate {
        return Ok(DAffine3::from_translation(at.vector("translate", by)?));
    }
    if let Some(rotate) = step.rotate {
        let at = at.key("rotate");
        let angle = at.finite("deg", rotate.deg)?.to_radians();
        return Ok(DAffine3::from_quat(DQuat::from_axis_angle(at.direction("axis", rotate.axis)?, angle)));
    }
    if let Some(matrix) = step.matrix {
        return affine(&matrix, &at.key("matrix"));
    }
    let factors = match step.scale {
        Some(ScaleDesc::PerAxis(factors)) => at.vector("scale", factors)?,
        Some(ScaleDesc::Uniform(factor)) => DVec3::splat(at.finite("scale", factor)?),
        None => DVec3::ONE,
    };
    if factors.cmpeq(DVec3::ZERO).any() {
        return Err(at.key("scale").fail("a factor of 0 flattens the shape"));
    }
    Ok(DAffine3::from_scale(factors))
}

/// A matrix given row by row.
fn affine(rows: &[f64; 16], at: &At<'_>) -> Result<DAffine3, SceneError> {
    for (i, &x) in rows.iter().enumerate() {
        at.finite(&i.to_string(), x)?;
    }
    if rows[12..] != [0.0, 0.0, 0.0, 1.0] {
        return Err(at.fail("the last of the four rows must be 0, 0, 0, 1 (numbers are given row by row)"));
    }
    let affine = DAffine3::from_mat4(DMat4::from_cols_array(rows).transpose());
    match affine.matrix3.determinant() {
        0.0 => Err(at.fail("the matrix flattens the shape: its determinant is 0")),
        _ => Ok(affine),
    }
}

/// The one factor by which a transform changes all lengths, if there is one.
pub(super) fn uniform_scale(transform: &DAffine3) -> Option<f64> {
    let m = transform.matrix3;
    let axes = [m.x_axis, m.y_axis, m.z_axis];
    let scale = m.determinant().abs().cbrt();
    // Matrices are often written with the digits of an f32.
    let tolerance = 1e-6 * scale * scale;
    let uniform = axes.iter().all(|a| (a.length_squared() - scale * scale).abs() <= tolerance)
        && [(0, 1), (1, 2), (2, 0)].iter().all(|&(i, j)| axes[i].dot(axes[j]).abs() <= tolerance);
    uniform.then_some(scale)
}
