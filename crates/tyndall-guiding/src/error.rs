//! What callers can get wrong.

/// Why a guide refused its input.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum GuidingError {
    /// A buffer does not have one entry per pixel.
    #[error(
        "{what} has {actual} entries, but the guide has {expected} pixels; pass one entry per pixel, row by row"
    )]
    BufferSize {
        /// Which buffer.
        what: &'static str,
        /// Pixels of the guide.
        expected: usize,
        /// Entries given.
        actual: usize,
    },
}

impl GuidingError {
    pub(crate) fn check(what: &'static str, expected: usize, actual: usize) -> Result<(), Self> {
        if expected == actual { Ok(()) } else { Err(Self::BufferSize { what, expected, actual }) }
    }
}
