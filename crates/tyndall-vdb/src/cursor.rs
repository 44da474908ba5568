//! A bounded position in the file's bytes: the only place that turns bytes into numbers.

use crate::VdbError;

/// Reads forward; every read is checked against the end. VDB files are little-endian.
#[derive(Debug, Clone)]
pub(crate) struct Cursor<'a> {
    bytes: &'a [u8],
    offset: usize,
}

macro_rules! number {
    ($name:ident, $type:ty) => {
        pub(crate) fn $name(&mut self, what: &'static str) -> Result<$type, VdbError> {
            self.array(what).map(<$type>::from_le_bytes)
        }
    };
}

impl<'a> Cursor<'a> {
    /// Starts at `offset` (at the end if past it) of `bytes`, which is the file or a front part of it.
    pub(crate) fn new(bytes: &'a [u8], offset: usize) -> Self {
        Self { bytes, offset: offset.min(bytes.len()) }
    }

    pub(crate) fn offset(&self) -> usize {
        self.offset
    }

    pub(crate) fn remaining(&self) -> usize {
        self.bytes.len() - self.offset
    }

    /// The next `count` bytes.
    pub(crate) fn take(&mut self, count: usize, what: &'static str) -> Result<&'a [u8], VdbError> {
        self.require(count as u64, what)?;
        let start = self.offset;
        self.offset += count;
        Ok(&self.bytes[start..self.offset])
    }

    /// Fails unless `count` bytes are left: to be asked before allocating for them.
    pub(crate) fn require(&self, count: u64, what: &'static str) -> Result<(), VdbError> {
        let available = self.remaining();
        if count > available as u64 {
            return Err(VdbError::Truncated { what, offset: self.offset, needed: count, available });
        }
        Ok(())
    }

    pub(crate) fn array<const N: usize>(&mut self, what: &'static str) -> Result<[u8; N], VdbError> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N, what)?);
        Ok(array)
    }

    number!(u8, u8);
    number!(u32, u32);
    number!(i32, i32);
    number!(i64, i64);
    number!(f64, f64);

    pub(crate) fn i32x3(&mut self, what: &'static str) -> Result<[i32; 3], VdbError> {
        Ok([self.i32(what)?, self.i32(what)?, self.i32(what)?])
    }

    /// A 32-bit length and that many bytes; bytes that are not UTF-8 become U+FFFD.
    pub(crate) fn string(&mut self, what: &'static str) -> Result<String, VdbError> {
        let length = self.u32(what)?;
        let bytes = self.take(length as usize, what)?;
        Ok(String::from_utf8_lossy(bytes).into_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_stop_at_the_end() {
        let mut cursor = Cursor::new(&[1, 0, 0, 0, 9], 0);
        assert_eq!(cursor.u32("a").ok(), Some(1));
        let error = cursor.u32("count").err().map(|e| e.to_string()).unwrap_or_default();
        assert!(error.contains("count at byte 4 needs 4 bytes but 1 are left"), "{error}");
        assert_eq!(cursor.u8("b").ok(), Some(9));
    }

    #[test]
    fn a_string_cannot_be_longer_than_the_file() {
        let mut cursor = Cursor::new(&[255, 255, 255, 255, b'x'], 0);
        assert!(matches!(cursor.string("name"), Err(VdbError::Truncated { needed: 0xffff_ffff, .. })));
    }
}
