//! Arbitrary bytes as a cache.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tyndall_guiding::cache::Cache;

fuzz_target!(|bytes: &[u8]| {
    if let Err(error) = Cache::from_bytes(bytes) {
        std::hint::black_box(error.to_string());
    }
});
