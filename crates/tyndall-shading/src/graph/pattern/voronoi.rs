//! Distances to random points.

use super::Pattern;
use super::noise::{LACUNARITY, ROUGHNESS, SCALE, VECTOR};
use crate::KindSpec;
use crate::graph::inputs::Inputs;
use crate::graph::{Operand, ShadingContext, Value};
use crate::kind::{POSITIVE, ParamSpec, UNIT};
use crate::procedural::{self, Feature, Metric, Octaves};

#[derive(Debug, Clone, Copy)]
pub(in crate::graph) struct Voronoi {
    vector: Operand,
    scale: Operand,
    detail: Operand,
    roughness: Operand,
    lacunarity: Operand,
    smoothness: Operand,
    exponent: Operand,
    randomness: Operand,
    feature: Feature,
    metric: Metric,
    is_normalized: bool,
    output: Output,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Output {
    Distance,
    Color,
    Position,
}

impl Pattern for Voronoi {
    const KIND: KindSpec = KindSpec {
        name: "voronoi",
        doc: "Distances to random points, one in every cell of a lattice, as Blender defines it.",
        params: &[
            VECTOR,
            SCALE,
            ParamSpec::float("detail", 0.0, [0.0, Octaves::MOST], "", "Octaves after the first."),
            ROUGHNESS,
            LACUNARITY,
            ParamSpec::float(
                "smoothness",
                1.0,
                UNIT,
                "",
                "Of smooth_f1: how wide cells go over into each other.",
            ),
            ParamSpec::float("exponent", 0.5, POSITIVE, "", "Of Minkowski's metric."),
            ParamSpec::float("randomness", 1.0, UNIT, "", "How far points leave the corner of their cell."),
            ParamSpec::text(
                "feature",
                "f1",
                "f1|f2|smooth_f1|distance_to_edge",
                "The nearest point, the second, the nearest without edges, or the edge of the cell.",
            ),
            ParamSpec::text(
                "metric",
                "euclidean",
                "euclidean|manhattan|chebychev|minkowski",
                "How distances are measured.",
            ),
            ParamSpec::text("normalize", "false", "true|false", "Whether distances are brought to [0, 1]."),
            ParamSpec::text(
                "output",
                "distance",
                "distance|color|position",
                "The distance, a random colour of the cell, or the point that was found.",
            ),
        ],
    };

    fn build(inputs: &mut Inputs) -> Self {
        Self {
            vector: inputs.point("vector"),
            scale: inputs.operand("scale"),
            detail: inputs.operand("detail"),
            roughness: inputs.operand("roughness"),
            lacunarity: inputs.operand("lacunarity"),
            smoothness: inputs.operand("smoothness"),
            exponent: inputs.operand("exponent"),
            randomness: inputs.operand("randomness"),
            feature: match inputs.choice("feature") {
                "f2" => Feature::F2,
                "smooth_f1" => Feature::SmoothF1,
                "distance_to_edge" => Feature::DistanceToEdge,
                _ => Feature::F1,
            },
            metric: match inputs.choice("metric") {
                "manhattan" => Metric::Manhattan,
                "chebychev" => Metric::Chebychev,
                "minkowski" => Metric::Minkowski,
                _ => Metric::Euclidean,
            },
            is_normalized: inputs.choice("normalize") == "true",
            output: match inputs.choice("output") {
                "color" => Output::Color,
                "position" => Output::Position,
                _ => Output::Distance,
            },
        }
    }

    fn operands(&self) -> Vec<Operand> {
        vec![
            self.vector,
            self.scale,
            self.detail,
            self.roughness,
            self.lacunarity,
            self.smoothness,
            self.exponent,
            self.randomness,
        ]
    }

    fn evaluate(&self, registers: &[Value], _: &dyn ShadingContext) -> Value {
        let voronoi = procedural::Voronoi {
            feature: self.feature,
            metric: self.metric,
            exponent: self.exponent.number(registers),
            detail: self.detail.number(registers),
            roughness: self.roughness.number(registers),
            lacunarity: self.lacunarity.number(registers),
            smoothness: self.smoothness.number(registers),
            randomness: self.randomness.number(registers),
            is_normalized: self.is_normalized,
        };
        let scale = self.scale.number(registers);
        let found = voronoi.at(self.vector.vector(registers) * scale);
        let vector = |v: glam::Vec3A| [v.x, v.y, v.z, 1.0];
        match self.output {
            Output::Distance => [found.distance; 4],
            Output::Color => vector(found.color),
            Output::Position => vector(if scale == 0.0 { found.position } else { found.position / scale }),
        }
    }
}
