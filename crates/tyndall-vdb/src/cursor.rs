//! A bounded position in the file's bytes: the only place that turns bytes into numbers.

use crate::VdbError;

/// Reads forward; every read is checked against the end. OpenVDB and NanoVDB files are little-endian.
#[derive(Debug, Clone)]
pub(crate) struct Cursor<'a> {
    /// Not yet read.
    rest: &'a [u8],
    /// The file's position of the next byte.
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
    /// Reads `bytes`, which are at position `offset` of the file.
    pub(crate) fn new(bytes: &'a [u8], offset: usize) -> Self {
        Self { rest: bytes, offset }
    }

    pub(crate) fn offset(&self) -> usize {
        self.offset
    }

    pub(crate) fn remaining(&self) -> usize {
        self.rest.len()
    }

    /// The next `count` bytes.
    pub(crate) fn take(&mut self, count: usize, what: &'static str) -> Result<&'a [u8], VdbError> {
        let Some((taken, rest)) = self.rest.split_at_checked(count) else {
            return Err(self.too_short(count as u64, what));
        };
        self.rest = rest;
        self.offset += count;
        Ok(taken)
    }

    /// Fails unless `count` bytes are left: to be asked before allocating for them.
    pub(crate) fn require(&self, count: u64, what: &'static str) -> Result<(), VdbError> {
        if count > self.remaining() as u64 { Err(self.too_short(count, what)) } else { Ok(()) }
    }

    fn too_short(&self, needed: u64, what: &'static str) -> VdbError {
        VdbError::Truncated { what, offset: self.offset, needed, available: self.remaining() }
    }

    pub(crate) fn array<const N: usize>(&mut self, what: &'static str) -> Result<[u8; N], VdbError> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N, what)?);
        Ok(array)
    }

    number!(u8, u8);
    number!(u16, u16);
    number!(u32, u32);
    number!(i32, i32);
    number!(u64, u64);
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
