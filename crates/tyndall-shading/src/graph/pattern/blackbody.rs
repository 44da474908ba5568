//! The colour of a hot body.

use super::Pattern;
use crate::KindSpec;
use crate::graph::inputs::Inputs;
use crate::graph::{Operand, ShadingContext, Value};
use crate::kind::{POSITIVE, ParamSpec};

#[derive(Debug, Clone, Copy)]
pub(in crate::graph) struct Blackbody {
    temperature: Operand,
}

impl Pattern for Blackbody {
    const KIND: KindSpec = KindSpec {
        name: "blackbody",
        doc: "Colour of a black body, with luminance 1, as MaterialX's node of that name has it.",
        params: &[ParamSpec::float("temperature", 6500.0, POSITIVE, "K", "Its temperature.")],
    };

    fn build(inputs: &mut Inputs) -> Self {
        Self { temperature: inputs.operand("temperature") }
    }

    fn operands(&self) -> Vec<Operand> {
        vec![self.temperature]
    }

    fn evaluate(&self, registers: &[Value], _: &dyn ShadingContext) -> Value {
        let [r, g, b] = tyndall_math::blackbody_color(self.temperature.number(registers)).to_array();
        [r, g, b, 1.0]
    }
}
