//! Media whose coefficients are any function of the position and of fields.

use super::KIND;
use crate::graph::compiler::{Compiler, reachable};
use crate::graph::inputs::Inputs;
use crate::graph::pattern::{self, Operation};
use crate::graph::{MAX_REGISTERS, Operand, ShadingContext, Space, Value, compiled::non_negative};
use tyndall_math::{Rgb, blackbody_radiance};
use tyndall_scene::prim::{Material, NodeInput, ShadingNode};
use tyndall_scene::{AssetLoader, Diagnostics, PrimPath};

/// A medium as a function of position and fields.
#[derive(Debug, Clone)]
pub struct VolumeProgram {
    /// What it was compiled from: equal nodes are equal programs.
    nodes: Vec<ShadingNode>,
    operations: Vec<Operation>,
    fields: Vec<String>,
    absorption: Operand,
    scattering: Operand,
    emission: Operand,
    temperature: Operand,
    blackbody_intensity: Operand,
}

impl PartialEq for VolumeProgram {
    fn eq(&self, other: &Self) -> bool {
        self.nodes == other.nodes
    }
}

/// A medium at a point. Nothing is negative or infinite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointCoefficients {
    /// Absorption coefficient, per stage unit.
    pub sigma_a: Rgb,
    /// Scattering coefficient, per stage unit.
    pub sigma_s: Rgb,
    /// Emitted radiance per stage unit.
    pub emission: Rgb,
}

/// Whether a `volume` node is more than sums and products of constants and fields.
pub(super) fn is_needed(material: &Material, index: usize) -> bool {
    let nodes = &material.nodes;
    let reached = reachable(material, index);
    if reached.iter().any(|&node| pattern::is_positional(&nodes[node].kind)) {
        return true;
    }
    let mut varies = vec![false; index];
    for &node in reached.iter().filter(|&&node| node != index) {
        varies[node] = nodes[node].kind == "field"
            || sources(&nodes[node]).any(|source| source < node && varies[source]);
    }
    let coefficients =
        ["absorption", "scattering"].into_iter().filter_map(|name| match nodes[index].inputs.get(name) {
            Some(NodeInput::Node(source)) if *source < index => Some(*source),
            _ => None,
        });
    let of_coefficients: Vec<usize> = coefficients.flat_map(|source| reachable(material, source)).collect();
    reached.iter().any(|&node| {
        let kind = nodes[node].kind.as_str();
        let is_sum = matches!(kind, "add" | "subtract");
        // A constant next to a field.
        let is_mixed = is_sum
            && of_coefficients.contains(&node)
            && (sources(&nodes[node]).count() < 2
                || sources(&nodes[node]).any(|source| !varies[source.min(index - 1)]));
        let is_linear = is_sum || matches!(kind, "field" | "multiply" | "channel" | "blackbody");
        node != index && varies[node] && (!is_linear || is_mixed)
    })
}

fn sources(node: &ShadingNode) -> impl Iterator<Item = usize> {
    node.inputs
        .values()
        .filter_map(|input| if let NodeInput::Node(source) = input { Some(*source) } else { None })
}

impl VolumeProgram {
    pub(super) fn compile(
        path: &PrimPath,
        material: &Material,
        index: usize,
        assets: &dyn AssetLoader,
        diags: &mut Diagnostics,
    ) -> Self {
        let mut compiler = Compiler::new(path, material, assets, diags);
        compiler.fields = Some(Vec::new());
        compiler.compile_up_to(index);
        let mut inputs = Inputs::new(&mut compiler, index, &KIND);
        let [absorption, scattering, emission, temperature, blackbody_intensity] =
            ["absorption", "scattering", "emission", "temperature", "blackbodyIntensity"]
                .map(|name| inputs.operand(name));
        let Compiler { operations, fields, .. } = compiler;
        Self {
            nodes: own_nodes(material, index),
            operations,
            fields: fields.unwrap_or_default(),
            absorption,
            scattering,
            emission,
            temperature,
            blackbody_intensity,
        }
    }

    /// Names of the fields that [`ShadingContext::field`] is asked for, by slot.
    pub fn fields(&self) -> &[String] {
        &self.fields
    }

    /// Whether it differs between the placements of an object.
    pub fn reads_world(&self) -> bool {
        self.operations.iter().any(|operation| operation.space() == Some(Space::World))
    }

    /// The medium at a point.
    pub fn evaluate(&self, context: &dyn ShadingContext) -> PointCoefficients {
        let mut registers: [Value; MAX_REGISTERS] = [[0.0; 4]; MAX_REGISTERS];
        for (index, operation) in self.operations.iter().enumerate() {
            registers[index] = operation.evaluate(&registers, context);
        }
        let color = |operand: &Operand| non_negative(operand.vector(&registers));
        let kelvin = self.temperature.number(&registers);
        let mut emission = color(&self.emission);
        if kelvin > 0.0 {
            emission += non_negative(color(&self.blackbody_intensity) * blackbody_radiance(kelvin));
        }
        PointCoefficients { sigma_a: color(&self.absorption), sigma_s: color(&self.scattering), emission }
    }
}

/// The nodes that `index` uses, with their places in the list, and itself.
fn own_nodes(material: &Material, index: usize) -> Vec<ShadingNode> {
    let used = reachable(material, index);
    let place = |node: usize| used.iter().position(|&u| u == node).unwrap_or(usize::MAX);
    let renumbered = |node: &ShadingNode| {
        let mut node = node.clone();
        for input in node.inputs.values_mut() {
            if let NodeInput::Node(source) = input {
                *source = place(*source);
            }
        }
        node
    };
    used.iter().map(|&node| renumbered(&material.nodes[node])).collect()
}
