//! From nodes to operations and weighted closures.

use super::closure::{self, Closure};
use super::inputs::Inputs;
use super::pattern::{self, Operation};
use super::{MAX_REGISTERS, Operand, kind};
use tyndall_scene::prim::{Material, NodeInput};
use tyndall_scene::{AssetLoader, Diagnostics, PrimPath};

/// Most closures of a material; nested mixes may repeat them.
const MAX_LEAVES: usize = 32;

/// A closure and the number it is multiplied by.
#[derive(Debug, Clone)]
pub(super) struct Leaf {
    pub(super) weight: Operand,
    pub(super) closure: Closure,
}

impl From<Closure> for Leaf {
    fn from(closure: Closure) -> Self {
        Self { weight: Operand::ONE, closure }
    }
}

/// State of one compilation.
pub(super) struct Compiler<'a> {
    pub(super) path: &'a PrimPath,
    pub(super) material: &'a Material,
    pub(super) assets: &'a dyn AssetLoader,
    pub(super) diags: &'a mut Diagnostics,
    pub(super) operations: Vec<Operation>,
    pub(super) primvars: Vec<String>,
    /// What a medium reads; `None` for surfaces, which have no fields.
    pub(super) fields: Option<Vec<String>>,
    /// Per node, once it is compiled.
    patterns: Vec<Option<Operand>>,
    closures: Vec<Option<Vec<Leaf>>>,
}

impl<'a> Compiler<'a> {
    pub(super) fn new(
        path: &'a PrimPath,
        material: &'a Material,
        assets: &'a dyn AssetLoader,
        diags: &'a mut Diagnostics,
    ) -> Self {
        let n = material.nodes.len();
        Self {
            path,
            material,
            assets,
            diags,
            operations: Vec::new(),
            primvars: Vec::new(),
            fields: None,
            patterns: vec![None; n],
            closures: vec![None; n],
        }
    }

    /// Compiles `terminal` and everything it uses, in the order of the list: no recursion, whatever the depth.
    pub(super) fn compile_up_to(&mut self, terminal: usize) {
        for index in reachable(self.material, terminal) {
            if self.patterns[index].is_none() && self.closures[index].is_none() {
                self.compile_node(index);
            }
        }
    }

    /// Compiles one node whose inputs are compiled.
    pub(super) fn compile_node(&mut self, index: usize) {
        let name = &self.material.nodes[index].kind;
        let Some(kind) = kind(name) else {
            let known: Vec<_> = super::NODE_KINDS.iter().map(|k| k.name).collect();
            let what = format!("node {index} is of unknown kind {name:?}");
            self.diags.warn(
                self.path,
                what,
                format!("defaults were used instead; known: {}", known.join(", ")),
            );
            return;
        };
        let is_foreign =
            if self.fields.is_some() { pattern::is_of_surfaces } else { |kind: &str| kind == "field" };
        if is_foreign(kind.name) {
            return;
        }
        if closure::is_kind(kind.name) {
            let leaves = closure::build(kind.name, &mut Inputs::new(self, index, kind));
            self.closures[index] = Some(leaves);
        } else if let Some(operation) = Operation::build(kind.name, &mut Inputs::new(self, index, kind)) {
            self.patterns[index] = Some(self.emit(operation));
        }
    }

    /// Appends an operation, unless its value is known now.
    pub(super) fn emit(&mut self, operation: Operation) -> Operand {
        if operation.is_constant() {
            return Operand::Constant(operation.evaluate(&[], &()));
        }
        if self.operations.len() == MAX_REGISTERS {
            let what = format!("the material has more than {MAX_REGISTERS} varying nodes");
            self.diags.warn(self.path, what, "the others read as 0; bake part of the graph into textures");
            return Operand::ZERO;
        }
        self.operations.push(operation);
        Operand::Register((self.operations.len() - 1) as u16)
    }

    /// The value of node `source` for node `user`, or what is wrong with that.
    pub(super) fn connection(&self, user: usize, source: usize) -> Result<Operand, String> {
        self.check_order(user, source)?;
        let kind = &self.material.nodes[source].kind;
        self.patterns[source].ok_or_else(|| format!("node {source} ({kind}) gives no number or colour here"))
    }

    /// The closures of node `source` for node `user`, or what is wrong with that.
    pub(super) fn closures_of(&self, user: usize, source: usize) -> Result<Vec<Leaf>, String> {
        self.check_order(user, source)?;
        let kind = &self.material.nodes[source].kind;
        self.closures[source].clone().ok_or_else(|| format!("node {source} ({kind}) is not a closure"))
    }

    pub(super) fn is_closure(&self, source: usize) -> bool {
        self.closures.get(source).is_some_and(Option::is_some)
    }

    fn check_order(&self, user: usize, source: usize) -> Result<(), String> {
        if source < user {
            return Ok(());
        }
        let n = self.material.nodes.len();
        Err(if source < n {
            format!("node {source} does not come before its user")
        } else {
            format!("node {source} does not exist: there are {n}")
        })
    }

    /// The leaves times `factor`, without those that vanish.
    pub(super) fn scale(&mut self, leaves: Vec<Leaf>, factor: Operand) -> Vec<Leaf> {
        let mut scaled = Vec::with_capacity(leaves.len());
        for leaf in leaves {
            let weight = if factor == Operand::ONE {
                leaf.weight
            } else if leaf.weight == Operand::ONE {
                factor
            } else {
                self.emit(Operation::multiply(leaf.weight, factor))
            };
            if weight.constant().is_none_or(|w| w[0] > 0.0) {
                scaled.push(Leaf { weight, ..leaf });
            }
        }
        self.limit(scaled)
    }

    /// The leaves of both.
    pub(super) fn sum(&mut self, mut a: Vec<Leaf>, b: Vec<Leaf>) -> Vec<Leaf> {
        a.extend(b);
        self.limit(a)
    }

    fn limit(&mut self, mut leaves: Vec<Leaf>) -> Vec<Leaf> {
        if leaves.len() > MAX_LEAVES {
            self.diags.warn(
                self.path,
                format!("the material mixes more than {MAX_LEAVES} closures"),
                "the others were left out; simplify the material",
            );
            leaves.truncate(MAX_LEAVES);
        }
        leaves
    }

    pub(super) fn primvar_slot(&mut self, name: &str) -> usize {
        self.primvars.iter().position(|p| p == name).unwrap_or_else(|| {
            self.primvars.push(name.to_owned());
            self.primvars.len() - 1
        })
    }

    pub(super) fn field_slot(&mut self, name: &str) -> usize {
        let fields = self.fields.get_or_insert_default();
        fields.iter().position(|f| f == name).unwrap_or_else(|| {
            fields.push(name.to_owned());
            fields.len() - 1
        })
    }

    pub(super) fn primvar(&mut self, name: &str) -> Operand {
        let slot = self.primvar_slot(name);
        self.emit(Operation::primvar(slot))
    }
}

/// `terminal` and the nodes it uses directly or indirectly, ascending.
pub(super) fn reachable(material: &Material, terminal: usize) -> Vec<usize> {
    let mut is_used = vec![false; terminal + 1];
    is_used[terminal] = true;
    for user in (0..=terminal).rev() {
        if is_used[user] {
            for input in material.nodes[user].inputs.values() {
                if let NodeInput::Node(source) = input
                    && *source < user
                {
                    is_used[*source] = true;
                }
            }
        }
    }
    (0..=terminal).filter(|&i| is_used[i]).collect()
}
