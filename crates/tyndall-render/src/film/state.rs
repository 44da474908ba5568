//! All of a film as bytes, for checkpoints and for parts made elsewhere.
//!
//! Little-endian, in this order: [`MAGIC`], version, length of the header, header (JSON: [`Header`]), the closed blocks
//! of every tile (statistics, sums, and the pairs of cryptomattes), the noise of every pixel if sampling is adaptive, what
//! guides had learned, and the BLAKE3 digest of everything before it. What a cancelled pass left is not kept: it is
//! rendered again.

use super::Film;
use super::SumLayout;
use super::block::Block;
use super::noise::{NoiseMap, PixelNoise};
use crate::aov::PixelStatistics;
use crate::aov::cryptomatte::Coverage;
use crate::guide::GuideState;
use serde::{Deserialize, Serialize};
use std::io::{self, Write};

const MAGIC: [u8; 8] = *b"TYNDFILM";
const VERSION: u32 = 3;
const DIGEST: usize = blake3::OUT_LEN;
/// Bytes of one pixel's statistics: a count, three sums, three sums of squares.
const STATISTICS: usize = 4 + 6 * 8;
/// Bytes of one pixel's noise: samples wanted and measured, three sums, a variance.
const NOISE: usize = 8 + 4 * 8;

/// What the blocks belong to.
#[derive(Serialize, Deserialize)]
struct Header {
    width: u32,
    height: u32,
    first_sample: u32,
    aovs: Vec<String>,
    is_adaptive: bool,
    /// Bytes of what guides had learned.
    guide: Option<u64>,
    #[serde(default)]
    matte_names: [Vec<String>; 2],
    /// What the caller wants to find again.
    description: String,
}

/// Why bytes are not a film.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum StateError {
    /// Something else altogether.
    #[error("it holds no film")]
    Foreign,
    /// Written by another version.
    #[error("its format is version {0}, this renderer reads version {VERSION}")]
    Version(u32),
    /// Cut off or changed.
    #[error("it is cut off or damaged")]
    Damaged,
    /// It has AOVs this renderer does not know.
    #[error("{0}")]
    Film(String),
}

/// What a file of a film holds.
#[derive(Clone)]
pub struct SavedFilm {
    /// The film.
    pub film: Film,
    /// The text of whoever wrote it.
    pub description: String,
    /// What the guides of its render had learned; `None` if that was not kept.
    pub guide: Option<GuideState>,
}

impl Film {
    /// Writes the film and a text of the caller's.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write_state(&self, description: &str, out: &mut dyn Write) -> io::Result<()> {
        self.write_with_guide(description, None, out)
    }

    /// As [`Self::write_state`], with what guides knew when the last sample was closed.
    pub(crate) fn write_with_guide(
        &self,
        description: &str,
        guide: Option<&[u8]>,
        out: &mut dyn Write,
    ) -> io::Result<()> {
        let header = Header {
            width: self.width,
            height: self.height,
            first_sample: self.first_sample,
            aovs: self.aovs.iter().map(|a| a.name.to_owned()).collect(),
            is_adaptive: self.noise.is_some(),
            guide: guide.map(|bytes| bytes.len() as u64),
            matte_names: self.matte_names.clone(),
            description: description.to_owned(),
        };
        let header = serde_json::to_vec(&header)?;
        let mut out = Hashing { out, hasher: blake3::Hasher::new() };
        out.write_all(&MAGIC)?;
        out.write_all(&VERSION.to_le_bytes())?;
        out.write_all(&(header.len() as u32).to_le_bytes())?;
        out.write_all(&header)?;
        for tile in &self.tiles {
            out.write_all(&(tile.blocks.len() as u32).to_le_bytes())?;
            for block in &tile.blocks {
                out.write_all(&block_bytes(block))?;
            }
        }
        for pixel in self.noise.iter().flat_map(|noise| &noise.pixels) {
            out.write_all(&noise_bytes(pixel))?;
        }
        out.write_all(guide.unwrap_or_default())?;
        let digest = out.hasher.finalize();
        out.out.write_all(digest.as_bytes())
    }

    /// Reads what [`Self::write_state`] or a snapshot wrote.
    ///
    /// # Errors
    /// The bytes are something else, of another version, or not all there.
    pub fn read_state(bytes: &[u8]) -> Result<SavedFilm, StateError> {
        let mut input = Input { bytes };
        if input.array()? != MAGIC {
            return Err(StateError::Foreign);
        }
        let version = input.u32()?;
        if version != VERSION {
            return Err(StateError::Version(version));
        }
        let (content, digest) = bytes.split_last_chunk::<DIGEST>().ok_or(StateError::Damaged)?;
        if blake3::hash(content).as_bytes() != digest {
            return Err(StateError::Damaged);
        }
        input.bytes = input.bytes.strip_suffix(digest).ok_or(StateError::Damaged)?;
        let header_len = input.u32()? as usize;
        let header: Header =
            serde_json::from_slice(input.take(header_len)?).map_err(|_| StateError::Damaged)?;
        let film = read_film(&header, &mut input)?;
        let n_bytes = usize::try_from(header.guide.unwrap_or(0)).map_err(|_| StateError::Damaged)?;
        let bytes = input.take(n_bytes)?;
        if !input.bytes.is_empty() {
            return Err(StateError::Damaged);
        }
        let guide = header.guide.map(|_| GuideState::from_bytes(bytes).ok_or(StateError::Damaged));
        Ok(SavedFilm { film, description: header.description, guide: guide.transpose()? })
    }
}

