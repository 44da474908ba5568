//! The image being made: per-pixel f64 sums of every AOV, in tiles that one worker owns at a time.

use crate::aov::{self, Aov, Mean, NO_HIT_DEPTH, PixelStatistics, SampleRecord, Source};
use tyndall_math::Rgb;

/// Pixels along the edge of a tile. Small enough that cancelling waits a few milliseconds, large enough that handing
/// out tiles costs nothing.
pub const TILE_SIZE: u32 = 16;

/// The accumulated image.
#[derive(Clone)]
pub struct Film {
    width: u32,
    height: u32,
    aovs: Vec<&'static Aov>,
    tiles: Vec<Tile>,
}

/// A rectangle of pixels.
#[derive(Clone)]
pub(crate) struct Tile {
    pub(crate) x0: u32,
    pub(crate) y0: u32,
    width: u32,
    height: u32,
    statistics: Vec<PixelStatistics>,
    /// `sum_stride` numbers a pixel: the sums of all sample AOVs, then the counts of those with [`Mean::Finite`].
    sums: Vec<f64>,
    layout: SumLayout,
    /// Samples that were not finite and count as zero.
    pub(crate) non_finite: u64,
}

/// Where each sample AOV keeps its sums.
#[derive(Clone, Default)]
struct SumLayout {
    stride: usize,
    slots: Vec<Slot>,
}

#[derive(Clone, Copy)]
struct Slot {
    aov: &'static Aov,
    offset: usize,
}

impl SumLayout {
    fn new(aovs: &[&'static Aov]) -> Self {
        let mut layout = Self::default();
        for aov in aovs {
            if let Source::Sample(_, mean) = aov.source {
                layout.slots.push(Slot { aov, offset: layout.stride });
                layout.stride += aov.channels.len() + usize::from(mean == Mean::Finite);
            }
        }
        layout
    }
}

impl Film {
    /// An empty film with the named AOVs; `rgba` is always there.
    ///
    /// # Errors
    /// An unknown AOV, or a size whose pixels cannot be counted.
    pub fn new(width: u32, height: u32, aov_names: &[String]) -> Result<Self, String> {
        let mut aovs: Vec<&'static Aov> = vec![aov::find("rgba")?];
        for name in aov_names {
            let aov = aov::find(name)?;
            if !aovs.iter().any(|a| a.name == aov.name) {
                aovs.push(aov);
            }
        }
        let layout = SumLayout::new(&aovs);
        let mut tiles = Vec::new();
        for y0 in (0..height).step_by(TILE_SIZE as usize) {
            for x0 in (0..width).step_by(TILE_SIZE as usize) {
                tiles.push(Tile::new(x0, y0, TILE_SIZE.min(width - x0), TILE_SIZE.min(height - y0), &layout));
            }
        }
        Ok(Self { width, height, aovs, tiles })
    }

    /// Pixels across.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Pixels down.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// The AOVs in it.
    pub fn aovs(&self) -> &[&'static Aov] {
        &self.aovs
    }

    /// Samples taken over all pixels.
    pub fn total_samples(&self) -> u64 {
        self.tiles.iter().flat_map(|t| &t.statistics).map(|p| u64::from(p.count)).sum()
    }

    /// The fewest samples any pixel has.
    pub fn min_samples(&self) -> u32 {
        self.tiles.iter().flat_map(|t| &t.statistics).map(|p| p.count).min().unwrap_or(0)
    }

    /// Samples that were not finite and count as zero.
    pub fn non_finite_samples(&self) -> u64 {
        self.tiles.iter().map(|t| t.non_finite).sum()
    }

    /// The AOV's image: row-major, row 0 on top, its channels interleaved.
    ///
    /// # Errors
    /// The film does not have it.
    pub fn image(&self, name: &str) -> Result<Vec<f32>, String> {
        let aov = self.aovs.iter().find(|a| a.name == name).ok_or_else(|| {
            let has: Vec<_> = self.aovs.iter().map(|a| a.name).collect();
            format!("AOV {name:?} was not rendered; this film has {}", has.join(", "))
        })?;
        let channels = aov.channels.len();
        let mut image = vec![0.0; self.width as usize * self.height as usize * channels];
        for tile in &self.tiles {
            for index in 0..tile.statistics.len() {
                let (x, y) = tile.pixel(index);
                let at = (y as usize * self.width as usize + x as usize) * channels;
                image[at..at + channels].copy_from_slice(&tile.value(aov, index)[..channels]);
            }
        }
        Ok(image)
    }

    pub(crate) fn tiles(&self) -> &[Tile] {
        &self.tiles
    }

    pub(crate) fn tiles_mut(&mut self) -> &mut [Tile] {
        &mut self.tiles
    }
}

impl Tile {
    fn new(x0: u32, y0: u32, width: u32, height: u32, layout: &SumLayout) -> Self {
        let pixels = width as usize * height as usize;
        Self {
            x0,
            y0,
            width,
            height,
            statistics: vec![PixelStatistics::default(); pixels],
            sums: vec![0.0; pixels * layout.stride],
            layout: layout.clone(),
            non_finite: 0,
        }
    }

