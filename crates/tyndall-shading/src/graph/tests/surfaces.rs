//! Surfaces.

use super::*;
use crate::{Bsdf, ShadingFrame};
use tyndall_math::{INV_PI, Rgb};

/// The albedo of a Lambertian surface.
fn albedo(bsdf: &Bsdf) -> Rgb {
    bsdf.eval(&ShadingFrame::flat(Vec3A::Z), Vec3A::Z, Vec3A::Z) / INV_PI
}

fn near(a: Rgb, b: Rgb) -> bool {
    (a - b).length() < 1e-5
}

#[test]
fn constants_are_folded() {
    let (m, messages) = surface(vec![
        node("multiply", [("in1", vector(0.5, 1.0, 0.25)), ("in2", float(0.5))]),
        node("add", [("in1", link(0)), ("in2", vector(0.1, 0.0, 0.0))]),
        node("clamp", [("in", link(1)), ("high", float(0.3))]),
        node("mix", [("bg", link(2)), ("fg", vector(1.0, 1.0, 1.0)), ("mix", float(0.5))]),
        node("diffuse", [("color", link(3)), ("weight", float(0.5))]),
    ]);
    assert!(messages.is_empty(), "{messages:?}");
    let shading = m.constant().expect("a constant material");
    assert!(near(albedo(&shading.bsdf), Rgb::new(0.325, 0.325, 0.28125)));
    assert!(m.is_opaque() && !m.is_emissive() && m.emission_constant() == Some(Rgb::ZERO));
}

#[test]
fn images_follow_st_scale_and_bias() {
    let (m, messages) = surface(vec![
        node(
            "image",
            [("file", text("map.png")), ("scale", vector(0.5, 1.0, 1.0)), ("bias", vector(0.0, 0.0, 0.1))],
        ),
        node("diffuse", [("color", link(0))]),
    ]);
    assert!(messages.is_empty(), "{messages:?}");
    assert_eq!(m.required_primvars(), ["st"]);
    assert!(m.constant().is_none() && m.is_opaque());
    let shading = m.evaluate(&Everywhere([0.25, 0.25, 0.0, 1.0]));
    assert!(near(albedo(&shading.bsdf), Rgb::new(0.3, 0.3, 0.1)));
    let (m, _) = surface(vec![
        node("primvar", [("name", text("uv2"))]),
        node(
            "transform2d",
            [("in", link(0)), ("rotation", float(90.0)), ("translation", vector(1.0, 0.0, 0.0))],
        ),
        node("image", [("file", text("map.png")), ("st", link(1)), ("wrap_s", text("repeat"))]),
        node("channel", [("in", link(2)), ("channel", text("g"))]),
        node("diffuse", [("color", link(3))]),
    ]);
    assert_eq!(m.required_primvars(), ["uv2"]);
    // (0.75, 0.25) turned by 90 degrees and moved is (0.75, 0.75).
    let shading = m.evaluate(&Everywhere([0.75, 0.25, 0.0, 1.0]));
    assert!(near(albedo(&shading.bsdf), Rgb::splat(0.2)));
}

#[test]
fn missing_files_kinds_inputs_and_connections_are_named() {
    let (m, messages) = surface(vec![
        node("image", [("file", text("gone.png")), ("fallback", vector(0.3, 0.2, 0.1))]),
        node("diffuse", [("color", link(0))]),
    ]);
    assert!(
        messages.len() == 1 && messages[0].contains("gone.png") && messages[0].contains("/Mat"),
        "{messages:?}"
    );
    assert!(near(albedo(&m.evaluate(&()).bsdf), Rgb::new(0.3, 0.2, 0.1)));

    let (m, messages) = surface(vec![node("velvet", [])]);
    assert!(messages.iter().any(|m| m.contains("velvet") && m.contains("preview_surface")), "{messages:?}");
    assert!(near(albedo(&m.evaluate(&()).bsdf), Rgb::splat(FALLBACK_ALBEDO)));

    let (_, messages) = surface(vec![node("diffuse", [("colour", float(1.0))])]);
    assert!(
        messages[0].contains("colour") && messages[0].contains("color, roughness, weight"),
        "{messages:?}"
    );

    for target in [1, 2, 9] {
        let nodes = vec![node("add", []), node("diffuse", [("color", link(target))]), node("add", [])];
        let (m, messages) = compile(&Material { nodes, surface: Some(1), volume: None });
        assert_eq!(messages.len(), 1, "{messages:?}");
        assert!(near(albedo(&m.evaluate(&()).bsdf), Rgb::splat(0.18)));
    }
    let (_, messages) = surface(vec![node("diffuse", []), node("diffuse", [("color", link(0))])]);
    assert!(messages[0].contains("node 0 (diffuse)"), "{messages:?}");
    let (_, messages) = surface(vec![node("field", []), node("diffuse", [("color", link(0))])]);
    assert_eq!(messages.len(), 1);
    let (_, messages) = surface(vec![node("diffuse", [("color", vector(2.0, 0.5, -1.0))])]);
    assert!(messages[0].contains("outside"), "{messages:?}");
    let (m, messages) = compile(&Material { nodes: Vec::new(), surface: Some(3), volume: Some(3) });
    assert!(messages.len() == 2 && m.has_surface() && m.volume().is_none());
}

