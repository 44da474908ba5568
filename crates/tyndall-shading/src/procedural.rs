//! Procedural textures: functions of a point, with Blender's definitions, so that a look keeps its shape.
//!
//! | module | what |
//! |---|---|
//! | `hash` | integers into random integers: Jenkins' lookup3 and PCG |
//! | `perlin` | gradient noise in one to four dimensions |
//! | `fractal` | sums and products of octaves of it |
//! | `voronoi` | distances to random points, one in every cell |
//! | `wave`, `gradient` | bands, rings and ramps |

mod fractal;
mod gradient;
mod hash;
mod perlin;
mod voronoi;
mod wave;

pub(crate) use fractal::{Fractal, Octaves};
pub(crate) use gradient::Gradient;
pub(crate) use perlin::{Grid, Lattice, Point, noise};
pub(crate) use voronoi::{Feature, Metric, Voronoi};
pub(crate) use wave::{Direction, Profile, Wave};

/// `a` at `t` = 0, `b` at 1.
#[inline]
fn lerp(a: f32, b: f32, t: f32) -> f32 {
    (1.0 - t) * a + t * b
}

/// A point far from others, told by a number: where a further channel of noise begins.
pub(crate) fn random_offset<const N: usize>(seed: f32) -> [f32; N] {
    std::array::from_fn(|axis| {
        let hash = match N {
            1 => hash::jenkins([seed.to_bits()]),
            _ => hash::jenkins([seed, axis as f32].map(f32::to_bits)),
        };
        100.0 + 100.0 * hash::unit(hash)
    })
}
