//! Files of other programs, and files nobody should have written.

use super::*;
use crate::{ExrCompression, Layer, SampleType as Stored, write_exr};
use exr::prelude::{
    AnyChannel, AnyChannels, Compression, FlatSamples, Image, ImageAttributes, LayerAttributes, LineOrder,
    WritableImage,
};
use proptest::prelude::*;
use std::fs;
use std::io::Cursor;
use std::path::PathBuf;

fn scratch() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    (folder, path)
}

fn part(
    name: &str,
    position: (i32, i32),
    size: (usize, usize),
    tiles: Option<usize>,
    channels: Vec<(&str, FlatSamples)>,
) -> exr::image::Layer<AnyChannels<FlatSamples>> {
    let blocks = tiles.map_or(exr::image::Blocks::ScanLines, |n| exr::image::Blocks::Tiles(Vec2(n, n)));
    let encoding =
        exr::image::Encoding { compression: Compression::RLE, blocks, line_order: LineOrder::Increasing };
    let attributes = LayerAttributes::named(name).with_position(Vec2(position.0, position.1));
    let list: Vec<_> = channels.into_iter().map(|(name, samples)| AnyChannel::new(name, samples)).collect();
    exr::image::Layer::new(size, attributes, encoding, AnyChannels::sort(list.into()))
}

fn save(path: &Path, window: IntegerBounds, parts: Vec<exr::image::Layer<AnyChannels<FlatSamples>>>) {
    Image::from_layers(ImageAttributes::new(window), parts).write().to_file(path).unwrap();
}

#[test]
fn many_tiled_parts_of_all_types_become_named_channels() {
    let (_folder, path) = scratch();
    let n = 37 * 21;
    let half = FlatSamples::F16((0..n).map(|i| f16::from_f32(i as f32)).collect());
    let ids = FlatSamples::U32((0..n).collect());
    let float = FlatSamples::F32((0..n).map(|i| i as f32 * 0.5).collect());
    let size = (37, 21);
    let parts = vec![
        part("rgba", (0, 0), size, Some(16), vec![("R", half)]),
        part("id", (0, 0), size, None, vec![("id.Y", ids)]),
        part("depth", (0, 0), size, Some(8), vec![("Z", float)]),
    ];
    save(&path, IntegerBounds::from_dimensions(size), parts);
    let image = read_exr(&path).unwrap();
    let names: Vec<_> = image.channels.iter().map(|(n, _)| n.as_str()).collect();
    assert_eq!(names, ["R", "id.Y", "depth.Z"]);
    for i in 0..n as usize {
        assert_eq!(image.channels[0].1[i], i as f32);
        assert_eq!(image.channels[1].1[i], i as f32);
        assert_eq!(image.channels[2].1[i], i as f32 * 0.5);
    }
}

#[test]
fn overscan_is_dropped_and_missing_pixels_are_zero() {
    let (_folder, path) = scratch();
    // The data window (2, -1) + 4 x 3 overlaps the display window (1, 0) + 3 x 4 in x 2..4, y 0..2.
    let data = FlatSamples::F32((1..=12).map(|i| i as f32).collect());
    let window = IntegerBounds::new(Vec2(1, 0), Vec2(3, 4));
    save(&path, window, vec![part("a", (2, -1), (4, 3), None, vec![("Y", data)])]);
    let image = read_exr(&path).unwrap();
    assert_eq!((image.width, image.height), (3, 4));
    assert_eq!(image.channel("Y").unwrap(), [0., 5., 6., 0., 9., 10., 0., 0., 0., 0., 0., 0.]);
}

#[test]
fn missing_and_foreign_files_are_errors() {
    let (folder, path) = scratch();
    assert!(matches!(read_exr(&path), Err(IoError::Read { .. })));
    assert!(matches!(read_exr(folder.path()), Err(IoError::Read { .. } | IoError::Damaged { .. })));
    for content in [&b""[..], b"not an exr file at all, but long enough to have a header"] {
        fs::write(&path, content).unwrap();
        let error = read_exr(&path).unwrap_err();
        assert!(matches!(error, IoError::Damaged { .. }) && error.to_string().contains("a.exr"), "{error}");
    }
}

