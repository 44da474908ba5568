//! Emission from the surface itself.

use super::{ClosureNode, LeafClosure};
use crate::KindSpec;
use crate::graph::compiled::{SurfaceShading, non_negative};
use crate::graph::compiler::Leaf;
use crate::graph::inputs::Inputs;
use crate::graph::{Operand, Value};
use crate::kind::{POSITIVE, ParamSpec};
use tyndall_math::Rgb;

#[derive(Debug, Clone, Copy)]
pub(in crate::graph) struct Emission {
    pub(super) color: Operand,
}

impl ClosureNode for Emission {
    const KIND: KindSpec = KindSpec {
        name: "emission",
        doc: "Radiance emitted into all directions, on both sides.",
        params: &[ParamSpec::vector("color", [1.0; 3], POSITIVE, "radiance", "Emitted radiance.")],
    };

    fn build(inputs: &mut Inputs) -> Vec<Leaf> {
        vec![Self { color: inputs.operand("color") }.into()]
    }
}

impl LeafClosure for Emission {
    const N_LOBES: usize = 0;

    fn add_to(&self, weight: f32, registers: &[Value], shading: &mut SurfaceShading) {
        shading.emission += non_negative(self.color.vector(registers)) * weight;
    }

    fn constant_emission(&self) -> Option<Rgb> {
        self.color.constant().map(|c| non_negative(Rgb::from_slice(&c[..3])))
    }
}
