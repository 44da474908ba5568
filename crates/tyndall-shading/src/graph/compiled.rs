//! A material, ready to be evaluated at hits.

use super::compiler::{Compiler, Leaf};
use super::pattern::Operation;
use super::volume::{self, VolumeMaterial};
use super::{FALLBACK_ALBEDO, MAX_REGISTERS, ShadingContext};
use crate::material::{Bsdf, Diffuse, MAX_LOBES};
use glam::Vec3A;
use tyndall_math::Rgb;
use tyndall_scene::prim::Material;
use tyndall_scene::{AssetLoader, Diagnostics, PrimPath};

/// What a surface does at one hit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceShading {
    /// Scattering and straight-through transparency; opacity is already in both.
    pub bsdf: Bsdf,
    /// Emitted radiance, on both sides; opacity is already in it.
    pub emission: Rgb,
    /// 1 minus the mean transparency: for the alpha channel.
    pub opacity: f32,
    /// Unit normal in tangent space if it is not the shading normal; see
    /// [`crate::ShadingFrame::with_tangent_space_normal`].
    pub normal: Option<Vec3A>,
}

impl SurfaceShading {
    fn empty() -> Self {
        Self { bsdf: Bsdf::black(), emission: Rgb::ZERO, opacity: 1.0, normal: None }
    }

    /// The documented stand-in for materials that cannot be used.
    pub fn fallback() -> Self {
        let grey = Diffuse::new(Rgb::splat(FALLBACK_ALBEDO), 0.0);
        Self { bsdf: grey.into(), ..Self::empty() }
    }
}

/// A colour without negative, infinite or undefined channels.
pub(super) fn non_negative(c: Rgb) -> Rgb {
    Rgb::from_array(c.to_array().map(|x| if x.is_finite() { x.max(0.0) } else { 0.0 }))
}

#[derive(Debug, Clone)]
enum Surface {
    /// The same everywhere.
    Constant(Box<SurfaceShading>),
    Program {
        operations: Vec<Operation>,
        leaves: Vec<Leaf>,
    },
}

/// A compiled material.
#[derive(Debug, Clone)]
pub struct CompiledMaterial {
    surface: Option<Surface>,
    volume: Option<VolumeMaterial>,
    primvars: Vec<String>,
    is_opaque: bool,
    emission_constant: Option<Rgb>,
}

impl CompiledMaterial {
    /// Compiles `material`; everything that cannot be honoured becomes a diagnostic about `path`.
    pub fn compile(
        path: &PrimPath,
        material: &Material,
        assets: &dyn AssetLoader,
        diags: &mut Diagnostics,
    ) -> Self {
        let mut compiled = match terminal(path, material, material.surface, "surface", diags) {
            Terminal::Absent => Self::without_surface(),
            Terminal::Missing => Self::fallback(),
            Terminal::Node(index) => Self::compile_surface(path, material, index, assets, diags),
        };
        compiled.volume = match terminal(path, material, material.volume, "volume", diags) {
            Terminal::Node(index) => volume::compile(path, material, index, assets, diags),
            _ => None,
        };
        compiled
    }

    /// The grey surface for meshes without a material or with one that cannot be used.
    pub fn fallback() -> Self {
        Self::from_constant(SurfaceShading::fallback())
    }

    fn without_surface() -> Self {
        let shading = SurfaceShading { bsdf: Bsdf::transparent(), opacity: 0.0, ..SurfaceShading::empty() };
        Self { surface: None, ..Self::from_constant(shading) }
    }

    fn from_constant(shading: SurfaceShading) -> Self {
        Self {
            is_opaque: shading.bsdf.transparency() == Rgb::ZERO,
            emission_constant: Some(shading.emission),
            surface: Some(Surface::Constant(Box::new(shading))),
            volume: None,
            primvars: Vec::new(),
        }
    }

