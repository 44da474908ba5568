//! Nothing in the way.

use super::{ClosureNode, LeafClosure};
use crate::KindSpec;
use crate::graph::Value;
use crate::graph::compiled::SurfaceShading;
use crate::graph::compiler::Leaf;
use crate::graph::inputs::Inputs;
use tyndall_math::Rgb;

#[derive(Debug, Clone, Copy)]
pub(in crate::graph) struct Transparent;

impl ClosureNode for Transparent {
    const KIND: KindSpec = KindSpec {
        name: "transparent",
        doc: "Lets light pass straight through; no scattering event.",
        params: &[],
    };

    fn build(_: &mut Inputs) -> Vec<Leaf> {
        vec![Self.into()]
    }
}

impl LeafClosure for Transparent {
    const N_LOBES: usize = 0;

    fn add_to(&self, weight: f32, _: &[Value], shading: &mut SurfaceShading) {
        shading.bsdf.add_transparency(Rgb::splat(weight));
    }

    fn may_transmit(&self) -> bool {
        true
    }
}
