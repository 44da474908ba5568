//! Functions of vectors.

use super::Pattern;
use crate::KindSpec;
use crate::graph::inputs::Inputs;
use crate::graph::{Operand, ShadingContext, Value};
use crate::kind::{ANY, ParamSpec};
use glam::Vec3A;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Function {
    #[default]
    Dot,
    Cross,
    Length,
    Distance,
    Normalize,
    Project,
    Reflect,
}

#[derive(Debug, Clone, Copy)]
pub(in crate::graph) struct VectorMath {
    in1: Operand,
    in2: Operand,
    function: Function,
}

impl Pattern for VectorMath {
    const KIND: KindSpec = KindSpec {
        name: "vector_math",
        doc: "A function of one or two vectors.",
        params: &[
            ParamSpec::text(
                "function",
                "dot",
                "dot|cross|length|distance|normalize|project|reflect",
                "Which function.",
            ),
            ParamSpec::vector("in1", [0.0; 3], ANY, "", "First vector."),
            ParamSpec::vector("in2", [0.0; 3], ANY, "", "Second vector."),
        ],
    };

    fn build(inputs: &mut Inputs) -> Self {
        let function = match inputs.choice("function") {
            "cross" => Function::Cross,
            "length" => Function::Length,
            "distance" => Function::Distance,
            "normalize" => Function::Normalize,
            "project" => Function::Project,
            "reflect" => Function::Reflect,
            _ => Function::Dot,
        };
        Self { in1: inputs.operand("in1"), in2: inputs.operand("in2"), function }
    }

    fn operands(&self) -> Vec<Operand> {
        vec![self.in1, self.in2]
    }

    fn evaluate(&self, registers: &[Value], _: &dyn ShadingContext) -> Value {
        let (a, b) = (self.in1.vector(registers), self.in2.vector(registers));
        let vector = |v: Vec3A| [v.x, v.y, v.z, 1.0];
        match self.function {
            Function::Dot => [a.dot(b); 4],
            Function::Cross => vector(a.cross(b)),
            Function::Length => [a.length(); 4],
            Function::Distance => [a.distance(b); 4],
            Function::Normalize => vector(a.normalize_or_zero()),
            Function::Project => {
                let square = b.length_squared();
                vector(if square > 0.0 { b * (a.dot(b) / square) } else { Vec3A::ZERO })
            }
            Function::Reflect => {
                let normal = b.normalize_or_zero();
                vector(a - 2.0 * normal * normal.dot(a))
            }
        }
    }
}
