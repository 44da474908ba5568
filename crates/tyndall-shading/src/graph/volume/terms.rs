//! What the inputs of a volume node may be: sums of constants, each times one or two fields or the light of a black
//! body.

use super::KIND;
use crate::KindSpec;
use crate::graph::compiler::Compiler;
use tyndall_math::Rgb;
use tyndall_scene::prim::{Material, NodeInput};
use tyndall_scene::{AssetLoader, Diagnostics, PrimPath};

/// A part of a medium's emission.
#[derive(Debug, Clone, PartialEq)]
pub struct EmissionTerm {
    /// Radiance per stage unit where the source is 1.
    pub color: Rgb,
    /// What `color` is multiplied by.
    pub source: EmissionSource,
}

/// What emission follows.
#[derive(Debug, Clone, PartialEq)]
pub enum EmissionSource {
    /// 1 everywhere.
    Constant,
    /// A field.
    Field(String),
    /// Two fields, of which one may hold colours.
    Product(String, String),
    /// Radiance of a black body ([`tyndall_math::blackbody_radiance`]).
    Blackbody {
        /// Its temperature in kelvin, where the field is 1.
        kelvin: f32,
        /// The field that scales the temperature; `None` is 1 everywhere.
        field: Option<String>,
    },
}

impl EmissionTerm {
    /// The field it reads.
    pub fn field(&self) -> Option<&str> {
        match &self.source {
            EmissionSource::Constant => None,
            EmissionSource::Field(field) | EmissionSource::Product(field, _) => Some(field),
            EmissionSource::Blackbody { field, .. } => field.as_deref(),
        }
    }
}

/// What a constant is multiplied by.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Scale {
    One,
    Field(String),
    /// Of two fields.
    Product(String, String),
    /// `kelvin` times the field is the temperature.
    Blackbody {
        kelvin: f32,
        field: Option<String>,
    },
}

impl From<Scale> for EmissionSource {
    fn from(scale: Scale) -> Self {
        match scale {
            Scale::One => Self::Constant,
            Scale::Field(field) => Self::Field(field),
            Scale::Product(a, b) => Self::Product(a, b),
            Scale::Blackbody { kelvin, field } => Self::Blackbody { kelvin, field },
        }
    }
}

/// A constant times something.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Term {
    pub(super) factor: [f32; 3],
    pub(super) scale: Scale,
}

impl Term {
    fn constant(factor: [f32; 3]) -> Self {
        Self { factor, scale: Scale::One }
    }

    fn times(&self, other: &Self) -> Option<Self> {
        let scale = match (&self.scale, &other.scale) {
            (Scale::One, scale) | (scale, Scale::One) => scale.clone(),
            (Scale::Field(a), Scale::Field(b)) => Scale::Product(a.clone(), b.clone()),
            _ => return None,
        };
        Some(Self { factor: std::array::from_fn(|c| self.factor[c] * other.factor[c]), scale })
    }
}

/// A sum; equal scales are one term. Nothing is 0.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Terms(pub(super) Vec<Term>);

impl Terms {
    fn constant(factor: [f32; 3]) -> Self {
        Self(vec![Term::constant(factor)])
    }

    fn is_constant(&self) -> bool {
        self.0.iter().all(|term| term.scale == Scale::One)
    }

    pub(super) fn extend(&mut self, other: Self) {
        for Term { factor, scale } in other.0 {
            match self.0.iter_mut().find(|term| term.scale == scale) {
                Some(known) => known.factor = std::array::from_fn(|c| known.factor[c] + factor[c]),
                None => self.0.push(Term { factor, scale }),
            }
        }
    }

    /// The product, if it has no term of more than two fields.
    fn times(&self, other: &Self) -> Option<Self> {
        let mut product = Self::default();
        for a in &self.0 {
            for b in &other.0 {
                product.extend(Self(vec![a.times(b)?]));
            }
        }
        Some(product)
    }
}

/// State of the compilation of one medium.
pub(super) struct VolumeCompiler<'a> {
    compiler: Compiler<'a>,
    /// Per node, once it is compiled; what is wrong with it otherwise.
    values: Vec<Option<Result<Terms, String>>>,
}