#[test]
fn surface_puts_opacity_on_everything() {
    let (m, messages) = surface(vec![
        node("diffuse", [("color", float(0.8))]),
        node("emission", [("color", vector(2.0, 4.0, 6.0))]),
        node("surface", [("bsdf", link(0)), ("emission", link(1)), ("opacity", float(0.25))]),
    ]);
    assert!(messages.is_empty(), "{messages:?}");
    let shading = m.constant().expect("a constant material");
    assert!(near(albedo(&shading.bsdf), Rgb::splat(0.2)));
    assert!(near(shading.emission, Rgb::new(0.5, 1.0, 1.5)));
    assert!(near(shading.bsdf.transparency(), Rgb::splat(0.75)) && (shading.opacity - 0.25).abs() < 1e-6);
    assert!(!m.is_opaque() && m.is_emissive());
    let (m, _) = surface(vec![node("surface", [("emission", vector(1.0, 2.0, 3.0))])]);
    assert_eq!(m.emission_constant(), Some(Rgb::new(1.0, 2.0, 3.0)));
}

#[test]
fn mixes_follow_their_weight() {
    let (m, messages) = surface(vec![
        node("primvar", [("name", text("mask"))]),
        node("diffuse", [("color", float(1.0))]),
        node("transparent", []),
        node("mix_closure", [("a", link(1)), ("b", link(2)), ("mix", link(0))]),
    ]);
    assert!(messages.is_empty() && !m.is_opaque());
    let shading = m.evaluate(&Everywhere([0.25; 4]));
    assert!(near(albedo(&shading.bsdf), Rgb::splat(0.75)));
    assert!(near(shading.bsdf.transparency(), Rgb::splat(0.25)));
    let mut nodes = vec![node("diffuse", [])];
    for i in 0..6 {
        nodes.push(node("mix_closure", [("a", link(i)), ("b", link(0))]));
    }
    let (_, messages) = surface(nodes);
    assert!(messages.iter().any(|m| m.contains("more than 4")), "{messages:?}");
}

#[test]
fn long_and_wide_graphs_end() {
    let mut nodes = vec![node("primvar", [])];
    for i in 0..50_000 {
        nodes.push(node("add", [("in1", link(i)), ("in2", link(i))]));
    }
    nodes.push(node("diffuse", [("color", link(50_000))]));
    let (m, messages) = surface(nodes);
    assert!(messages.iter().any(|m| m.contains("varying nodes")), "{messages:?}");
    assert!(m.evaluate(&()).opacity == 1.0);
    let mut nodes = vec![node("diffuse", [])];
    for i in 0..200 {
        nodes.push(node("mix_closure", [("a", link(i)), ("b", link(i))]));
    }
    assert!(surface(nodes).0.is_opaque());
}

#[test]
fn preview_surface_in_the_graph() {
    let glass =
        node("preview_surface", [("opacity", float(0.0)), ("roughness", float(0.0)), ("ior", float(1.5))]);
    let (m, messages) = surface(vec![glass]);
    assert!(messages.is_empty(), "{messages:?}");
    assert!(m.is_opaque() && m.evaluate(&()).bsdf.is_delta_only(), "glass refracts, shadow rays do not pass");

    let cut = |mode: &'static str| {
        surface(vec![
            node("primvar", [("name", text("alpha"))]),
            node(
                "preview_surface",
                [
                    ("opacity", link(0)),
                    ("opacityMode", text(mode)),
                    ("emissiveColor", vector(3.0, 2.0, 1.0)),
                    ("diffuseColor", float(0.5)),
                ],
            ),
        ])
        .0
    };
    let presence = cut("presence");
    assert!(!presence.is_opaque() && presence.is_emissive() && presence.emission_constant().is_none());
    let shading = presence.evaluate(&Everywhere([0.5; 4]));
    assert!(near(shading.emission, Rgb::new(1.5, 1.0, 0.5)) && (shading.opacity - 0.5).abs() < 1e-5);
    let transparent = cut("transparent");
    assert_eq!(transparent.emission_constant(), Some(Rgb::new(3.0, 2.0, 1.0)));
}

#[test]
fn normal_maps_are_tangent_space_normals() {
    let with = |encoded: NodeInput| {
        let nodes =
            vec![node("normal_map", [("in", encoded)]), node("preview_surface", [("normal", link(0))])];
        surface(nodes).0.evaluate(&()).normal
    };
    assert_eq!(with(vector(0.5, 0.5, 1.0)), None);
    let tilted = with(vector(0.8, 0.5, 0.9)).expect("a normal");
    assert!((tilted - Vec3A::new(0.6, 0.0, 0.8)).length() < 1e-5);
    let frame = ShadingFrame::flat(Vec3A::Y).with_tangent_space_normal(tilted, Vec3A::X, 1.0);
    assert!((frame.frame.normal - Vec3A::new(0.6, 0.8, 0.0)).length() < 1e-5);
}

#[test]
fn closures_add_up_and_tinted_glass_passes_its_colour() {
    let (material, messages) = surface(vec![
        node("diffuse", [("color", vector(0.25, 0.5, 0.125))]),
        node("transparent", [("color", vector(0.5, 0.25, 0.125))]),
        node("emission", [("color", vector(2.0, 0.0, 0.0))]),
        node("add_closure", [("a", link(0)), ("b", link(1))]),
        node("add_closure", [("a", link(3)), ("b", link(2))]),
    ]);
    assert!(messages.is_empty(), "{messages:?}");
    let shading = material.evaluate(&());
    assert_eq!(shading.bsdf.transparency(), Rgb::new(0.5, 0.25, 0.125));
    assert_eq!(shading.emission, Rgb::new(2.0, 0.0, 0.0));
    assert!(near(albedo(&shading.bsdf), Rgb::new(0.25, 0.5, 0.125)));
    assert!(!material.is_opaque());
}
