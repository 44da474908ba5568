//! A volume material as media: one for extinction, and one for each field that shines by itself.
//!
//! Media add, so fire from a grid of its own is a medium of its own in the same volume: it has its own box, its own
//! voxels and its own bounds, and smoke is tracked as if there were no fire.

use tyndall_math::{Rgb, blackbody_radiance};
use tyndall_shading::{EmissionSource, PhaseModel, VolumeMaterial};
use tyndall_volume::phase::{Draine, Rayleigh};
use tyndall_volume::{Emission, Medium, Phase, PhaseMix};

/// A medium still without its grids.
pub(super) struct Part {
    /// The field that is its density; `None` is 1 everywhere.
    pub(super) field: Option<String>,
    pub(super) medium: Medium,
    /// What a second field adds; only where there is a first.
    pub(super) tint: Option<PartTint>,
}

/// A tint still without its grid.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct PartTint {
    pub(super) field: String,
    /// The density is the largest component of the same field.
    pub(super) is_relative: bool,
    pub(super) sigma_a: Rgb,
    pub(super) sigma_s: Rgb,
    pub(super) glow: Rgb,
}

impl Part {
    /// Something is in the way of light, not only shining.
    pub(super) fn has_extinction(&self) -> bool {
        let is_tint = |tint: &PartTint| tint.sigma_a != Rgb::ZERO || tint.sigma_s != Rgb::ZERO;
        !self.medium.coefficients().is_zero() || self.tint.as_ref().is_some_and(is_tint)
    }

    /// The names of the fields it reads.
    pub(super) fn fields(&self) -> impl Iterator<Item = &String> {
        self.field.iter().chain(self.tint.iter().map(|tint| &tint.field))
    }

    fn shining(field: Option<String>, emission: Emission) -> Self {
        let medium = Medium {
            sigma_a: Rgb::ZERO,
            sigma_s: Rgb::ZERO,
            emission,
            phase: PhaseMix::from(Phase::henyey_greenstein(0.0)),
            density: None,
            tint: None,
        };
        Self { field, medium, tint: None }
    }
}

/// The media of `material`. Without extinction and emission there are none.
pub(super) fn parts(material: &VolumeMaterial) -> Vec<Part> {
    let mut parts = Vec::new();
    let tint = material.tint.as_ref().map(|tint| PartTint {
        field: tint.field.clone(),
        is_relative: false,
        sigma_a: tint.sigma_a,
        sigma_s: tint.sigma_s,
        glow: Rgb::ZERO,
    });
    let extinction = Part { field: material.density_field.clone(), medium: dark(material), tint };
    if extinction.has_extinction() {
        parts.push(extinction);
    }
    for term in &material.emission {
        let (field, emission) = match &term.source {
            EmissionSource::Constant => (None, Emission::Glow(term.color)),
            EmissionSource::Field(field) => (Some(field.clone()), Emission::Glow(term.color)),
            EmissionSource::Product(a, b) => {
                add_tinted_emission(&mut parts, [a, b], term.color);
                continue;
            }
            EmissionSource::Blackbody { kelvin, field: None } => {
                (None, Emission::Glow(term.color * blackbody_radiance(*kelvin)))
            }
            EmissionSource::Blackbody { kelvin, field } => {
                (field.clone(), Emission::Blackbody { kelvin: *kelvin, intensity: term.color })
            }
        };
        add_emission(&mut parts, field, emission);
    }
    parts
}

/// Adds emission to the part with its field, if that can hold it.
fn add_emission(parts: &mut Vec<Part>, field: Option<String>, emission: Emission) {
    for part in parts.iter_mut().filter(|part| part.field == field) {
        if let (Emission::Glow(known), Emission::Glow(color)) = (&mut part.medium.emission, emission) {
            *known += color;
            return;
        }
        if part.medium.emission.is_dark() {
            part.medium.emission = emission;
            return;
        }
    }
    parts.push(Part::shining(field, emission));
}

