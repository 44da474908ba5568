//! Voxel types: their names in files, their bytes, and what mask compression does with them.

use std::fmt;

use half::f16;
use half::slice::HalfFloatSliceExt;

/// The type of a grid's voxels as its tree type names it.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum ValueType {
    /// `float`
    Float,
    /// `double`
    Double,
    /// `half`: half floats in memory too (file version 225), not the same as a float grid saved as half.
    Half,
    /// `int32`
    Int32,
    /// `int64`
    Int64,
    /// `bool`
    Bool,
    /// `mask`: no values, just active voxels; read as `bool`.
    Mask,
    /// `vec3s`
    Vec3s,
    /// `vec3d`
    Vec3d,
    /// `vec3i`
    Vec3i,
    /// `ptdataidx32`: a points grid.
    Points,
    /// Any other name.
    Other(String),
}

impl ValueType {
    /// From the name inside a tree type, e.g. `float` of `Tree_float_5_4_3`.
    pub(crate) fn from_name(name: &str) -> Self {
        match name {
            "float" => Self::Float,
            "double" => Self::Double,
            "half" => Self::Half,
            "int32" => Self::Int32,
            "int64" => Self::Int64,
            "bool" => Self::Bool,
            "mask" => Self::Mask,
            "vec3s" => Self::Vec3s,
            "vec3d" => Self::Vec3d,
            "vec3i" => Self::Vec3i,
            "ptdataidx32" => Self::Points,
            other => Self::Other(other.to_owned()),
        }
    }

    /// Three numbers a voxel.
    pub fn is_vector(&self) -> bool {
        matches!(self, Self::Vec3s | Self::Vec3d | Self::Vec3i)
    }

    /// Sizes in bytes of one value; `None` for types whose leaves are laid out differently or unknown.
    pub(crate) fn layout(&self, saved_as_half: bool) -> Option<ValueLayout> {
        let (full, half) = match self {
            Self::Float => (4, Some(2)),
            Self::Double => (8, Some(2)),
            Self::Half => (2, None),
            Self::Int32 => (4, None),
            Self::Int64 => (8, None),
            Self::Vec3s => (12, Some(6)),
            Self::Vec3d => (24, Some(6)),
            Self::Vec3i => (12, None),
            Self::Bool | Self::Mask => (1, None),
            Self::Points | Self::Other(_) => return None,
        };
        let half = half.filter(|_| saved_as_half);
        let leaf = match self {
            Self::Bool => LeafLayout::Bits,
            Self::Mask => LeafLayout::MaskOnly,
            _ => LeafLayout::Block,
        };
        Some(ValueLayout {
            full_bytes: full,
            stored_bytes: half.unwrap_or(full),
            is_half: half.is_some(),
            leaf,
        })
    }
}

impl fmt::Display for ValueType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Float => "float",
            Self::Double => "double",
            Self::Half => "half",
            Self::Int32 => "int32",
            Self::Int64 => "int64",
            Self::Bool => "bool",
            Self::Mask => "mask",
            Self::Vec3s => "vec3s",
            Self::Vec3d => "vec3d",
            Self::Vec3i => "vec3i",
            Self::Points => "points",
            Self::Other(name) => name,
        })
    }
}

/// Bytes of one value.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ValueLayout {
    /// Of the background, root tiles and inactive values.
    pub(crate) full_bytes: usize,
    /// Inside node blocks.
    pub(crate) stored_bytes: usize,
    /// Blocks hold half floats.
    pub(crate) is_half: bool,
    /// What follows a leaf's mask.
    pub(crate) leaf: LeafLayout,
}

/// How leaves store their values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LeafLayout {
    /// A packed block.
    Block,
    /// The leaf's origin and one bit per voxel, never packed: `bool`.
    Bits,
    /// The leaf's origin; the active voxels are the true ones: `mask`.
    MaskOnly,
}

