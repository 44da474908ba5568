//! Media.

use super::*;
use tyndall_math::Rgb;

fn term(color: Rgb, source: EmissionSource) -> EmissionTerm {
    EmissionTerm { color, source }
}

fn field(name: &str) -> EmissionSource {
    EmissionSource::Field(name.to_owned())
}

#[test]
fn constants_are_homogeneous() {
    let (volume, messages) = medium(vec![node(
        "volume",
        [("absorption", vector(0.1, 0.2, 0.3)), ("scattering", float(2.0)), ("anisotropy", float(0.7))],
    )]);
    assert!(messages.is_empty(), "{messages:?}");
    let expected = VolumeMaterial {
        sigma_a: Rgb::new(0.1, 0.2, 0.3),
        sigma_s: Rgb::splat(2.0),
        density_field: None,
        tint: None,
        phase: PhaseModel::lobe(0.7),
        emission: Vec::new(),
        program: None,
    };
    assert_eq!(volume, Some(expected));
}

#[test]
fn products_with_fields() {
    let (volume, messages) = medium(vec![
        node("field", [("name", text("density"))]),
        node("field", [("name", text("flame"))]),
        node("multiply", [("in1", vector(1.0, 2.0, 3.0)), ("in2", link(0))]),
        node("add", [("in1", float(1.0)), ("in2", float(1.0))]),
        node("multiply", [("in1", link(2)), ("in2", link(3))]),
        node("multiply", [("in1", float(5.0)), ("in2", link(1))]),
        node("volume", [("scattering", link(4)), ("absorption", link(2)), ("emission", link(5))]),
    ]);
    assert!(messages.is_empty(), "{messages:?}");
    let volume = volume.expect("a medium");
    assert_eq!(volume.sigma_s, Rgb::new(2.0, 4.0, 6.0));
    assert_eq!(volume.sigma_a, Rgb::new(1.0, 2.0, 3.0));
    assert_eq!(volume.emission, [term(Rgb::splat(5.0), field("flame"))]);
    assert_eq!(volume.density_field.as_deref(), Some("density"));
}

/// An albedo that is a field: what it gives to scattering it takes from absorption.
#[test]
fn a_second_field_tints_the_first() {
    let fields = || vec![node("field", []), node("field", [("name", text("Cd"))])];
    let products = [
        node("multiply", [("in1", link(1)), ("in2", link(0))]),
        node("multiply", [("in1", float(2.0)), ("in2", link(2))]),
        node("multiply", [("in1", float(2.0)), ("in2", link(0))]),
        node("subtract", [("in1", link(4)), ("in2", link(3))]),
        node("volume", [("scattering", link(3)), ("absorption", link(5)), ("emission", link(2))]),
    ];
    let (volume, messages) = medium(fields().into_iter().chain(products).collect());
    assert!(messages.is_empty(), "{messages:?}");
    let volume = volume.expect("a medium");
    assert_eq!((volume.sigma_a, volume.sigma_s), (Rgb::splat(2.0), Rgb::ZERO));
    assert_eq!(volume.density_field.as_deref(), Some("density"));
    let tint = VolumeTint { field: "Cd".to_owned(), sigma_a: Rgb::splat(-2.0), sigma_s: Rgb::splat(2.0) };
    assert_eq!(volume.tint, Some(tint));
    assert_eq!(volume.emission[0].source, EmissionSource::Product("Cd".to_owned(), "density".to_owned()));

    // Without the field that is in both, the order decides; less than nothing is cut.
    let product = node("multiply", [("in1", link(0)), ("in2", link(1))]);
    let negative = node("multiply", [("in1", float(-1.0)), ("in2", link(2))]);
    let volume = node("volume", [("scattering", link(2)), ("absorption", link(3))]);
    let (volume, messages) = medium(fields().into_iter().chain([product, negative, volume]).collect());
    assert!(messages.len() == 1 && messages[0].contains("absorption"), "{messages:?}");
    let tint = VolumeTint { field: "Cd".to_owned(), sigma_a: Rgb::ZERO, sigma_s: Rgb::ONE };
    assert_eq!(volume.expect("a medium").tint, Some(tint));
}

#[test]
fn zero_absorption_joins_any_field() {
    let (volume, messages) = medium(vec![
        node("field", []),
        node("volume", [("scattering", link(0)), ("absorption", float(0.0))]),
    ]);
    assert!(messages.is_empty(), "{messages:?}");
    assert_eq!(volume.expect("a medium").density_field.as_deref(), Some("density"));
}

