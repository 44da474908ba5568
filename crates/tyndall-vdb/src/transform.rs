//! A grid's map from index space (voxel centres at integers) to the file's world space.
//!
//! OpenVDB multiplies row vectors from the left (`p M`), so the rows of a stored matrix are the columns of the
//! matrix used here. All linear map types are read into one affine transform.

use glam::{DAffine3, DMat3, DVec3};

use crate::VdbError;
use crate::cursor::Cursor;
use crate::header::{VERSION_FLOAT_FRUSTUM, VERSION_MAPS};

/// What a grid's transform turned out to be.
#[derive(Debug, Clone)]
pub(crate) enum Transform {
    /// `file_from_index`; finite, not necessarily invertible.
    Linear(DAffine3),
    /// A camera frustum, skipped.
    Frustum,
    /// An unknown type; where it ends is unknown too.
    Unknown(String),
}

/// Reads type name and map.
pub(crate) fn read_transform(cursor: &mut Cursor<'_>, version: u32) -> Result<Transform, VdbError> {
    let kind = cursor.string("transform type")?;
    if version < VERSION_MAPS {
        return match kind.as_str() {
            "LinearTransform" => read_legacy(cursor).map(Transform::Linear),
            _ => Ok(Transform::Unknown(kind)),
        };
    }
    if kind == "NonlinearFrustumMap" {
        return skip_frustum(cursor, version);
    }
    Ok(read_linear(cursor, &kind)?.map_or(Transform::Unknown(kind), Transform::Linear))
}

/// A linear map of type `kind`, `None` if there is no such type. Derived values that follow (inverse, voxel
/// size...) are skipped: they carry no information.
fn read_linear(cursor: &mut Cursor<'_>, kind: &str) -> Result<Option<DAffine3>, VdbError> {
    let start = cursor.offset();
    let map = match kind {
        "AffineMap" | "UnitaryMap" => read_matrix(cursor)?,
        "ScaleMap" | "UniformScaleMap" => DAffine3::from_scale(read_scale(cursor)?),
        "TranslationMap" => DAffine3::from_translation(read_vector(cursor)?),
        "ScaleTranslateMap" | "UniformScaleTranslateMap" => {
            let translation = read_vector(cursor)?;
            DAffine3::from_mat3_translation(DMat3::from_diagonal(read_scale(cursor)?), translation)
        }
        _ => return Ok(None),
    };
    if !map.is_finite() {
        return Err(VdbError::corrupt(start, "the grid's transform is not finite"));
    }
    Ok(Some(map))
}

fn read_vector(cursor: &mut Cursor<'_>) -> Result<DVec3, VdbError> {
    Ok(DVec3::new(cursor.f64("transform")?, cursor.f64("transform")?, cursor.f64("transform")?))
}

/// Scale, then voxel size, 1/scale, 1/scale² and 1/(2 scale).
fn read_scale(cursor: &mut Cursor<'_>) -> Result<DVec3, VdbError> {
    let scale = read_vector(cursor)?;
    cursor.take(4 * 24, "transform")?;
    Ok(scale)
}

/// Sixteen doubles; the fourth row is the translation and the fourth column must be that of an affine map.
fn read_matrix(cursor: &mut Cursor<'_>) -> Result<DAffine3, VdbError> {
    let start = cursor.offset();
    let mut rows = [DVec3::ZERO; 4];
    let mut last_column = [0.0; 4];
    for (row, last) in rows.iter_mut().zip(&mut last_column) {
        *row = read_vector(cursor)?;
        *last = cursor.f64("transform")?;
    }
    if last_column != [0.0, 0.0, 0.0, 1.0] {
        return Err(VdbError::corrupt(start, "the grid's transform matrix is not affine"));
    }
    Ok(DAffine3::from_mat3_translation(DMat3::from_cols(rows[0], rows[1], rows[2]), rows[3]))
}

/// Version 218: index box, then local-to-world, its inverse, voxel-to-local, its inverse.
fn read_legacy(cursor: &mut Cursor<'_>) -> Result<DAffine3, VdbError> {
    cursor.take(24, "transform")?;
    let world_from_local = read_matrix(cursor)?;
    read_matrix(cursor)?;
    let local_from_index = read_matrix(cursor)?;
    read_matrix(cursor)?;
    Ok(world_from_local * local_from_index)
}