/// A voxel type this crate can decode.
pub trait Value: Copy + PartialEq + Default + fmt::Debug + Send + Sync + 'static {
    /// The type's name in files.
    const TYPE: ValueType;
    /// One value from full-size little-endian bytes, of which missing ones count as zero.
    fn from_full(bytes: &[u8]) -> Self;
    /// Fills `out` from full-size bytes, one value after the other; stops where either ends.
    fn read_full(bytes: &[u8], out: &mut [Self]);
    /// As [`Self::read_full`], from a grid saved as half; types without a half form use their full one.
    fn read_half(bytes: &[u8], out: &mut [Self]);
    /// `-self`: inside a level set, inactive values are stored as "minus background".
    fn negated(self) -> Self;
}

/// A number: what sums and conversions need.
pub trait Scalar: Value {
    /// Exact for all types but `i64`.
    fn to_f64(self) -> f64;
    /// Rounded to nearest; values beyond the range of `f32` become infinite.
    fn to_f32(self) -> f32;
}

fn array<const N: usize>(bytes: &[u8], at: usize) -> [u8; N] {
    bytes.get(at..).and_then(|tail| tail.first_chunk()).copied().unwrap_or([0; N])
}

fn half_at(bytes: &[u8], at: usize) -> f32 {
    f16::from_le_bytes(array(bytes, at)).to_f32()
}

/// Loops over chunks of a constant size compile to plain copies.
fn read_chunks<const N: usize, T>(bytes: &[u8], out: &mut [T], parse: impl Fn(&[u8; N]) -> T) {
    out.iter_mut().zip(bytes.as_chunks::<N>().0).for_each(|(slot, chunk)| *slot = parse(chunk));
}

/// Half floats into floats, sixteen at a time where the processor can.
fn read_half_floats(bytes: &[u8], out: &mut [f32]) {
    const LANES: usize = 16;
    let n = out.len().min(bytes.len() / 2);
    let (wide, tail) = out[..n].as_chunks_mut::<LANES>();
    let (wide_bytes, tail_bytes) = bytes.split_at(wide.len() * LANES * 2);
    for (slots, halves) in wide.iter_mut().zip(wide_bytes.as_chunks::<{ LANES * 2 }>().0) {
        let halves: [f16; LANES] = std::array::from_fn(|i| f16::from_le_bytes(array(halves, 2 * i)));
        halves.convert_to_f32_slice(slots);
    }
    read_chunks::<2, f32>(tail_bytes, tail, |chunk| half_at(chunk, 0));
}

/// `$n` bytes make a value; `half` is a function of bytes and values.
macro_rules! value {
    ($type:ty, $name:ident, $n:literal, |$chunk:ident| $parse:expr, half: $half:expr, negated: |$v:ident| $negated:expr) => {
        impl Value for $type {
            const TYPE: ValueType = ValueType::$name;
            fn from_full(bytes: &[u8]) -> Self {
                let $chunk = &array::<$n>(bytes, 0);
                $parse
            }
            fn read_full(bytes: &[u8], out: &mut [Self]) {
                read_chunks::<$n, Self>(bytes, out, |$chunk| $parse);
            }
            fn read_half(bytes: &[u8], out: &mut [Self]) {
                $half(bytes, out);
            }
            fn negated(self) -> Self {
                let $v = self;
                $negated
            }
        }
    };
}

value!(f32, Float, 4, |b| Self::from_le_bytes(*b), half: read_half_floats, negated: |v| -v);
value!(f64, Double, 8, |b| Self::from_le_bytes(*b), half: |bytes, out| {
    read_chunks::<2, f64>(bytes, out, |b| f64::from(half_at(b, 0)));
}, negated: |v| -v);
value!(f16, Half, 2, |b| Self::from_le_bytes(*b), half: Self::read_full, negated: |v| -v);
value!(i32, Int32, 4, |b| Self::from_le_bytes(*b), half: Self::read_full, negated: |v| v.wrapping_neg());
value!(i64, Int64, 8, |b| Self::from_le_bytes(*b), half: Self::read_full, negated: |v| v.wrapping_neg());
// OpenVDB's "minus" of a truth value is the other one.
value!(bool, Bool, 1, |b| b[0] != 0, half: Self::read_full, negated: |v| !v);
value!([f32; 3], Vec3s, 12, |b| std::array::from_fn(|axis| f32::from_le_bytes(array(b, axis * 4))),
half: |bytes, out: &mut [Self]| read_half_floats(bytes, out.as_flattened_mut()), negated: |v| v.map(|c| -c));
value!([f64; 3], Vec3d, 24, |b| std::array::from_fn(|axis| f64::from_le_bytes(array(b, axis * 8))),
half: |bytes, out: &mut [Self]| f64::read_half(bytes, out.as_flattened_mut()), negated: |v| v.map(|c| -c));
value!([i32; 3], Vec3i, 12, |b| std::array::from_fn(|axis| i32::from_le_bytes(array(b, axis * 4))),
half: Self::read_full, negated: |v| v.map(i32::wrapping_neg));

