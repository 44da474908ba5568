//! A whole file in memory: header, descriptors, metadata, transforms, trees.

use std::hash::Hasher;

use glam::{DAffine3, DMat3, DVec3};
use rustc_hash::{FxHashMap, FxHasher};

use super::tree::{Stored, tree_bytes};
use super::{FogGrid, WriteCompression};
use crate::VdbError;
use crate::descriptor::NAME_SEPARATOR;
use crate::grid::{Grid, GridClass};
use crate::header::{COMPRESS_ACTIVE_MASK, COMPRESS_ZIP, MAGIC};
use crate::metadata::MetaValue;

const VERSION: u32 = 224;
/// The OpenVDB version these files are like.
const LIBRARY_VERSION: [u32; 2] = [10, 0];
/// Metadata that follows from the grid and is therefore never copied.
const DERIVED: [&str; 9] = [
    "name",
    "class",
    "file_bbox_min",
    "file_bbox_max",
    "file_voxel_count",
    "file_compression",
    "file_mem_bytes",
    "file_delayed_load",
    "is_saved_as_half_float",
];

pub(super) fn file(grids: &[FogGrid<'_>], compression: WriteCompression) -> Result<Vec<u8>, VdbError> {
    let body = |grid: &FogGrid<'_>| match grid {
        FogGrid::Float(grid) => GridBytes::of(grid, compression),
        FogGrid::Vec3s(grid) => GridBytes::of(grid, compression),
    };
    let bodies = grids.iter().map(body).collect::<Result<Vec<_>, _>>()?;
    let mut out = MAGIC.to_vec();
    out.extend(VERSION.to_le_bytes());
    out.extend(LIBRARY_VERSION.iter().flat_map(|v| v.to_le_bytes()));
    out.push(1); // has grid offsets
    out.extend(uuid(&bodies).bytes());
    out.extend(0_u32.to_le_bytes()); // file metadata
    out.extend((grids.len() as u32).to_le_bytes());
    let names: Vec<&str> = grids.iter().map(FogGrid::name).collect();
    for ((name, body), grid) in unique_names(&names).iter().zip(&bodies).zip(grids) {
        put_string(&mut out, name);
        put_string(&mut out, grid.tree_type());
        put_string(&mut out, ""); // not an instance
        let start = out.len() + 3 * 8;
        let blocks = start + body.head.len() + body.topology.len();
        for offset in [start, blocks, blocks + body.buffers.len()] {
            out.extend((offset as i64).to_le_bytes());
        }
        out.extend_from_slice(&body.head);
        out.extend_from_slice(&body.topology);
        out.extend_from_slice(&body.buffers);
    }
    Ok(out)
}

struct GridBytes {
    head: Vec<u8>,
    topology: Vec<u8>,
    buffers: Vec<u8>,
}

impl GridBytes {
    fn of<T: Stored>(grid: &Grid<T>, compression: WriteCompression) -> Result<Self, VdbError> {
        if grid.name.contains(NAME_SEPARATOR) {
            let what = "its name contains the separator character U+001E".to_owned();
            return Err(VdbError::InvalidGrid { name: grid.name.clone(), what });
        }
        let flags = match compression {
            WriteCompression::None => COMPRESS_ACTIVE_MASK,
            WriteCompression::Zip => COMPRESS_ACTIVE_MASK | COMPRESS_ZIP,
        };
        let mut head = flags.to_le_bytes().to_vec();
        put_metadata(&mut head, &metadata(grid, compression));
        put_transform(&mut head, grid)?;
        let tree = tree_bytes(grid, compression)?;
        Ok(Self { head, topology: tree.topology, buffers: tree.buffers })
    }
}

/// Derived entries first, then the grid's own.
fn metadata<T: Stored>(grid: &Grid<T>, compression: WriteCompression) -> Vec<(String, MetaValue)> {
    let storage = match compression {
        WriteCompression::None => "active values",
        WriteCompression::Zip => "zip + active values",
    };
    // OpenVDB's box of a grid without active voxels: from the highest to the lowest coordinate.
    let (low, high) = grid.active_bounds().unwrap_or(([i32::MAX; 3], [i32::MIN; 3]));
    let count = i64::try_from(grid.active_voxel_count()).unwrap_or(i64::MAX);
    let class = match grid.class {
        GridClass::Staggered => "staggered",
        GridClass::LevelSet => "level set",
        GridClass::Unknown | GridClass::FogVolume => "fog volume",
    };
    let derived = [
        ("class", MetaValue::String(class.to_owned())),
        ("file_bbox_max", MetaValue::Vec3i(high)),
        ("file_bbox_min", MetaValue::Vec3i(low)),
        ("file_compression", MetaValue::String(storage.to_owned())),
        ("file_voxel_count", MetaValue::Int64(count)),
        ("is_saved_as_half_float", MetaValue::Bool(false)),
        ("name", MetaValue::String(grid.name.clone())),
    ];
    let own = grid.metadata.iter().filter(|(key, _)| !DERIVED.contains(&key.as_str())).cloned();
    derived.map(|(key, value)| (key.to_owned(), value)).into_iter().chain(own).collect()
}

