//! Sound files with a few numbers changed: reaches the trees, whose bytes are too many for [`bytes`](../bytes.rs).
//!
//! The input's first byte chooses a file of the test corpora; every eight bytes that follow are a patch: three bytes of
//! position, one that tells how many bytes to write, and those bytes.
#![no_main]

use libfuzzer_sys::fuzz_target;

mod read_all;

macro_rules! corpus {
    ($($path:literal),* $(,)?) => {
        &[$(include_bytes!(concat!("../../tests/", $path))),*]
    };
}

/// One file per way to store a tree; of those that are packed as a whole, the unpacked ones.
const FILES: &[&[u8]] = corpus![
    "corpus/form_none_masks.vdb",
    "corpus/form_zip_masks_half.vdb",
    "corpus/form_blosc_masks.vdb",
    "corpus/form_blosc_small_blocks.vdb",
    "corpus/native_codes.vdb",
    "corpus/native_tiles.vdb",
    "corpus/native_instance.vdb",
    "corpus/native_transforms.vdb",
    "corpus/type_bool_zip_masks.vdb",
    "corpus/type_vec3d_zip_masks_half.vdb",
    "corpus/made_mask_none.vdb",
    "corpus/made_half_none.vdb",
    "corpus/version_218.vdb",
    "corpus/version_221_tiles.vdb",
    "corpus/stream_none.vdb",
    "corpus/wrong_buffer_offset.vdb",
    "corpus_nano/raw.nvdb",
    "corpus_nano/warp_float_none.nvdb",
    "corpus_nano/bare.nvdb",
    "corpus_nano/two_segments.nvdb",
    "corpus_nano/type_fpn_zip.nvdb",
    "corpus_nano/type_vec3s_blosc.nvdb",
];

fuzz_target!(|input: &[u8]| {
    let Some((choice, patches)) = input.split_first() else { return };
    let mut bytes = FILES[usize::from(*choice) % FILES.len()].to_vec();
    for patch in patches.as_chunks::<8>().0 {
        let [a, b, c, count, new @ ..] = *patch;
        let at = u32::from_le_bytes([a, b, c, 0]) as usize % bytes.len();
        bytes.iter_mut().skip(at).zip(new).take(usize::from(count % 5)).for_each(|(byte, new)| *byte = new);
    }
    read_all::read_all(bytes);
});
