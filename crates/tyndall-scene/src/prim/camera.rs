//! Cameras.

use super::TransformKey;
use glam::{DAffine3, DVec2};
use serde::Serialize;

/// How a camera maps the world to its image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize)]
pub enum Projection {
    /// Through a pinhole or lens.
    #[default]
    Perspective,
    /// Parallel.
    Orthographic,
}

/// A camera looking along its local -z with +y up (UsdGeomCamera).
///
/// Apertures and focal length share one unit (tenths of a stage unit in USD); only their ratios matter for perspective.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Camera {
    /// Places the camera at the time of the frame; scale is ignored.
    pub world_from_camera: DAffine3,
    /// Where it is while the shutter is open, in the order of time; fewer than two of a camera that stands still.
    pub motion: Vec<TransformKey>,
    /// Kind of projection.
    pub projection: Projection,
    /// Horizontal and vertical film size. Perspective: same unit as `focal_length`; orthographic: stage units.
    pub aperture: DVec2,
    /// Film shift to the right and up, unit of `aperture`.
    pub aperture_offset: DVec2,
    /// Distance from lens to film.
    pub focal_length: f64,
    /// Lens radius in stage units; 0 is a pinhole.
    pub lens_radius: f64,
    /// Distance in focus in stage units; only used with a lens.
    pub focus_distance: f64,
    /// Nearest and farthest depth seen, stage units; surfaces and media outside are cut.
    pub clipping_range: [f64; 2],
    /// Factor on the image.
    pub exposure_scale: f64,
}

impl Default for Camera {
    fn default() -> Self {
        Self {
            world_from_camera: DAffine3::IDENTITY,
            motion: Vec::new(),
            projection: Projection::Perspective,
            aperture: DVec2::new(36.0, 24.0),
            aperture_offset: DVec2::ZERO,
            focal_length: 50.0,
            lens_radius: 0.0,
            focus_distance: 1.0,
            clipping_range: [0.0, f64::INFINITY],
            exposure_scale: 1.0,
        }
    }
}
