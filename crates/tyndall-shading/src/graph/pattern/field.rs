//! A field of a volume.

use super::Pattern;
use crate::KindSpec;
use crate::graph::inputs::Inputs;
use crate::graph::{Operand, ShadingContext, Value};
use crate::kind::{ANY, ParamSpec};

#[derive(Debug, Clone, Copy)]
pub(in crate::graph) struct Field {
    slot: usize,
    default: Operand,
}

impl Pattern for Field {
    const KIND: KindSpec = KindSpec {
        name: "field",
        doc: "The value of a field of the volume; only in the inputs of a volume node.",
        params: &[
            ParamSpec::text("name", "density", "", "The field, as the volume names it."),
            ParamSpec::float("default", 0.0, ANY, "", "Where the volume has no such field."),
        ],
    };
    const IS_VARYING: bool = true;

    fn build(inputs: &mut Inputs) -> Self {
        let name = inputs.text("name").to_owned();
        Self { slot: inputs.field_slot(&name), default: inputs.operand("default") }
    }

    fn operands(&self) -> Vec<Operand> {
        vec![self.default]
    }

    fn evaluate(&self, registers: &[Value], context: &dyn ShadingContext) -> Value {
        context.field(self.slot).unwrap_or_else(|| self.default.value(registers))
    }
}