fn sample_file(compression: ExrCompression) -> Vec<u8> {
    let (_folder, path) = scratch();
    let data = (0..24 * 20 * 4).map(|i| (i as f32).sin()).collect();
    let layers =
        [Layer::new("", "RGBA", data, Stored::Half), Layer::new("id", "Y", vec![3.0; 24 * 20], Stored::Uint)];
    write_exr(&path, 24, 20, 1.0, &layers, &[], compression).unwrap();
    fs::read(&path).unwrap()
}

fn decode(bytes: &[u8]) -> Result<ExrImage, IoError> {
    let path = Path::new("mutated.exr");
    guard_decoder(path, || read_from(path, Cursor::new(bytes), bytes.len() as u64))
}

#[test]
fn every_truncation_is_an_error() {
    for compression in [ExrCompression::None, ExrCompression::Zip, ExrCompression::Piz] {
        let bytes = sample_file(compression);
        for len in (0..bytes.len()).step_by(7) {
            assert!(decode(&bytes[..len]).is_err(), "{compression:?} cut at {len} of {}", bytes.len());
        }
    }
}

/// Where the offset table is: it ends where the first chunk begins.
fn table_of(bytes: &[u8], chunks: usize) -> std::ops::Range<usize> {
    let place = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
    let start = (0..bytes.len() - 8).find(|&at| place(at) == (at + 8 * chunks) as u64).unwrap();
    start..start + 8 * chunks
}

#[test]
fn without_an_offset_table_chunks_are_read_as_they_come() {
    let (_folder, path) = scratch();
    let n = 37 * 21;
    for (tiles, chunks) in [(None, 21), (Some(16), 3 * 2)] {
        let half = FlatSamples::F16((0..n).map(|i| f16::from_f32(i as f32)).collect());
        let layer = part("rgba", (0, 0), (37, 21), tiles, vec![("R", half)]);
        save(&path, IntegerBounds::from_dimensions((37, 21)), vec![layer]);
        let whole = fs::read(&path).unwrap();
        let table = table_of(&whole, chunks);
        let mut emptied = whole.clone();
        emptied[table.clone()].fill(0);
        assert_ne!(emptied, whole);
        assert_eq!(decode(&emptied).unwrap(), decode(&whole).unwrap());
        for len in (0..emptied.len()).step_by(7) {
            assert!(decode(&emptied[..len]).is_err(), "{tiles:?} cut at {len} of {}", emptied.len());
        }
        // A table that was written and is damaged says that the rest may be, too.
        let mut half_empty = whole;
        half_empty[table.start..table.end - 8].fill(0);
        assert!(matches!(decode(&half_empty), Err(IoError::Damaged { .. })), "{tiles:?}");
    }
}

#[test]
fn a_header_announcing_terabytes_is_refused() {
    let bytes = sample_file(ExrCompression::Zip);
    let mut hostile = bytes.clone();
    for name in ["dataWindow\0box2i\0", "displayWindow\0box2i\0"] {
        let at = bytes.windows(name.len()).position(|w| w == name.as_bytes()).unwrap() + name.len() + 4;
        hostile[at + 8..at + 12].copy_from_slice(&1_000_000i32.to_le_bytes());
        hostile[at + 12..at + 16].copy_from_slice(&1_000_000i32.to_le_bytes());
        let error = decode(&hostile).unwrap_err();
        assert!(matches!(error, IoError::TooLarge { .. } | IoError::Damaged { .. }), "{error}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]
    #[test]
    fn mutated_files_never_panic(
        kind in 0usize..4,
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
        in_header in any::<bool>(),
    ) {
        use ExrCompression::{None, Piz, Zip, Zips};
        let mut bytes = sample_file([None, Zips, Zip, Piz][kind]);
        let len = if in_header { 400.min(bytes.len()) } else { bytes.len() };
        for (index, value) in edits {
            bytes[index.index(len)] = value;
        }
        // Either outcome is right; a panic or an abort is not.
        if let Ok(image) = decode(&bytes) {
            prop_assert!(image.channels.iter().all(|(_, c)| c.len() == image.width * image.height));
        }
    }
}
