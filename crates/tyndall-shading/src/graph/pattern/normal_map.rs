//! A tangent-space normal from its usual encoding in an image.

use super::Pattern;
use crate::KindSpec;
use crate::graph::inputs::Inputs;
use crate::graph::{Operand, ShadingContext, Value};
use crate::kind::{ANY, ParamSpec};
use glam::Vec3A;

#[derive(Debug, Clone, Copy)]
pub(in crate::graph) struct NormalMap {
    input: Operand,
    scale: Operand,
}

impl Pattern for NormalMap {
    const KIND: KindSpec = KindSpec {
        name: "normal_map",
        doc: "A tangent-space normal from a colour: 2 * in - 1, x and y scaled, normalised.",
        params: &[
            ParamSpec::vector("in", [0.5, 0.5, 1.0], ANY, "", "The encoded normal, each channel in [0, 1]."),
            ParamSpec::float("scale", 1.0, ANY, "", "Strength: factor on x and y."),
        ],
    };

    fn build(inputs: &mut Inputs) -> Self {
        Self { input: inputs.operand("in"), scale: inputs.operand("scale") }
    }

    fn operands(&self) -> Vec<Operand> {
        vec![self.input, self.scale]
    }

    fn evaluate(&self, registers: &[Value], _: &dyn ShadingContext) -> Value {
        let scale = self.scale.number(registers);
        let decoded = (self.input.vector(registers) * 2.0 - 1.0) * Vec3A::new(scale, scale, 1.0);
        let n = decoded.normalize_or(Vec3A::Z);
        [n.x, n.y, n.z, 1.0]
    }
}