fn put_metadata(out: &mut Vec<u8>, metadata: &[(String, MetaValue)]) {
    out.extend((metadata.len() as u32).to_le_bytes());
    for (key, value) in metadata {
        let (type_name, bytes) = value.to_stored();
        put_string(out, key);
        put_string(out, type_name);
        out.extend((bytes.len() as u32).to_le_bytes());
        out.extend(bytes);
    }
}

/// The simplest map type that holds the transform: some readers know only those without rotation.
fn put_transform<T>(out: &mut Vec<u8>, grid: &Grid<T>) -> Result<(), VdbError> {
    let DAffine3 { matrix3, translation } = grid.file_from_index;
    let is_usable = grid.file_from_index.is_finite() && matrix3.inverse().is_finite();
    if !is_usable || matrix3.determinant() == 0.0 {
        let what = "the transform is not finite or not invertible".to_owned();
        return Err(VdbError::InvalidGrid { name: grid.name.clone(), what });
    }
    let scale = DVec3::new(matrix3.x_axis.x, matrix3.y_axis.y, matrix3.z_axis.z);
    if matrix3 != DMat3::from_diagonal(scale) {
        put_string(out, "AffineMap");
        let rows = [(matrix3.x_axis, 0.0), (matrix3.y_axis, 0.0), (matrix3.z_axis, 0.0), (translation, 1.0)];
        rows.iter().for_each(|(row, last)| put_doubles(out, &[row.x, row.y, row.z, *last]));
        return Ok(());
    }
    let is_uniform = scale.x == scale.y && scale.x == scale.z;
    put_string(out, if is_uniform { "UniformScaleTranslateMap" } else { "ScaleTranslateMap" });
    let derived = [scale.abs(), scale.recip(), (scale * scale).recip(), (2.0 * scale).recip()];
    for vector in [translation, scale].into_iter().chain(derived) {
        put_doubles(out, &vector.to_array());
    }
    Ok(())
}

fn put_doubles(out: &mut Vec<u8>, values: &[f64]) {
    out.extend(values.iter().flat_map(|v| v.to_le_bytes()));
}

fn put_string(out: &mut Vec<u8>, text: &str) {
    out.extend((text.len() as u32).to_le_bytes());
    out.extend(text.bytes());
}

/// Names as OpenVDB makes them unique: empty and repeated ones get a separator and a number.
fn unique_names(names: &[&str]) -> Vec<String> {
    let mut totals: FxHashMap<&str, usize> = FxHashMap::default();
    names.iter().for_each(|name| *totals.entry(name).or_default() += 1);
    let mut used: FxHashMap<&str, usize> = FxHashMap::default();
    let mut unique = Vec::with_capacity(names.len());
    for &name in names {
        if !name.is_empty() && totals.get(name) == Some(&1) {
            unique.push(name.to_owned());
            continue;
        }
        let number = used.entry(name).or_default();
        unique.push(format!("{name}{NAME_SEPARATOR}{number}"));
        *number += 1;
    }
    unique
}

/// Looks like a UUID and identifies the contents.
fn uuid(bodies: &[GridBytes]) -> String {
    let mut words = [0_u64; 2];
    for (seed, word) in words.iter_mut().enumerate() {
        let mut hasher = FxHasher::default();
        hasher.write_usize(seed);
        for body in bodies {
            hasher.write(&body.head);
            hasher.write(&body.topology);
            hasher.write(&body.buffers);
        }
        *word = hasher.finish();
    }
    let hex = format!("{:016x}{:016x}", words[0], words[1]);
    format!("{}-{}-{}-{}-{}", &hex[..8], &hex[8..12], &hex[12..16], &hex[16..20], &hex[20..])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_numbered_only_where_needed() {
        assert_eq!(unique_names(&["a", "b", "a", "", "a"]), ["a\x1e0", "b", "a\x1e1", "\x1e0", "a\x1e2"]);
    }

    #[test]
    fn a_uuid_has_the_length_readers_expect() {
        assert_eq!(uuid(&[]).len(), crate::header::UUID_BYTES);
    }

    #[test]
    fn singular_transforms_are_refused() {
        for matrix in [DMat3::ZERO, DMat3::from_diagonal(DVec3::new(1.0, f64::NAN, 1.0))] {
            let grid = Grid::new("flat", 0.0, DAffine3::from_mat3(matrix));
            assert!(matches!(
                file(&[(&grid).into()], WriteCompression::None),
                Err(VdbError::InvalidGrid { .. })
            ));
        }
    }
}
