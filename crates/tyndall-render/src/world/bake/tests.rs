use super::*;
use std::path::Path;
use tyndall_scene::prim::{Material, NodeInput, ShadingNode};
use tyndall_scene::{AssetError, AssetLoader, ColorSpace, Diagnostics, ImageData};
use tyndall_shading::CompiledMaterial;

struct NoFiles;

impl AssetLoader for NoFiles {
    fn image(&self, path: &Path, _: ColorSpace) -> Result<Arc<ImageData>, AssetError> {
        Err(AssetError { message: format!("{}: no files in this test", path.display()) })
    }
}

fn node<const N: usize>(kind: &str, inputs: [(&str, NodeInput); N]) -> ShadingNode {
    let inputs = inputs.into_iter().map(|(name, input)| (name.to_owned(), input)).collect();
    ShadingNode { kind: kind.to_owned(), inputs }
}

/// The last node is the volume; the box is 2 x 1 x 4, off the origin.
fn source(nodes: Vec<ShadingNode>) -> BakeSource {
    let mut diagnostics = Diagnostics::default();
    let volume = Some(nodes.len() - 1);
    let material = Material { nodes, surface: None, volume };
    let compiled = CompiledMaterial::compile(&"/Mat".into(), &material, &NoFiles, &mut diagnostics);
    assert!(diagnostics.is_empty(), "{diagnostics:?}");
    let program = compiled.volume().and_then(|volume| volume.program.clone()).expect("a program");
    let fields = vec![None; program.fields().len()];
    let (min, max) = (DVec3::new(5.0, -1.0, 0.0), DVec3::new(7.0, 0.0, 4.0));
    let world_from_object = DAffine3::IDENTITY;
    BakeSource { program, min, max, world_from_object, fields, least_cells: [1; 3], resolution: 128 }
}

/// What the grids say at a point of the object.
fn lookup(baked: &Baked, position: DVec3) -> Outputs {
    let p_index = baked.object_from_index.inverse().transform_point3(position).as_vec3a();
    let mut sum = [Rgb::ZERO; 3];
    for layer in &baked.layers {
        let density = layer.density.density(p_index);
        let value = layer.colors.as_ref().map_or(Rgb::splat(density), |colors| colors.color(p_index));
        (0..3).for_each(|i| sum[i] += layer.ratio[i] * value);
    }
    sum
}

/// Largest difference between grids and program, and the two means, of all outputs.
fn compare(source: &BakeSource, baked: &Baked) -> (f32, f32, f32) {
    let (mut most, mut ours, mut exact) = (0f32, 0.0, 0.0);
    for (position, found) in source.probes() {
        let kept = lookup(baked, position);
        for i in 0..3 {
            most = most.max((kept[i] - found[i]).abs().max_element());
            ours += kept[i].element_sum();
            exact += found[i].element_sum();
        }
    }
    (most, ours, exact)
}

fn axis(channel: &str) -> ShadingNode {
    node("channel", [("in", NodeInput::Node(0)), ("channel", NodeInput::Text(channel.to_owned()))])
}

#[test]
fn what_is_linear_is_exact_and_one_small_grid() {
    let source = source(vec![
        node("coordinate", []),
        axis("r"),
        node("multiply", [("in1", NodeInput::Vector([1.0, 2.0, 3.0])), ("in2", NodeInput::Node(1))]),
        node("volume", [("scattering", NodeInput::Node(2)), ("absorption", NodeInput::Node(1))]),
    ]);
    let baked = source.bake();
    assert_eq!(baked.layers.len(), 1);
    assert!(baked.layers[0].colors.is_none());
    assert_eq!(baked.layers[0].density.bounds().map(|[_, hi]| hi), Some(Vec3A::splat(9.0)));
    assert!(compare(&source, &baked).0 < 1e-5);
}

#[test]
fn noise_gets_the_voxels_it_needs() {
    let noise = |detail: f32| {
        source(vec![
            node("coordinate", [("space", NodeInput::Text("object".to_owned()))]),
            node("noise", [("vector", NodeInput::Node(0)), ("detail", NodeInput::Float(detail))]),
            node(
                "map_range",
                [
                    ("in", NodeInput::Node(1)),
                    ("from_min", NodeInput::Float(0.45)),
                    ("from_max", NodeInput::Float(0.7)),
                    ("clamp", NodeInput::Text("true".to_owned())),
                ],
            ),
            node("volume", [("scattering", NodeInput::Node(2))]),
        ])
    };
    let [coarse, fine] = [0.0, 4.0].map(noise);
    let (coarse_cells, error) = coarse.cells(&coarse.probes());
    assert!(error <= TOLERANCE);
    // The same noise along all axes, but the box is longest along z.
    assert!(coarse_cells[2] > coarse_cells[1], "{coarse_cells:?}");
    let (fine_cells, _) = fine.cells(&fine.probes());
    assert!((0..3).all(|axis| fine_cells[axis] >= coarse_cells[axis]) && fine_cells != coarse_cells);
    let baked = coarse.bake();
    let (_, ours, exact) = compare(&coarse, &baked);
    assert!((ours / exact - 1.0).abs() < 0.01, "{ours} {exact}");
}

#[test]
fn colours_that_vary_are_grids_of_colours() {
    let source = source(vec![
        node("coordinate", []),
        axis("r"),
        node("subtract", [("in1", NodeInput::Vector([1.0; 3])), ("in2", NodeInput::Node(0))]),
        node(
            "volume",
            [
                ("scattering", NodeInput::Node(0)),
                ("absorption", NodeInput::Node(2)),
                ("emission", NodeInput::Node(1)),
            ],
        ),
    ]);
    let baked = source.bake();
    let tinted: Vec<_> = baked.layers.iter().map(|layer| layer.colors.is_some()).collect();
    assert_eq!(tinted, [true, true, false]);
    assert!(compare(&source, &baked).0 < 1e-5);
}

/// Smaller than the distance of the points at which a program is tried.
#[test]
fn what_the_probes_miss_is_kept() {
    let source = source(vec![
        node("coordinate", [("space", NodeInput::Text("object".to_owned()))]),
        axis("r"),
        node(
            "math",
            [
                ("function", NodeInput::Text("less_than".to_owned())),
                ("in1", NodeInput::Node(1)),
                ("in2", NodeInput::Float(5.0 + 1e-6)),
            ],
        ),
        node("multiply", [("in1", NodeInput::Vector([1.0, 0.5, 0.0])), ("in2", NodeInput::Node(2))]),
        node("volume", [("scattering", NodeInput::Node(3)), ("absorption", NodeInput::Node(0))]),
    ]);
    let found = lookup(&source.bake(), source.min);
    assert!((found[1] - Rgb::new(1.0, 0.5, 0.0)).abs().max_element() < 1e-5, "{found:?}");
}

#[test]
fn flat_boxes_and_nonsense_are_no_trouble() {
    let mut flat = source(vec![node("noise", []), node("volume", [("scattering", NodeInput::Node(0))])]);
    flat.resolution = 32;
    flat.max.y = flat.min.y;
    assert!(flat.bake().layers.iter().all(|layer| layer.density.max_density().is_finite()));
    flat.max = DVec3::INFINITY;
    assert!(flat.bake().layers.iter().all(|layer| layer.density.max_density().is_finite()));
}
