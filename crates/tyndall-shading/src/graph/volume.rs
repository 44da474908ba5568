//! Media: `volume` nodes whose coefficients are constants, or constants times one field.

use super::compiler::{Compiler, reachable};
use crate::KindSpec;
use crate::kind::{POSITIVE, ParamSpec};
use tyndall_math::Rgb;
use tyndall_scene::prim::{Material, NodeInput};
use tyndall_scene::{AssetLoader, Diagnostics, PrimPath};

pub(super) const KIND: KindSpec = KindSpec {
    name: "volume",
    doc: "A medium: coefficients are constants, or constants times a field.",
    params: &[
        ParamSpec::vector(
            "absorption",
            [0.0; 3],
            POSITIVE,
            "1 / stage unit",
            "sigma_a; times density if a field.",
        ),
        ParamSpec::vector(
            "scattering",
            [0.0; 3],
            POSITIVE,
            "1 / stage unit",
            "sigma_s; times density if a field.",
        ),
        ParamSpec::float("anisotropy", 0.0, [-1.0, 1.0], "", "Mean cosine g; positive is forward."),
        ParamSpec::vector(
            "emission",
            [0.0; 3],
            POSITIVE,
            "radiance / stage unit",
            "Emitted radiance per length.",
        ),
    ],
};

/// Largest |g|: beyond it the phase function is a delta function in f32.
const MAX_G: f32 = 0.99999;

/// The coefficients of a medium.
#[derive(Debug, Clone, PartialEq)]
pub struct VolumeMaterial {
    /// Absorption coefficient, where the density is 1.
    pub sigma_a: Rgb,
    /// Scattering coefficient, where the density is 1.
    pub sigma_s: Rgb,
    /// Emitted radiance per length, where the emission field is 1.
    pub emission: Rgb,
    /// Mean cosine of the phase function (Henyey-Greenstein).
    pub g: f32,
    /// The field that scales both coefficients; `None` is 1 everywhere.
    pub density_field: Option<String>,
    /// The field that scales emission; `None` is 1 everywhere.
    pub emission_field: Option<String>,
}

/// A constant, or a constant times a field.
#[derive(Debug, Clone, PartialEq)]
struct Scaled {
    factor: [f32; 3],
    field: Option<String>,
}

impl Scaled {
    fn constant(factor: [f32; 3]) -> Self {
        Self { factor, field: None }
    }
}

struct VolumeCompiler<'a> {
    compiler: Compiler<'a>,
    /// Per node, once it is compiled; what is wrong with it otherwise.
    values: Vec<Option<Result<Scaled, String>>>,
}

/// The medium of node `index`; `None`, after a diagnostic, if it is none.
pub(super) fn compile(
    path: &PrimPath,
    material: &Material,
    index: usize,
    assets: &dyn AssetLoader,
    diags: &mut Diagnostics,
) -> Option<VolumeMaterial> {
    let kind = &material.nodes[index].kind;
    if kind != KIND.name {
        let what = format!("node {index} ({kind}) cannot be a volume");
        diags.warn(path, what, "the medium was left out; connect a volume node");
        return None;
    }
    let compiler = Compiler::new(path, material, assets, diags);
    let mut this = VolumeCompiler { compiler, values: vec![None; material.nodes.len()] };
    for node in reachable(material, index) {
        if node != index {
            this.values[node] = Some(this.node(node));
        }
    }
    Some(this.volume(index))
}

