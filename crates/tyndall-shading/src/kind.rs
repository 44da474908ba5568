//! How a kind of light, closure or node describes itself: the one table from which help, panels and schemas are made.

/// The value a parameter has unless authored; also its type.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ParamDefault {
    /// A number.
    Float(f32),
    /// A colour or vector.
    Vector([f32; 3]),
    /// A token, name or file path.
    Text(&'static str),
    /// As many numbers as there are; none.
    Numbers,
    /// Another node; a closure or pattern that has no constant form.
    Node,
}

/// One parameter of a kind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParamSpec {
    /// Name, as in `ShadingNode::inputs`.
    pub name: &'static str,
    /// Type and default.
    pub default: ParamDefault,
    /// Smallest meaningful value of a number or of each channel.
    pub min: f32,
    /// Largest meaningful value.
    pub max: f32,
    /// Unit; empty for plain numbers, the allowed words separated by `|` for text.
    pub unit: &'static str,
    /// One sentence.
    pub doc: &'static str,
}

impl ParamSpec {
    /// A number in `[min, max]`.
    pub const fn float(
        name: &'static str,
        default: f32,
        range: [f32; 2],
        unit: &'static str,
        doc: &'static str,
    ) -> Self {
        Self { name, default: ParamDefault::Float(default), min: range[0], max: range[1], unit, doc }
    }

    /// Three numbers, each in `[min, max]`.
    pub const fn vector(
        name: &'static str,
        default: [f32; 3],
        range: [f32; 2],
        unit: &'static str,
        doc: &'static str,
    ) -> Self {
        Self { name, default: ParamDefault::Vector(default), min: range[0], max: range[1], unit, doc }
    }

    /// A word; `choices` lists the allowed ones separated by `|`, or is empty for free text.
    pub const fn text(
        name: &'static str,
        default: &'static str,
        choices: &'static str,
        doc: &'static str,
    ) -> Self {
        Self { name, default: ParamDefault::Text(default), min: 0.0, max: 0.0, unit: choices, doc }
    }

    /// A list of numbers.
    pub const fn numbers(name: &'static str, doc: &'static str) -> Self {
        Self { name, default: ParamDefault::Numbers, min: f32::MIN, max: f32::MAX, unit: "", doc }
    }

    /// Another node.
    pub const fn node(name: &'static str, doc: &'static str) -> Self {
        Self { name, default: ParamDefault::Node, min: 0.0, max: f32::MAX, unit: "", doc }
    }
}

/// A kind of light, lobe or node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KindSpec {
    /// Name in scene descriptions.
    pub name: &'static str,
    /// One sentence.
    pub doc: &'static str,
    /// Parameters, in the order a panel shows them.
    pub params: &'static [ParamSpec],
}

impl KindSpec {
    /// The parameter called `name`.
    pub fn param(&self, name: &str) -> Option<&'static ParamSpec> {
        self.params.iter().find(|p| p.name == name)
    }
}

/// Any non-negative number.
pub(crate) const POSITIVE: [f32; 2] = [0.0, f32::MAX];
/// Zero to one.
pub(crate) const UNIT: [f32; 2] = [0.0, 1.0];
/// Any finite number.
pub(crate) const ANY: [f32; 2] = [f32::MIN, f32::MAX];