impl<'a> VolumeCompiler<'a> {
    pub(super) fn new(
        path: &'a PrimPath,
        material: &'a Material,
        assets: &'a dyn AssetLoader,
        diags: &'a mut Diagnostics,
    ) -> Self {
        let values = vec![None; material.nodes.len()];
        Self { compiler: Compiler::new(path, material, assets, diags), values }
    }

    pub(super) fn warn(&mut self, what: String, action: &str) {
        self.compiler.diags.warn(self.compiler.path, what, action);
    }

    /// Compiles a node other than the volume; those before it are compiled.
    pub(super) fn compile_node(&mut self, index: usize) {
        self.values[index] = Some(self.node(index));
    }

    fn node(&mut self, index: usize) -> Result<Terms, String> {
        let node = &self.compiler.material.nodes[index];
        let mut varies = false;
        for input in node.inputs.values() {
            if let NodeInput::Node(source) = input {
                varies |= !self.operand(index, *source)?.is_constant();
            }
        }
        match (node.kind.as_str(), varies) {
            ("field", _) => {
                Ok(Terms(vec![Term { factor: [1.0; 3], scale: Scale::Field(self.field_name(index)) }]))
            }
            ("multiply", true) => self.product(index),
            ("add", true) => self.sum(index, 1.0),
            ("subtract", true) => self.sum(index, -1.0),
            ("channel", true) => self.value(index, "in", [0.0; 3]),
            ("blackbody", true) => self.black_body_of_field(index),
            (kind, true) => Err(format!(
                "node {index} ({kind}): only sums and products of constants and fields are supported"
            )),
            (_, false) => self.constant_node(index),
        }
    }

    fn field_name(&self, index: usize) -> String {
        match self.compiler.material.nodes[index].inputs.get("name") {
            Some(NodeInput::Text(name)) => name.clone(),
            _ => "density".to_owned(),
        }
    }

    fn constant_node(&mut self, index: usize) -> Result<Terms, String> {
        let kind = &self.compiler.material.nodes[index].kind;
        self.compiler.compile_node(index);
        let operand = self.compiler.connection(index + 1, index)?;
        let constant = operand.constant();
        let [x, y, z, _] = constant.ok_or_else(|| format!("node {index} ({kind}) depends on a surface"))?;
        Ok(Terms::constant([x, y, z]))
    }

    fn product(&mut self, index: usize) -> Result<Terms, String> {
        let (a, b) = (self.value(index, "in1", [1.0; 3])?, self.value(index, "in2", [1.0; 3])?);
        let message = "a product of more than two fields, or of a field and a black body, is not supported";
        a.times(&b).ok_or_else(|| format!("node {index} (multiply): {message}"))
    }

    /// The first input plus `sign` times the second.
    fn sum(&mut self, index: usize, sign: f32) -> Result<Terms, String> {
        let mut sum = self.value(index, "in1", [0.0; 3])?;
        let mut other = self.value(index, "in2", [0.0; 3])?;
        other.0.iter_mut().for_each(|term| term.factor = term.factor.map(|x| x * sign));
        sum.extend(other);
        Ok(sum)
    }

    /// MaterialX's `blackbody` of a temperature that is a constant times a field.
    fn black_body_of_field(&mut self, index: usize) -> Result<Terms, String> {
        let terms = self.value(index, "temperature", [0.0; 3])?;
        let [Term { factor: [kelvin, ..], scale: Scale::Field(field) }] = &terms.0[..] else {
            return Err(format!(
                "node {index} (blackbody): the temperature must be a constant times one field"
            ));
        };
        self.warn(
            format!("node {index} (blackbody): the temperature is a field"),
            "brightness follows Stefan and Boltzmann, 1e-6 sigma T^4 / pi, so that what is cold is dark",
        );
        let scale = Scale::Blackbody { kelvin: *kelvin, field: Some(field.clone()) };
        Ok(Terms(vec![Term { factor: [1.0; 3], scale }]))
    }

    fn operand(&self, user: usize, source: usize) -> Result<Terms, String> {
        if source >= user {
            return Err(format!("node {source} does not come before its user {user}"));
        }
        self.values[source].clone().unwrap_or_else(|| Err(format!("node {source} cannot be used here")))
    }

