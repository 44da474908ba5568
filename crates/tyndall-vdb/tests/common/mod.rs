//! Where the corpus is.

use std::path::PathBuf;

/// Bytes of a corpus file.
pub(crate) fn corpus_file(name: &str) -> Vec<u8> {
    std::fs::read(corpus_folder().join(name)).expect(name)
}

/// The facts about each grid of each file.
#[allow(dead_code, reason = "each test program uses its part")]
pub(crate) fn truth() -> Vec<serde_json::Value> {
    serde_json::from_slice(&corpus_file("truth.json")).expect("truth.json")
}

fn corpus_folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/corpus")
}
