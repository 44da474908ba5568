//! Colour: three linear Rec.709 numbers.

use glam::Vec3A;

/// Linear Rec.709 colour or any per-channel coefficient (radiance, albedo, sigma_t, throughput).
pub type Rgb = Vec3A;

/// Relative luminance of linear Rec.709 (ITU-R BT.709).
#[inline]
pub fn luminance(c: Rgb) -> f32 {
    c.dot(Vec3A::new(0.2126, 0.7152, 0.0722))
}

/// The largest of the three channels.
#[inline]
pub fn max_component(c: Rgb) -> f32 {
    c.max_element()
}

/// The mean of the three channels, computed without overflow for channels up to `f32::MAX`.
#[inline]
pub fn mean_component(c: Rgb) -> f32 {
    c.x * (1.0 / 3.0) + c.y * (1.0 / 3.0) + c.z * (1.0 / 3.0)
}

/// The sRGB transfer function inverted: display-encoded value in [0, 1] to linear (IEC 61966-2-1).
#[inline]
pub fn rec709_from_srgb(encoded: f32) -> f32 {
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// The sRGB transfer function: linear value to display-encoded (IEC 61966-2-1). Negative values are mirrored.
#[inline]
pub fn srgb_from_rec709(linear: f32) -> f32 {
    let magnitude = linear.abs();
    let encoded =
        if magnitude <= 0.003_130_8 { 12.92 * magnitude } else { 1.055 * magnitude.powf(1.0 / 2.4) - 0.055 };
    encoded.copysign(linear)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transfer_function_is_inverted() {
        for i in 0..=1000 {
            let x = i as f32 / 1000.0;
            assert!((rec709_from_srgb(srgb_from_rec709(x)) - x).abs() < 1e-5, "at {x}");
        }
    }

    #[test]
    fn mean_of_huge_channels_is_finite() {
        assert!(mean_component(Rgb::splat(3e38)).is_finite());
    }
}