    /// An input of any node, or `default`.
    fn value(&self, index: usize, name: &str, default: [f32; 3]) -> Result<Terms, String> {
        match self.compiler.material.nodes[index].inputs.get(name) {
            None => Ok(Terms::constant(default)),
            Some(NodeInput::Float(x)) => Ok(Terms::constant([*x; 3])),
            Some(NodeInput::Vector(v)) => Ok(Terms::constant(*v)),
            Some(NodeInput::Text(text)) => Err(format!("{text:?} is not a number")),
            Some(NodeInput::Numbers(_)) => Err("a list is no number".to_owned()),
            Some(NodeInput::Node(source)) => self.operand(index, *source),
        }
    }
}

/// Inputs of the volume node itself.
impl VolumeCompiler<'_> {
    pub(super) fn is_authored(&self, index: usize, name: &str) -> bool {
        self.compiler.material.nodes[index].inputs.contains_key(name)
    }

    pub(super) fn report_unknown(&mut self, index: usize, kind: &KindSpec) {
        for name in self.compiler.material.nodes[index].inputs.keys() {
            if kind.param(name).is_none() {
                let known: Vec<_> = kind.params.iter().map(|p| p.name).collect();
                let what =
                    format!("node {index} ({}), input {name}: is not an input of this kind", kind.name);
                self.warn(what, &format!("it was ignored; known inputs: {}", known.join(", ")));
            }
        }
    }

    pub(super) fn report(&mut self, index: usize, name: &str, what: &str, action: &str) {
        self.warn(format!("node {index} ({}), input {name}: {what}", KIND.name), action);
    }

    /// Any sum; 0, with a message, if it is none.
    pub(super) fn input(&mut self, index: usize, name: &str) -> Terms {
        self.value(index, name, [0.0; 3]).unwrap_or_else(|what| {
            self.report(index, name, &what, "0 was used");
            Terms::default()
        })
    }

    /// A constant, or a constant times one field.
    pub(super) fn single(&mut self, index: usize, name: &str) -> Term {
        let mut terms = self.input(index, name);
        terms.0.retain(|term| term.factor != [0.0; 3]);
        match (terms.0.pop(), terms.0.is_empty()) {
            (None, _) => Term::constant([0.0; 3]),
            (Some(term), true) if matches!(term.scale, Scale::One | Scale::Field(_)) => term,
            _ => {
                let what = "only products of constants and one field are supported";
                self.report(index, name, what, "0 was used");
                Term::constant([0.0; 3])
            }
        }
    }

    /// A value that cannot come from a field.
    pub(super) fn constant(&mut self, index: usize, name: &str) -> [f32; 3] {
        match self.single(index, name) {
            Term { factor, scale: Scale::One } => factor,
            _ => {
                self.report(index, name, "cannot come from a field", "0 was used");
                [0.0; 3]
            }
        }
    }

    /// A constant number within `range`, or `default`.
    pub(super) fn number(&mut self, index: usize, name: &str, default: f32, range: [f32; 2]) -> f32 {
        if !self.is_authored(index, name) {
            return default;
        }
        let [x, ..] = self.constant(index, name);
        if x >= range[0] && x <= range[1] {
            return x;
        }
        let limited = if x.is_finite() { x.clamp(range[0], range[1]) } else { default };
        let what = format!("{x} lies outside [{}, {}]", range[0], range[1]);
        self.report(index, name, &what, &format!("{limited} was used"));
        limited
    }

    /// A word out of `choices`.
    pub(super) fn choice(&mut self, index: usize, name: &str, default: &str, choices: &str) -> String {
        match self.compiler.material.nodes[index].inputs.get(name) {
            None => default.to_owned(),
            Some(NodeInput::Text(word)) if choices.split('|').any(|choice| choice == word) => word.clone(),
            Some(other) => {
                let what = match other {
                    NodeInput::Text(word) => format!("{word:?} is unknown"),
                    _ => "is not a word".to_owned(),
                };
                self.report(index, name, &what, &format!("{default} was used; known: {choices}"));
                default.to_owned()
            }
        }
    }
}
