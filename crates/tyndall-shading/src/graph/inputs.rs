//! Checked access to the inputs of a node.

use super::compiler::{Compiler, Leaf};
use super::pattern::Operation;
use super::{Operand, Value};
use crate::KindSpec;
use crate::kind::ParamDefault;
use tyndall_scene::AssetLoader;
use tyndall_scene::prim::{NodeInput, ShadingNode};

/// The inputs of one node, with defaults and messages.
pub(super) struct Inputs<'c, 'a> {
    pub(super) compiler: &'c mut Compiler<'a>,
    index: usize,
    node: &'a ShadingNode,
    kind: &'static KindSpec,
}

impl<'c, 'a> Inputs<'c, 'a> {
    pub(super) fn new(compiler: &'c mut Compiler<'a>, index: usize, kind: &'static KindSpec) -> Self {
        let node = &compiler.material.nodes[index];
        let mut inputs = Self { compiler, index, node, kind };
        inputs.report_unknown();
        inputs
    }

    fn report_unknown(&mut self) {
        for name in self.node.inputs.keys().filter(|name| self.kind.param(name).is_none()) {
            let known: Vec<_> = self.kind.params.iter().map(|p| p.name).collect();
            let action = format!("it was ignored; known inputs: {}", known.join(", "));
            self.warn(name, "is not an input of this kind", &action);
        }
    }

    pub(super) fn is_authored(&self, name: &str) -> bool {
        self.node.inputs.contains_key(name)
    }

    pub(super) fn assets(&self) -> &'a dyn AssetLoader {
        self.compiler.assets
    }

    pub(super) fn warn(&mut self, input: &str, what: &str, action: &str) {
        let what = self.describe(input, what);
        self.compiler.diags.warn(self.compiler.path, what, action);
    }

    pub(super) fn error(&mut self, input: &str, what: &str, action: &str) {
        let what = self.describe(input, what);
        self.compiler.diags.error(self.compiler.path, what, action);
    }

    fn describe(&self, input: &str, what: &str) -> String {
        format!("node {} ({}), input {input}: {what}", self.index, self.kind.name)
    }

    /// The default of an input; its kind's table must have it.
    fn default(&self, name: &str) -> Value {
        match self.kind.param(name).map(|p| p.default) {
            Some(ParamDefault::Float(x)) => [x; 4],
            Some(ParamDefault::Vector([x, y, z])) => [x, y, z, 1.0],
            _ => [0.0; 4],
        }
    }

    /// A number or vector, constant or connected.
    pub(super) fn operand(&mut self, name: &str) -> Operand {
        let default = Operand::Constant(self.default(name));
        match self.node.inputs.get(name) {
            None => default,
            Some(NodeInput::Float(x)) => self.limited(name, [*x; 4]),
            Some(NodeInput::Vector([x, y, z])) => self.limited(name, [*x, *y, *z, 1.0]),
            Some(NodeInput::Text(text)) => {
                self.warn(name, &format!("{text:?} is not a number"), "the default was used");
                default
            }
            Some(NodeInput::Numbers(list)) => {
                self.warn(name, &format!("a list of {} is no number", list.len()), "the default was used");
                default
            }
            Some(NodeInput::Node(source)) => match self.compiler.connection(self.index, *source) {
                Ok(operand) => operand,
                Err(what) => {
                    self.warn(name, &what, "the input's default was used");
                    default
                }
            },
        }
    }

    /// A constant within the range of the table, with a message if it was not.
    fn limited(&mut self, name: &str, value: Value) -> Operand {
        let Some(param) = self.kind.param(name) else { return Operand::Constant(value) };
        if !value.iter().all(|x| x.is_finite()) {
            self.warn(name, &format!("{value:?} is not finite"), "the default was used");
            return Operand::Constant(self.default(name));
        }
        let n = if matches!(param.default, ParamDefault::Vector(_)) { 3 } else { 4 };
        let mut limited = value;
        for x in &mut limited[..n] {
            *x = x.max(param.min).min(param.max);
        }
        if limited != value {
            let what = format!("{:?} lies outside [{}, {}]", &value[..3], param.min, param.max);
            self.warn(name, &what, "it was limited to that range");
        }
        Operand::Constant(limited)
    }

    /// A value that may not depend on the hit.
    pub(super) fn constant(&mut self, name: &str) -> Value {
        let operand = self.operand(name);
        operand.constant().unwrap_or_else(|| {
            self.warn(name, "cannot vary over the surface", "the default was used; set a constant");
            self.default(name)
        })
    }

    /// A point; unless authored that in the object's box.
    pub(super) fn point(&mut self, name: &str) -> Operand {
        if self.is_authored(name) {
            self.operand(name)
        } else {
            self.compiler.emit(Operation::point_in_box())
        }
    }

    /// A list of numbers; empty without one.
    pub(super) fn numbers(&mut self, name: &str) -> &'a [f32] {
        match self.node.inputs.get(name) {
            None => &[],
            Some(NodeInput::Numbers(list)) => list,
            Some(other) => {
                self.warn(name, &format!("{other:?} is no list of numbers"), "it was ignored");
                &[]
            }
        }
    }

    /// A word or path.
    pub(super) fn text(&mut self, name: &str) -> &'a str {
        let default = match self.kind.param(name).map(|p| p.default) {
            Some(ParamDefault::Text(text)) => text,
            _ => "",
        };
        match self.node.inputs.get(name) {
            None => default,
            Some(NodeInput::Text(text)) => text,
            Some(other) => {
                self.warn(name, &format!("{other:?} is not text"), "the default was used");
                default
            }
        }
    }

    /// A word out of the table's choices.
    pub(super) fn choice(&mut self, name: &str) -> &'a str {
        let text = self.text(name);
        let Some(param) = self.kind.param(name) else { return text };
        if param.unit.split('|').any(|choice| choice == text) {
            return text;
        }
        self.warn(
            name,
            &format!("{text:?} is unknown"),
            &format!("the default was used; known: {}", param.unit),
        );
        match param.default {
            ParamDefault::Text(default) => default,
            _ => "",
        }
    }

    /// The closures of a connected node; empty without one.
    pub(super) fn closures(&mut self, name: &str) -> Vec<Leaf> {
        match self.node.inputs.get(name) {
            None => Vec::new(),
            Some(NodeInput::Node(source)) => match self.compiler.closures_of(self.index, *source) {
                Ok(leaves) => leaves,
                Err(what) => {
                    self.warn(name, &what, "nothing was connected");
                    Vec::new()
                }
            },
            Some(other) => {
                self.warn(name, &format!("{other:?} is not a node"), "nothing was connected");
                Vec::new()
            }
        }
    }

    /// Whether the node connected to `name` is a closure.
    pub(super) fn is_closure(&self, name: &str) -> bool {
        matches!(self.node.inputs.get(name), Some(NodeInput::Node(source))
            if *source < self.index && self.compiler.is_closure(*source))
    }

    pub(super) fn primvar_slot(&mut self, name: &str) -> usize {
        self.compiler.primvar_slot(name)
    }

    pub(super) fn field_slot(&mut self, name: &str) -> usize {
        self.compiler.field_slot(name)
    }

    /// The primvar `name` without a node for it.
    pub(super) fn primvar(&mut self, name: &str) -> Operand {
        self.compiler.primvar(name)
    }
}
