//! From one interval to another.

use super::Pattern;
use crate::KindSpec;
use crate::graph::inputs::Inputs;
use crate::graph::{Operand, ShadingContext, Value};
use crate::kind::{ANY, ParamSpec};

/// How a value goes from one end to the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Interpolation {
    #[default]
    Linear,
    Stepped,
    Smooth,
    Smoother,
}

#[derive(Debug, Clone, Copy)]
pub(in crate::graph) struct MapRange {
    /// Value, from, to, steps.
    inputs: [Operand; 6],
    interpolation: Interpolation,
    is_clamped: bool,
}

const NAMES: [&str; 6] = ["in", "from_min", "from_max", "to_min", "to_max", "steps"];

impl Pattern for MapRange {
    const KIND: KindSpec = KindSpec {
        name: "map_range",
        doc: "The input, mapped from one interval to another; 0 if the first is empty.",
        params: &[
            ParamSpec::vector(NAMES[0], [1.0; 3], ANY, "", "What is mapped, channel by channel."),
            ParamSpec::vector(NAMES[1], [0.0; 3], ANY, "", "Goes to to_min."),
            ParamSpec::vector(NAMES[2], [1.0; 3], ANY, "", "Goes to to_max."),
            ParamSpec::vector(NAMES[3], [0.0; 3], ANY, "", "One end of the result."),
            ParamSpec::vector(NAMES[4], [1.0; 3], ANY, "", "The other end."),
            ParamSpec::vector(NAMES[5], [4.0; 3], ANY, "", "Of stepped: how many."),
            ParamSpec::text(
                "interpolation",
                "linear",
                "linear|stepped|smooth|smoother",
                "How a value goes from one end to the other; the smooth ones stay within.",
            ),
            ParamSpec::text("clamp", "false", "true|false", "Whether the result stays within its interval."),
        ],
    };

    fn build(inputs: &mut Inputs) -> Self {
        let interpolation = match inputs.choice("interpolation") {
            "stepped" => Interpolation::Stepped,
            "smooth" => Interpolation::Smooth,
            "smoother" => Interpolation::Smoother,
            _ => Interpolation::Linear,
        };
        let is_clamped = inputs.choice("clamp") == "true";
        Self { inputs: NAMES.map(|name| inputs.operand(name)), interpolation, is_clamped }
    }

    fn operands(&self) -> Vec<Operand> {
        self.inputs.to_vec()
    }

    fn evaluate(&self, registers: &[Value], _: &dyn ShadingContext) -> Value {
        let inputs = self.inputs.map(|input| input.value(registers));
        std::array::from_fn(|i| self.mapped(inputs.map(|input| input[i])))
    }
}

impl MapRange {
    fn mapped(&self, [x, from_min, from_max, to_min, to_max, steps]: [f32; 6]) -> f32 {
        if from_min == from_max {
            return 0.0;
        }
        let share = (x - from_min) / (from_max - from_min);
        let t = share.clamp(0.0, 1.0);
        let share = match self.interpolation {
            Interpolation::Linear => share,
            Interpolation::Stepped if steps > 0.0 => (share * (steps + 1.0)).floor() / steps,
            Interpolation::Stepped => 0.0,
            Interpolation::Smooth => t * t * (3.0 - 2.0 * t),
            Interpolation::Smoother => t * t * t * (t * (t * 6.0 - 15.0) + 10.0),
        };
        let value = to_min + share * (to_max - to_min);
        if self.is_clamped { value.clamp(to_min.min(to_max), to_max.max(to_min)) } else { value }
    }
}
