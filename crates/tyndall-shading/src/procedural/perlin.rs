//! Gradient noise of Perlin (2002), with the gradients and the scale of Blender.

use super::hash::jenkins;

/// A point of as many dimensions as the noise has.
pub(crate) type Point<const N: usize> = [f32; N];

/// Beyond this noise repeats: f32 has too few digits for more.
const PERIOD: f32 = 100_000.0;

/// Noise on the integer lattice of `N` dimensions.
pub(crate) trait Lattice<const N: usize> {
    /// Brings the noise to about [-1, 1].
    const SCALE: f32;

    /// The scalar product of a random gradient with an offset.
    fn slope(hash: u32, offset: &Point<N>) -> f32;
}

/// Implements [`Lattice`].
pub(crate) struct Grid;

#[inline]
fn signed(value: f32, is_negative: bool) -> f32 {
    if is_negative { -value } else { value }
}

impl Lattice<1> for Grid {
    const SCALE: f32 = 0.25;

    #[inline]
    fn slope(hash: u32, &[x]: &Point<1>) -> f32 {
        signed(1.0 + (hash & 7) as f32, hash & 8 != 0) * x
    }
}

impl Lattice<2> for Grid {
    const SCALE: f32 = 0.6616;

    #[inline]
    fn slope(hash: u32, &[x, y]: &Point<2>) -> f32 {
        let (u, v) = if hash & 7 < 4 { (x, y) } else { (y, x) };
        signed(u, hash & 1 != 0) + signed(2.0 * v, hash & 2 != 0)
    }
}

impl Lattice<3> for Grid {
    const SCALE: f32 = 0.982;

    #[inline]
    fn slope(hash: u32, &[x, y, z]: &Point<3>) -> f32 {
        let h = hash & 15;
        let u = if h < 8 { x } else { y };
        let v = match h {
            0..4 => y,
            12 | 14 => x,
            _ => z,
        };
        signed(u, h & 1 != 0) + signed(v, h & 2 != 0)
    }
}

impl Lattice<4> for Grid {
    const SCALE: f32 = 0.8344;

    #[inline]
    fn slope(hash: u32, &[x, y, z, w]: &Point<4>) -> f32 {
        let h = hash & 31;
        let u = if h < 24 { x } else { y };
        let v = if h < 16 { y } else { z };
        let s = if h < 8 { z } else { w };
        signed(u, h & 1 != 0) + signed(v, h & 2 != 0) + signed(s, h & 4 != 0)
    }
}

/// The noise at `p`, about within [-1, 1]; 0 at what is not finite.
#[inline]
pub(crate) fn noise<const N: usize>(p: &Point<N>) -> f32
where
    Grid: Lattice<N>,
{
    let p = p.map(|x| if x.abs() < PERIOD { x } else { repeated(x) });
    let cell = p.map(|x| x.floor());
    let offset: Point<N> = std::array::from_fn(|axis| p[axis] - cell[axis]);
    let fade = offset.map(|t| t * t * t * (t * (t * 6.0 - 15.0) + 10.0));
    let mut values = [0.0; 16];
    for (corner, value) in values.iter_mut().enumerate().take(1 << N) {
        let upper = |axis: usize| corner >> axis & 1;
        let key = std::array::from_fn(|axis| (cell[axis] as i32).wrapping_add(upper(axis) as i32) as u32);
        let from_corner = std::array::from_fn(|axis| offset[axis] - upper(axis) as f32);
        *value = Grid::slope(jenkins::<N>(key), &from_corner);
    }
    for (axis, t) in fade.iter().enumerate() {
        for pair in 0..1 << (N - 1 - axis) {
            values[pair] = super::lerp(values[2 * pair], values[2 * pair + 1], *t);
        }
    }
    let noise = values[0] * <Grid as Lattice<N>>::SCALE;
    if noise.is_finite() { noise } else { 0.0 }
}

/// A coordinate that is far out or not finite. Half a cell off where f32 has no fractions left.
#[cold]
fn repeated(x: f32) -> f32 {
    x % PERIOD + if x.abs() >= 10.0 * PERIOD { 0.5 } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_vanishes_on_the_lattice_and_stays_within_its_range() {
        assert_eq!(noise(&[3.0, -2.0, 7.0]), 0.0);
        let (mut least, mut most) = (0f32, 0f32);
        for i in 0..20_000u32 {
            let x = std::array::from_fn(|axis| {
                (jenkins([i, axis as u32]) as f32 / u32::MAX as f32) * 50.0 - 25.0
            });
            let value = noise::<3>(&x);
            (least, most) = (least.min(value), most.max(value));
        }
        assert!((-1.05..-0.7).contains(&least) && (0.7..1.05).contains(&most), "{least} {most}");
    }

    #[test]
    fn it_is_smooth_across_cells() {
        for axis in 0..3 {
            let mut p = [0.3, 0.6, 0.2];
            p[axis] = 2.0 - 1e-4;
            let below = noise(&p);
            p[axis] = 2.0 + 1e-4;
            assert!((noise(&p) - below).abs() < 2e-3);
        }
    }

    #[test]
    fn nothing_breaks_far_out_or_at_nonsense() {
        for x in [1e9, -1e30, f32::INFINITY, f32::NAN] {
            assert!(noise(&[x, 0.5, 0.5, x]).is_finite());
        }
    }
}
