//! Fractal noise.

use super::Pattern;
use crate::KindSpec;
use crate::graph::inputs::Inputs;
use crate::graph::{Operand, ShadingContext, Value};
use crate::kind::{ANY, POSITIVE, ParamSpec};
use crate::procedural::{Fractal, Grid, Lattice, Octaves, Point, noise, random_offset};
use std::array::from_fn;

#[derive(Debug, Clone, Copy)]
pub(in crate::graph) struct Noise {
    vector: Operand,
    w: Operand,
    scale: Operand,
    detail: Operand,
    roughness: Operand,
    lacunarity: Operand,
    offset: Operand,
    gain: Operand,
    distortion: Operand,
    fractal: Fractal,
    dimensions: usize,
    is_normalized: bool,
    is_color: bool,
}

/// The octaves' inputs that every node with noise has.
pub(super) const DETAIL: ParamSpec = ParamSpec::float(
    "detail",
    2.0,
    [0.0, Octaves::MOST],
    "",
    "Octaves after the first; a fraction weights the last.",
);
pub(super) const ROUGHNESS: ParamSpec =
    ParamSpec::float("roughness", 0.5, POSITIVE, "", "Weight of an octave over that of the one before.");
pub(super) const LACUNARITY: ParamSpec =
    ParamSpec::float("lacunarity", 2.0, ANY, "", "Frequency of an octave over that of the one before.");
pub(super) const SCALE: ParamSpec =
    ParamSpec::float("scale", 5.0, ANY, "", "Frequency: the point is multiplied by it.");
pub(super) const VECTOR: ParamSpec =
    ParamSpec::vector("vector", [0.0; 3], ANY, "", "The point; unless authored that in the object's box.");

impl Pattern for Noise {
    const KIND: KindSpec = KindSpec {
        name: "noise",
        doc: "Fractal gradient noise, as Blender defines it.",
        params: &[
            VECTOR,
            ParamSpec::float(
                "w",
                0.0,
                ANY,
                "",
                "The point's fourth coordinate, or the only one of one dimension.",
            ),
            SCALE,
            DETAIL,
            ROUGHNESS,
            LACUNARITY,
            ParamSpec::float(
                "offset",
                0.0,
                ANY,
                "",
                "Added to the noise of hetero_terrain, hybrid and ridged.",
            ),
            ParamSpec::float(
                "gain",
                1.0,
                ANY,
                "",
                "Of hybrid and ridged: how much an octave counts for the next.",
            ),
            ParamSpec::float("distortion", 0.0, ANY, "", "How far noise moves the point first."),
            ParamSpec::text(
                "fractal",
                "fbm",
                "fbm|multifractal|hetero_terrain|hybrid|ridged",
                "How octaves become one number.",
            ),
            ParamSpec::text("dimensions", "3", "1|2|3|4", "How many coordinates of the point count."),
            ParamSpec::text("normalize", "true", "true|false", "Whether fbm is brought to [0, 1]."),
            ParamSpec::text("output", "value", "value|color", "A number, or three that are independent."),
        ],
    };

    fn build(inputs: &mut Inputs) -> Self {
        Self {
            vector: inputs.point("vector"),
            w: inputs.operand("w"),
            scale: inputs.operand("scale"),
            detail: inputs.operand("detail"),
            roughness: inputs.operand("roughness"),
            lacunarity: inputs.operand("lacunarity"),
            offset: inputs.operand("offset"),
            gain: inputs.operand("gain"),
            distortion: inputs.operand("distortion"),
            fractal: match inputs.choice("fractal") {
                "multifractal" => Fractal::Multifractal,
                "hetero_terrain" => Fractal::HeteroTerrain,
                "hybrid" => Fractal::Hybrid,
                "ridged" => Fractal::Ridged,
                _ => Fractal::Fbm,
            },
            dimensions: match inputs.choice("dimensions") {
                "1" => 1,
                "2" => 2,
                "4" => 4,
                _ => 3,
            },
            is_normalized: inputs.choice("normalize") == "true",
            is_color: inputs.choice("output") == "color",
        }
    }

    fn operands(&self) -> Vec<Operand> {
        vec![
            self.vector,
            self.w,
            self.scale,
            self.detail,
            self.roughness,
            self.lacunarity,
            self.offset,
            self.gain,
            self.distortion,
        ]
    }

    fn evaluate(&self, registers: &[Value], _: &dyn ShadingContext) -> Value {
        let octaves = Octaves {
            fractal: self.fractal,
            detail: self.detail.number(registers),
            roughness: self.roughness.number(registers),
            lacunarity: self.lacunarity.number(registers),
            offset: self.offset.number(registers),
            gain: self.gain.number(registers),
            is_normalized: self.is_normalized,
        };
        let distortion = self.distortion.number(registers);
        let scale = self.scale.number(registers);
        let [x, y, z, _] = self.vector.value(registers).map(|v| v * scale);
        let w = self.w.number(registers) * scale;
        match self.dimensions {
            1 => self.value(&octaves, distortion, [w]),
            2 => self.value(&octaves, distortion, [x, y]),
            4 => self.value(&octaves, distortion, [x, y, z, w]),
            _ => self.value(&octaves, distortion, [x, y, z]),
        }
    }
}

impl Noise {
    /// The offsets of what is added are numbered: first those of the distortion's axes, then those of the channels.
    fn value<const N: usize>(&self, octaves: &Octaves, distortion: f32, mut p: Point<N>) -> Value
    where
        Grid: Lattice<N>,
    {
        let moved = |p: &Point<N>, seed: usize| {
            let offset = random_offset::<N>(seed as f32);
            from_fn(|axis| p[axis] + offset[axis])
        };
        if distortion != 0.0 {
            p = from_fn(|axis| p[axis] + noise(&moved(&p, axis)) * distortion);
        }
        let value = octaves.at(&p);
        if !self.is_color {
            return [value; 4];
        }
        [value, octaves.at(&moved(&p, N)), octaves.at(&moved(&p, N + 1)), 1.0]
    }
}
