//! Scattering, emission and opacity put together.

use super::ClosureNode;
use super::emission::Emission;
use super::transparent::Transparent;
use crate::KindSpec;
use crate::graph::Operand;
use crate::graph::compiler::Leaf;
use crate::graph::inputs::Inputs;
use crate::graph::pattern::Operation;
use crate::kind::{ParamSpec, UNIT};

pub(in crate::graph) struct Surface;

impl ClosureNode for Surface {
    const KIND: KindSpec = KindSpec {
        name: "surface",
        doc: "A surface: scattering, emission, and the fraction of it that is there.",
        params: &[
            ParamSpec::node("bsdf", "Scattering closure; black without."),
            ParamSpec::node("emission", "Emission closure, or a radiance."),
            ParamSpec::float("opacity", 1.0, UNIT, "", "Fraction that is there; the rest lets light pass."),
        ],
    };

    fn build(inputs: &mut Inputs) -> Vec<Leaf> {
        let mut leaves = inputs.closures("bsdf");
        if inputs.is_closure("emission") {
            leaves.extend(inputs.closures("emission"));
        } else if inputs.is_authored("emission") {
            leaves.push(Emission { color: inputs.operand("emission") }.into());
        }
        let opacity = inputs.operand("opacity");
        let opacity = inputs.compiler.emit(Operation::saturate(opacity));
        let passing = inputs.compiler.emit(Operation::one_minus(opacity));
        let mut scaled = inputs.compiler.scale(leaves, opacity);
        if passing != Operand::ZERO {
            scaled.push(Leaf { weight: passing, ..Transparent::clear().into() });
        }
        scaled
    }
}