#[test]
fn what_is_more_general_is_reported() {
    let report = |nodes: Vec<ShadingNode>| {
        let (volume, messages) = medium(nodes);
        assert!(
            !messages.is_empty() && messages[0].contains("/Mat") && messages[0].contains("node"),
            "{messages:?}"
        );
        volume
    };
    report(vec![
        node("field", []),
        node("multiply", [("in1", link(0)), ("in2", link(0))]),
        node("multiply", [("in1", link(0)), ("in2", link(1))]),
        node("volume", [("scattering", link(2))]),
    ]);
    report(vec![
        node("field", []),
        node("field", [("name", text("other"))]),
        node("volume", [("scattering", link(0)), ("absorption", link(1))]),
    ]);
    report(vec![node("primvar", []), node("volume", [("scattering", link(0))])]);
    report(vec![node("volume", [("density", float(1.0))])]);
    assert!(report(vec![node("diffuse", [])]).is_none());
}

/// Nodes, and what the program of the last one says where the position and all fields are `at`.
fn program(nodes: Vec<ShadingNode>, at: f32) -> PointCoefficients {
    let (volume, messages) = medium(nodes);
    assert!(messages.is_empty(), "{messages:?}");
    let program = volume.and_then(|volume| volume.program).expect("a program");
    program.evaluate(&Everywhere([at; 4]))
}

#[test]
fn what_is_no_sum_of_products_is_a_program() {
    let with_one = program(
        vec![
            node("field", [("name", text("smoke"))]),
            node("add", [("in1", link(0)), ("in2", float(1.0))]),
            node("volume", [("scattering", link(1))]),
        ],
        2.0,
    );
    assert_eq!(with_one.sigma_s, Rgb::splat(3.0));
    let clamped = program(
        vec![node("field", []), node("clamp", [("in", link(0))]), node("volume", [("absorption", link(1))])],
        2.0,
    );
    assert_eq!((clamped.sigma_a, clamped.sigma_s), (Rgb::ONE, Rgb::ZERO));
    let noise =
        vec![node("noise", []), node("volume", [("scattering", link(0)), ("temperature", float(1500.0))])];
    let found = program(noise, 0.3);
    assert!(found.sigma_s.x > 0.0 && found.sigma_s.x < 1.0 && found.emission.x > 0.0);
    let negative =
        vec![node("coordinate", []), node("volume", [("scattering", link(0)), ("emission", link(0))])];
    assert_eq!(program(negative, -1.0).sigma_s, Rgb::ZERO);
}

#[test]
fn what_only_surfaces_have_is_reported_in_programs() {
    let (volume, messages) = medium(vec![
        node("primvar", []),
        node("coordinate", []),
        node("multiply", [("in1", link(0)), ("in2", link(1))]),
        node("volume", [("scattering", link(2))]),
    ]);
    assert!(volume.is_some_and(|volume| volume.program.is_some()));
    assert!(messages.iter().any(|m| m.contains("node 0 (primvar)")), "{messages:?}");
}

#[test]
fn unphysical_values_are_limited_with_a_message() {
    let with = |absorption: f32, scattering: f32, g: f32| {
        let inputs =
            [("absorption", float(absorption)), ("scattering", float(scattering)), ("anisotropy", float(g))];
        let (volume, messages) = medium(vec![node("volume", inputs)]);
        (volume.expect("a medium"), messages.len())
    };
    // Albedo 1.1 and -0.5 of an extinction of 1.
    let (volume, n) = with(-0.1, 1.1, 0.0);
    assert_eq!((volume.sigma_a, n), (Rgb::ZERO, 1));
    let (volume, n) = with(1.5, -0.5, 0.0);
    assert_eq!((volume.sigma_s, n), (Rgb::ZERO, 1));
    let (volume, n) = with(0.0, 1.0, 2.0);
    assert_eq!((volume.phase, n), (PhaseModel::lobe(0.99999), 1));
    let (volume, n) = with(0.0, 1.0, -1.0);
    assert_eq!((volume.phase, n), (PhaseModel::lobe(-0.99999), 0));
    let (volume, n) = with(f32::NAN, 1.0, f32::NAN);
    assert_eq!((volume.sigma_a, volume.phase, n), (Rgb::ZERO, PhaseModel::lobe(0.0), 2));
}

fn volume_with<const N: usize>(inputs: [(&str, NodeInput); N]) -> (VolumeMaterial, Vec<String>) {
    let (volume, messages) = medium(vec![node("volume", inputs)]);
    (volume.expect("a medium"), messages)
}

#[test]
fn phase_functions_by_name() {
    let g = ("anisotropy", float(0.75));
    let (volume, messages) = volume_with([g.clone(), ("anisotropy2", float(-0.3)), ("lobeMix", float(0.2))]);
    assert!(messages.is_empty(), "{messages:?}");
    assert_eq!(volume.phase, PhaseModel::Lobes { g: 0.75, g2: -0.3, mix: 0.2 });
    let (volume, messages) = volume_with([("phase", text("rayleigh"))]);
    assert_eq!((volume.phase, messages.len()), (PhaseModel::Rayleigh, 0));
    let (volume, messages) = volume_with([("phase", text("draine")), g.clone(), ("alpha", float(30.0))]);
    assert_eq!((volume.phase, messages.len()), (PhaseModel::Draine { g: 0.75, alpha: 30.0 }, 0));
    let (volume, messages) = volume_with([("phase", text("droplets")), ("dropletDiameter", float(8.0))]);
    assert_eq!((volume.phase, messages.len()), (PhaseModel::Droplets { diameter: 8.0 }, 0));
}

