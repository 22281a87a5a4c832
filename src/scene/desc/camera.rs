//! The pinhole camera, by field of view or as the textbook gives it.

use schemars::JsonSchema;
use serde::Deserialize;

/// A pinhole camera: `fov_deg`, or `view_plane_distance` and `pixel_size`.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields, expecting = "a table")]
pub struct CameraDesc {
    /// The pinhole.
    pub eye: [f64; 3],
    /// The point in the middle of the image.
    pub look_at: [f64; 3],
    /// A direction that is upward in the image.
    pub up: [f64; 3],
    /// Width and height in pixels.
    pub resolution: [u32; 2],
    /// Angle between the lower and the upper edge of the image; 40 if nothing else is given.
    pub fov_deg: Option<f64>,
    /// Distance from the eye to the textbook's view plane.
    pub view_plane_distance: Option<f64>,
    /// Edge of a pixel on that plane; 1 if it is left out.
    pub pixel_size: Option<f64>,
    /// Magnification: divides the size of a pixel.
    pub zoom: f64,
}

impl Default for CameraDesc {
    fn default() -> Self {
        Self {
            eye: [0.0, 0.0, 5.0],
            look_at: [0.0; 3],
            up: [0.0, 1.0, 0.0],
            resolution: [600, 600],
            fov_deg: None,
            view_plane_distance: None,
            pixel_size: None,
            zoom: 1.0,
        }
    }
}
