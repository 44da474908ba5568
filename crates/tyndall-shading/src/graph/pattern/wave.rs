//! Bands and rings.

use super::Pattern;
use super::noise::{DETAIL, ROUGHNESS, SCALE, VECTOR};
use crate::KindSpec;
use crate::graph::inputs::Inputs;
use crate::graph::{Operand, ShadingContext, Value};
use crate::kind::{ANY, ParamSpec};
use crate::procedural::{self, Direction, Fractal, Octaves, Profile};
use glam::Vec3A;

#[derive(Debug, Clone, Copy)]
pub(in crate::graph) struct Wave {
    vector: Operand,
    scale: Operand,
    distortion: Operand,
    detail: Operand,
    detail_scale: Operand,
    roughness: Operand,
    phase: Operand,
    direction: Direction,
    profile: Profile,
}

impl Pattern for Wave {
    const KIND: KindSpec = KindSpec {
        name: "wave",
        doc: "Bands or rings, moved by noise, as Blender defines them.",
        params: &[
            VECTOR,
            SCALE,
            ParamSpec::float("distortion", 0.0, ANY, "rad", "How far noise moves the bands."),
            DETAIL,
            ParamSpec::float("detail_scale", 1.0, ANY, "", "Frequency of that noise."),
            ROUGHNESS,
            ParamSpec::float("phase", 0.0, ANY, "rad", "Where the first band begins."),
            ParamSpec::text("form", "bands", "bands|rings", "Planes or shells."),
            ParamSpec::text(
                "direction",
                "x",
                "x|y|z|all",
                "Across the bands, or the axis of the rings; all is the diagonal, or spheres.",
            ),
            ParamSpec::text("profile", "sine", "sine|saw|triangle", "The height over a period."),
        ],
    };

    fn build(inputs: &mut Inputs) -> Self {
        let axis = match inputs.choice("direction") {
            "x" => Some(Vec3A::X),
            "y" => Some(Vec3A::Y),
            "z" => Some(Vec3A::Z),
            _ => None,
        };
        let direction = if inputs.choice("form") == "rings" {
            Direction::Rings(axis.map_or(Vec3A::ONE, |axis| Vec3A::ONE - axis))
        } else {
            // Half of x + y + z, so that the diagonal's bands are as Blender's.
            Direction::Bands(axis.unwrap_or(Vec3A::splat(0.5)))
        };
        Self {
            vector: inputs.point("vector"),
            scale: inputs.operand("scale"),
            distortion: inputs.operand("distortion"),
            detail: inputs.operand("detail"),
            detail_scale: inputs.operand("detail_scale"),
            roughness: inputs.operand("roughness"),
            phase: inputs.operand("phase"),
            direction,
            profile: match inputs.choice("profile") {
                "saw" => Profile::Saw,
                "triangle" => Profile::Triangle,
                _ => Profile::Sine,
            },
        }
    }

    fn operands(&self) -> Vec<Operand> {
        vec![
            self.vector,
            self.scale,
            self.distortion,
            self.detail,
            self.detail_scale,
            self.roughness,
            self.phase,
        ]
    }

    fn evaluate(&self, registers: &[Value], _: &dyn ShadingContext) -> Value {
        let wave = procedural::Wave {
            direction: self.direction,
            profile: self.profile,
            phase: self.phase.number(registers),
            distortion: self.distortion.number(registers),
            distortion_scale: self.detail_scale.number(registers),
            octaves: Octaves {
                fractal: Fractal::Fbm,
                detail: self.detail.number(registers),
                roughness: self.roughness.number(registers),
                lacunarity: 2.0,
                offset: 0.0,
                gain: 1.0,
                is_normalized: true,
            },
        };
        [wave.at(self.vector.vector(registers) * self.scale.number(registers)); 4]
    }
}
