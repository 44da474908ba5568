//! How much memory a file may ask for, and what happens when a decoder panics.

use crate::IoError;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

/// Decoded bytes any file may ask for, however small it is.
const FREE_BYTES: u64 = 64 << 20;
/// Deflate expands by 1032 at most; run lengths of the other codecs expand less.
const MAX_EXPANSION: u64 = 2048;
/// No image is larger: 64 Ki x 32 Ki pixels of four floats.
const MAX_BYTES: u64 = 32 << 30;

/// The decoded bytes a file of `file_bytes` bytes can honestly need.
pub(crate) fn decoded_limit(file_bytes: u64) -> u64 {
    file_bytes.saturating_mul(MAX_EXPANSION).saturating_add(FREE_BYTES).min(MAX_BYTES)
}

/// Fails if `bytes` is more than the file at `path` can hold; `None` stands for a size that overflowed.
pub(crate) fn check_decoded_bytes(path: &Path, bytes: Option<u64>, file_bytes: u64) -> Result<(), IoError> {
    let (bytes, limit) = (bytes.unwrap_or(u64::MAX), decoded_limit(file_bytes));
    if bytes > limit { Err(IoError::TooLarge { path: path.into(), bytes, limit }) } else { Ok(()) }
}

/// `width * height * bytes_per_pixel`, or `None` if it overflows.
pub(crate) fn image_bytes(width: usize, height: usize, bytes_per_pixel: usize) -> Option<u64> {
    u64::try_from(width.checked_mul(height)?.checked_mul(bytes_per_pixel)?).ok()
}

/// Runs a third-party decoder. They assert their own consistency here and there (`exr` has a dozen `expect`s on its
/// reading path); 40,000 mutated files triggered none, but should one panic, it ends here as a "damaged file" error.
/// `decode` must run on this thread or through rayon's scoped calls, which hand panics on.
pub(crate) fn guard_decoder<T>(
    path: &Path,
    decode: impl FnOnce() -> Result<T, IoError>,
) -> Result<T, IoError> {
    catch_unwind(AssertUnwindSafe(decode)).unwrap_or_else(|panic| {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        let text = text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("contradictory content");
        Err(IoError::damaged(path, text))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_grow_with_the_file_and_never_overflow() {
        assert_eq!(decoded_limit(0), FREE_BYTES);
        assert_eq!(decoded_limit(u64::MAX), MAX_BYTES);
        assert_eq!(image_bytes(usize::MAX, 2, 4), None);
        assert!(check_decoded_bytes("a".as_ref(), None, 1 << 30).is_err());
        assert!(check_decoded_bytes("a".as_ref(), Some(FREE_BYTES), 0).is_ok());
    }

    #[test]
    fn a_panic_becomes_an_error_naming_the_file() {
        let error =
            guard_decoder::<()>("bad.exr".as_ref(), || panic!("index {}", 7)).unwrap_err().to_string();
        assert!(error.contains("bad.exr") && error.contains("index 7"), "{error}");
    }
}
