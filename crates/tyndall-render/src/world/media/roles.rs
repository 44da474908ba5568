//! Which of a part's fields is the density and which the colour: their files say.

use super::super::context::BuildContext;
use super::super::grids;
use super::field_of;
use super::parts::{Part, PartTint};
use tyndall_math::Rgb;
use tyndall_scene::PrimPath;
use tyndall_scene::prim::Volume;
use tyndall_volume::Emission;

/// Makes fields of numbers densities and fields of colours tints. Parts of two fields of colours are left out, with a
/// message.
pub(super) fn assign(path: &PrimPath, volume: &Volume, parts: &mut Vec<Part>, context: &mut BuildContext) {
    let is_color = |name: &str, context: &BuildContext| {
        field_of(volume, name).is_some_and(|field| grids::holds_colors(field, context))
    };
    parts.retain_mut(|part| {
        let Some(density) = part.field.clone().filter(|name| is_color(name, context)) else { return true };
        let Some(tint) = &mut part.tint else {
            stand_for_both(path, part, density, context);
            return true;
        };
        if part.medium.coefficients().is_zero()
            && part.medium.emission.is_dark()
            && !is_color(&tint.field, context)
        {
            part.field = Some(std::mem::replace(&mut tint.field, density));
            return true;
        }
        let what = format!(
            "the fields {density:?} and {:?} are multiplied, and the first holds colours",
            tint.field
        );
        context.diagnostics.error(
            path,
            what,
            "that part of the volume is left out; multiply colours by numbers",
        );
        false
    });
}

/// Colours alone: their largest component is the density, and they are relative to it.
fn stand_for_both(path: &PrimPath, part: &mut Part, field: String, context: &mut BuildContext) {
    let mut glow = Rgb::ZERO;
    match part.medium.emission {
        Emission::Glow(color) => {
            glow = color;
            part.medium.emission = Emission::NONE;
        }
        Emission::Blackbody { .. } => {
            let what = format!("the field {field:?} of vectors is used as a temperature");
            context.diagnostics.warn(path, what, "the largest component is used");
        }
    }
    let (sigma_a, sigma_s) = (part.medium.sigma_a, part.medium.sigma_s);
    (part.medium.sigma_a, part.medium.sigma_s) = (Rgb::ZERO, Rgb::ZERO);
    part.tint = Some(PartTint { field, is_relative: true, sigma_a, sigma_s, glow });
}