    /// Number of pixels.
    pub(crate) fn len(&self) -> usize {
        self.statistics.len()
    }

    /// Image position of a pixel.
    pub(crate) fn pixel(&self, index: usize) -> (u32, u32) {
        debug_assert!(index < (self.width * self.height) as usize);
        (self.x0 + index as u32 % self.width, self.y0 + index as u32 / self.width)
    }

    /// Samples the pixel has so far.
    pub(crate) fn sample_count(&self, index: usize) -> u32 {
        self.statistics[index].count
    }

    /// Adds a sample. Radiance that is not finite counts as black, and is counted.
    pub(crate) fn add(&mut self, index: usize, mut record: SampleRecord) {
        if !(record.radiance.is_finite() && record.volume_radiance.is_finite()) {
            self.non_finite += 1;
            record.radiance = Rgb::ZERO;
            record.volume_radiance = Rgb::ZERO;
        }
        let pixel = &mut self.statistics[index];
        pixel.count += 1;
        for (c, value) in record.radiance.to_array().into_iter().enumerate() {
            pixel.sum[c] += f64::from(value);
            pixel.sum_of_squares[c] += f64::from(value) * f64::from(value);
        }
        let stride = self.layout.stride;
        let sums = &mut self.sums[index * stride..(index + 1) * stride];
        for slot in &self.layout.slots {
            let Source::Sample(value_of, mean) = slot.aov.source else { continue };
            let value = value_of(&record);
            if mean == Mean::Finite {
                if !value[0].is_finite() {
                    continue;
                }
                sums[slot.offset + slot.aov.channels.len()] += 1.0;
            }
            for (sum, v) in sums[slot.offset..].iter_mut().zip(&value[..slot.aov.channels.len()]) {
                *sum += f64::from(*v);
            }
        }
    }

    fn value(&self, aov: &Aov, index: usize) -> [f32; 4] {
        let statistics = &self.statistics[index];
        let mean = match aov.source {
            Source::Pixel(value_of) => return value_of(statistics),
            Source::Sample(_, mean) => mean,
        };
        let Some(slot) = self.layout.slots.iter().find(|s| s.aov.name == aov.name) else { return [0.0; 4] };
        let channels = aov.channels.len();
        let sums = &self.sums[index * self.layout.stride + slot.offset..];
        let count = match mean {
            Mean::All => f64::from(statistics.count),
            Mean::Finite => sums[channels],
        };
        let empty = if mean == Mean::Finite { NO_HIT_DEPTH } else { 0.0 };
        std::array::from_fn(|c| if c < channels && count > 0.0 { (sums[c] / count) as f32 } else { empty })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn film(width: u32, height: u32) -> Film {
        let names = ["depth", "samples", "variance"].map(String::from);
        Film::new(width, height, &names).unwrap()
    }

    #[test]
    fn every_pixel_belongs_to_exactly_one_tile() {
        for (w, h) in [(1, 1), (1, 77), (33, 16), (17, 47)] {
            let mut film = film(w, h);
            for tile in film.tiles_mut() {
                for i in 0..tile.len() {
                    tile.add(i, SampleRecord::default());
                }
            }
            assert_eq!(film.total_samples(), u64::from(w) * u64::from(h));
            assert!(film.image("samples").unwrap().iter().all(|&n| n == 1.0));
        }
    }

    #[test]
    fn a_million_ones_are_one() {
        let mut film = film(1, 1);
        for _ in 0..1_000_000 {
            film.tiles_mut()[0].add(0, SampleRecord { radiance: Rgb::ONE, alpha: 1.0, ..Default::default() });
        }
        assert_eq!(film.image("rgba").unwrap(), [1.0; 4]);
        assert_eq!(film.image("variance").unwrap(), [0.0; 3]);
    }

    #[test]
    fn non_finite_samples_are_black_and_counted() {
        let mut film = film(1, 1);
        for value in [f32::NAN, f32::INFINITY, 4.0, 4.0] {
            film.tiles_mut()[0].add(0, SampleRecord { radiance: Rgb::splat(value), ..Default::default() });
        }
        assert_eq!(film.non_finite_samples(), 2);
        assert_eq!(film.image("rgba").unwrap()[0], 2.0);
    }

    #[test]
    fn depth_is_the_mean_of_hits_only() {
        let mut film = film(2, 1);
        for depth in [2.0, f32::INFINITY, 4.0] {
            film.tiles_mut()[0].add(0, SampleRecord { depth, ..Default::default() });
        }
        assert_eq!(film.image("depth").unwrap(), [3.0, NO_HIT_DEPTH]);
    }

    #[test]
    fn unknown_aovs_are_refused_by_name() {
        let error = Film::new(1, 1, &["beauty".to_owned()]).err().unwrap();
        assert!(error.contains("beauty") && error.contains("transmittance"), "{error}");
        assert!(film(1, 1).image("albedo").is_err());
    }
}
