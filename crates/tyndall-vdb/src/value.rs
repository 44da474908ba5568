//! Voxel types: their names in files, their bytes, and what mask compression does with them.

use std::fmt;

use half::f16;

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
    /// `mask`
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
            Self::Bool | Self::Mask | Self::Points | Self::Other(_) => return None,
        };
        let half = half.filter(|_| saved_as_half);
        Some(ValueLayout { full_bytes: full, stored_bytes: half.unwrap_or(full), is_half: half.is_some() })
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
}

/// A voxel type this crate can decode.
///
/// The byte functions get exactly as many bytes as the type takes in the file; missing bytes count as zero.
pub trait Value: Copy + PartialEq + Default + fmt::Debug + Send + Sync + 'static {
    /// The type's name in files.
    const TYPE: ValueType;
    /// From full-size little-endian bytes.
    fn from_full(bytes: &[u8]) -> Self;
    /// From the bytes of a grid saved as half; types without a half form use their full one.
    fn from_half(bytes: &[u8]) -> Self;
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

macro_rules! scalar {
    ($type:ty, $name:ident, half: |$bytes:ident| $half:expr, negated: |$v:ident| $negated:expr) => {
        impl Value for $type {
            const TYPE: ValueType = ValueType::$name;
            fn from_full(bytes: &[u8]) -> Self {
                Self::from_le_bytes(array(bytes, 0))
            }
            fn from_half($bytes: &[u8]) -> Self {
                $half
            }
            fn negated(self) -> Self {
                let $v = self;
                $negated
            }
        }
    };
}

scalar!(f32, Float, half: |bytes| half_at(bytes, 0), negated: |v| -v);
scalar!(f64, Double, half: |bytes| f64::from(half_at(bytes, 0)), negated: |v| -v);
scalar!(f16, Half, half: |bytes| Self::from_full(bytes), negated: |v| -v);
scalar!(i32, Int32, half: |bytes| Self::from_full(bytes), negated: |v| v.wrapping_neg());
scalar!(i64, Int64, half: |bytes| Self::from_full(bytes), negated: |v| v.wrapping_neg());

macro_rules! vector {
    ($type:ty, $bytes_each:literal, $name:ident, half: |$half_bytes:ident| $half:expr, negated: |$v:ident| $negated:expr) => {
        impl Value for [$type; 3] {
            const TYPE: ValueType = ValueType::$name;
            fn from_full(bytes: &[u8]) -> Self {
                std::array::from_fn(|axis| <$type>::from_le_bytes(array(bytes, axis * $bytes_each)))
            }
            fn from_half($half_bytes: &[u8]) -> Self {
                $half
            }
            fn negated(self) -> Self {
                self.map(|$v| $negated)
            }
        }
    };
}

vector!(f32, 4, Vec3s, half: |bytes| std::array::from_fn(|axis| half_at(bytes, axis * 2)), negated: |v| -v);
vector!(f64, 8, Vec3d, half: |bytes| std::array::from_fn(|axis| f64::from(half_at(bytes, axis * 2))), negated: |v| -v);
vector!(i32, 4, Vec3i, half: |bytes| Self::from_full(bytes), negated: |v| v.wrapping_neg());

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_and_full_bytes_agree() {
        let half = f16::from_f32(-1.25).to_le_bytes();
        assert_eq!(f32::from_half(&half), -1.25);
        assert_eq!(f64::from_half(&half), -1.25);
        let three: Vec<u8> = half.iter().chain(&half).chain(&half).copied().collect();
        assert_eq!(<[f32; 3]>::from_half(&three), [-1.25; 3]);
        let bytes: Vec<u8> = [1_i32, -2, 3].iter().flat_map(|v| v.to_le_bytes()).collect();
        assert_eq!(<[i32; 3]>::from_full(&bytes), [1, -2, 3]);
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
