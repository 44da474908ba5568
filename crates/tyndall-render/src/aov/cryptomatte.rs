//! `crypto_object` and `crypto_material`: which surfaces a pixel shows and how much of each, by Friedman and Jones'
//! specification 1.2 (*Fully automatic ID mattes with support for motion blur and transparency*, 2015).
//!
//! A name's hash, as the bits of a float, and the part of the pixel that it covers are a pair of channels, most first.
//! Media don't count: they take away from what is behind them, as in Cycles.

use super::{Aov, Precision, Source};

/// Pairs a pixel has room for, two a layer.
pub const RANKS: usize = 6;

/// What is told apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Matte {
    /// Prims.
    Object,
    /// Their materials.
    Material,
}

impl Matte {
    /// Both, in the order of [`super::SampleRecord::mattes`].
    pub const ALL: [Self; 2] = [Self::Object, Self::Material];

    /// The name that layers begin with.
    pub fn layer_name(self) -> &'static str {
        match self {
            Self::Object => "CryptoObject",
            Self::Material => "CryptoMaterial",
        }
    }
}

const CHANNELS: &[&str] =
    &["00.R", "00.G", "00.B", "00.A", "01.R", "01.G", "01.B", "01.A", "02.R", "02.G", "02.B", "02.A"];

pub(super) const OBJECT: Aov = Aov {
    name: "crypto_object",
    channels: CHANNELS,
    doc: "Cryptomatte of prims: hash of the path and coverage, in pairs, for six of them.",
    precision: Precision::Float,
    source: Source::Coverage(Matte::Object),
};

pub(super) const MATERIAL: Aov = Aov {
    name: "crypto_material",
    channels: CHANNELS,
    doc: "Cryptomatte of materials: hash of the path and coverage, in pairs, for six of them.",
    precision: Precision::Float,
    source: Source::Coverage(Matte::Material),
};

/// The id of a name: MurmurHash3_32, changed in one bit where its float would be denormal, infinite or NaN.
pub fn id(name: &str) -> u32 {
    let hash = murmur3(name.as_bytes());
    if matches!(hash >> 23 & 255, 0 | 255) { hash ^ 1 << 23 } else { hash }
}

/// What the keys of a matte's metadata begin with, by the name its layers begin with.
pub fn metadata_prefix(name: &str) -> String {
    let hash = format!("{:08x}", id(name));
    format!("cryptomatte/{}/", &hash[..7])
}

/// The ids of names as JSON: `{"name": "<8 hex digits>"}`.
pub fn manifest(names: &[String]) -> String {
    let ids: std::collections::BTreeMap<_, _> =
        names.iter().map(|name| (name, format!("{:08x}", id(name)))).collect();
    serde_json::to_string(&ids).unwrap_or_default()
}

/// Appleby's MurmurHash3, x86, 32 bits, seed 0.
fn murmur3(bytes: &[u8]) -> u32 {
    let scramble = |k: u32| k.wrapping_mul(0xcc9e_2d51).rotate_left(15).wrapping_mul(0x1b87_3593);
    let (words, rest) = bytes.as_chunks::<4>();
    let mut hash = 0u32;
    for word in words {
        hash ^= scramble(u32::from_le_bytes(*word));
        hash = hash.rotate_left(13).wrapping_mul(5).wrapping_add(0xe654_6b64);
    }
    let tail = rest.iter().rev().fold(0u32, |tail, byte| tail << 8 | u32::from(*byte));
    hash ^= scramble(tail) ^ bytes.len() as u32;
    hash = (hash ^ hash >> 16).wrapping_mul(0x85eb_ca6b);
    hash = (hash ^ hash >> 13).wrapping_mul(0xc2b2_ae35);
    hash ^ hash >> 16
}

/// What of a pixel each id covers: sums of weights over samples.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Coverage(pub(crate) Vec<(u32, f64)>);

impl Coverage {
    /// Adds to the sum of an id.
    pub(crate) fn add(&mut self, id: u32, weight: f64) {
        match self.0.iter_mut().find(|(known, _)| *known == id) {
            Some((_, sum)) => *sum += weight,
            None => self.0.push((id, weight)),
        }
    }

    /// Adds all sums of another.
    pub(crate) fn merge(&mut self, other: &Self) {
        other.0.iter().for_each(|&(id, weight)| self.add(id, weight));
    }

    /// The pairs of channels of a pixel of `count` samples, most first.
    pub(crate) fn ranked(mut self, count: u32) -> [f32; 2 * RANKS] {
        self.0.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let mut channels = [0.0; 2 * RANKS];
        for ([rank, share], (id, sum)) in channels.as_chunks_mut::<2>().0.iter_mut().zip(self.0) {
            (*rank, *share) = (f32::from_bits(id), (sum / f64::from(count)) as f32);
        }
        channels
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hashes_are_murmur3() {
        // Reference values of the algorithm's author and of the specification.
        assert_eq!(murmur3(b""), 0);
        assert_eq!(murmur3(b"test"), 0xba6b_d213);
        assert_eq!(murmur3(b"Hello, world!"), 0xc036_3e43);
        assert_eq!(murmur3(b"The quick brown fox jumps over the lazy dog"), 0x2e4f_f723);
    }

    #[test]
    fn ids_are_ordinary_floats() {
        for i in 0..100_000 {
            assert!(f32::from_bits(id(&format!("object{i}"))).is_normal());
        }
    }

    #[test]
    fn the_largest_come_first() {
        let mut coverage = Coverage::default();
        [(7, 1.0), (9, 0.5), (7, 1.0), (8, 0.5)].iter().for_each(|&(id, weight)| coverage.add(id, weight));
        let channels = coverage.ranked(4);
        let ids: Vec<u32> = channels.iter().step_by(2).map(|x| x.to_bits()).collect();
        assert_eq!(ids, [7, 8, 9, 0, 0, 0]);
        assert_eq!(
            channels[1..].iter().step_by(2).copied().collect::<Vec<_>>(),
            [0.5, 0.125, 0.125, 0.0, 0.0, 0.0]
        );
    }
}
