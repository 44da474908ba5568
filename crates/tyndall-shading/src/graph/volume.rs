//! Media: `volume` nodes whose coefficients are constants, times a field, times a second field of colours; or, if they are
//! anything else, a program.

mod coefficients;
mod phase;
mod program;
mod terms;

pub use coefficients::VolumeTint;
pub use phase::PhaseModel;
pub use program::{PointCoefficients, VolumeProgram};
pub use terms::{EmissionSource, EmissionTerm};

use super::compiler::reachable;
use crate::KindSpec;
use crate::kind::{POSITIVE, ParamSpec, UNIT};
use coefficients::Coefficients;
use std::sync::Arc;
use terms::{Scale, Term, Terms, VolumeCompiler};
use tyndall_math::Rgb;
use tyndall_scene::prim::Material;
use tyndall_scene::{AssetLoader, Diagnostics, PrimPath};

const COSINE: [f32; 2] = [-1.0, 1.0];

pub(super) const KIND: KindSpec = KindSpec {
    name: "volume",
    doc: "A medium: coefficients are constants, times a field, times a second field (colours).",
    params: &[
        ParamSpec::vector(
            "absorption",
            [0.0; 3],
            POSITIVE,
            "1 / stage unit",
            "sigma_a; times density and colour if fields.",
        ),
        ParamSpec::vector(
            "scattering",
            [0.0; 3],
            POSITIVE,
            "1 / stage unit",
            "sigma_s; times density and colour if fields.",
        ),
        ParamSpec::text("phase", phase::LOBES, phase::CHOICES, "Where scattered light goes."),
        ParamSpec::float("anisotropy", 0.0, COSINE, "", "Mean cosine g; positive is forward."),
        ParamSpec::float("anisotropy2", 0.0, COSINE, "", "Mean cosine of the second lobe."),
        ParamSpec::float("lobeMix", 0.0, UNIT, "", "Part of the light in the second lobe."),
        ParamSpec::float("alpha", 1.0, [0.0, 1e6], "", "Of Draine's phase function: strength of cos^2."),
        ParamSpec::float(
            "dropletDiameter",
            20.0,
            [0.0, 50.0],
            "µm",
            "Of water droplets; fog and cloud have 5 to 50.",
        ),
        ParamSpec::vector(
            "emission",
            [0.0; 3],
            POSITIVE,
            "radiance / stage unit",
            "Emitted radiance per length; each part may have a field of its own.",
        ),
        ParamSpec::float(
            "temperature",
            0.0,
            POSITIVE,
            "K",
            "Of a black body; times a field that may have values of its own.",
        ),
        ParamSpec::vector(
            "blackbodyIntensity",
            [1.0; 3],
            POSITIVE,
            "1 / stage unit",
            "Radiance per length over 1e-6 sigma T^4 / pi (Stefan-Boltzmann) times the colour of T, of luminance 1.",
        ),
    ],
};

/// What a medium does.
#[derive(Debug, Clone, PartialEq)]
pub struct VolumeMaterial {
    /// Absorption coefficient, where the density is 1.
    pub sigma_a: Rgb,
    /// Scattering coefficient, where the density is 1.
    pub sigma_s: Rgb,
    /// The field that scales both coefficients; `None` is 1 everywhere.
    pub density_field: Option<String>,
    /// What a second field adds, which may hold colours.
    pub tint: Option<VolumeTint>,
    /// Where scattered light goes.
    pub phase: PhaseModel,
    /// Emitted radiance per length, to be added up.
    pub emission: Vec<EmissionTerm>,
    /// What gives coefficients and emission instead of all of the above, if they vary in another way than with fields.
    pub program: Option<Arc<VolumeProgram>>,
}

impl VolumeMaterial {
    fn of_program(program: Arc<VolumeProgram>, phase: PhaseModel) -> Self {
        Self {
            sigma_a: Rgb::ZERO,
            sigma_s: Rgb::ZERO,
            density_field: None,
            tint: None,
            phase,
            emission: Vec::new(),
            program: Some(program),
        }
    }

    /// Some coefficient or emission reads a field.
    pub fn reads_fields(&self) -> bool {
        self.density_field.is_some() || self.emission.iter().any(|term| term.field().is_some())
    }
}

/// The medium of node `index`; `None`, after a diagnostic, if it is none.
pub(super) fn compile(
    path: &PrimPath,
    material: &Material,
    index: usize,
    assets: &dyn AssetLoader,
    diags: &mut Diagnostics,
) -> Option<VolumeMaterial> {
    let kind = &material.nodes[index].kind;
    if kind != KIND.name {
        let what = format!("node {index} ({kind}) cannot be a volume");
        diags.warn(path, what, "the medium was left out; connect a volume node");
        return None;
    }
    if program::is_needed(material, index) {
        let program = Arc::new(VolumeProgram::compile(path, material, index, assets, diags));
        let mut compiler = VolumeCompiler::new(path, material, assets, diags);
        return Some(VolumeMaterial::of_program(program, compiler.phase(index)));
    }
    let mut compiler = VolumeCompiler::new(path, material, assets, diags);
    for node in reachable(material, index) {
        if node != index {
            compiler.compile_node(node);
        }
    }
    Some(compiler.volume(index))
}

impl VolumeCompiler<'_> {
    fn volume(&mut self, index: usize) -> VolumeMaterial {
        self.report_unknown(index, &KIND);
        let Coefficients { sigma_a, sigma_s, density_field, tint } = self.coefficients(index);
        let phase = self.phase(index);
        let emission = self.emission(index);
        VolumeMaterial { sigma_a, sigma_s, density_field, tint, phase, emission, program: None }
    }

    /// The `emission` input and the black body.
    fn emission(&mut self, index: usize) -> Vec<EmissionTerm> {
        let mut terms = self.input(index, "emission");
        terms.extend(self.black_body(index));
        let mut emission = Vec::new();
        for Term { factor, scale } in terms.0 {
            let color = self.non_negative(index, "emission", factor);
            if color != Rgb::ZERO {
                emission.push(EmissionTerm { color, source: scale.into() });
            }
        }
        emission
    }

    /// `temperature` and `blackbodyIntensity`.
    fn black_body(&mut self, index: usize) -> Terms {
        let Term { factor: [kelvin, ..], scale } = self.single(index, "temperature");
        let kelvin = self.non_negative(index, "temperature", [kelvin; 3]).x;
        if kelvin == 0.0 {
            if self.is_authored(index, "blackbodyIntensity") && !self.is_authored(index, "temperature") {
                let what = format!("node {index} (volume): blackbodyIntensity without a temperature");
                self.warn(what, "nothing glows; set temperature");
            }
            return Terms::default();
        }
        let intensity = if self.is_authored(index, "blackbodyIntensity") {
            self.constant(index, "blackbodyIntensity")
        } else {
            [1.0; 3]
        };
        let field = if let Scale::Field(field) = scale { Some(field) } else { None };
        Terms(vec![Term { factor: intensity, scale: Scale::Blackbody { kelvin, field } }])
    }

    fn non_negative(&mut self, index: usize, name: &str, factor: [f32; 3]) -> Rgb {
        let clean = factor.map(|x| if x.is_finite() { x.max(0.0) } else { 0.0 });
        if clean != factor {
            let what = format!("node {index} (volume), input {name}: {factor:?} is negative or not finite");
            self.warn(what, "such channels were set to 0 (an albedo outside [0, 1] looks like this)");
        }
        Rgb::from_array(clean)
    }
}
