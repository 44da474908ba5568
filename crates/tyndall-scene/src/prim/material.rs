//! Materials: a shading graph as plain data.
//!
//! UsdPreviewSurface, MaterialX, Blender's and glTF's nodes are all translated into this one graph. Which kinds exist,
//! and their parameters with units and defaults, is tyndall-shading's table (`NODE_KINDS`).

use serde::Serialize;
use std::collections::BTreeMap;

/// The value of an input of a node.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum NodeInput {
    /// A number.
    Float(f32),
    /// A colour or vector.
    Vector([f32; 3]),
    /// A token, name or file path.
    Text(String),
    /// The output of the node at this index, which must come earlier in the list.
    Node(usize),
    /// A list, such as a table of colours.
    Numbers(Vec<f32>),
}

/// A node of the graph.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ShadingNode {
    /// The kind's name.
    pub kind: String,
    /// Inputs that are authored; the others have the kind's defaults.
    pub inputs: BTreeMap<String, NodeInput>,
}

/// A material.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Material {
    /// Nodes, inputs before their users.
    pub nodes: Vec<ShadingNode>,
    /// The node that gives the surface; `None` means no surface at all.
    pub surface: Option<usize>,
    /// The node that gives the medium inside.
    pub volume: Option<usize>,
}
