//! Where the corpora are.

use std::path::PathBuf;

/// Bytes of a corpus file.
pub(crate) fn corpus_file(name: &str) -> Vec<u8> {
    std::fs::read(corpus_path(name)).expect(name)
}

/// The facts about each grid of each file: `corpus` are OpenVDB's files, `corpus_nano` NanoVDB's.
#[allow(dead_code, reason = "each test program uses its part")]
pub(crate) fn truth(corpus: &str) -> Vec<serde_json::Value> {
    let packed = std::fs::read(tests().join(corpus).join("truth.json.gz")).expect(corpus);
    serde_json::from_reader(flate2::read::GzDecoder::new(&packed[..])).expect(corpus)
}

/// Where a corpus file is.
pub(crate) fn corpus_path(name: &str) -> PathBuf {
    tests().join(if name.ends_with(".nvdb") { "corpus_nano" } else { "corpus" }).join(name)
}

fn tests() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests")
}
