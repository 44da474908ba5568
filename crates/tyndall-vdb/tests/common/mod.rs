//! Where the corpora are.

use std::path::{Path, PathBuf};

/// Bytes of a corpus file.
pub(crate) fn corpus_file(name: &str) -> Vec<u8> {
    std::fs::read(corpus_path(name)).expect(name)
}

/// Where a corpus file is.
pub(crate) fn corpus_path(name: &str) -> PathBuf {
    let corpus = if name.ends_with(".nvdb") { "corpus_nano" } else { "corpus" };
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests").join(corpus).join(name)
}