macro_rules! number {
    ($type:ty, |$v:ident| $wide:expr, $narrow:expr) => {
        impl Scalar for $type {
            fn to_f64(self) -> f64 {
                let $v = self;
                $wide
            }
            fn to_f32(self) -> f32 {
                let $v = self;
                $narrow
            }
        }
    };
}

number!(f32, |v| f64::from(v), v);
number!(f64, |v| v, v as f32);
number!(f16, |v| v.to_f64(), v.to_f32());
number!(i32, |v| f64::from(v), v as f32);
number!(i64, |v| v as f64, v as f32);
number!(bool, |v| f64::from(u8::from(v)), f32::from(u8::from(v)));

#[cfg(test)]
mod tests {
    use super::*;

    /// Every half float there is, at every position in a chunk; NaNs by their bits.
    #[test]
    fn half_floats_widen_as_one_by_one() {
        let bytes: Vec<u8> = (0..=u16::MAX).flat_map(u16::to_le_bytes).collect();
        for skip in [0, 1, 7] {
            let (mut fast, mut doubles) = (vec![9.0_f32; 65536], vec![9.0_f64; 65536]);
            f32::read_half(&bytes[2 * skip..], &mut fast);
            f64::read_half(&bytes[2 * skip..], &mut doubles);
            for (i, bits) in (0..=u16::MAX).skip(skip).enumerate() {
                let slow = f16::from_bits(bits).to_f32();
                assert!(fast[i] == slow || fast[i].is_nan() && slow.is_nan(), "{bits:#x}");
                assert!(doubles[i] == f64::from(slow) || slow.is_nan(), "{bits:#x}");
            }
            assert_eq!(fast[65536 - skip..], vec![9.0; skip], "filled from missing bytes");
        }
    }

    #[test]
    fn runs_and_single_values_agree() {
        fn check<T: Value>(n_bytes: usize) {
            let bytes: Vec<u8> = (0..n_bytes * 5).map(|i| (i * 89 % 251) as u8).collect();
            let mut run = [T::default(); 5];
            T::read_full(&bytes, &mut run);
            for (i, value) in run.iter().enumerate() {
                assert_eq!(*value, T::from_full(&bytes[i * n_bytes..]), "{}", T::TYPE);
            }
        }
        check::<f32>(4);
        check::<f64>(8);
        check::<f16>(2);
        check::<i32>(4);
        check::<i64>(8);
        check::<bool>(1);
        check::<[f32; 3]>(12);
        check::<[f64; 3]>(24);
        check::<[i32; 3]>(12);
    }

    #[test]
    fn vectors_widen_by_component() {
        let bytes: Vec<u8> =
            [-1.25_f32, 2.0, 0.5].iter().flat_map(|&v| f16::from_f32(v).to_le_bytes()).collect();
        let (mut single, mut double) = ([[0.0_f32; 3]; 1], [[0.0_f64; 3]; 1]);
        <[f32; 3]>::read_half(&bytes, &mut single);
        <[f64; 3]>::read_half(&bytes, &mut double);
        assert_eq!((single[0], double[0]), ([-1.25, 2.0, 0.5], [-1.25, 2.0, 0.5]));
    }

    #[test]
    fn short_bytes_and_the_smallest_integer_are_harmless() {
        assert_eq!(f64::from_full(&[1, 2]), 0.0);
        assert_eq!(i32::MIN.negated(), i32::MIN);
    }

    #[test]
    fn names_round_trip() {
        for name in
            ["float", "double", "half", "int32", "int64", "bool", "mask", "vec3s", "vec3d", "vec3i", "string"]
        {
            assert_eq!(ValueType::from_name(name).to_string(), name);
        }
    }
}
