//! Arbitrary bytes as the sections of a cache whose checksums are right: reaches the decoders, which damage alone never
//! does. The input's first two bytes say how it is divided into a summary and one further section, and of which kind.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tyndall_guiding::cache::{Cache, FORMAT, Fingerprint, MAGIC, Present};
use tyndall_guiding::image_space::View;

const BYTE_ORDER: u32 = 0x0a0b_0c0d;

fuzz_target!(|input: &[u8]| {
    let Some(([kind, share], content)) = input.split_first_chunk::<2>() else { return };
    let kind = 2 + u32::from(kind % 2);
    let (summary, other) = content.split_at(content.len() * usize::from(*share) / 255);
    let bytes = cache(&[(1, summary), (kind, other)]);
    if let Ok(mut cache) = Cache::from_bytes(&bytes) {
        // What is accepted can be used and written.
        let fingerprint = Fingerprint::new(|section| [section as u8; 16]);
        let view = View { near: 0.5, ..View::default() };
        cache.reuse(&Present { fingerprint, origin: [0.0; 3], view, resolution: [7, 5] });
        std::hint::black_box(cache.to_bytes());
    }
});

/// A file with these sections, each stored as one block.
fn cache(sections: &[(u32, &[u8])]) -> Vec<u8> {
    let mut head = MAGIC.to_vec();
    head.extend([BYTE_ORDER, FORMAT].into_iter().flat_map(u32::to_le_bytes));
    head.extend(7u64.to_le_bytes());
    head.extend([sections.len() as u32, 0].into_iter().flat_map(u32::to_le_bytes));
    head.extend([0; 32]);
    let mut body = Vec::new();
    for (kind, raw) in sections {
        let stored = store(raw);
        head.extend([*kind, 0].into_iter().flat_map(u32::to_le_bytes));
        head.extend([stored.len() as u64, raw.len() as u64].into_iter().flat_map(u64::to_le_bytes));
        head.extend(&blake3::hash(&stored).as_bytes()[..16]);
        body.extend(stored);
    }
    let checksum = blake3::hash(&head);
    head.extend(&checksum.as_bytes()[..16]);
    head.extend(body);
    head
}

fn store(raw: &[u8]) -> Vec<u8> {
    if raw.is_empty() {
        return Vec::new();
    }
    // As long as it is before compression: a block that is stored as it is.
    let mut stored = (raw.len() as u32).to_le_bytes().to_vec();
    stored.extend(raw);
    stored
}
