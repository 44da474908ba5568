//! No bytes make the reader panic, hang or allocate beyond a multiple of their size.

mod common;

use common::corpus_file;
use proptest::prelude::*;
use tyndall_vdb::{Grid, MetaValue, Value, ValueType, VdbError, VdbFile};

/// One file per storage form, and those with the richest structure.
const VICTIMS: [&str; 22] = [
    "form_zip.vdb",
    "form_zip_masks_half.vdb",
    "form_blosc.vdb",
    "form_blosc_small_blocks.vdb",
    "form_blosc_masks_half.vdb",
    "form_none_masks.vdb",
    "native_codes.vdb",
    "native_tiles.vdb",
    "native_instance.vdb",
    "native_transforms.vdb",
    "plain_maps.vdb",
    "version_221.vdb",
    "version_222_half.vdb",
    "stream.vdb",
    "version_218.vdb",
    "type_bool_zip_masks.vdb",
    "type_vec3d_zip_masks_half.vdb",
    "wrong_buffer_offset.vdb",
    "raw.nvdb",
    "bare.nvdb",
    "two_segments.nvdb",
    "type_vec3s_blosc.nvdb",
];

/// A small generator with a fixed seed: the same mutations in every run.
struct Random(u64);

impl Random {
    /// Uniform enough in `0..n`.
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) as usize) % n
    }

    fn word(&mut self) -> [u8; 4] {
        const EDGES: [u32; 8] = [0, 1, 0x7f, 0x7fff_ffff, 0x8000_0000, 0xffff_ffff, 0xffff_fff0, 4096];
        EDGES[self.below(EDGES.len())].to_le_bytes()
    }
}

/// Reads everything, checks that what came out is in proportion to what went in, and counts the refused grids.
fn read_all(bytes: Vec<u8>) -> Result<usize, VdbError> {
    let size = bytes.len();
    let file = VdbFile::from_bytes(bytes)?;
    let mut n_refused = 0;
    for info in file.grids() {
        assert!(metadata_bytes(&info.metadata) <= 4 * size);
        let (name, index) = (info.name.as_str(), Some(info.index));
        let read = match info.value_type {
            ValueType::Vec3s => {
                file.read_grid_as::<[f32; 3]>(name, index).map(|g| check_proportions(&g, size))
            }
            ValueType::Vec3d => {
                file.read_grid_as::<[f64; 3]>(name, index).map(|g| check_proportions(&g, size))
            }
            _ => file.read_grid(name, index).map(|grid| check_proportions(&grid, size)),
        };
        n_refused += usize::from(read.is_err());
    }
    Ok(n_refused)
}

fn metadata_bytes(metadata: &[(String, MetaValue)]) -> usize {
    let value_bytes = |value: &MetaValue| match value {
        MetaValue::String(text) => text.len(),
        MetaValue::Other { bytes, .. } => bytes.len(),
        _ => 8,
    };
    metadata.iter().map(|(key, value)| key.len() + value_bytes(value)).sum()
}

fn check_proportions<T: Value>(grid: &Grid<T>, file_bytes: usize) {
    // NanoVDB packs whole grids, at most 1032 to one.
    let packed = grid.metadata.is_empty();
    let bytes = if packed { file_bytes * 1032 } else { file_bytes };
    // A leaf takes at least a mask, a node at least two masks of one bit per tile.
    assert!(grid.leaves.len() <= bytes / 64);
    assert!(grid.tiles.len() <= bytes * 4);
    let _ = (grid.active_bounds(), grid.active_voxel_count(), grid.value([0; 3]));
}

/// Single bits, bytes and 32-bit words at edge values, half of them among the first bytes, where the lengths are.
fn mutate(bytes: &mut [u8], random: &mut Random) {
    for _ in 0..=random.below(3) {
        let range = if random.below(2) == 0 { bytes.len().min(1200) } else { bytes.len() };
        let at = random.below(range);
        match random.below(3) {
            0 => bytes[at] ^= 1 << random.below(8),
            1 => bytes[at] = random.below(256) as u8,
            _ => bytes.iter_mut().skip(at).zip(random.word()).for_each(|(byte, new)| *byte = new),
        }
    }
}

#[test]
fn mutated_files_are_errors_or_grids() {
    let mut random = Random(2013);
    let (mut n_unopened, mut n_refused, mut n_read) = (0, 0, 0);
    for name in VICTIMS {
        let original = corpus_file(name);
        // The large ones are slow to copy.
        for _ in 0..if original.len() > 100_000 { 30 } else { 300 } {
            let mut bytes = original.clone();
            mutate(&mut bytes, &mut random);
            match read_all(bytes) {
                Ok(0) => n_read += 1,
                Ok(_) => n_refused += 1,
                Err(_) => n_unopened += 1,
            }
        }
    }
    // All three must be exercised, or the mutations miss the point.
    let counts = [n_unopened, n_refused, n_read];
    assert!(counts.iter().all(|&n| n > 200), "unopened, refused, read: {counts:?}");
}

