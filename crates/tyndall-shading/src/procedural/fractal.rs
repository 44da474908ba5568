//! Octaves of noise, added up or multiplied (Ebert et al., *Texturing and Modeling*, ch. 16).

use super::lerp;
use super::perlin::{Grid, Lattice, Point, noise};

/// How octaves become one number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Fractal {
    /// Fractional Brownian motion: a weighted sum.
    #[default]
    Fbm,
    /// A product.
    Multifractal,
    /// Rough where it is high.
    HeteroTerrain,
    /// Rough where the coarser octaves are high.
    Hybrid,
    /// Sharp crests.
    Ridged,
}

/// The octaves. More of them than [`Octaves::MOST`] cannot be seen.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Octaves {
    pub(crate) fractal: Fractal,
    /// Octaves after the first; a fraction weights the last.
    pub(crate) detail: f32,
    /// Weight of an octave over that of the one before.
    pub(crate) roughness: f32,
    /// Frequency of an octave over that of the one before.
    pub(crate) lacunarity: f32,
    /// Of all but the sum and the product: added to the noise.
    pub(crate) offset: f32,
    /// Of hybrid and ridged: how much an octave counts for the next.
    pub(crate) gain: f32,
    /// Whether the sum is brought to [0, 1].
    pub(crate) is_normalized: bool,
}

impl Octaves {
    pub(crate) const MOST: f32 = 15.0;

    /// The value at `p`.
    pub(crate) fn at<const N: usize>(&self, p: &Point<N>) -> f32
    where
        Grid: Lattice<N>,
    {
        let detail = if self.detail > 0.0 { self.detail.min(Self::MOST) } else { 0.0 };
        let octaves = Self { detail, roughness: self.roughness.max(0.0), ..*self };
        let value = match self.fractal {
            Fractal::Fbm => octaves.sum(*p),
            Fractal::Multifractal => octaves.product(*p),
            Fractal::HeteroTerrain => octaves.hetero_terrain(*p),
            Fractal::Hybrid => octaves.hybrid(*p),
            Fractal::Ridged => octaves.ridged(*p),
        };
        if value.is_finite() { value } else { 0.0 }
    }

    fn whole(&self) -> u32 {
        self.detail as u32
    }

    fn part(&self) -> f32 {
        self.detail.fract()
    }

    fn finer<const N: usize>(&self, p: Point<N>) -> Point<N> {
        p.map(|x| x * self.lacunarity)
    }

    fn sum<const N: usize>(&self, p: Point<N>) -> f32
    where
        Grid: Lattice<N>,
    {
        let (mut frequency, mut amplitude, mut total, mut sum) = (1.0, 1.0, 0.0, 0.0);
        let mean = |sum: f32, total: f32| if self.is_normalized { 0.5 * sum / total + 0.5 } else { sum };
        for _ in 0..=self.whole() {
            sum += noise(&p.map(|x| x * frequency)) * amplitude;
            total += amplitude;
            amplitude *= self.roughness;
            frequency *= self.lacunarity;
        }
        if self.part() == 0.0 {
            return mean(sum, total);
        }
        let further = sum + noise(&p.map(|x| x * frequency)) * amplitude;
        lerp(mean(sum, total), mean(further, total + amplitude), self.part())
    }

    fn product<const N: usize>(&self, mut p: Point<N>) -> f32
    where
        Grid: Lattice<N>,
    {
        let (mut value, mut amplitude) = (1.0, 1.0);
        for _ in 0..=self.whole() {
            value *= amplitude * noise(&p) + 1.0;
            amplitude *= self.roughness;
            p = self.finer(p);
        }
        if self.part() != 0.0 {
            value *= self.part() * amplitude * noise(&p) + 1.0;
        }
        value
    }

    fn hetero_terrain<const N: usize>(&self, mut p: Point<N>) -> f32
    where
        Grid: Lattice<N>,
    {
        let mut value = self.offset + noise(&p);
        let mut amplitude = self.roughness;
        p = self.finer(p);
        for _ in 1..=self.whole() {
            value += (noise(&p) + self.offset) * amplitude * value;
            amplitude *= self.roughness;
            p = self.finer(p);
        }
        value + self.part() * (noise(&p) + self.offset) * amplitude * value
    }

    fn hybrid<const N: usize>(&self, mut p: Point<N>) -> f32
    where
        Grid: Lattice<N>,
    {
        /// Finer octaves no longer count below this weight.
        const FAINT: f32 = 0.001;
        let (mut value, mut amplitude, mut weight) = (0.0, 1.0, 1f32);
        for octave in 0..=self.whole() + 1 {
            let share = if octave <= self.whole() { 1.0 } else { self.part() };
            if weight <= FAINT || share == 0.0 {
                break;
            }
            weight = weight.min(1.0);
            let signal = (noise(&p) + self.offset) * amplitude;
            value += share * weight * signal;
            weight *= self.gain * signal;
            amplitude *= self.roughness;
            p = self.finer(p);
        }
        value
    }

    fn ridged<const N: usize>(&self, mut p: Point<N>) -> f32
    where
        Grid: Lattice<N>,
    {
        let crest = |p: &Point<N>| {
            let height = self.offset - noise(p).abs();
            height * height
        };
        let mut signal = crest(&p);
        let (mut value, mut amplitude) = (signal, self.roughness);
        for _ in 1..=self.whole() {
            p = self.finer(p);
            let weight = (signal * self.gain).clamp(0.0, 1.0);
            signal = crest(&p) * weight;
            value += signal * amplitude;
            amplitude *= self.roughness;
        }
        value
    }
}
