//! The image being made: per-pixel f64 sums of every AOV, in tiles that one worker owns at a time.
//!
//! | module | what |
//! |---|---|
//! | `block` | sums over consecutive samples; the order in which they are added, the same for an image made in parts |
//! | `tile` | a rectangle of pixels |
//! | `noise` | which pixels are clean, for adaptive sampling |
//! | `state` | all of a film as bytes, for checkpoints and for parts made elsewhere |

mod block;
mod layout;
mod noise;
mod state;
mod tile;

pub use block::SAMPLE_GRID;
pub(crate) use block::leaf_end;
pub use state::{SavedFilm, StateError};
pub(crate) use tile::Tile;

use crate::aov::{self, Aov, Source};
use aov::cryptomatte::Matte;
use layout::SumLayout;
use noise::NoiseMap;
use rayon::prelude::*;

/// Pixels along the edge of a tile. Small enough that cancelling waits a few milliseconds, large enough that handing
/// out tiles costs nothing.
pub const TILE_SIZE: u32 = 16;

/// The accumulated image.
#[derive(Clone)]
pub struct Film {
    width: u32,
    height: u32,
    first_sample: u32,
    aovs: Vec<&'static Aov>,
    tiles: Vec<Tile>,
    /// Names by [`aov::cryptomatte::Matte`]; empty unless asked for.
    matte_names: [Vec<String>; 2],
    /// Of films that are sampled adaptively.
    noise: Option<NoiseMap>,
}

impl Film {
    /// An empty film with the named AOVs; `rgba` is always there.
    ///
    /// # Errors
    /// An unknown AOV.
    pub fn new(width: u32, height: u32, aov_names: &[String]) -> Result<Self, String> {
        Self::starting_at(0, width, height, aov_names)
    }

