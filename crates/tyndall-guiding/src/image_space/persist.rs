//! An image guide as bytes and back. Its odds are made anew from the sums, bit for bit.

use super::ImageGuide;
use crate::cache::{CacheError, Reader, Writer, checked_count, f32s_of};
use crate::{ClassCosts, Moments, Strategy};

const STRATEGIES: [Strategy; 4] =
    [Strategy::Odds, Strategy::Target, Strategy::Normalized, Strategy::NormalizedPlus];

type Result<T> = std::result::Result<T, CacheError>;

impl ImageGuide {
    /// The sums of all pixels one kind after the other: they compress better so.
    pub(crate) fn write(&self, out: &mut Writer) {
        self.origin.into_iter().for_each(|v| out.u32(v.cast_unsigned()));
        out.u32(self.width as u32);
        out.u32(self.height as u32);
        out.u32(STRATEGIES.iter().position(|&s| s == self.strategy).unwrap_or_default() as u32);
        for (rays, paths) in [self.costs.volume, self.costs.surface] {
            out.u64(rays);
            out.u64(paths);
        }
        for sum in 0..Moments::N_SUMS {
            out.f32s(self.moments.iter().map(|moments| moments.to_array()[sum]));
        }
    }

    pub(crate) fn read(input: &mut Reader<'_>) -> Result<Self> {
        let origin = [input.u32()?, input.u32()?].map(u32::cast_signed);
        let (width, height) = (input.u32()?, input.u32()?);
        let strategy = STRATEGIES.get(input.u32()? as usize).copied();
        let strategy = strategy.ok_or(CacheError::Malformed("its image guide is of an unknown strategy"))?;
        let mut pair = || Ok((checked_count(input.u64()?)?, checked_count(input.u64()?)?));
        let costs = ClassCosts { volume: pair()?, surface: pair()? };
        let n = width.checked_mul(height).ok_or(CacheError::Malformed("its image guide is too large"))?;
        let sums = input.items(n, 4 * Moments::N_SUMS)?;
        let moments = interleave(sums, n as usize)?;
        Ok(Self::from_sums(origin, [width as usize, height as usize], strategy, moments, costs))
    }
}

fn interleave(sums: &[u8], n: usize) -> Result<Vec<Moments>> {
    let mut moments = vec![[0.0; Moments::N_SUMS]; n];
    for (sum, row) in sums.chunks_exact((4 * n).max(1)).enumerate() {
        moments.iter_mut().zip(f32s_of(row)).for_each(|(moments, value)| moments[sum] = value);
    }
    if moments.iter().flatten().all(|&v| v.is_finite() && v >= 0.0) {
        Ok(moments.into_iter().map(Moments::from_array).collect())
    } else {
        Err(CacheError::Malformed("its image guide holds numbers that make no sense"))
    }
}
