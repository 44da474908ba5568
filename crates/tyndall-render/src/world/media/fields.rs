//! The fields of a volume that its material reads.

use super::super::context::BuildContext;
use super::parts::Part;
use tyndall_scene::PrimPath;
use tyndall_scene::prim;

/// Whether the volume has the fields that its extinction needs. Messages name what is missing; emission that lacks a
/// field is left out.
pub(super) fn has_all_fields(
    path: &PrimPath,
    volume: &prim::Volume,
    parts: &mut Vec<Part>,
    context: &mut BuildContext,
) -> bool {
    let extent = volume_extent(parts, volume);
    let mut is_drawn = true;
    parts.retain(|part| {
        if part.field.is_none() {
            report_constant(path, part, &extent, context);
        }
        let missing = part.fields().find(|name| field_of(volume, name).is_none());
        if let Some(name) = missing {
            report_missing(path, volume, name, part, context);
            is_drawn &= !part.has_extinction();
        }
        missing.is_none()
    });
    is_drawn
}

pub(super) fn field_of<'a>(volume: &'a prim::Volume, name: &str) -> Option<&'a PrimPath> {
    volume.fields.iter().find(|(known, _)| known == name).map(|(_, field)| field)
}

/// The field whose box holds what has no field: the first that the material reads, or the volume's first.
pub(super) fn volume_extent(parts: &[Part], volume: &prim::Volume) -> String {
    let read = parts.iter().filter_map(|part| part.field.as_ref());
    let present = |name: &&String| volume.fields.iter().any(|(known, _)| known == *name);
    read.into_iter().find(present).unwrap_or(&volume.fields[0].0).clone()
}

fn report_constant(path: &PrimPath, part: &Part, extent: &str, context: &mut BuildContext) {
    let what = if part.has_extinction() {
        "the coefficients of the volume's material read none of its fields"
    } else {
        "the emission of the volume's material is constant"
    };
    let action = format!("it fills the bounding box of the field {extent:?}; multiply it by a field");
    context.diagnostics.warn(path, what, action);
}

fn report_missing(
    path: &PrimPath,
    volume: &prim::Volume,
    name: &str,
    part: &Part,
    context: &mut BuildContext,
) {
    let known: Vec<_> = volume.fields.iter().map(|(name, _)| name.as_str()).collect();
    let what = format!("the material reads the field {name:?}; the volume has {}", known.join(", "));
    if part.has_extinction() {
        context.diagnostics.error(path, what, "the volume is not drawn; rename the field relationship");
    } else {
        context.diagnostics.warn(path, what, "that emission is left out; rename the field relationship");
    }
}
