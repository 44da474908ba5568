//! Two closures on top of each other.

use super::ClosureNode;
use crate::KindSpec;
use crate::graph::compiler::Leaf;
use crate::graph::inputs::Inputs;
use crate::kind::ParamSpec;

pub(in crate::graph) struct AddClosure;

impl ClosureNode for AddClosure {
    const KIND: KindSpec = KindSpec {
        name: "add_closure",
        doc: "The sum of two closures; that it reflects no more light than arrives is up to the user.",
        params: &[
            ParamSpec::node("a", "One closure; black without."),
            ParamSpec::node("b", "The other; black without."),
        ],
    };

    fn build(inputs: &mut Inputs) -> Vec<Leaf> {
        let (a, b) = (inputs.closures("a"), inputs.closures("b"));
        inputs.compiler.sum(a, b)
    }
}
