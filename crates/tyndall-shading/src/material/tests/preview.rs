//! UsdPreviewSurface's semantics.

use super::*;

#[test]
fn the_lambert_spelling_leaves_no_specular_lobe() {
    let params = PreviewParams {
        diffuse_color: grey(0.6),
        use_specular_workflow: true,
        specular_color: Rgb::ZERO,
        ior: 1.0,
        roughness: 1.0,
        ..PreviewParams::default()
    };
    let bsdf = params.bsdf(false);
    for wo in views().into_iter().filter(|wo| wo.z > 0.0) {
        let wi = Vec3A::new(0.0, 0.6, 0.8);
        let value = bsdf.evaluate(&frame(), wo, wi);
        assert_eq!(value.glossy, Rgb::ZERO);
        assert!((value.diffuse.x - 0.6 * 0.8 / PI).abs() < 1e-6);
        assert!((value.pdf - 0.8 / PI).abs() < 1e-6);
    }
}

#[test]
fn preview_glass_is_a_smooth_dielectric() {
    let glass = PreviewParams { opacity: 0.0, roughness: 0.0, ior: 1.5, ..PreviewParams::default() };
    let expected = Bsdf::from(Dielectric::new(1.5, 0.0, grey(1.0), ScatterMode::Both));
    assert_eq!(glass.bsdf(true), expected);
    assert_ne!(glass.bsdf(false), expected, "a hole in an opacity map is no glass");
}

#[test]
fn opacity_modes() {
    let base = PreviewParams { opacity: 0.25, ior: 1.5, roughness: 0.0, ..PreviewParams::default() };
    let transparent = base.bsdf(false);
    assert!((transparent.transparency().x - 0.75 * 0.96).abs() < 1e-5);
    let presence = PreviewParams { opacity_mode: OpacityMode::Presence, ..base };
    assert!((presence.bsdf(false).transparency().x - 0.75).abs() < 1e-6);
    assert_eq!(presence.presence(), 0.25);
    // Highlights at normal incidence stay in one mode and shrink in the other.
    let highlight = |bsdf: &Bsdf| {
        let n = 4000;
        let mut rng = Pcg::new(&[4]);
        let drawn = (0..n).filter_map(|_| draw(bsdf, &frame(), Vec3A::Z, &mut rng)).filter(|s| s.is_delta);
        drawn.map(|s| s.weight.x).sum::<f32>() / n as f32
    };
    assert!((highlight(&transparent) - 0.04).abs() < 5e-3);
    assert!((highlight(&presence.bsdf(false)) - 0.01).abs() < 2e-3);
}

#[test]
fn the_threshold_cuts() {
    for (opacity, is_there) in [(0.49, false), (0.5, true), (0.9, true)] {
        let p = PreviewParams { opacity, opacity_threshold: 0.5, ..PreviewParams::default() };
        assert_eq!(p.bsdf(false).transparency(), if is_there { Rgb::ZERO } else { Rgb::ONE });
        assert_eq!(p.presence(), f32::from(is_there));
    }
}

#[test]
fn white_plastic_keeps_all_energy() {
    for roughness in [0.0, 0.3, 0.6, 1.0] {
        let p = PreviewParams { diffuse_color: grey(1.0), roughness, ..PreviewParams::default() };
        for wo in views().into_iter().filter(|wo| wo.z.abs() > 0.05) {
            let (mean, sigma) = furnace(&p.bsdf(false), &frame(), wo, 20_000);
            assert!((mean - 1.0).abs() < 5.0 * sigma + 1e-2, "roughness {roughness} {wo}: {mean}");
        }
    }
}

#[test]
fn metals_have_the_colour_of_the_base_at_every_angle() {
    let base = Rgb::new(0.9, 0.6, 0.3);
    let p = PreviewParams { diffuse_color: base, metallic: 1.0, roughness: 0.0, ..PreviewParams::default() };
    for wo in views() {
        let s = p.bsdf(false).sample(&frame(), wo, [0.5; 3]).expect("a reflection");
        assert!((s.weight - base).length() < 1e-4, "{wo}: {}", s.weight);
    }
}

proptest::proptest! {
    #![proptest_config(proptest::prelude::ProptestConfig { cases: 200, failure_persistence: None, ..Default::default() })]

    #[test]
    fn no_combination_of_inputs_makes_energy(
        (base, specular, metallic, roughness) in (0f32..=1.0, 0f32..=1.0, 0f32..=1.0, 0f32..=1.0),
        (clearcoat, clearcoat_roughness, opacity, ior) in (0f32..=1.0, 0f32..=1.0, 0f32..=1.0, 1f32..=2.5),
        (cos, use_specular_workflow, is_presence) in (0.01f32..=1.0, proptest::bool::ANY, proptest::bool::ANY),
    ) {
        let params = PreviewParams {
            diffuse_color: grey(base),
            use_specular_workflow,
            specular_color: grey(specular),
            metallic,
            roughness,
            clearcoat,
            clearcoat_roughness,
            opacity,
            opacity_mode: if is_presence { OpacityMode::Presence } else { OpacityMode::Transparent },
            opacity_threshold: 0.0,
            ior,
        };
        let wo = Vec3A::new((1.0 - cos * cos).sqrt(), 0.0, cos);
        let (mean, sigma) = furnace(&params.bsdf(false), &frame(), wo, 4000);
        proptest::prop_assert!(mean <= 1.0 + 5.0 * sigma + 5e-3, "{params:?} from {wo}: {mean} +- {sigma}");
    }
}

#[test]
fn a_bsdf_stays_small() {
    assert!(size_of::<Bsdf>() <= 1024, "{} bytes", size_of::<Bsdf>());
}
