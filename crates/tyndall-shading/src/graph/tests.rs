//! Graphs end to end: values, messages, fallbacks.

mod surfaces;
mod volumes;

use super::*;
use crate::testing::{Images, messages};
use std::collections::BTreeMap;
use tyndall_scene::prim::{Material, NodeInput, ShadingNode};
use tyndall_scene::{Diagnostics, PrimPath};

fn node<const N: usize>(kind: &str, inputs: [(&str, NodeInput); N]) -> ShadingNode {
    let inputs: BTreeMap<_, _> = inputs.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
    ShadingNode { kind: kind.to_owned(), inputs }
}

fn float(x: f32) -> NodeInput {
    NodeInput::Float(x)
}

fn vector(x: f32, y: f32, z: f32) -> NodeInput {
    NodeInput::Vector([x, y, z])
}

fn text(text: &str) -> NodeInput {
    NodeInput::Text(text.to_owned())
}

fn link(index: usize) -> NodeInput {
    NodeInput::Node(index)
}

fn compile(material: &Material) -> (CompiledMaterial, Vec<String>) {
    let mut diags = Diagnostics::default();
    let px = |v: f32| [v, 0.5 * v, 0.0, v];
    let images = Images::with("map.png", 2, vec![px(0.2), px(0.4), px(0.6), px(0.8)]);
    let compiled = CompiledMaterial::compile(&PrimPath::from("/Mat"), material, &images, &mut diags);
    (compiled, messages(&diags))
}

/// The last node is the surface.
fn surface(nodes: Vec<ShadingNode>) -> (CompiledMaterial, Vec<String>) {
    let surface = Some(nodes.len() - 1);
    compile(&Material { nodes, surface, volume: None })
}

/// The last node is the volume.
fn medium(nodes: Vec<ShadingNode>) -> (Option<VolumeMaterial>, Vec<String>) {
    let volume = Some(nodes.len() - 1);
    let (compiled, messages) = compile(&Material { nodes, surface: None, volume });
    assert!(!compiled.has_surface());
    (compiled.volume().cloned(), messages)
}

/// Every primvar has this value.
struct Everywhere([f32; 4]);

impl ShadingContext for Everywhere {
    fn primvar(&self, _: usize) -> Option<[f32; 4]> {
        Some(self.0)
    }

    fn position(&self, _: Space) -> Vec3A {
        Vec3A::from_slice(&self.0)
    }

    fn field(&self, _: usize) -> Option<[f32; 4]> {
        Some(self.0)
    }
}

#[test]
fn the_table_lists_every_kind_once_with_documented_inputs() {
    let mut names: Vec<_> = NODE_KINDS.iter().map(|k| k.name).collect();
    for expected in ["image", "field", "diffuse", "preview_surface", "surface", "mix_closure", "volume"] {
        assert!(names.contains(&expected));
    }
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), NODE_KINDS.len());
    for kind in NODE_KINDS {
        assert!(!kind.doc.is_empty());
        assert!(kind.params.iter().all(|p| !p.doc.is_empty() && p.min <= p.max), "{}", kind.name);
    }
}

#[test]
fn every_kind_compiles_with_its_defaults_and_with_nonsense() {
    let nonsense = [float(f32::NAN), vector(-1e30, f32::INFINITY, 1e30), text("?"), link(0), link(99)];
    for kind in NODE_KINDS {
        let (bare, _) = surface(vec![node(kind.name, [])]);
        assert!(bare.evaluate(&()).emission.is_finite());
        for value in &nonsense {
            let inputs = kind.params.iter().map(|p| (p.name.to_owned(), value.clone())).collect();
            let nodes = vec![node("add", []), ShadingNode { kind: kind.name.to_owned(), inputs }];
            for (surface, volume) in [(Some(1), None), (None, Some(1))] {
                let material = Material { nodes: nodes.clone(), surface, volume };
                let (compiled, _) = compile(&material);
                let shading = compiled.evaluate(&Everywhere([f32::NAN; 4]));
                assert!(shading.emission.is_finite() && shading.opacity.is_finite(), "{}", kind.name);
                if let Some(v) = compiled.volume() {
                    assert!(v.sigma_a.is_finite() && v.sigma_s.is_finite());
                    assert!(v.emission.iter().all(|term| term.color.is_finite()));
                }
            }
        }
    }
}
