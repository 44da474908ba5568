//! Messages about what could not be rendered as asked.

use crate::PrimPath;
use std::fmt;

/// How bad it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Severity {
    /// Nothing is lost; worth knowing.
    Info,
    /// The picture differs from what the shot asks for.
    Warning,
    /// Something that was asked for is missing from the picture.
    Error,
}

impl Severity {
    /// Lower-case name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Info => "info",
            Self::Warning => "warning",
            Self::Error => "error",
        }
    }

    /// The inverse of [`Self::name`].
    pub fn from_name(name: &str) -> Option<Self> {
        [Self::Info, Self::Warning, Self::Error].into_iter().find(|s| s.name() == name)
    }
}

/// One message: which prim, what is wrong, what to do.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Diagnostic {
    /// How bad it is.
    pub severity: Severity,
    /// The prim it is about; empty for the whole shot.
    pub path: String,
    /// What is wrong, with the attribute and value.
    pub what: String,
    /// What the user can do.
    pub action: String,
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.severity.name())?;
        if !self.path.is_empty() {
            write!(f, " at <{}>", self.path)?;
        }
        write!(f, ": {}", self.what)?;
        if !self.action.is_empty() {
            write!(f, " ({})", self.action)?;
        }
        Ok(())
    }
}

/// Collected messages, each kept once, in the order they came.
#[derive(Debug, Clone, Default)]
pub struct Diagnostics(Vec<Diagnostic>);

impl Diagnostics {
    /// Adds a message unless the same one is there.
    pub fn push(&mut self, diagnostic: Diagnostic) {
        if !self.0.contains(&diagnostic) {
            self.0.push(diagnostic);
        }
    }

    /// Adds a warning about the prim at `path`.
    pub fn warn(&mut self, path: &PrimPath, what: impl Into<String>, action: impl Into<String>) {
        self.report(Severity::Warning, path, what, action);
    }

    /// Adds an error about the prim at `path`.
    pub fn error(&mut self, path: &PrimPath, what: impl Into<String>, action: impl Into<String>) {
        self.report(Severity::Error, path, what, action);
    }

    /// Adds a message about the prim at `path`.
    pub fn report(
        &mut self,
        severity: Severity,
        path: &PrimPath,
        what: impl Into<String>,
        action: impl Into<String>,
    ) {
        let (what, action) = (what.into(), action.into());
        self.push(Diagnostic { severity, path: path.as_str().to_owned(), what, action });
    }

    /// Adds every message of `other`.
    pub fn extend(&mut self, other: Diagnostics) {
        other.0.into_iter().for_each(|d| self.push(d));
    }

    /// The messages.
    pub fn as_slice(&self) -> &[Diagnostic] {
        &self.0
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repeated_messages_are_kept_once_and_read_well() {
        let mut all = Diagnostics::default();
        for _ in 0..3 {
            all.warn(&"/World/Fog".into(), "albedo 1.1 is above 1", "it was clamped to 1");
        }
        assert_eq!(all.as_slice().len(), 1);
        assert_eq!(
            all.as_slice()[0].to_string(),
            "warning at </World/Fog>: albedo 1.1 is above 1 (it was clamped to 1)"
        );
    }
}
