//! Where the hit is, or the point of a medium.

use super::Pattern;
use crate::KindSpec;
use crate::graph::inputs::Inputs;
use crate::graph::{Operand, ShadingContext, Space, Value};
use crate::kind::ParamSpec;

/// A point in some space.
#[derive(Debug, Clone, Copy)]
pub(in crate::graph) struct Coordinate {
    space: Space,
}

impl Coordinate {
    pub(super) const BOX: Self = Self { space: Space::Box };

    pub(in crate::graph) fn space(&self) -> Space {
        self.space
    }
}

impl Pattern for Coordinate {
    const KIND: KindSpec = KindSpec {
        name: "coordinate",
        doc: "The position of the hit, or of the point in a medium.",
        params: &[ParamSpec::text(
            "space",
            "box",
            "box|object|world",
            "In the object's bounding box as [0, 1]^3, in the object's space, or on the stage.",
        )],
    };
    const IS_VARYING: bool = true;

    fn build(inputs: &mut Inputs) -> Self {
        let space = match inputs.choice("space") {
            "object" => Space::Object,
            "world" => Space::World,
            _ => Space::Box,
        };
        Self { space }
    }

    fn operands(&self) -> Vec<Operand> {
        Vec::new()
    }

    fn evaluate(&self, _: &[Value], context: &dyn ShadingContext) -> Value {
        let [x, y, z] = context.position(self.space).to_array();
        [x, y, z, 1.0]
    }
}
