//! The camera in the unit world.

use super::SceneError;
use super::source::{At, Source};
use crate::scene::desc::CameraDesc;
use crate::scene::{Camera, World};

/// The greatest width and height of an image.
const LARGEST: u32 = 65_536;

/// Field of view where the file gives none.
const FOV_DEG: f64 = 40.0;

/// The camera, checked.
///
/// An override of the resolution alone keeps the height of what is seen, also with the textbook's camera: its pixels
/// grow or shrink.
pub(super) fn build(desc: &CameraDesc, source: &Source, world: &World) -> Result<Camera, SceneError> {
    let at = &source.at("camera");
    if let Some(i) = desc.resolution.iter().position(|n| !(1..=LARGEST).contains(n)) {
        let n = desc.resolution[i];
        let message = format!("{n} pixels: width and height must be from 1 to {LARGEST}");
        return Err(at.key("resolution").key(i).fail(message));
    }
    let eye = at.vector("eye", desc.eye)?;
    let eye_in_unit = world.to_unit(eye);
    if !eye_in_unit.is_finite() {
        return Err(at.key("eye").fail("too far away for the size of the scene"));
    }
    let look_at = at.vector("look_at", desc.look_at)?;
    let up = at.direction("up", desc.up)?;
    // Halved and scaled first, so that what is far away has a direction too.
    let forward = 0.5 * look_at - 0.5 * eye;
    let Some(forward) = (forward / forward.abs().max_element()).try_normalize() else {
        return Err(at.key("look_at").fail("the same point as `eye`: the camera needs a direction"));
    };
    if forward.cross(up).length() < 1e-6 {
        let message = "parallel to the direction from `eye` to `look_at`: choose another, such as [0, 0, 1]";
        return Err(at.key("up").fail(message));
    }
    let zoom = at.positive("zoom", desc.zoom)? / source.resized_by(desc);
    let pixel = pixel_at_unit_distance(desc, at)? / zoom;
    check_pixel(pixel, desc, at)?;
    Ok(Camera::look_at(eye_in_unit, forward, up, pixel, desc.resolution))
}

/// Refuses pixels so small or so large that rays through them have no directions of their own.
fn check_pixel(pixel: f64, desc: &CameraDesc, at: &At<'_>) -> Result<(), SceneError> {
    // Directions are vectors of f32, and their lengths are the roots of sums of squares.
    let edge = pixel * f64::from(desc.resolution[0].max(desc.resolution[1]));
    let why = if pixel < f64::from(f32::MIN_POSITIVE) {
        "too small: zoom less, or widen the field of view"
    } else if edge * edge > 0.5 * f64::from(f32::MAX) {
        "too large: zoom more, or narrow the field of view"
    } else {
        return Ok(());
    };
    let key = match (desc.zoom == 1.0, desc.view_plane_distance) {
        (false, _) => "zoom",
        (true, Some(_)) => "view_plane_distance",
        (true, None) => "fov_deg",
    };
    Err(at.key(key).fail(format!("pixels become {pixel:e} large at distance 1, which is {why}")))
}

/// Edge of a pixel on the plane at distance 1, before zoom.
fn pixel_at_unit_distance(desc: &CameraDesc, at: &At<'_>) -> Result<f64, SceneError> {
    match (desc.fov_deg, desc.view_plane_distance, desc.pixel_size) {
        (fov_deg, None, None) => {
            let fov_deg = at.positive("fov_deg", fov_deg.unwrap_or(FOV_DEG))?;
            if fov_deg >= 180.0 {
                return Err(at.key("fov_deg").fail(format!("{fov_deg} degrees: it must be below 180")));
            }
            Ok(2.0 * (0.5 * fov_deg.to_radians()).tan() / f64::from(desc.resolution[1]))
        }
        (None, Some(distance), pixel_size) => {
            let distance = at.positive("view_plane_distance", distance)?;
            Ok(at.positive("pixel_size", pixel_size.unwrap_or(1.0))? / distance)
        }
        (None, None, Some(_)) => {
            Err(at.key("pixel_size").fail("goes with `view_plane_distance`, which is missing"))
        }
        (Some(_), ..) => Err(at
            .key("fov_deg")
            .fail("goes without `view_plane_distance` and `pixel_size`: give the one or the others")),
    }
}
