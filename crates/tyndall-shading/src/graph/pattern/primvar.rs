//! A value that the geometry carries.

use super::Pattern;
use crate::KindSpec;
use crate::graph::inputs::Inputs;
use crate::graph::{Operand, ShadingContext, Value};
use crate::kind::{ANY, ParamSpec};

#[derive(Debug, Clone, Copy)]
pub(in crate::graph) struct Primvar {
    slot: usize,
    default: Operand,
}

impl Primvar {
    pub(super) fn new(slot: usize) -> Self {
        Self { slot, default: Operand::ZERO }
    }
}

impl Pattern for Primvar {
    const KIND: KindSpec = KindSpec {
        name: "primvar",
        doc: "A primvar of the geometry.",
        params: &[
            ParamSpec::text("name", "st", "", "Which primvar."),
            ParamSpec::vector("default", [0.0; 3], ANY, "", "Where the geometry has no such primvar."),
        ],
    };
    const IS_VARYING: bool = true;

    fn build(inputs: &mut Inputs) -> Self {
        let name = inputs.text("name").to_owned();
        Self { slot: inputs.primvar_slot(&name), default: inputs.operand("default") }
    }

    fn operands(&self) -> Vec<Operand> {
        vec![self.default]
    }

    fn evaluate(&self, registers: &[Value], context: &dyn ShadingContext) -> Value {
        context.primvar(self.slot).unwrap_or_else(|| self.default.value(registers))
    }
}
