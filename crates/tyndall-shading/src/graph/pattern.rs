//! Patterns: nodes that give numbers and colours.

mod arithmetic;
mod blackbody;
mod combine;
mod coordinate;
mod field;
mod gradient;
mod image;
mod map_range;
mod math;
mod noise;
mod normal_map;
mod primvar;
mod ramp;
mod transform2d;
mod transform3d;
mod vector_math;
mod voronoi;
mod wave;

use super::inputs::Inputs;
use super::{Operand, ShadingContext, Space, Value};
use crate::KindSpec;
use arithmetic::{Add, Channel, Clamp, Mix, Multiply, Subtract};
use blackbody::Blackbody;
use combine::Combine;
use coordinate::Coordinate;
use field::Field;
use gradient::Gradient;
use image::Image;
use map_range::MapRange;
use math::Math;
use noise::Noise;
use normal_map::NormalMap;
use primvar::Primvar;
use ramp::Ramp;
use transform2d::Transform2d;
use transform3d::Transform3d;
use vector_math::VectorMath;
use voronoi::Voronoi;
use wave::Wave;

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
        pub(super) const KINDS: &[KindSpec] = &[$(<$kind as Pattern>::KIND),+];

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

closed_set!(
    Image,
    Channel,
    Combine,
    Primvar,
    Field,
    Coordinate,
    Transform2d,
    Transform3d,
    Noise,
    Voronoi,
    Gradient,
    Wave,
    Ramp,
    MapRange,
    Math,
    VectorMath,
    Multiply,
    Add,
    Subtract,
    Mix,
    Clamp,
    NormalMap,
    Blackbody,
);

/// Whether nodes of this kind read the position of the hit.
pub(super) fn is_positional(kind: &str) -> bool {
    [Coordinate::KIND, Noise::KIND, Voronoi::KIND, Gradient::KIND, Wave::KIND].iter().any(|k| k.name == kind)
}

/// Whether nodes of this kind read what only surfaces have.
pub(super) fn is_of_surfaces(kind: &str) -> bool {
    [Image::KIND, Primvar::KIND, NormalMap::KIND].iter().any(|k| k.name == kind)
}

impl Operation {
    /// `a * b`, for weights made by the compiler.
    pub(super) fn multiply(a: Operand, b: Operand) -> Self {
        Self::Multiply(Multiply { in1: a, in2: b })
    }

    /// The primvar of `slot`, or 0.
    pub(super) fn primvar(slot: usize) -> Self {
        Self::Primvar(Primvar::new(slot))
    }

    /// The point in the object's box.
    pub(super) fn point_in_box() -> Self {
        Self::Coordinate(Coordinate::BOX)
    }

    /// The space whose coordinates it gives, if it does.
    pub(super) fn space(&self) -> Option<Space> {
        if let Self::Coordinate(it) = self { Some(it.space()) } else { None }
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
