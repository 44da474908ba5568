//! Prim paths.

use serde::Serialize;
use std::fmt;
use std::sync::Arc;

/// The address of a prim in the shot, such as `/World/Cloud`. Cheap to clone; ordered as text.
#[derive(Clone, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
pub struct PrimPath(Arc<str>);

impl PrimPath {
    /// The path as text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl From<&str> for PrimPath {
    fn from(text: &str) -> Self {
        Self(text.into())
    }
}

impl From<String> for PrimPath {
    fn from(text: String) -> Self {
        Self(text.into())
    }
}

impl fmt::Display for PrimPath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl fmt::Debug for PrimPath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "<{}>", self.0)
    }
}
