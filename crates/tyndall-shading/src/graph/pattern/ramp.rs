//! Colours along a line.

use super::Pattern;
use crate::KindSpec;
use crate::graph::inputs::Inputs;
use crate::graph::{Operand, ShadingContext, Value};
use crate::kind::{ANY, ParamSpec};

#[derive(Debug, Clone)]
pub(in crate::graph) struct Ramp {
    position: Operand,
    /// At equal distances from 0 to 1; not empty.
    colors: Vec<Value>,
    is_stepped: bool,
}

impl Pattern for Ramp {
    const KIND: KindSpec = KindSpec {
        name: "ramp",
        doc: "A colour by position, from a table.",
        params: &[
            ParamSpec::float(
                "in",
                0.5,
                ANY,
                "",
                "The position; what lies outside [0, 1] has the colour of the end.",
            ),
            ParamSpec::numbers("colors", "Red, green, blue and alpha at equal distances from 0 to 1."),
            ParamSpec::text(
                "interpolation",
                "linear",
                "linear|constant",
                "Between the colours of the table.",
            ),
        ],
    };

    fn build(inputs: &mut Inputs) -> Self {
        let (colors, rest) = inputs.numbers("colors").as_chunks::<4>();
        if !rest.is_empty() || colors.is_empty() || !colors.as_flattened().iter().all(|x| x.is_finite()) {
            inputs.warn("colors", "is no table of finite colours with alpha", "black was used");
            return Self { position: Operand::ZERO, colors: vec![[0.0; 4]], is_stepped: true };
        }
        Self {
            position: inputs.operand("in"),
            colors: colors.to_vec(),
            is_stepped: inputs.choice("interpolation") == "constant",
        }
    }

    fn operands(&self) -> Vec<Operand> {
        vec![self.position]
    }

    fn evaluate(&self, registers: &[Value], _: &dyn ShadingContext) -> Value {
        let last = self.colors.len() - 1;
        let position = crate::material::unit(self.position.number(registers)) * last as f32;
        let index = (position as usize).min(last);
        let (a, b) = (self.colors[index], self.colors[(index + 1).min(last)]);
        let t = if self.is_stepped { 0.0 } else { position - index as f32 };
        std::array::from_fn(|c| a[c] + (b[c] - a[c]) * t)
    }
}
