//! Values of the metadata an image file carries.

use std::fmt;

/// One metadata value: `("software", Text("Tyndall 0.1"))`, `("tyndall:spp", Int(256))`.
#[derive(Debug, Clone, PartialEq)]
pub enum MetaValue {
    /// UTF-8 text.
    Text(String),
    /// A 32-bit signed integer.
    Int(i32),
    /// A 32-bit float.
    Float(f32),
}

impl fmt::Display for MetaValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Text(text) => f.write_str(text),
            Self::Int(value) => value.fmt(f),
            Self::Float(value) => value.fmt(f),
        }
    }
}