fn read_film(header: &Header, input: &mut Input) -> Result<Film, StateError> {
    // Every tile takes four bytes at least: a size that the bytes cannot hold is not allocated.
    let tiles = u64::from(header.width.div_ceil(super::TILE_SIZE))
        * u64::from(header.height.div_ceil(super::TILE_SIZE));
    if tiles * 4 > input.bytes.len() as u64 {
        return Err(StateError::Damaged);
    }
    let mut film = Film::starting_at(header.first_sample, header.width, header.height, &header.aovs)
        .map_err(StateError::Film)?;
    film.matte_names.clone_from(&header.matte_names);
    for tile in &mut film.tiles {
        for _ in 0..input.u32()? {
            let block = input.block(tile.len(), &tile.layout)?;
            if block.first != tile.next_sample() || block.end <= block.first {
                return Err(StateError::Damaged);
            }
            tile.blocks.push(block);
        }
    }
    if header.is_adaptive {
        film = film.adaptive();
        for pixel in film.noise.iter_mut().flat_map(|noise: &mut NoiseMap| &mut noise.pixels) {
            *pixel = input.noise()?;
        }
    }
    Ok(film)
}

fn block_bytes(block: &Block) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(16 + block.statistics.len() * STATISTICS + block.sums.len() * 8);
    bytes.extend(block.first.to_le_bytes());
    bytes.extend(block.end.to_le_bytes());
    bytes.extend(block.non_finite.to_le_bytes());
    for pixel in &block.statistics {
        bytes.extend(pixel.count.to_le_bytes());
        pixel.sum.iter().chain(&pixel.sum_of_squares).for_each(|sum| bytes.extend(sum.to_le_bytes()));
    }
    block.sums.iter().for_each(|sum| bytes.extend(sum.to_le_bytes()));
    for Coverage(pairs) in &block.coverage {
        bytes.extend((pairs.len() as u32).to_le_bytes());
        for (id, weight) in pairs {
            bytes.extend(id.to_le_bytes());
            bytes.extend(weight.to_le_bytes());
        }
    }
    bytes
}

fn noise_bytes(pixel: &PixelNoise) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(NOISE);
    bytes.extend(pixel.wanted.to_le_bytes());
    bytes.extend(pixel.count.to_le_bytes());
    pixel.sums.iter().chain([&pixel.variance]).for_each(|number| bytes.extend(number.to_le_bytes()));
    bytes
}

/// Hashes what it writes.
struct Hashing<'a> {
    out: &'a mut dyn Write,
    hasher: blake3::Hasher,
}

impl Hashing<'_> {
    fn write_all(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.hasher.update(bytes);
        self.out.write_all(bytes)
    }
}

/// The bytes that have not been read.
struct Input<'a> {
    bytes: &'a [u8],
}

impl<'a> Input<'a> {
    fn take(&mut self, len: usize) -> Result<&'a [u8], StateError> {
        let (taken, rest) = self.bytes.split_at_checked(len).ok_or(StateError::Damaged)?;
        self.bytes = rest;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], StateError> {
        self.take(N)?.try_into().map_err(|_| StateError::Damaged)
    }

    fn u32(&mut self) -> Result<u32, StateError> {
        Ok(u32::from_le_bytes(self.array()?))
    }

    fn f64s<const N: usize>(&mut self) -> Result<[f64; N], StateError> {
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            *number = f64::from_le_bytes(self.array()?);
        }
        Ok(numbers)
    }

    fn noise(&mut self) -> Result<PixelNoise, StateError> {
        let (wanted, count) = (self.u32()?, self.u32()?);
        Ok(PixelNoise { wanted, count, sums: self.f64s()?, variance: f64::from_le_bytes(self.array()?) })
    }

    fn coverage(&mut self) -> Result<Coverage, StateError> {
        let pairs = (0..self.u32()?).map(|_| Ok((self.u32()?, f64::from_le_bytes(self.array()?))));
        pairs.collect::<Result<_, _>>().map(Coverage)
    }

    fn block(&mut self, pixels: usize, layout: &SumLayout) -> Result<Block, StateError> {
        let (first, end) = (self.u32()?, self.u32()?);
        let non_finite = u64::from_le_bytes(self.array()?);
        let mut statistics = Vec::with_capacity(pixels);
        for _ in 0..pixels {
            let count = self.u32()?;
            let (sum, sum_of_squares) = (self.f64s()?, self.f64s()?);
            statistics.push(PixelStatistics { count, sum, sum_of_squares });
        }
        let bytes = self.take(pixels * layout.stride * 8)?;
        let (numbers, _) = bytes.as_chunks::<8>();
        let sums = numbers.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect();
        let coverage =
            (0..pixels * layout.mattes.len()).map(|_| self.coverage()).collect::<Result<_, _>>()?;
        Ok(Block { first, end, non_finite, statistics, sums, coverage })
    }
}
