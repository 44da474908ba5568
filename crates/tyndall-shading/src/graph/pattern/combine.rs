//! Numbers into a vector.

use super::Pattern;
use crate::KindSpec;
use crate::graph::inputs::Inputs;
use crate::graph::{Operand, ShadingContext, Value};
use crate::kind::{ANY, ParamSpec};

#[derive(Debug, Clone, Copy)]
pub(in crate::graph) struct Combine {
    parts: [Operand; 3],
}

impl Pattern for Combine {
    const KIND: KindSpec = KindSpec {
        name: "combine",
        doc: "A vector or colour of three numbers.",
        params: &[
            ParamSpec::float("in1", 0.0, ANY, "", "x or red."),
            ParamSpec::float("in2", 0.0, ANY, "", "y or green."),
            ParamSpec::float("in3", 0.0, ANY, "", "z or blue."),
        ],
    };

    fn build(inputs: &mut Inputs) -> Self {
        Self { parts: ["in1", "in2", "in3"].map(|name| inputs.operand(name)) }
    }

    fn operands(&self) -> Vec<Operand> {
        self.parts.to_vec()
    }

    fn evaluate(&self, registers: &[Value], _: &dyn ShadingContext) -> Value {
        let [x, y, z] = self.parts.map(|part| part.number(registers));
        [x, y, z, 1.0]
    }
}
