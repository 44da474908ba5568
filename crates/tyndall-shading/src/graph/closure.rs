//! Closures: nodes that give scattering and emission.

mod add_closure;
mod conductor;
mod dielectric;
mod diffuse;
mod emission;
mod mix_closure;
mod preview_surface;
mod surface;
mod transparent;

use super::Value;
use super::compiled::SurfaceShading;
use super::compiler::Leaf;
use super::inputs::Inputs;
use crate::KindSpec;
use add_closure::AddClosure;
use conductor::Conductor;
use dielectric::Dielectric;
use diffuse::Diffuse;
use emission::Emission;
use mix_closure::MixClosure;
use preview_surface::PreviewSurface;
use surface::Surface;
use transparent::Transparent;
use tyndall_math::Rgb;

/// A kind of node that gives closures.
trait ClosureNode {
    /// Name and inputs.
    const KIND: KindSpec;

    /// Reads the node's inputs.
    fn build(inputs: &mut Inputs) -> Vec<Leaf>;
}

/// A closure that is left when mixes are resolved.
trait LeafClosure {
    /// Adds `weight` times this closure to the shading of a hit.
    fn add_to(&self, weight: f32, registers: &[Value], shading: &mut SurfaceShading);

    /// Whether light may pass straight through.
    fn may_transmit(&self) -> bool {
        false
    }

    /// Emission if it is the same everywhere.
    fn constant_emission(&self) -> Option<Rgb> {
        Some(Rgb::ZERO)
    }

    /// Lobes it adds.
    const N_LOBES: usize;
}

macro_rules! node_kinds {
    ($($kind:ident),+ $(,)?) => {
        /// Every node that gives closures.
        pub(super) const KINDS: &[KindSpec] = &[$(<$kind as ClosureNode>::KIND),+];

        /// The closures of a node of a kind in [`KINDS`].
        pub(super) fn build(kind: &str, inputs: &mut Inputs) -> Vec<Leaf> {
            match kind {
                $(name if name == <$kind as ClosureNode>::KIND.name => $kind::build(inputs),)+
                _ => Vec::new(),
            }
        }
    };
}

macro_rules! leaf_kinds {
    ($($kind:ident),+ $(,)?) => {
        /// A closure of a compiled material.
        #[derive(Debug, Clone, Copy)]
        pub(super) enum Closure { $($kind($kind)),+ }

        impl Closure {
            pub(super) fn add_to(&self, weight: f32, registers: &[Value], shading: &mut SurfaceShading) {
                match self { $(Self::$kind(it) => it.add_to(weight, registers, shading)),+ }
            }

            pub(super) fn may_transmit(&self) -> bool {
                match self { $(Self::$kind(it) => it.may_transmit()),+ }
            }

            pub(super) fn constant_emission(&self) -> Option<Rgb> {
                match self { $(Self::$kind(it) => it.constant_emission()),+ }
            }

            pub(super) fn n_lobes(&self) -> usize {
                match self { $(Self::$kind(_) => <$kind as LeafClosure>::N_LOBES),+ }
            }
        }
        $(impl From<$kind> for Leaf { fn from(it: $kind) -> Self { Closure::$kind(it).into() } })+
    };
}

node_kinds!(
    Diffuse,
    Dielectric,
    Conductor,
    PreviewSurface,
    Emission,
    Transparent,
    Surface,
    MixClosure,
    AddClosure
);
leaf_kinds!(Diffuse, Dielectric, Conductor, PreviewSurface, Emission, Transparent);

/// Whether nodes of this kind give closures.
pub(super) fn is_kind(name: &str) -> bool {
    KINDS.iter().any(|k| k.name == name)
}
