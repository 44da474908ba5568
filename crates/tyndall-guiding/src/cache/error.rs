//! Why bytes are no cache that can be used.

/// Why a cache cannot be read. The texts follow "FILE: ".
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CacheError {
    /// Another kind of file.
    #[error("is not a guiding cache")]
    NotACache,
    /// Of a later version of the format.
    #[error("is a guiding cache of format {found}, this version reads up to {known}; use a newer Tyndall")]
    Newer {
        /// In the file.
        found: u32,
        /// The latest that can be read.
        known: u32,
    },
    /// Of an earlier version of the format, or not of this byte order.
    #[error("is a guiding cache that cannot be read here: {0}")]
    Foreign(&'static str),
    /// Holds what this version does not know.
    #[error("needs features that this version does not have (bits {0:#x}); use a newer Tyndall")]
    UnknownFeatures(u64),
    /// Ends too early, or goes on after its end.
    #[error("has {actual} bytes instead of {expected}; it was not copied completely")]
    Length {
        /// By its table.
        expected: u64,
        /// Of the file.
        actual: u64,
    },
    /// A checksum does not match.
    #[error("is damaged: the checksum of its {0} does not match")]
    Checksum(&'static str),
    /// Content that no renderer writes.
    #[error("is damaged: {0}")]
    Malformed(&'static str),
}

pub(crate) type Result<T> = std::result::Result<T, CacheError>;
