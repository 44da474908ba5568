//! Two closures in a proportion.

use super::ClosureNode;
use crate::KindSpec;
use crate::graph::compiler::Leaf;
use crate::graph::inputs::Inputs;
use crate::graph::pattern::Operation;
use crate::kind::{ParamSpec, UNIT};

pub(in crate::graph) struct MixClosure;

impl ClosureNode for MixClosure {
    const KIND: KindSpec = KindSpec {
        name: "mix_closure",
        doc: "A mixture of two closures.",
        params: &[
            ParamSpec::node("a", "Closure at mix 0; black without."),
            ParamSpec::node("b", "Closure at mix 1; black without."),
            ParamSpec::float("mix", 0.5, UNIT, "", "Share of b."),
        ],
    };

    fn build(inputs: &mut Inputs) -> Vec<Leaf> {
        let mix = inputs.operand("mix");
        let (a, b) = (inputs.closures("a"), inputs.closures("b"));
        let t = inputs.compiler.emit(Operation::saturate(mix));
        let rest = inputs.compiler.emit(Operation::one_minus(t));
        let mut leaves = inputs.compiler.scale(a, rest);
        leaves.extend(inputs.compiler.scale(b, t));
        leaves
    }
}
