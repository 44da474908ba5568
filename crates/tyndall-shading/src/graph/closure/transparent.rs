//! Nothing in the way.

use super::{ClosureNode, LeafClosure};
use crate::KindSpec;
use crate::graph::compiled::SurfaceShading;
use crate::graph::compiler::Leaf;
use crate::graph::inputs::Inputs;
use crate::graph::{Operand, Value};
use crate::kind::{ParamSpec, UNIT};
use crate::material;

#[derive(Debug, Clone, Copy)]
pub(in crate::graph) struct Transparent {
    color: Operand,
}

impl Transparent {
    /// Without colour.
    pub(super) fn clear() -> Self {
        Self { color: Operand::ONE }
    }
}

impl ClosureNode for Transparent {
    const KIND: KindSpec = KindSpec {
        name: "transparent",
        doc: "Lets light pass straight through; no scattering event.",
        params: &[ParamSpec::vector("color", [1.0; 3], UNIT, "", "Part that passes.")],
    };

    fn build(inputs: &mut Inputs) -> Vec<Leaf> {
        vec![Self { color: inputs.operand("color") }.into()]
    }
}

impl LeafClosure for Transparent {
    const N_LOBES: usize = 0;

    fn add_to(&self, weight: f32, registers: &[Value], shading: &mut SurfaceShading) {
        shading.bsdf.add_transparency(material::unit_color(self.color.vector(registers)) * weight);
    }

    fn may_transmit(&self) -> bool {
        true
    }
}