#[test]
fn phase_inputs_that_do_not_fit_are_named() {
    let (volume, messages) = volume_with([("phase", text("mie"))]);
    assert_eq!(volume.phase, PhaseModel::lobe(0.0));
    assert!(messages[0].contains("mie") && messages[0].contains("droplets"), "{messages:?}");
    let (_, messages) = volume_with([("phase", text("rayleigh")), ("anisotropy", float(0.5))]);
    assert!(messages[0].contains("rayleigh") && messages[0].contains("anisotropy"), "{messages:?}");
    let (volume, messages) = volume_with([("phase", text("droplets")), ("dropletDiameter", float(200.0))]);
    assert_eq!(volume.phase, PhaseModel::Droplets { diameter: 50.0 });
    assert!(messages[0].contains("dropletDiameter") && messages[0].contains("200"), "{messages:?}");
}

#[test]
fn a_black_body_by_temperature() {
    let (volume, messages) =
        volume_with([("temperature", float(1500.0)), ("blackbodyIntensity", vector(1.0, 0.5, 0.0))]);
    assert!(messages.is_empty(), "{messages:?}");
    let constant = EmissionSource::Blackbody { kelvin: 1500.0, field: None };
    assert_eq!(volume.emission, [term(Rgb::new(1.0, 0.5, 0.0), constant)]);
    assert!(!volume.reads_fields());
    let (volume, messages) = medium(vec![
        node("field", [("name", text("temperature"))]),
        node("multiply", [("in1", float(2000.0)), ("in2", link(0))]),
        node("volume", [("temperature", link(1))]),
    ]);
    assert!(messages.is_empty(), "{messages:?}");
    let volume = volume.expect("a medium");
    let by_field = EmissionSource::Blackbody { kelvin: 2000.0, field: Some("temperature".to_owned()) };
    assert_eq!(volume.emission, [term(Rgb::ONE, by_field)]);
    assert!(volume.reads_fields());
    assert_eq!(volume_with([("blackbodyIntensity", float(2.0))]).1.len(), 1);
}

/// MaterialX's node: a colour where the temperature is constant, with the brightness of Planck's law in a field.
#[test]
fn blackbody_nodes() {
    let (volume, messages) = medium(vec![
        node("blackbody", [("temperature", float(3000.0))]),
        node("field", [("name", text("flame"))]),
        node("multiply", [("in1", link(0)), ("in2", link(1))]),
        node("volume", [("emission", link(2))]),
    ]);
    assert!(messages.is_empty(), "{messages:?}");
    assert_eq!(
        volume.expect("a medium").emission,
        [term(tyndall_math::blackbody_color(3000.0), field("flame"))]
    );
    let (volume, messages) = medium(vec![
        node("field", [("name", text("temperature"))]),
        node("blackbody", [("temperature", link(0))]),
        node("multiply", [("in1", float(3.0)), ("in2", link(1))]),
        node("volume", [("emission", link(2))]),
    ]);
    assert!(messages.len() == 1 && messages[0].contains("Stefan"), "{messages:?}");
    let by_field = EmissionSource::Blackbody { kelvin: 1.0, field: Some("temperature".to_owned()) };
    assert_eq!(volume.expect("a medium").emission, [term(Rgb::splat(3.0), by_field)]);
}

#[test]
fn emission_is_a_sum_of_fields() {
    let (volume, messages) = medium(vec![
        node("field", [("name", text("fire"))]),
        node("field", [("name", text("sparks"))]),
        node("multiply", [("in1", vector(1.0, 0.5, 0.0)), ("in2", link(0))]),
        node("add", [("in1", link(2)), ("in2", link(1))]),
        node("add", [("in1", link(3)), ("in2", link(0))]),
        node("add", [("in1", link(4)), ("in2", float(0.25))]),
        node("volume", [("emission", link(5)), ("temperature", float(900.0))]),
    ]);
    assert!(messages.is_empty(), "{messages:?}");
    let expected = [
        term(Rgb::new(2.0, 1.5, 1.0), field("fire")),
        term(Rgb::ONE, field("sparks")),
        term(Rgb::splat(0.25), EmissionSource::Constant),
        term(Rgb::ONE, EmissionSource::Blackbody { kelvin: 900.0, field: None }),
    ];
    assert_eq!(volume.expect("a medium").emission, expected);
}
