//! UsdPreviewSurface; semantics in [`crate::material::PreviewSurface`].

use super::{ClosureNode, LeafClosure};
use crate::KindSpec;
use crate::graph::compiled::{SurfaceShading, non_negative};
use crate::graph::compiler::Leaf;
use crate::graph::inputs::Inputs;
use crate::graph::{Operand, Value};
use crate::kind::{ANY, POSITIVE, ParamSpec, UNIT};
use crate::material::{OpacityMode, PreviewParams};
use glam::Vec3A;
use tyndall_math::Rgb;

#[derive(Debug, Clone, Copy)]
pub(in crate::graph) struct PreviewSurface {
    diffuse_color: Operand,
    emissive_color: Operand,
    use_specular_workflow: bool,
    specular_color: Operand,
    metallic: Operand,
    roughness: Operand,
    clearcoat: Operand,
    clearcoat_roughness: Operand,
    opacity: Operand,
    opacity_mode: OpacityMode,
    opacity_threshold: f32,
    ior: Operand,
    /// `None` for the shading normal itself.
    normal: Option<Operand>,
}

impl ClosureNode for PreviewSurface {
    const KIND: KindSpec = KindSpec {
        name: "preview_surface",
        doc: "UsdPreviewSurface: diffuse or metal base, specular lobe, clear coat, opacity, emission.",
        params: &[
            ParamSpec::vector(
                "diffuseColor",
                [0.18; 3],
                UNIT,
                "",
                "Diffuse albedo; with metallic also the metal's colour.",
            ),
            ParamSpec::vector("emissiveColor", [0.0; 3], POSITIVE, "radiance", "Emitted radiance."),
            ParamSpec::float("useSpecularWorkflow", 0.0, UNIT, "", "1: specularColor instead of metallic."),
            ParamSpec::vector("specularColor", [0.0; 3], UNIT, "", "Reflectance at normal incidence."),
            ParamSpec::float("metallic", 0.0, UNIT, "", "1 for metal."),
            ParamSpec::float("roughness", 0.5, UNIT, "", "Of the specular lobe; GGX alpha is its square."),
            ParamSpec::float("clearcoat", 0.0, UNIT, "", "Amount of the white second lobe."),
            ParamSpec::float("clearcoatRoughness", 0.01, UNIT, "", "Its roughness."),
            ParamSpec::float("opacity", 1.0, UNIT, "", "1 is opaque; fixed at 0 is glass of index ior."),
            ParamSpec::text("opacityMode", "transparent", "transparent|presence", "Whether highlights stay."),
            ParamSpec::float(
                "opacityThreshold",
                0.0,
                UNIT,
                "",
                "Above 0: lower opacities are holes, others opaque.",
            ),
            ParamSpec::float("ior", 1.5, [0.0, 100.0], "", "Refractive index."),
            ParamSpec::vector("normal", [0.0, 0.0, 1.0], ANY, "", "Tangent-space normal."),
            ParamSpec::float("displacement", 0.0, ANY, "stage units", "Not supported yet."),
            ParamSpec::float("occlusion", 1.0, UNIT, "", "Ignored: the renderer computes occlusion."),
        ],
    };

    fn build(inputs: &mut Inputs) -> Vec<Leaf> {
        if inputs.operand("displacement") != Operand::ZERO {
            inputs.warn("displacement", "is not supported", "it was ignored");
        }
        let normal = inputs.operand("normal");
        let leaf = Self {
            diffuse_color: inputs.operand("diffuseColor"),
            emissive_color: inputs.operand("emissiveColor"),
            use_specular_workflow: inputs.constant("useSpecularWorkflow")[0] >= 0.5,
            specular_color: inputs.operand("specularColor"),
            metallic: inputs.operand("metallic"),
            roughness: inputs.operand("roughness"),
            clearcoat: inputs.operand("clearcoat"),
            clearcoat_roughness: inputs.operand("clearcoatRoughness"),
            opacity: inputs.operand("opacity"),
            opacity_mode: match inputs.choice("opacityMode") {
                "presence" => OpacityMode::Presence,
                _ => OpacityMode::Transparent,
            },
            opacity_threshold: inputs.constant("opacityThreshold")[0],
            ior: inputs.operand("ior"),
            normal: (normal != Operand::Constant([0.0, 0.0, 1.0, 1.0])).then_some(normal),
        };
        vec![leaf.into()]
    }
}

impl PreviewSurface {
    fn params(&self, registers: &[Value]) -> PreviewParams {
        PreviewParams {
            diffuse_color: self.diffuse_color.vector(registers),
            use_specular_workflow: self.use_specular_workflow,
            specular_color: self.specular_color.vector(registers),
            metallic: self.metallic.number(registers),
            roughness: self.roughness.number(registers),
            clearcoat: self.clearcoat.number(registers),
            clearcoat_roughness: self.clearcoat_roughness.number(registers),
            opacity: self.opacity.number(registers),
            opacity_mode: self.opacity_mode,
            opacity_threshold: self.opacity_threshold,
            ior: self.ior.number(registers),
        }
    }

    fn is_opaque(&self) -> bool {
        self.opacity.constant().is_some_and(|o| o[0] >= 1.0)
    }

    /// Opacity 0 for the whole surface.
    fn is_glass(&self) -> bool {
        self.opacity.constant().is_some_and(|o| o[0] <= 0.0)
    }
}

impl LeafClosure for PreviewSurface {
    const N_LOBES: usize = 1;

    fn add_to(&self, weight: f32, registers: &[Value], shading: &mut SurfaceShading) {
        let params = self.params(registers);
        shading.bsdf.add_scaled(&params.bsdf(self.is_glass()), Rgb::splat(weight));
        let emission = non_negative(self.emissive_color.vector(registers));
        shading.emission += emission * (weight * params.presence());
        if let Some(normal) = &self.normal {
            shading.normal = normal.vector(registers).try_normalize().filter(|n| *n != Vec3A::Z);
        }
    }

    fn may_transmit(&self) -> bool {
        let is_refracting =
            self.is_glass() && self.ior.constant().is_some_and(|ior| (ior[0] - 1.0).abs() > 1e-3);
        let is_cut_out = self.opacity_threshold > 0.0 || self.opacity_mode == OpacityMode::Presence;
        let is_glass = is_refracting && !is_cut_out && self.metallic == Operand::ZERO;
        !self.is_opaque() && !is_glass
    }

    fn constant_emission(&self) -> Option<Rgb> {
        let color = self.emissive_color.constant()?;
        let is_black = color[..3] == [0.0; 3];
        let is_cut_out = self.opacity_threshold > 0.0 || self.opacity_mode == OpacityMode::Presence;
        if !is_black && is_cut_out && !self.is_opaque() {
            return None;
        }
        Some(Rgb::from_slice(&color[..3]))
    }
}
