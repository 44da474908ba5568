//! Images read between their pixels.
//!
//! Two coordinate systems meet here: *st* has its origin at the bottom left (USD), *from top* at the top left (image
//! rows). Texel centres lie at `(i + 0.5) / n`; between them values are bilinear.

use glam::Vec2;
use std::sync::Arc;
use tyndall_math::Rgb;
use tyndall_scene::ImageData;

/// What lies outside the image (UsdUVTexture `wrapS`, `wrapT`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Wrap {
    /// Zeros.
    #[default]
    Black,
    /// The nearest edge texel.
    Clamp,
    /// The image again.
    Repeat,
    /// The image again, every second time mirrored.
    Mirror,
}

impl Wrap {
    /// From the token of a scene description. `useMetadata` reads as black, which the specification says applies if the
    /// file says nothing.
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "black" | "useMetadata" => Some(Self::Black),
            "clamp" => Some(Self::Clamp),
            "repeat" => Some(Self::Repeat),
            "mirror" => Some(Self::Mirror),
            _ => None,
        }
    }

    /// The texel for index `i` of `n`.
    #[inline]
    fn texel(self, i: i64, n: i64) -> Option<usize> {
        let wrapped = match self {
            Self::Black if i < 0 || i >= n => return None,
            Self::Black => i,
            Self::Clamp => i.clamp(0, n - 1),
            Self::Repeat => i.rem_euclid(n),
            Self::Mirror => {
                let m = i.rem_euclid(2 * n);
                if m < n { m } else { 2 * n - 1 - m }
            }
        };
        Some(wrapped as usize)
    }
}

/// An image with its wrap modes.
#[derive(Debug, Clone)]
pub struct Texture {
    image: Arc<ImageData>,
    wrap_s: Wrap,
    wrap_t: Wrap,
}

/// The two texels around a position along one axis, and the weight of the second.
struct Taps {
    first: Option<usize>,
    second: Option<usize>,
    weight: f32,
}

impl Taps {
    #[inline]
    fn new(x: f32, n: usize, wrap: Wrap) -> Self {
        // f64: a 65,536 pixel wide image leaves an f32 with 7 bits of sub-pixel position.
        let position = f64::from(x) * n as f64 - 0.5;
        let position = if position.abs() < 1e15 { position } else { 0.0 };
        let floor = position.floor();
        let n = n as i64;
        Self {
            first: wrap.texel(floor as i64, n),
            second: wrap.texel(floor as i64 + 1, n),
            weight: (position - floor) as f32,
        }
    }
}

impl Texture {
    /// `image` must have pixels.
    pub fn new(image: Arc<ImageData>, wrap_s: Wrap, wrap_t: Wrap) -> Self {
        debug_assert!(
            image.width > 0 && image.height > 0 && image.pixels.len() == image.width * image.height
        );
        Self { image, wrap_s, wrap_t }
    }

    /// RGBA at USD's texture coordinates (origin bottom left).
    #[inline]
    pub fn lookup(&self, st: Vec2) -> [f32; 4] {
        self.lookup_from_top(Vec2::new(st.x, 1.0 - st.y))
    }

    /// RGBA at image coordinates (origin top left).
    #[inline]
    pub fn lookup_from_top(&self, uv: Vec2) -> [f32; 4] {
        let x = Taps::new(uv.x, self.image.width, self.wrap_s);
        let y = Taps::new(uv.y, self.image.height, self.wrap_t);
        let top = lerp(self.texel(x.first, y.first), self.texel(x.second, y.first), x.weight);
        let bottom = lerp(self.texel(x.first, y.second), self.texel(x.second, y.second), x.weight);
        lerp(top, bottom, y.weight)
    }

    #[inline]
    fn texel(&self, x: Option<usize>, y: Option<usize>) -> [f32; 4] {
        match (x, y) {
            (Some(x), Some(y)) => self.image.pixels[y * self.image.width + x],
            _ => [0.0; 4],
        }
    }

    /// Mean colour.
    pub fn mean(&self) -> Rgb {
        self.weighted_mean(|_| 1.0)
    }

    /// Mean colour over directions if the image is lat-long.
    pub fn mean_on_sphere(&self) -> Rgb {
        let h = self.image.height as f64;
        self.weighted_mean(|j| (std::f64::consts::PI * (j as f64 + 0.5) / h).sin())
    }

    fn weighted_mean(&self, row_weight: impl Fn(usize) -> f64) -> Rgb {
        let mut sum = [0.0f64; 3];
        let mut total = 0.0;
        for (j, row) in self.image.pixels.chunks(self.image.width).enumerate() {
            let weight = row_weight(j);
            total += weight * row.len() as f64;
            for pixel in row {
                for (s, c) in sum.iter_mut().zip(pixel) {
                    *s += weight * f64::from(*c);
                }
            }
        }
        Rgb::new((sum[0] / total) as f32, (sum[1] / total) as f32, (sum[2] / total) as f32)
    }
}

#[inline]
fn lerp(a: [f32; 4], b: [f32; 4], t: f32) -> [f32; 4] {
    std::array::from_fn(|i| a[i] + (b[i] - a[i]) * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two_by_two(wrap: Wrap) -> Texture {
        let px = |v: f32| [v, 0.0, 0.0, 1.0];
        let image = ImageData { width: 2, height: 2, pixels: vec![px(1.0), px(2.0), px(3.0), px(4.0)] };
        Texture::new(Arc::new(image), wrap, wrap)
    }

    #[test]
    fn st_origin_is_the_bottom_left() {
        let t = two_by_two(Wrap::Clamp);
        assert_eq!(t.lookup(Vec2::new(0.25, 0.25))[0], 3.0);
        assert_eq!(t.lookup(Vec2::new(0.75, 0.75))[0], 2.0);
        assert_eq!(t.lookup(Vec2::new(0.5, 0.5))[0], 2.5);
    }

    #[test]
    fn wrap_modes() {
        let at = |wrap, s: f32| two_by_two(wrap).lookup(Vec2::new(s, 0.75))[0];
        assert_eq!(at(Wrap::Repeat, 1.25), 1.0);
        assert_eq!(at(Wrap::Repeat, -0.25), 2.0);
        assert_eq!(at(Wrap::Mirror, 1.25), 2.0);
        assert_eq!(at(Wrap::Clamp, 7.0), 2.0);
        assert_eq!(at(Wrap::Black, 7.0), 0.0);
        assert_eq!(at(Wrap::Repeat, 1.0), 1.5);
        assert_eq!(at(Wrap::Clamp, 0.0), 1.0);
    }

    #[test]
    fn absurd_coordinates_are_finite() {
        for s in [f32::NAN, f32::INFINITY, -1e30, 1e12] {
            for wrap in [Wrap::Black, Wrap::Clamp, Wrap::Repeat, Wrap::Mirror] {
                assert!(two_by_two(wrap).lookup(Vec2::new(s, s)).iter().all(|c| c.is_finite()));
            }
        }
    }

    #[test]
    fn means_weigh_rows() {
        assert_eq!(two_by_two(Wrap::Clamp).mean().x, 2.5);
        assert_eq!(two_by_two(Wrap::Clamp).mean_on_sphere().x, 2.5);
    }
}
