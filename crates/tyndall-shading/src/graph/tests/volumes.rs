//! Media.

use super::*;
use tyndall_math::Rgb;

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
        emission: Rgb::ZERO,
        g: 0.7,
        density_field: None,
        emission_field: None,
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
    assert_eq!(volume.emission, Rgb::splat(5.0));
    assert_eq!(volume.density_field.as_deref(), Some("density"));
    assert_eq!(volume.emission_field.as_deref(), Some("flame"));
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
        node("add", [("in1", link(0)), ("in2", float(1.0))]),
        node("volume", [("scattering", link(1))]),
    ]);
    report(vec![
        node("field", []),
        node("multiply", [("in1", link(0)), ("in2", link(0))]),
        node("volume", [("scattering", link(1))]),
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
    assert_eq!((volume.g, n), (0.99999, 1));
    let (volume, n) = with(0.0, 1.0, -1.0);
    assert_eq!((volume.g, n), (-0.99999, 0));
    let (volume, n) = with(f32::NAN, 1.0, f32::NAN);
    assert_eq!((volume.sigma_a, volume.g, n), (Rgb::ZERO, 0.0, 2));
}
