//! Diffuse reflection.

use super::{ClosureNode, LeafClosure};
use crate::KindSpec;
use crate::graph::compiled::SurfaceShading;
use crate::graph::compiler::Leaf;
use crate::graph::inputs::Inputs;
use crate::graph::{Operand, Value};
use crate::kind::{ParamSpec, UNIT};
use crate::material;
use tyndall_math::Rgb;

#[derive(Debug, Clone, Copy)]
pub(in crate::graph) struct Diffuse {
    color: Operand,
    roughness: Operand,
}

impl ClosureNode for Diffuse {
    const KIND: KindSpec = KindSpec {
        name: "diffuse",
        doc: "Diffuse reflection on both sides; roughness 0 is Lambert's.",
        params: &[
            ParamSpec::vector("color", [0.18; 3], UNIT, "", "Albedo."),
            ParamSpec::float("roughness", 0.0, UNIT, "", "0 is Lambert, 1 is as rough as EON's slopes get."),
            ParamSpec::float("weight", 1.0, UNIT, "", "Factor on the whole closure."),
        ],
    };

    fn build(inputs: &mut Inputs) -> Vec<Leaf> {
        let leaf = Self { color: inputs.operand("color"), roughness: inputs.operand("roughness") }.into();
        let weight = inputs.operand("weight");
        inputs.compiler.scale(vec![leaf], weight)
    }
}

impl LeafClosure for Diffuse {
    const N_LOBES: usize = 1;

    fn add_to(&self, weight: f32, registers: &[Value], shading: &mut SurfaceShading) {
        let lobe = material::Diffuse::new(self.color.vector(registers), self.roughness.number(registers));
        shading.bsdf.add(lobe.into(), Rgb::splat(weight));
    }
}