    /// An empty film whose first sample will be `first_sample`, a multiple of [`SAMPLE_GRID`].
    ///
    /// # Errors
    /// An unknown AOV, or a sample that is not on the grid.
    pub fn starting_at(
        first_sample: u32,
        width: u32,
        height: u32,
        aov_names: &[String],
    ) -> Result<Self, String> {
        if !first_sample.is_multiple_of(SAMPLE_GRID) {
            return Err(format!(
                "a part begins with sample {first_sample}, which is not a multiple of {SAMPLE_GRID}"
            ));
        }
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
                let size = [TILE_SIZE.min(width - x0), TILE_SIZE.min(height - y0)];
                tiles.push(Tile::new([x0, y0], size, first_sample, &layout));
            }
        }
        let matte_names = Default::default();
        Ok(Self { width, height, first_sample, aovs, tiles, matte_names, noise: None })
    }

    /// This film with the names of what its cryptomattes may show.
    pub(crate) fn with_matte_names(mut self, names: impl Fn(Matte) -> Vec<String>) -> Self {
        for aov in &self.aovs {
            if let Source::Coverage(matte) = aov.source {
                self.matte_names[matte as usize] = names(matte);
            }
        }
        self
    }

    /// Names of what a cryptomatte may show.
    pub fn matte_names(&self, matte: Matte) -> &[String] {
        &self.matte_names[matte as usize]
    }

    /// This empty film, of which pixels that are clean get no more samples.
    pub(crate) fn adaptive(mut self) -> Self {
        self.noise = Some(NoiseMap::new(self.width, self.height));
        self
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
        self.sample_counts().map(u64::from).sum()
    }

    /// The fewest samples any pixel has.
    pub fn min_samples(&self) -> u32 {
        self.sample_counts().min().unwrap_or(0)
    }

    /// Samples a pixel has on average.
    pub fn mean_samples(&self) -> f64 {
        self.total_samples() as f64 / (f64::from(self.width) * f64::from(self.height))
    }

    /// The index of the first sample in it.
    pub fn first_sample(&self) -> u32 {
        self.first_sample
    }

    /// The index of the first sample that not all pixels have, or need.
    pub fn next_sample(&self) -> u32 {
        self.tiles.iter().map(Tile::next_sample).min().unwrap_or(self.first_sample)
    }

    /// Samples that were not finite and count as zero.
    pub fn non_finite_samples(&self) -> u64 {
        self.tiles.iter().map(Tile::non_finite).sum()
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
        let row = self.width as usize * channels;
        let mut image = vec![0.0; row * self.height as usize];
        let across = self.width.div_ceil(TILE_SIZE).max(1) as usize;
        let strips = image.par_chunks_mut((row * TILE_SIZE as usize).max(1));
        strips.zip(self.tiles.par_chunks(across)).for_each(|(strip, tiles)| {
            for tile in tiles {
                for index in 0..tile.len() {
                    let (x, y) = tile.pixel(index);
                    let at = (y - tile.y0) as usize * row + x as usize * channels;
                    let pixel = &mut strip[at..at + channels];
                    match aov.source {
                        Source::Coverage(matte) => pixel.copy_from_slice(&tile.ranked(matte, index)),
                        _ => pixel.copy_from_slice(&tile.value(aov, index)[..channels]),
                    }
                }
            }
        });
        Ok(image)
    }

    /// Appends the samples that follow this film's, with the same bits as if one film had taken all of them.
    ///
    /// # Errors
    /// The films differ in size or AOVs, or `next` does not begin where this one ends.
    pub fn append(&mut self, next: &Self) -> Result<(), String> {
        let names = |film: &Self| film.aovs.iter().map(|a| a.name).collect::<Vec<_>>().join(", ");
        if [self.width, self.height] != [next.width, next.height] {
            let [a, b] = [self, next].map(|film| format!("{} x {}", film.width, film.height));
            return Err(format!("one has {a} pixels, the other {b}"));
        }
        if names(self) != names(next) {
            return Err(format!("one has the AOVs {}, the other {}", names(self), names(next)));
        }
        if self.tiles.iter().any(|tile| tile.next_sample() != next.first_sample) {
            return Err(format!(
                "one ends before sample {}, the other begins with sample {}",
                self.next_sample(),
                next.first_sample
            ));
        }
        let is_empty = self.next_sample() == self.first_sample;
        if self.noise.is_some() != next.noise.is_some() || (self.noise.is_some() && !is_empty) {
            return Err(
                "adaptive sampling decides by all samples of a pixel: its films cannot be added".to_owned()
            );
        }
        self.noise.clone_from(&next.noise);
        self.tiles.iter_mut().zip(&next.tiles).for_each(|(tile, other)| tile.append(other));
        Ok(())
    }

    /// Whether adaptive sampling asks for no samples after the first `count` of any pixel.
    pub(crate) fn is_clean(&self, count: u32) -> bool {
        self.noise.as_ref().is_some_and(|noise| noise.are_all_clean(count))
    }

    /// Decides which pixels are clean now that the others have `count` samples, if it is time to.
    pub(crate) fn update_noise(&mut self, count: u32, threshold: f64) {
        let Some(noise) = self.noise.as_mut().filter(|_| NoiseMap::is_time(count)) else { return };
        let across = self.width.div_ceil(TILE_SIZE);
        noise.update(count, threshold, |x, y| {
            self.tiles[(y / TILE_SIZE * across + x / TILE_SIZE) as usize].radiance_sums(x, y)
        });
    }

    fn sample_counts(&self) -> impl Iterator<Item = u32> {
        self.tiles.iter().flat_map(|tile| (0..tile.len()).map(|index| tile.sample_count(index)))
    }

    pub(crate) fn tiles(&self) -> &[Tile] {
        &self.tiles
    }

    #[cfg(test)]
    pub(crate) fn tiles_mut(&mut self) -> &mut [Tile] {
        &mut self.tiles
    }

    /// The tiles, and whether the pixel in a column and row is clean once it has so many samples.
    pub(crate) fn tiles_to_render(&mut self) -> (&mut [Tile], impl Fn(u32, u32, u32) -> bool + Sync) {
        let noise = self.noise.as_ref();
        (&mut self.tiles, move |x, y, count| noise.is_some_and(|noise| noise.is_clean(x, y, count)))
    }
}

#[cfg(test)]
#[path = "film/tests.rs"]
mod tests;
