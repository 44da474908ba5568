//! UsdTransform2d: `in * scale * rotate + translation`.

use super::Pattern;
use crate::KindSpec;
use crate::graph::inputs::Inputs;
use crate::graph::{Operand, ShadingContext, Value};
use crate::kind::{ANY, ParamSpec};
use glam::Vec2;

#[derive(Debug, Clone, Copy)]
pub(in crate::graph) struct Transform2d {
    input: Operand,
    rotation: Operand,
    scale: Operand,
    translation: Operand,
}

impl Pattern for Transform2d {
    const KIND: KindSpec = KindSpec {
        name: "transform2d",
        doc: "Texture coordinates scaled, then rotated counter-clockwise, then moved.",
        params: &[
            ParamSpec::vector("in", [0.0; 3], ANY, "", "Coordinates; z is kept."),
            ParamSpec::float("rotation", 0.0, ANY, "degrees", "Counter-clockwise around the origin."),
            ParamSpec::vector("scale", [1.0; 3], ANY, "", "Factors on x and y."),
            ParamSpec::vector("translation", [0.0; 3], ANY, "", "Added to x and y."),
        ],
    };

    fn build(inputs: &mut Inputs) -> Self {
        Self {
            input: inputs.operand("in"),
            rotation: inputs.operand("rotation"),
            scale: inputs.operand("scale"),
            translation: inputs.operand("translation"),
        }
    }

    fn operands(&self) -> Vec<Operand> {
        vec![self.input, self.rotation, self.scale, self.translation]
    }

    fn evaluate(&self, registers: &[Value], _: &dyn ShadingContext) -> Value {
        let xy = |operand: &Operand| {
            let [x, y, ..] = operand.value(registers);
            Vec2::new(x, y)
        };
        let [_, _, z, w] = self.input.value(registers);
        let scaled = xy(&self.input) * xy(&self.scale);
        let turned = Vec2::from_angle(self.rotation.number(registers).to_radians()).rotate(scaled);
        let moved = turned + xy(&self.translation);
        [moved.x, moved.y, z, w]
    }
}
