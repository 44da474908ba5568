//! Clipping planes that would leave nothing of the shot.

use crate::camera::CameraModel;
use glam::Vec3A;
use tyndall_scene::{Diagnostics, PrimPath};

/// Ignores clipping planes that cut away everything: cameras are written with the planes of some rasteriser's depth
/// buffer (0.001 to 1e6 is common), which say nothing about a shot modelled in another unit.
pub(super) fn drop_if_nothing_is_left(
    camera: &mut CameraModel,
    path: &PrimPath,
    bounds: Option<(Vec3A, Vec3A)>,
    diagnostics: &mut Diagnostics,
) {
    let Some((min, max)) = bounds else { return };
    let corner = |i: usize| {
        let pick = |axis: usize| if i >> axis & 1 == 0 { min[axis] } else { max[axis] };
        Vec3A::new(pick(0), pick(1), pick(2))
    };
    let depths = (0..8).map(|i| camera.depth_of(corner(i)));
    let (nearest, farthest) =
        depths.fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), d| (a.min(d), b.max(d)));
    let [near, far] = camera.clipping();
    if (farthest > 0.0 && farthest <= near) || nearest >= far {
        diagnostics.warn(
            path,
            format!(
                "clippingRange ({near}, {far}) cuts away everything: the shot lies at depths {nearest} to {farthest}"
            ),
            "the clipping planes are ignored; author a clippingRange that fits the shot",
        );
        camera.ignore_clipping();
    }
}