/// Box, taper, depth and a linear map: read to find the tree behind it in stream files.
fn skip_frustum(cursor: &mut Cursor<'_>, version: u32) -> Result<Transform, VdbError> {
    cursor.take(if version < VERSION_FLOAT_FRUSTUM { 24 } else { 48 }, "frustum box")?;
    cursor.take(16, "frustum taper and depth")?;
    let kind = cursor.string("frustum map type")?;
    Ok(match read_linear(cursor, &kind)? {
        Some(_) => Transform::Frustum,
        None => Transform::Unknown(kind),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stored(kind: &str, numbers: &[f64]) -> Vec<u8> {
        let mut bytes = (kind.len() as u32).to_le_bytes().to_vec();
        bytes.extend(kind.bytes());
        bytes.extend(numbers.iter().flat_map(|v| v.to_le_bytes()));
        bytes
    }

    fn linear(kind: &str, numbers: &[f64]) -> Option<DAffine3> {
        let bytes = stored(kind, numbers);
        let mut cursor = Cursor::new(&bytes, 0);
        let Ok(Transform::Linear(map)) = read_transform(&mut cursor, 224) else { return None };
        assert_eq!(cursor.remaining(), 0, "{kind} has another length");
        Some(map)
    }

    #[test]
    fn each_linear_map_moves_a_point_as_openvdb_does() {
        let point = DVec3::new(1.0, 2.0, 3.0);
        let zeros = [0.0; 12];
        let scale = [&[2.0, 3.0, 4.0], &zeros[..]].concat();
        let translate_scale = [&[10.0, 20.0, 30.0], &scale[..]].concat();
        #[rustfmt::skip]
        let matrix = [0.0, 1.0, 0.0, 0.0,  -1.0, 0.0, 0.0, 0.0,  0.0, 0.0, 1.0, 0.0,  5.0, 6.0, 7.0, 1.0];
        let cases = [
            ("ScaleMap", &scale[..], DVec3::new(2.0, 6.0, 12.0)),
            ("UniformScaleMap", &scale, DVec3::new(2.0, 6.0, 12.0)),
            ("TranslationMap", &[1.0, 1.0, 1.0], DVec3::new(2.0, 3.0, 4.0)),
            ("ScaleTranslateMap", &translate_scale, DVec3::new(12.0, 26.0, 42.0)),
            ("UniformScaleTranslateMap", &translate_scale, DVec3::new(12.0, 26.0, 42.0)),
            ("AffineMap", &matrix, DVec3::new(3.0, 7.0, 10.0)),
            ("UnitaryMap", &matrix, DVec3::new(3.0, 7.0, 10.0)),
        ];
        for (kind, numbers, expected) in cases {
            assert_eq!(
                linear(kind, numbers).map(|map| map.transform_point3(point)),
                Some(expected),
                "{kind}"
            );
        }
    }

    #[test]
    fn matrices_that_are_not_affine_or_not_finite_are_refused() {
        assert!(linear("AffineMap", &[1.0; 16]).is_none());
        assert!(linear("TranslationMap", &[f64::NAN, 0.0, 0.0]).is_none());
    }

    #[test]
    fn version_218_concatenates_two_matrices() {
        let matrix = |scale: f64, shift: f64| {
            let affine = DAffine3::from_mat3_translation(
                DMat3::from_diagonal(DVec3::splat(scale)),
                DVec3::splat(shift),
            );
            let rows =
                [affine.matrix3.x_axis, affine.matrix3.y_axis, affine.matrix3.z_axis, affine.translation];
            rows.iter().enumerate().flat_map(|(i, r)| [r.x, r.y, r.z, f64::from(i == 3)]).collect::<Vec<_>>()
        };
        let numbers =
            [vec![0.0; 3], matrix(2.0, 1.0), matrix(1.0, 0.0), matrix(0.5, 3.0), matrix(1.0, 0.0)].concat();
        let bytes = stored("LinearTransform", &numbers);
        let Ok(Transform::Linear(map)) = read_transform(&mut Cursor::new(&bytes, 0), 218) else {
            panic!("not read")
        };
        assert_eq!(map.transform_point3(DVec3::ONE), DVec3::splat((0.5 + 3.0) * 2.0 + 1.0));
    }
}
