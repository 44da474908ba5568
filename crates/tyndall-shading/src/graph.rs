//! Shading graphs: from nodes as data to a short program.
//!
//! [`CompiledMaterial::compile`] folds everything constant; what remains are at most [`MAX_REGISTERS`] operations on
//! four-channel values and a list of weighted closures. A material without textures and primvars costs a copy per hit.
//! Whatever cannot be understood becomes a diagnostic that names prim, node and input, and the input's default; a surface
//! that cannot be understood at all is [`FALLBACK_ALBEDO`] grey.

mod closure;
mod compiled;
mod compiler;
mod inputs;
mod pattern;
mod volume;

#[cfg(test)]
mod tests;

pub use compiled::{CompiledMaterial, SurfaceShading};
pub use volume::{
    EmissionSource, EmissionTerm, PhaseModel, PointCoefficients, VolumeMaterial, VolumeProgram, VolumeTint,
};

use crate::KindSpec;
use glam::Vec3A;

/// Albedo of surfaces whose material cannot be used.
pub const FALLBACK_ALBEDO: f32 = 0.18;

/// Most operations of a program that are not constant.
pub const MAX_REGISTERS: usize = 64;

/// Every kind of node, with its inputs.
pub const NODE_KINDS: &[KindSpec] = &{
    const N: usize = pattern::KINDS.len() + closure::KINDS.len() + 1;
    let mut all = [volume::KIND; N];
    let mut i = 0;
    while i < pattern::KINDS.len() {
        all[i] = pattern::KINDS[i];
        i += 1;
    }
    let mut j = 0;
    while j < closure::KINDS.len() {
        all[i + j] = closure::KINDS[j];
        j += 1;
    }
    all
};

/// The kind called `name`.
pub(crate) fn kind(name: &str) -> Option<&'static KindSpec> {
    NODE_KINDS.iter().find(|k| k.name == name)
}

/// The space that a position is asked for in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Space {
    /// The object's bounding box is [0, 1]^3.
    Box,
    /// The object's own.
    Object,
    /// The stage.
    World,
}

/// What a program may ask about the hit, or about a point in a medium.
pub trait ShadingContext {
    /// The value of primvar `slot` of [`CompiledMaterial::required_primvars`]; `None` if the geometry has no such
    /// primvar. Numbers fill all four channels; shorter vectors end with 0 and then 1 in the last channel.
    fn primvar(&self, slot: usize) -> Option<[f32; 4]>;

    /// Where it is.
    fn position(&self, space: Space) -> Vec3A;

    /// The value of field `slot` of [`VolumeProgram::fields`]; `None` if the volume has no such field.
    fn field(&self, _slot: usize) -> Option<[f32; 4]> {
        None
    }
}

/// A hit without primvars, at the origin.
impl ShadingContext for () {
    fn primvar(&self, _: usize) -> Option<[f32; 4]> {
        None
    }

    fn position(&self, _: Space) -> Vec3A {
        Vec3A::ZERO
    }
}

/// Four channels; numbers fill all of them, vectors have 1 in the last.
type Value = [f32; 4];

/// An argument of an operation.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Operand {
    Constant(Value),
    Register(u16),
}

impl Operand {
    const ZERO: Self = Self::Constant([0.0; 4]);
    const ONE: Self = Self::Constant([1.0; 4]);

    #[inline]
    fn value(&self, registers: &[Value]) -> Value {
        match *self {
            Self::Constant(value) => value,
            Self::Register(index) => registers[usize::from(index)],
        }
    }

    #[inline]
    fn number(&self, registers: &[Value]) -> f32 {
        self.value(registers)[0]
    }

    #[inline]
    fn vector(&self, registers: &[Value]) -> Vec3A {
        Vec3A::from_slice(&self.value(registers)[..3])
    }

    fn constant(&self) -> Option<Value> {
        match *self {
            Self::Constant(value) => Some(value),
            Self::Register(_) => None,
        }
    }
}
