//! Ramps over space.

use super::Pattern;
use super::noise::VECTOR;
use crate::KindSpec;
use crate::graph::inputs::Inputs;
use crate::graph::{Operand, ShadingContext, Value};
use crate::kind::ParamSpec;
use crate::procedural;

#[derive(Debug, Clone, Copy)]
pub(in crate::graph) struct Gradient {
    vector: Operand,
    shape: procedural::Gradient,
}

impl Pattern for Gradient {
    const KIND: KindSpec = KindSpec {
        name: "gradient",
        doc: "A ramp from 0 to 1 over space, as Blender defines it.",
        params: &[
            VECTOR,
            ParamSpec::text(
                "shape",
                "linear",
                "linear|quadratic|easing|diagonal|spherical|quadratic_sphere|radial",
                "Along x, its square, slow at both ends, along x and y, around the origin, its square, or around z.",
            ),
        ],
    };

    fn build(inputs: &mut Inputs) -> Self {
        let shape = match inputs.choice("shape") {
            "quadratic" => procedural::Gradient::Quadratic,
            "easing" => procedural::Gradient::Easing,
            "diagonal" => procedural::Gradient::Diagonal,
            "spherical" => procedural::Gradient::Spherical,
            "quadratic_sphere" => procedural::Gradient::QuadraticSphere,
            "radial" => procedural::Gradient::Radial,
            _ => procedural::Gradient::Linear,
        };
        Self { vector: inputs.point("vector"), shape }
    }

    fn operands(&self) -> Vec<Operand> {
        vec![self.vector]
    }

    fn evaluate(&self, registers: &[Value], _: &dyn ShadingContext) -> Value {
        [self.shape.at(self.vector.vector(registers)); 4]
    }
}
