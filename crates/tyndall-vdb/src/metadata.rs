//! Named values attached to files and grids.

use crate::VdbError;
use crate::cursor::Cursor;

/// One metadata value. Types without a variant keep their bytes.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum MetaValue {
    /// `string`; not UTF-8 becomes U+FFFD.
    String(String),
    /// `bool`
    Bool(bool),
    /// `int32`
    Int32(i32),
    /// `int64`
    Int64(i64),
    /// `float`
    Float(f32),
    /// `double`
    Double(f64),
    /// `vec3i`
    Vec3i([i32; 3]),
    /// `vec3s`
    Vec3s([f32; 3]),
    /// `vec3d`
    Vec3d([f64; 3]),
    /// Anything else, or a value whose size contradicts its type.
    Other {
        /// The type's name in the file.
        type_name: String,
        /// As stored.
        bytes: Vec<u8>,
    },
}

/// Entries in file order.
pub(crate) type Metadata = Vec<(String, MetaValue)>;

impl MetaValue {
    fn from_stored(type_name: String, bytes: &[u8]) -> Self {
        let known = match (type_name.as_str(), bytes.len()) {
            ("string", _) => Some(Self::String(String::from_utf8_lossy(bytes).into_owned())),
            ("bool", 1) => bytes.first().map(|&byte| Self::Bool(byte != 0)),
            ("int32", 4) => numbers(bytes, i32::from_le_bytes).map(|[v]| Self::Int32(v)),
            ("int64", 8) => numbers(bytes, i64::from_le_bytes).map(|[v]| Self::Int64(v)),
            ("float", 4) => numbers(bytes, f32::from_le_bytes).map(|[v]| Self::Float(v)),
            ("double", 8) => numbers(bytes, f64::from_le_bytes).map(|[v]| Self::Double(v)),
            ("vec3i", 12) => numbers(bytes, i32::from_le_bytes).map(Self::Vec3i),
            ("vec3s", 12) => numbers(bytes, f32::from_le_bytes).map(Self::Vec3s),
            ("vec3d", 24) => numbers(bytes, f64::from_le_bytes).map(Self::Vec3d),
            _ => None,
        };
        known.unwrap_or_else(|| Self::Other { type_name, bytes: bytes.to_vec() })
    }

    /// The type's name and the bytes to store.
    pub(crate) fn to_stored(&self) -> (&str, Vec<u8>) {
        match self {
            Self::String(text) => ("string", text.as_bytes().to_vec()),
            Self::Bool(flag) => ("bool", vec![u8::from(*flag)]),
            Self::Int32(v) => ("int32", v.to_le_bytes().to_vec()),
            Self::Int64(v) => ("int64", v.to_le_bytes().to_vec()),
            Self::Float(v) => ("float", v.to_le_bytes().to_vec()),
            Self::Double(v) => ("double", v.to_le_bytes().to_vec()),
            Self::Vec3i(v) => ("vec3i", v.iter().flat_map(|c| c.to_le_bytes()).collect()),
            Self::Vec3s(v) => ("vec3s", v.iter().flat_map(|c| c.to_le_bytes()).collect()),
            Self::Vec3d(v) => ("vec3d", v.iter().flat_map(|c| c.to_le_bytes()).collect()),
            Self::Other { type_name, bytes } => (type_name, bytes.clone()),
        }
    }
}

/// `N` numbers of `B` bytes each; `None` unless the sizes agree exactly.
fn numbers<T, const B: usize, const N: usize>(bytes: &[u8], parse: fn([u8; B]) -> T) -> Option<[T; N]> {
    let (chunks, []) = bytes.as_chunks::<B>() else { return None };
    let chunks: &[[u8; B]; N] = chunks.try_into().ok()?;
    Some(chunks.map(parse))
}

/// Reads a metadata map. Entries cost at least twelve bytes, so a claimed count beyond that is refused at once.
pub(crate) fn read_metadata(cursor: &mut Cursor<'_>) -> Result<Metadata, VdbError> {
    const SMALLEST_ENTRY: u64 = 12;
    let count = cursor.u32("metadata count")?;
    cursor.require(u64::from(count) * SMALLEST_ENTRY, "metadata")?;
    let mut metadata = Metadata::new();
    for _ in 0..count {
        let key = cursor.string("metadata name")?;
        let type_name = cursor.string("metadata type")?;
        let size = cursor.u32("metadata size")?;
        let bytes = cursor.take(size as usize, "metadata value")?;
        metadata.push((key, MetaValue::from_stored(type_name, bytes)));
    }
    Ok(metadata)
}

/// The first entry called `key`.
pub(crate) fn find<'a>(metadata: &'a [(String, MetaValue)], key: &str) -> Option<&'a MetaValue> {
    metadata.iter().find(|(name, _)| name == key).map(|(_, value)| value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_variant_survives_a_round_trip() {
        let values = [
            MetaValue::String("héllo".to_owned()),
            MetaValue::Bool(true),
            MetaValue::Int32(-3),
            MetaValue::Int64(i64::MIN),
            MetaValue::Float(1.5),
            MetaValue::Double(-2.25),
            MetaValue::Vec3i([1, -2, 3]),
            MetaValue::Vec3s([0.5, 1.0, -1.0]),
            MetaValue::Vec3d([0.1, 0.2, 0.3]),
            MetaValue::Other { type_name: "mat4d".to_owned(), bytes: vec![7; 128] },
        ];
        for value in values {
            let (type_name, bytes) = value.to_stored();
            assert_eq!(MetaValue::from_stored(type_name.to_owned(), &bytes), value);
        }
    }

    #[test]
    fn a_value_of_the_wrong_size_keeps_its_bytes() {
        let value = MetaValue::from_stored("int32".to_owned(), &[1, 2]);
        assert_eq!(value, MetaValue::Other { type_name: "int32".to_owned(), bytes: vec![1, 2] });
    }

    #[test]
    fn an_absurd_count_is_refused() {
        let mut cursor = Cursor::new(&[255, 255, 255, 255, 0, 0, 0, 0], 0);
        assert!(matches!(read_metadata(&mut cursor), Err(VdbError::Truncated { .. })));
    }
}
