//! Lights, with UsdLux's parameters and units.

use glam::DAffine3;
use serde::Serialize;
use std::path::PathBuf;

/// The shape of a light, in its own space.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum LightKind {
    /// A sphere, or a point if `as_point`.
    Sphere {
        /// Radius.
        radius: f64,
        /// Emit from the centre without area.
        as_point: bool,
    },
    /// A rectangle in the xy plane emitting along -z.
    Rect {
        /// Extent along x.
        width: f64,
        /// Extent along y.
        height: f64,
        /// Multiplies the colour, covering the rectangle once.
        texture: Option<PathBuf>,
    },
    /// A disk in the xy plane emitting along -z.
    Disk {
        /// Radius.
        radius: f64,
    },
    /// A tube along x without caps.
    Cylinder {
        /// Length.
        length: f64,
        /// Radius.
        radius: f64,
        /// Emit from the axis without area.
        as_line: bool,
    },
    /// Parallel light travelling along -z.
    Distant {
        /// Angular diameter in degrees; 0 is a true parallel beam.
        angle: f64,
    },
    /// Light from everywhere.
    Dome {
        /// Image; `None` is constant.
        texture: Option<DomeTexture>,
    },
}

impl LightKind {
    /// Whether it is somewhere, and not at infinity.
    pub fn has_place(&self) -> bool {
        !matches!(self, Self::Distant { .. } | Self::Dome { .. })
    }
}

/// The image around a dome: lat-long in the orientation of the OpenEXR and UsdLux specifications, poles along y.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DomeTexture {
    /// The file.
    pub path: PathBuf,
}

/// How light fades towards the edge of a cone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Default)]
#[serde(rename_all = "camelCase")]
pub enum ConeProfile {
    /// By smoothstep of the angle (UsdLux).
    #[default]
    Angle,
    /// By smoothstep of the angle's cosine (Blender's spot).
    Cosine,
    /// As behind a honeycomb, linearly in the tangent of the angle; a card sends as much as with an open cone
    /// (Blender's spread). Softness is not used.
    Honeycomb,
}

/// Restricts the directions of a light (UsdLuxShapingAPI).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Shaping {
    /// Exponent of the cosine to the axis.
    pub focus: f32,
    /// Colour in the direction away from the axis.
    pub focus_tint: [f32; 3],
    /// Half angle of the cone in degrees; 90 or more is open.
    pub cone_angle: f32,
    /// 0 is a hard edge, 1 fades from the axis.
    pub cone_softness: f32,
    /// How it fades.
    pub cone_profile: ConeProfile,
}

impl Default for Shaping {
    fn default() -> Self {
        Self {
            focus: 0.0,
            focus_tint: [0.0; 3],
            cone_angle: 90.0,
            cone_softness: 0.0,
            cone_profile: ConeProfile::Angle,
        }
    }
}

/// A light.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Light {
    /// Places the light.
    pub world_from_light: DAffine3,
    /// Shape.
    pub kind: LightKind,
    /// Luminance factor (UsdLuxLightAPI `inputs:intensity`).
    pub intensity: f32,
    /// Stops: the factor is `2^exposure`.
    pub exposure: f32,
    /// Linear Rec.709 colour, colour temperature already multiplied in.
    pub color: [f32; 3],
    /// Divide by the world-space area (or its equivalent).
    pub normalize: bool,
    /// Factor on what diffuse lobes and media receive.
    pub diffuse: f32,
    /// Factor on what glossy lobes receive.
    pub specular: f32,
    /// Cone and focus.
    pub shaping: Shaping,
    /// Shown or hidden (a hidden light does not shine).
    pub visible: bool,
    /// Camera rays see it; without, they go on behind it. What it lights, and its reflections, stay.
    pub camera_visible: bool,
    /// Its body is in the way of other light; without, rays gain its radiance and go on behind it.
    pub opaque: bool,
}
