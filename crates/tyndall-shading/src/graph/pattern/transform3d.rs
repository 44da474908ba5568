//! An affine map of points.

use super::Pattern;
use crate::KindSpec;
use crate::graph::inputs::Inputs;
use crate::graph::{Operand, ShadingContext, Value};
use crate::kind::{ANY, ParamSpec};

#[derive(Debug, Clone, Copy)]
pub(in crate::graph) struct Transform3d {
    point: Operand,
    /// Where the axes go, then the origin.
    columns: [Operand; 4],
}

impl Pattern for Transform3d {
    const KIND: KindSpec = KindSpec {
        name: "transform3d",
        doc: "An affine map: in.x * x + in.y * y + in.z * z + translation.",
        params: &[
            ParamSpec::vector("in", [0.0; 3], ANY, "", "The point."),
            ParamSpec::vector("x", [1.0, 0.0, 0.0], ANY, "", "Where the x axis goes."),
            ParamSpec::vector("y", [0.0, 1.0, 0.0], ANY, "", "Where the y axis goes."),
            ParamSpec::vector("z", [0.0, 0.0, 1.0], ANY, "", "Where the z axis goes."),
            ParamSpec::vector("translation", [0.0; 3], ANY, "", "Where the origin goes."),
        ],
    };

    fn build(inputs: &mut Inputs) -> Self {
        let columns = ["x", "y", "z", "translation"].map(|name| inputs.operand(name));
        Self { point: inputs.operand("in"), columns }
    }

    fn operands(&self) -> Vec<Operand> {
        let mut operands = self.columns.to_vec();
        operands.push(self.point);
        operands
    }

    fn evaluate(&self, registers: &[Value], _: &dyn ShadingContext) -> Value {
        let p = self.point.vector(registers);
        let [x, y, z, origin] = self.columns.map(|column| column.vector(registers));
        let [x, y, z] = (x * p.x + y * p.y + z * p.z + origin).to_array();
        [x, y, z, 1.0]
    }
}
