//! Metal.

use super::{ClosureNode, LeafClosure};
use crate::KindSpec;
use crate::graph::compiled::SurfaceShading;
use crate::graph::compiler::Leaf;
use crate::graph::inputs::Inputs;
use crate::graph::{Operand, Value};
use crate::kind::{ParamSpec, UNIT};
use crate::material;
use tyndall_math::Rgb;

#[derive(Debug, Clone, Copy)]
pub(in crate::graph) struct Conductor {
    reflectance: Operand,
    /// Index and extinction, in place of the reflectance.
    index: Option<(Operand, Operand)>,
    roughness: Operand,
}

impl ClosureNode for Conductor {
    const KIND: KindSpec = KindSpec {
        name: "conductor",
        doc: "Reflection of a metal, by reflectance or by refractive index and extinction.",
        params: &[
            ParamSpec::vector(
                "reflectance",
                [0.9; 3],
                UNIT,
                "",
                "At normal incidence; unless ior or extinction is set.",
            ),
            ParamSpec::vector("ior", [0.2; 3], [0.0, 100.0], "", "Refractive index per channel."),
            ParamSpec::vector(
                "extinction",
                [3.9; 3],
                [0.0, 100.0],
                "",
                "Extinction coefficient per channel.",
            ),
            ParamSpec::float("roughness", 0.0, UNIT, "", "0 is a mirror; GGX alpha is its square."),
        ],
    };

    fn build(inputs: &mut Inputs) -> Vec<Leaf> {
        let has_index = inputs.is_authored("ior") || inputs.is_authored("extinction");
        let index = has_index.then(|| (inputs.operand("ior"), inputs.operand("extinction")));
        let (reflectance, roughness) = (inputs.operand("reflectance"), inputs.operand("roughness"));
        vec![Self { reflectance, index, roughness }.into()]
    }
}

impl LeafClosure for Conductor {
    const N_LOBES: usize = 1;

    fn add_to(&self, weight: f32, registers: &[Value], shading: &mut SurfaceShading) {
        let roughness = self.roughness.number(registers);
        let lobe = match &self.index {
            Some((n, k)) => {
                material::Conductor::from_index(n.vector(registers), k.vector(registers), roughness)
            }
            None => material::Conductor::from_reflectance(self.reflectance.vector(registers), roughness),
        };
        shading.bsdf.add(lobe.into(), Rgb::splat(weight));
    }
}