impl VolumeCompiler<'_> {
    fn warn(&mut self, what: String, action: &str) {
        self.compiler.diags.warn(self.compiler.path, what, action);
    }

    /// The value of a node other than a volume.
    fn node(&mut self, index: usize) -> Result<Scaled, String> {
        let node = &self.compiler.material.nodes[index];
        let mut operands = Vec::new();
        for (name, input) in &node.inputs {
            if let NodeInput::Node(source) = input {
                operands.push((name.as_str(), self.operand(index, *source)?));
            }
        }
        if node.kind == "field" {
            let name = match node.inputs.get("name") {
                Some(NodeInput::Text(name)) => name.clone(),
                _ => "density".to_owned(),
            };
            return Ok(Scaled { factor: [1.0; 3], field: Some(name) });
        }
        if operands.iter().any(|(_, value)| value.field.is_some()) {
            return self.product(index);
        }
        self.compiler.compile_node(index);
        let operand = self.compiler.connection(index + 1, index)?;
        let [x, y, z, _] =
            operand.constant().ok_or_else(|| format!("node {index} ({}) depends on a surface", node.kind))?;
        Ok(Scaled::constant([x, y, z]))
    }

    fn operand(&self, user: usize, source: usize) -> Result<Scaled, String> {
        if source >= user {
            return Err(format!("node {source} does not come before its user {user}"));
        }
        self.values[source].clone().unwrap_or_else(|| Err(format!("node {source} cannot be used here")))
    }

    /// A `multiply` node with a field in it.
    fn product(&mut self, index: usize) -> Result<Scaled, String> {
        let node = &self.compiler.material.nodes[index];
        if !["multiply", "channel"].contains(&node.kind.as_str()) {
            return Err(format!(
                "node {index} ({}): only products of constants and one field are supported",
                node.kind
            ));
        }
        let mut product = Scaled::constant([1.0; 3]);
        for input in node.inputs.values() {
            let factor = match input {
                NodeInput::Float(x) => Scaled::constant([*x; 3]),
                NodeInput::Vector(v) => Scaled::constant(*v),
                NodeInput::Node(source) => self.operand(index, *source)?,
                NodeInput::Text(_) => continue,
            };
            if product.field.is_some() && factor.field.is_some() {
                return Err(format!("node {index} (multiply): a product of two fields is not supported"));
            }
            product.field = product.field.or(factor.field);
            for (p, f) in product.factor.iter_mut().zip(factor.factor) {
                *p *= f;
            }
        }
        Ok(product)
    }

    /// An input of the volume node.
    fn input(&mut self, index: usize, name: &str) -> Scaled {
        let value = match self.compiler.material.nodes[index].inputs.get(name) {
            None => Ok(Scaled::constant([0.0; 3])),
            Some(NodeInput::Float(x)) => Ok(Scaled::constant([*x; 3])),
            Some(NodeInput::Vector(v)) => Ok(Scaled::constant(*v)),
            Some(NodeInput::Text(text)) => Err(format!("{text:?} is not a number")),
            Some(NodeInput::Node(source)) => self.operand(index, *source),
        };
        value.unwrap_or_else(|what| {
            self.warn(format!("node {index} (volume), input {name}: {what}"), "0 was used");
            Scaled::constant([0.0; 3])
        })
    }

    /// A coefficient that must not be negative.
    fn coefficient(&mut self, index: usize, name: &str) -> (Rgb, Option<String>) {
        let Scaled { factor, field } = self.input(index, name);
        let clean = factor.map(|x| if x.is_finite() { x.max(0.0) } else { 0.0 });
        if clean != factor {
            let what = format!("node {index} (volume), input {name}: {factor:?} is negative or not finite");
            self.warn(what, "such channels were set to 0 (an albedo outside [0, 1] looks like this)");
        }
        let color = Rgb::from_array(clean);
        (color, field.filter(|_| color != Rgb::ZERO))
    }

    fn anisotropy(&mut self, index: usize) -> f32 {
        let Scaled { factor: [g, ..], field } = self.input(index, "anisotropy");
        if field.is_some() {
            self.warn(
                format!("node {index} (volume), input anisotropy: cannot come from a field"),
                "0 was used",
            );
            return 0.0;
        }
        if !(-1.0..=1.0).contains(&g) {
            let limited = if g.is_finite() { g.clamp(-MAX_G, MAX_G) } else { 0.0 };
            let what = format!("node {index} (volume), input anisotropy: {g} lies outside [-1, 1]");
            self.warn(what, &format!("{limited} was used"));
            return limited;
        }
        g.clamp(-MAX_G, MAX_G)
    }

    fn volume(&mut self, index: usize) -> VolumeMaterial {
        for name in self.compiler.material.nodes[index].inputs.keys() {
            if KIND.param(name).is_none() {
                let known: Vec<_> = KIND.params.iter().map(|p| p.name).collect();
                let what = format!("node {index} (volume), input {name}: is not an input of this kind");
                self.warn(what, &format!("it was ignored; known inputs: {}", known.join(", ")));
            }
        }
        let (sigma_a, field_a) = self.coefficient(index, "absorption");
        let (sigma_s, field_s) = self.coefficient(index, "scattering");
        let (emission, emission_field) = self.coefficient(index, "emission");
        let density_field = field_s.clone().or(field_a.clone());
        let are_together = field_a == field_s
            || (sigma_a == Rgb::ZERO && field_a.is_none())
            || (sigma_s == Rgb::ZERO && field_s.is_none());
        if !are_together {
            let what = format!(
                "node {index} (volume): absorption and scattering vary with different fields ({} and {})",
                field_a.as_deref().unwrap_or("none"),
                field_s.as_deref().unwrap_or("none"),
            );
            self.warn(
                what,
                "one field must scale both: that of scattering, or the only one, was used for both",
            );
        }
        let g = self.anisotropy(index);
        VolumeMaterial { sigma_a, sigma_s, emission, g, density_field, emission_field }
    }
}