    fn compile_surface(
        path: &PrimPath,
        material: &Material,
        index: usize,
        assets: &dyn AssetLoader,
        diags: &mut Diagnostics,
    ) -> Self {
        let mut compiler = Compiler::new(path, material, assets, diags);
        compiler.compile_up_to(index);
        let Ok(leaves) = compiler.closures_of(index + 1, index) else {
            let kind = &material.nodes[index].kind;
            let what = format!("node {index} ({kind}) cannot be a surface");
            diags.warn(path, what, format!("a grey surface of albedo {FALLBACK_ALBEDO} was used"));
            return Self::fallback();
        };
        let Compiler { operations, primvars, .. } = compiler;
        if leaves.iter().map(|leaf| leaf.closure.n_lobes()).sum::<usize>() > MAX_LOBES {
            let what = format!("the surface mixes more than {MAX_LOBES} scattering closures");
            diags.warn(path, what, "the last ones were left out; simplify the material");
        }
        if operations.is_empty() {
            return Self::from_constant(shade(&leaves, &[]));
        }
        Self {
            is_opaque: !leaves.iter().any(|leaf| leaf.closure.may_transmit()),
            emission_constant: constant_emission(&leaves),
            surface: Some(Surface::Program { operations, leaves }),
            volume: None,
            primvars,
        }
    }

    /// Whether there is a surface at all; without one the boundary is index-matched and invisible.
    pub fn has_surface(&self) -> bool {
        self.surface.is_some()
    }

    /// The medium inside.
    pub fn volume(&self) -> Option<&VolumeMaterial> {
        self.volume.as_ref()
    }

    /// Names of the primvars that [`ShadingContext::primvar`] is asked for, by slot.
    pub fn required_primvars(&self) -> &[String] {
        &self.primvars
    }

    /// No light passes straight through anywhere.
    pub fn is_opaque(&self) -> bool {
        self.has_surface() && self.is_opaque
    }

    /// The surface may emit.
    pub fn is_emissive(&self) -> bool {
        self.emission_constant != Some(Rgb::ZERO)
    }

    /// Emitted radiance if it is the same everywhere.
    pub fn emission_constant(&self) -> Option<Rgb> {
        self.emission_constant
    }

    /// The shading if it is the same everywhere.
    pub fn constant(&self) -> Option<&SurfaceShading> {
        match &self.surface {
            Some(Surface::Constant(shading)) => Some(shading),
            _ => None,
        }
    }

    /// The shading of a hit.
    pub fn evaluate(&self, context: &dyn ShadingContext) -> SurfaceShading {
        match &self.surface {
            None => SurfaceShading { bsdf: Bsdf::transparent(), opacity: 0.0, ..SurfaceShading::empty() },
            Some(Surface::Constant(shading)) => **shading,
            Some(Surface::Program { operations, leaves }) => {
                let mut registers = [[0.0; 4]; MAX_REGISTERS];
                for (index, operation) in operations.iter().enumerate() {
                    registers[index] = operation.evaluate(&registers, context);
                }
                shade(leaves, &registers)
            }
        }
    }
}

fn shade(leaves: &[Leaf], registers: &[super::Value]) -> SurfaceShading {
    let mut shading = SurfaceShading::empty();
    for leaf in leaves {
        let weight = crate::material::unit(leaf.weight.number(registers));
        if weight > 0.0 {
            leaf.closure.add_to(weight, registers, &mut shading);
        }
    }
    shading.opacity = 1.0 - tyndall_math::mean_component(shading.bsdf.transparency());
    shading
}

fn constant_emission(leaves: &[Leaf]) -> Option<Rgb> {
    let mut sum = Rgb::ZERO;
    for leaf in leaves {
        let emission = leaf.closure.constant_emission()?;
        if emission != Rgb::ZERO {
            sum += emission * leaf.weight.constant()?[0];
        }
    }
    Some(sum)
}

enum Terminal {
    Absent,
    Missing,
    Node(usize),
}

fn terminal(
    path: &PrimPath,
    material: &Material,
    index: Option<usize>,
    name: &str,
    diags: &mut Diagnostics,
) -> Terminal {
    match index {
        None => Terminal::Absent,
        Some(index) if index < material.nodes.len() => Terminal::Node(index),
        Some(index) => {
            let what = format!("the {name} is node {index}, but there are {}", material.nodes.len());
            diags.warn(path, what, "a default was used; connect an existing node");
            Terminal::Missing
        }
    }
}