/// Adds emission by the product of two fields to the part that has both, or else to one of its own.
fn add_tinted_emission(parts: &mut Vec<Part>, [a, b]: [&String; 2], glow: Rgb) {
    let has = |part: &&mut Part, density: &String, color: &String| {
        part.field.as_ref() == Some(density) && part.tint.as_ref().is_some_and(|tint| tint.field == *color)
    };
    if let Some(part) = parts.iter_mut().find(|part| has(part, a, b) || has(part, b, a))
        && let Some(tint) = &mut part.tint
    {
        tint.glow += glow;
        return;
    }
    let mut part = Part::shining(Some(a.clone()), Emission::NONE);
    let (field, sigma_a, sigma_s) = (b.clone(), Rgb::ZERO, Rgb::ZERO);
    part.tint = Some(PartTint { field, is_relative: false, sigma_a, sigma_s, glow });
    parts.push(part);
}

/// All of `material` where every field is 1.
pub(super) fn homogeneous(material: &VolumeMaterial) -> Medium {
    let parts = parts(material);
    let tints = || parts.iter().filter_map(|part| part.tint.as_ref());
    let glow: Rgb = parts.iter().map(|part| part.medium.emission.at(1.0)).sum();
    let dark = dark(material);
    Medium {
        sigma_a: dark.sigma_a + tints().map(|tint| tint.sigma_a).sum::<Rgb>(),
        sigma_s: dark.sigma_s + tints().map(|tint| tint.sigma_s).sum::<Rgb>(),
        emission: Emission::Glow(glow + tints().map(|tint| tint.glow).sum::<Rgb>()),
        ..dark
    }
}

/// The medium without its emission.
fn dark(material: &VolumeMaterial) -> Medium {
    Medium {
        sigma_a: material.sigma_a,
        sigma_s: material.sigma_s,
        emission: Emission::NONE,
        phase: phase(material.phase),
        density: None,
        tint: None,
    }
}

pub(super) fn phase(model: PhaseModel) -> PhaseMix {
    match model {
        PhaseModel::Lobes { g, g2, mix } => PhaseMix::two_lobes(g, g2, mix),
        PhaseModel::Rayleigh => Phase::from(Rayleigh).into(),
        PhaseModel::Draine { g, alpha } => Phase::from(Draine { g, alpha }).into(),
        PhaseModel::Droplets { diameter } => PhaseMix::droplets(diameter),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tyndall_shading::EmissionTerm;

    fn material(density: Option<&str>, emission: Vec<EmissionTerm>) -> VolumeMaterial {
        VolumeMaterial {
            sigma_a: Rgb::splat(0.5),
            sigma_s: Rgb::ONE,
            density_field: density.map(str::to_owned),
            tint: None,
            phase: PhaseModel::lobe(0.5),
            emission,
            program: None,
        }
    }

    fn field(name: &str) -> EmissionSource {
        EmissionSource::Field(name.to_owned())
    }

    fn hot(name: Option<&str>) -> EmissionSource {
        EmissionSource::Blackbody { kelvin: 1500.0, field: name.map(str::to_owned) }
    }

    fn term(source: EmissionSource) -> EmissionTerm {
        EmissionTerm { color: Rgb::ONE, source }
    }

    #[test]
    fn what_glows_by_the_density_stays_one_medium() {
        let parts = parts(&material(Some("density"), vec![term(field("density"))]));
        assert_eq!(parts.len(), 1);
        assert_eq!(parts[0].medium.emission, Emission::Glow(Rgb::ONE));
        assert_eq!(parts[0].medium.phase, PhaseMix::single(Phase::henyey_greenstein(0.5)));
    }

    #[test]
    fn every_other_field_is_a_medium_of_its_own() {
        let emission = vec![
            term(field("fire")),
            term(hot(Some("fire"))),
            term(hot(Some("density"))),
            term(EmissionSource::Constant),
            term(hot(None)),
        ];
        let parts = parts(&material(Some("density"), emission));
        let fields: Vec<_> = parts.iter().map(|part| part.field.as_deref()).collect();
        // The density's black body fits into the first.
        assert_eq!(fields, [Some("density"), Some("fire"), Some("fire"), None]);
        assert!(parts[0].has_extinction() && parts[1..].iter().all(|part| !part.has_extinction()));
        let both = Emission::Glow(Rgb::ONE + blackbody_radiance(1500.0));
        assert_eq!(parts[3].medium.emission, both);
    }

    #[test]
    fn where_fields_are_one_everything_adds_up() {
        let medium =
            homogeneous(&material(None, vec![term(field("fire")), term(hot(Some("t"))), term(hot(None))]));
        let expected = Rgb::ONE + 2.0 * blackbody_radiance(1500.0);
        assert!(medium.emission.at(1.0).abs_diff_eq(expected, 1e-6));
    }
}