/// The header and the list of grids: every byte, every bit.
#[test]
fn every_bit_of_the_first_bytes_may_flip() {
    for name in ["form_zip_masks_half.vdb", "stream.vdb", "two_segments.nvdb", "bare.nvdb"] {
        let original = corpus_file(name);
        for at in 0..420 {
            for bit in 0..8 {
                let mut bytes = original.clone();
                bytes[at] ^= 1 << bit;
                let _ = VdbFile::from_bytes(bytes);
            }
        }
    }
}

#[test]
fn truncated_files_are_errors() {
    let mut random = Random(222);
    for name in VICTIMS {
        let original = corpus_file(name);
        let lengths = (0..60).map(|i| i * 9).chain((0..60).map(|_| random.below(original.len())));
        let lengths = lengths.filter(|&length| length < original.len());
        for length in lengths {
            // What is left of a NanoVDB file between two segments is a sound file.
            let result = read_all(original[..length].to_vec());
            assert!(result.is_err(), "{name} cut to {length} bytes: {result:?}");
        }
    }
}

#[test]
fn claimed_counts_are_refused_before_allocation() {
    let original = corpus_file("native_far.vdb");
    let file = VdbFile::from_bytes(original.clone()).expect("opens");
    assert!(file.read_grid("far", None).is_ok());
    // Background zero, no root tiles, three root children.
    let at = original.windows(12).position(|w| w == [0, 0, 0, 0, 0, 0, 0, 0, 3, 0, 0, 0]).expect("root") + 4;
    for (offset, what) in [(0, "root tiles"), (4, "root children")] {
        let mut bytes = original.clone();
        bytes[at + offset..at + offset + 4].copy_from_slice(&4_000_000_000_u32.to_le_bytes());
        let file = VdbFile::from_bytes(bytes).expect("opens");
        let error = file.read_grid("far", None).expect_err("four thousand million").to_string();
        assert!(error.contains(what), "{error}");
    }
}

/// A NanoVDB grid that says it unpacks to more than zlib can pack is refused before memory is reserved.
#[test]
fn claimed_sizes_are_refused_before_allocation() {
    let mut bytes = corpus_file("type_float_zip.nvdb");
    bytes[16..24].copy_from_slice(&(1_u64 << 45).to_le_bytes());
    let error = VdbFile::from_bytes(bytes).expect_err("32 TiB").to_string();
    assert!(error.contains("claims more bytes"), "{error}");
}

/// Found by fuzzing: bare grids of no size, four thousand million of them.
#[test]
fn bare_grids_without_bytes_are_refused() {
    let mut bytes = corpus_file("bare.nvdb");
    bytes[28..32].copy_from_slice(&u32::MAX.to_le_bytes());
    bytes[32..40].fill(0);
    let error = VdbFile::from_bytes(bytes).expect_err("no bytes").to_string();
    assert!(error.contains("smaller than its first structure"), "{error}");
}

/// Nodes that two places point to would unfold a small file into a large tree.
#[test]
fn shared_nodes_are_refused() {
    let original = corpus_file("raw.nvdb");
    let grid = 16 + 176 + 8;
    let word =
        |bytes: &[u8], at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().expect("8 bytes")) as usize;
    // Of the tree, behind the grid's 672 bytes: where the lower nodes are.
    let lower = grid + 672 + word(&original, grid + 672 + 8);
    let (children, table) = (lower + 32 + 512, lower + 32 + 1024 + 32);
    let slots: Vec<usize> =
        (0..4096).filter(|slot| original[children + slot / 8] >> (slot % 8) & 1 == 1).collect();
    assert!(slots.len() >= 2 && VdbFile::from_bytes(original.clone()).is_ok());
    let mut bytes = original.clone();
    bytes.copy_within(table + 8 * slots[0]..table + 8 * slots[0] + 8, table + 8 * slots[1]);
    let file = VdbFile::from_bytes(bytes).expect("opens");
    let error = file.read_grid("density", None).expect_err("a shared leaf").to_string();
    assert!(error.contains("overlap"), "{error}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    #[test]
    fn arbitrary_bytes_never_open_or_open_cleanly(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let _ = read_all(bytes);
    }

    /// A valid beginning followed by anything: reaches metadata, descriptors and transforms.
    #[test]
    fn arbitrary_bytes_after_a_valid_header(
        tail in prop::collection::vec(prop_oneof![Just(0_u8), Just(1), any::<u8>()], 0..400),
        keep in 58_usize..300,
    ) {
        let mut bytes = corpus_file("stream.vdb");
        bytes.truncate(keep);
        bytes.extend(tail);
        let _ = read_all(bytes);
    }
}
