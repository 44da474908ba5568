//! Arithmetic, channel by channel.

use super::Pattern;
use crate::KindSpec;
use crate::graph::inputs::Inputs;
use crate::graph::{Operand, ShadingContext, Value};
use crate::kind::{ANY, ParamSpec};

macro_rules! binary {
    ($type:ident, $name:literal, $doc:literal, $neutral:literal, $function:expr) => {
        #[doc = $doc]
        #[derive(Debug, Clone, Copy)]
        pub(in crate::graph) struct $type {
            pub(super) in1: Operand,
            pub(super) in2: Operand,
        }

        impl Pattern for $type {
            const KIND: KindSpec = KindSpec {
                name: $name,
                doc: $doc,
                params: &[
                    ParamSpec::vector("in1", [$neutral; 3], ANY, "", "First operand."),
                    ParamSpec::vector("in2", [$neutral; 3], ANY, "", "Second operand."),
                ],
            };

            fn build(inputs: &mut Inputs) -> Self {
                Self { in1: inputs.operand("in1"), in2: inputs.operand("in2") }
            }

            fn operands(&self) -> Vec<Operand> {
                vec![self.in1, self.in2]
            }

            fn evaluate(&self, registers: &[Value], _: &dyn ShadingContext) -> Value {
                let (a, b) = (self.in1.value(registers), self.in2.value(registers));
                let function: fn(f32, f32) -> f32 = $function;
                std::array::from_fn(|i| function(a[i], b[i]))
            }
        }
    };
}

binary!(Multiply, "multiply", "Product.", 1.0, |a, b| a * b);
binary!(Add, "add", "Sum.", 0.0, |a, b| a + b);
binary!(Subtract, "subtract", "First minus second operand.", 0.0, |a, b| a - b);

/// Linear interpolation.
#[derive(Debug, Clone, Copy)]
pub(in crate::graph) struct Mix {
    bg: Operand,
    fg: Operand,
    mix: Operand,
}

impl Pattern for Mix {
    const KIND: KindSpec = KindSpec {
        name: "mix",
        doc: "Linear interpolation from bg to fg.",
        params: &[
            ParamSpec::vector("bg", [0.0; 3], ANY, "", "Value at mix 0."),
            ParamSpec::vector("fg", [0.0; 3], ANY, "", "Value at mix 1."),
            ParamSpec::float("mix", 0.0, ANY, "", "Position."),
        ],
    };

    fn build(inputs: &mut Inputs) -> Self {
        Self { bg: inputs.operand("bg"), fg: inputs.operand("fg"), mix: inputs.operand("mix") }
    }

    fn operands(&self) -> Vec<Operand> {
        vec![self.bg, self.fg, self.mix]
    }

    fn evaluate(&self, registers: &[Value], _: &dyn ShadingContext) -> Value {
        let (a, b, t) = (self.bg.value(registers), self.fg.value(registers), self.mix.number(registers));
        std::array::from_fn(|i| a[i] + (b[i] - a[i]) * t)
    }
}

/// Limits.
#[derive(Debug, Clone, Copy)]
pub(in crate::graph) struct Clamp {
    input: Operand,
    low: Operand,
    high: Operand,
}

impl Clamp {
    pub(super) fn saturate(input: Operand) -> Self {
        Self { input, low: Operand::ZERO, high: Operand::ONE }
    }
}

impl Pattern for Clamp {
    const KIND: KindSpec = KindSpec {
        name: "clamp",
        doc: "The input limited to an interval.",
        params: &[
            ParamSpec::vector("in", [0.0; 3], ANY, "", "What is limited."),
            ParamSpec::float("low", 0.0, ANY, "", "Lower limit."),
            ParamSpec::float("high", 1.0, ANY, "", "Upper limit."),
        ],
    };

    fn build(inputs: &mut Inputs) -> Self {
        Self { input: inputs.operand("in"), low: inputs.operand("low"), high: inputs.operand("high") }
    }

    fn operands(&self) -> Vec<Operand> {
        vec![self.input, self.low, self.high]
    }

    fn evaluate(&self, registers: &[Value], _: &dyn ShadingContext) -> Value {
        let (low, high) = (self.low.number(registers), self.high.number(registers));
        self.input.value(registers).map(|x| x.max(low).min(high))
    }
}

/// One channel, as a number.
#[derive(Debug, Clone, Copy)]
pub(in crate::graph) struct Channel {
    input: Operand,
    /// 0 to 3; `None` keeps the colour.
    index: Option<usize>,
}

impl Pattern for Channel {
    const KIND: KindSpec = KindSpec {
        name: "channel",
        doc: "One channel of the input as a number, or all of them.",
        params: &[
            ParamSpec::vector("in", [0.0; 3], ANY, "", "A colour or vector."),
            ParamSpec::text("channel", "r", "r|g|b|a|rgb", "Which channel."),
        ],
    };

    fn build(inputs: &mut Inputs) -> Self {
        let index = ["r", "g", "b", "a"].iter().position(|c| *c == inputs.choice("channel"));
        Self { input: inputs.operand("in"), index }
    }

    fn operands(&self) -> Vec<Operand> {
        vec![self.input]
    }

    fn evaluate(&self, registers: &[Value], _: &dyn ShadingContext) -> Value {
        let value = self.input.value(registers);
        self.index.map_or(value, |i| [value[i]; 4])
    }
}
