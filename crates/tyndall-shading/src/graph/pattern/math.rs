//! Functions of numbers, channel by channel. What is undefined is 0, as in Blender.

use super::Pattern;
use crate::KindSpec;
use crate::graph::inputs::Inputs;
use crate::graph::{Operand, ShadingContext, Value};
use crate::kind::{ANY, ParamSpec};

type Function = fn(f32, f32, f32) -> f32;

/// Every function, by name.
const FUNCTIONS: &[(&str, Function)] = &[
    ("add", |a, b, _| a + b),
    ("subtract", |a, b, _| a - b),
    ("multiply", |a, b, _| a * b),
    ("divide", |a, b, _| if b != 0.0 { a / b } else { 0.0 }),
    ("multiply_add", |a, b, c| a * b + c),
    ("power", |a, b, _| if a >= 0.0 || b == b.trunc() { a.powf(b) } else { 0.0 }),
    ("logarithm", |a, b, _| if a > 0.0 && b > 0.0 && b != 1.0 { a.ln() / b.ln() } else { 0.0 }),
    ("sqrt", |a, _, _| a.max(0.0).sqrt()),
    ("inverse_sqrt", |a, _, _| if a > 0.0 { a.sqrt().recip() } else { 0.0 }),
    ("absolute", |a, _, _| a.abs()),
    ("exponent", |a, _, _| a.exp()),
    ("minimum", |a, b, _| a.min(b)),
    ("maximum", |a, b, _| a.max(b)),
    ("less_than", |a, b, _| f32::from(u8::from(a < b))),
    ("greater_than", |a, b, _| f32::from(u8::from(a > b))),
    ("sign", |a, _, _| if a == 0.0 { 0.0 } else { a.signum() }),
    ("compare", |a, b, c| f32::from(u8::from((a - b).abs() <= c.max(1e-5)))),
    ("smooth_min", smooth_min),
    ("smooth_max", |a, b, c| -smooth_min(-a, -b, c)),
    ("round", |a, _, _| (a + 0.5).floor()),
    ("floor", |a, _, _| a.floor()),
    ("ceil", |a, _, _| a.ceil()),
    ("trunc", |a, _, _| a.trunc()),
    ("fract", |a, _, _| a - a.floor()),
    ("modulo", |a, b, _| if b != 0.0 { a % b } else { 0.0 }),
    ("floored_modulo", |a, b, _| if b != 0.0 { a - (a / b).floor() * b } else { 0.0 }),
    ("wrap", wrap),
    ("snap", |a, b, _| if b != 0.0 { (a / b).floor() * b } else { 0.0 }),
    ("pingpong", pingpong),
    ("sine", |a, _, _| a.sin()),
    ("cosine", |a, _, _| a.cos()),
    ("tangent", |a, _, _| a.tan()),
    ("arcsine", |a, _, _| a.clamp(-1.0, 1.0).asin()),
    ("arccosine", |a, _, _| a.clamp(-1.0, 1.0).acos()),
    ("arctangent", |a, _, _| a.atan()),
    ("arctan2", |a, b, _| a.atan2(b)),
    ("sinh", |a, _, _| a.sinh()),
    ("cosh", |a, _, _| a.cosh()),
    ("tanh", |a, _, _| a.tanh()),
    ("radians", |a, _, _| a.to_radians()),
    ("degrees", |a, _, _| a.to_degrees()),
];

/// A minimum without an edge, over a width of `c` (Quilez).
fn smooth_min(a: f32, b: f32, c: f32) -> f32 {
    if c == 0.0 {
        return a.min(b);
    }
    let h = (c - (a - b).abs()).max(0.0) / c;
    a.min(b) - h * h * h * c / 6.0
}

/// `a` in the interval from `c` to `b`.
fn wrap(a: f32, b: f32, c: f32) -> f32 {
    let range = b - c;
    if range != 0.0 { a - range * ((a - c) / range).floor() } else { c }
}

/// Up to `b` and back.
fn pingpong(a: f32, b: f32, _: f32) -> f32 {
    if b == 0.0 {
        return 0.0;
    }
    let t = (a - b) / (b * 2.0);
    ((t - t.floor()) * b * 2.0 - b).abs()
}

#[derive(Debug, Clone, Copy)]
pub(in crate::graph) struct Math {
    inputs: [Operand; 3],
    function: Function,
}

impl Pattern for Math {
    const KIND: KindSpec = KindSpec {
        name: "math",
        doc: "A function of up to three values, channel by channel; what is undefined is 0.",
        params: &[
            ParamSpec::text(
                "function",
                "add",
                "add|subtract|multiply|divide|multiply_add|power|logarithm|sqrt|inverse_sqrt|absolute|exponent|\
                 minimum|maximum|less_than|greater_than|sign|compare|smooth_min|smooth_max|round|floor|ceil|trunc|\
                 fract|modulo|floored_modulo|wrap|snap|pingpong|sine|cosine|tangent|arcsine|arccosine|arctangent|\
                 arctan2|sinh|cosh|tanh|radians|degrees",
                "Which function.",
            ),
            ParamSpec::vector("in1", [0.0; 3], ANY, "", "First argument."),
            ParamSpec::vector("in2", [0.0; 3], ANY, "", "Second argument."),
            ParamSpec::vector("in3", [0.0; 3], ANY, "", "Third argument."),
        ],
    };

    fn build(inputs: &mut Inputs) -> Self {
        let name = inputs.choice("function");
        let function = FUNCTIONS.iter().find(|(known, _)| *known == name).unwrap_or(&FUNCTIONS[0]).1;
        Self { inputs: ["in1", "in2", "in3"].map(|name| inputs.operand(name)), function }
    }

    fn operands(&self) -> Vec<Operand> {
        self.inputs.to_vec()
    }

    fn evaluate(&self, registers: &[Value], _: &dyn ShadingContext) -> Value {
        let [a, b, c] = self.inputs.map(|input| input.value(registers));
        std::array::from_fn(|i| {
            let value = (self.function)(a[i], b[i], c[i]);
            if value.is_finite() { value } else { 0.0 }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kind::ParamDefault;

    #[test]
    fn the_choices_are_the_functions() {
        let param = Math::KIND.param("function").unwrap();
        assert_eq!(param.default, ParamDefault::Text(FUNCTIONS[0].0));
        let names: Vec<_> = FUNCTIONS.iter().map(|(name, _)| *name).collect();
        assert_eq!(param.unit.split('|').collect::<Vec<_>>(), names);
    }
}
