//! Arbitrary bytes as a file.
#![no_main]

use libfuzzer_sys::fuzz_target;

mod read_all;

fuzz_target!(|bytes: &[u8]| read_all::read_all(bytes.to_vec()));
