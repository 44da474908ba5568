//! The boundary of a transparent body.

use super::{ClosureNode, LeafClosure};
use crate::KindSpec;
use crate::graph::compiled::SurfaceShading;
use crate::graph::compiler::Leaf;
use crate::graph::inputs::Inputs;
use crate::graph::{Operand, Value};
use crate::kind::{ParamSpec, UNIT};
use crate::material::{self, ScatterMode};
use tyndall_math::Rgb;

#[derive(Debug, Clone, Copy)]
pub(in crate::graph) struct Dielectric {
    ior: Operand,
    roughness: Operand,
    tint: Operand,
    mode: ScatterMode,
}

impl ClosureNode for Dielectric {
    const KIND: KindSpec = KindSpec {
        name: "dielectric",
        doc: "Reflection and refraction at the boundary of a transparent body.",
        params: &[
            ParamSpec::float("ior", 1.5, [0.01, 100.0], "", "Refractive index inside over outside."),
            ParamSpec::float("roughness", 0.0, UNIT, "", "0 is smooth; GGX alpha is its square."),
            ParamSpec::vector("tint", [1.0; 3], UNIT, "", "Factor on both parts."),
            ParamSpec::text("mode", "RT", "R|T|RT", "Reflection, transmission or both."),
        ],
    };

    fn build(inputs: &mut Inputs) -> Vec<Leaf> {
        let mode = ScatterMode::from_name(inputs.choice("mode")).unwrap_or_default();
        let (ior, roughness) = (inputs.operand("ior"), inputs.operand("roughness"));
        vec![Self { ior, roughness, tint: inputs.operand("tint"), mode }.into()]
    }
}

impl LeafClosure for Dielectric {
    const N_LOBES: usize = 1;

    fn add_to(&self, weight: f32, registers: &[Value], shading: &mut SurfaceShading) {
        let (ior, roughness) = (self.ior.number(registers), self.roughness.number(registers));
        let lobe = material::Dielectric::new(ior, roughness, self.tint.vector(registers), self.mode);
        shading.bsdf.add(lobe.into(), Rgb::splat(weight));
    }

    fn may_transmit(&self) -> bool {
        self.ior.constant().is_none_or(|ior| (ior[0] - 1.0).abs() < 1e-3)
    }
}
