//! Patterns: nodes that give numbers and colours.

mod arithmetic;
mod blackbody;
mod image;
mod normal_map;
mod primvar;
mod transform2d;

use super::inputs::Inputs;
use super::{Operand, ShadingContext, Value};
use crate::KindSpec;
use crate::kind::{ANY, ParamSpec};
use arithmetic::{Add, Channel, Clamp, Mix, Multiply, Subtract};
use blackbody::Blackbody;
use image::Image;
use normal_map::NormalMap;
use primvar::Primvar;
use transform2d::Transform2d;

/// What a pattern answers.
trait Pattern: Sized {
    /// Name and inputs.
    const KIND: KindSpec;

    /// Reads the node's inputs.
    fn build(inputs: &mut Inputs) -> Self;

    /// The arguments; if all are constant, so is the value.
    fn operands(&self) -> Vec<Operand>;

    /// Whether the value depends on the hit even with constant arguments.
    const IS_VARYING: bool = false;

    /// The value at a hit.
    fn evaluate(&self, registers: &[Value], context: &dyn ShadingContext) -> Value;
}

macro_rules! closed_set {
    ($($kind:ident),+ $(,)?) => {
        /// An operation of a program.
        #[derive(Debug, Clone)]
        pub(super) enum Operation { $($kind($kind)),+ }

        /// Every pattern.
        pub(super) const KINDS: &[KindSpec] = &[$(<$kind as Pattern>::KIND),+, FIELD];

        impl Operation {
            /// The operation of a node, or `None` if its kind is no pattern.
            pub(super) fn build(kind: &str, inputs: &mut Inputs) -> Option<Self> {
                match kind {
                    $(name if name == <$kind as Pattern>::KIND.name => Some(Self::$kind($kind::build(inputs))),)+
                    _ => None,
                }
            }

            /// Whether the value is the same at every hit.
            pub(super) fn is_constant(&self) -> bool {
                match self {
                    $(Self::$kind(it) => {
                        !<$kind as Pattern>::IS_VARYING && it.operands().iter().all(|o| o.constant().is_some())
                    })+
                }
            }

            #[inline]
            pub(super) fn evaluate(&self, registers: &[Value], context: &dyn ShadingContext) -> Value {
                match self { $(Self::$kind(it) => it.evaluate(registers, context)),+ }
            }
        }
    };
}

closed_set!(Image, Channel, Primvar, Transform2d, Multiply, Add, Subtract, Mix, Clamp, NormalMap, Blackbody);

/// Known in volumes only, where it is no operation but a name.
const FIELD: KindSpec = KindSpec {
    name: "field",
    doc: "The value of a field of the volume; only in the inputs of a volume node.",
    params: &[
        ParamSpec::text("name", "density", "", "The field, as the volume names it."),
        ParamSpec::float("default", 0.0, ANY, "", "Where the volume has no such field."),
    ],
};

impl Operation {
    /// `a * b`, for weights made by the compiler.
    pub(super) fn multiply(a: Operand, b: Operand) -> Self {
        Self::Multiply(Multiply { in1: a, in2: b })
    }

    /// The primvar of `slot`, or 0.
    pub(super) fn primvar(slot: usize) -> Self {
        Self::Primvar(Primvar::new(slot))
    }

    /// `1 - a`.
    pub(super) fn one_minus(a: Operand) -> Self {
        Self::Subtract(Subtract { in1: Operand::ONE, in2: a })
    }

    /// `a` limited to [0, 1].
    pub(super) fn saturate(a: Operand) -> Self {
        Self::Clamp(Clamp::saturate(a))
    }
}
