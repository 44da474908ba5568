//! Tests that every lobe must pass: samples follow the density, weights are value over density, no energy is made.

mod preview;
mod specular;

use super::*;
use crate::testing::Cap;
use std::f32::consts::PI;
use tyndall_math::Frame;
use tyndall_math::random::Pcg;

fn grey(x: f32) -> Rgb {
    Rgb::splat(x)
}

fn preview(params: PreviewParams) -> Bsdf {
    params.bsdf(false)
}

/// Every lobe over its parameters; all that reflects or transmits is white unless said otherwise.
fn bsdfs() -> Vec<(String, Bsdf)> {
    let mut all: Vec<(String, Bsdf)> = Vec::new();
    for r in [0.0, 0.4, 1.0] {
        all.push((format!("diffuse {r}"), Diffuse::new(grey(1.0), r).into()));
    }
    for r in [0.0, 0.15, 0.5, 1.0] {
        all.push((format!("conductor {r}"), Conductor::from_reflectance(grey(1.0), r).into()));
        let gold = Conductor::from_index(Rgb::new(0.14, 0.37, 1.44), Rgb::new(3.98, 2.38, 1.6), r);
        all.push((format!("gold {r}"), gold.into()));
        for ior in [1.5, 0.7, 2.4] {
            for mode in [ScatterMode::Both, ScatterMode::Reflect, ScatterMode::Transmit] {
                let glass = Dielectric::new(ior, r, grey(1.0), mode);
                all.push((format!("dielectric {ior} {r} {mode:?}"), glass.into()));
            }
        }
        let base = PreviewParams { diffuse_color: grey(1.0), roughness: r, ..PreviewParams::default() };
        all.push((format!("preview {r}"), preview(base)));
        all.push((format!("preview metal {r}"), preview(PreviewParams { metallic: 1.0, ..base })));
        let coated = PreviewParams { clearcoat: 1.0, clearcoat_roughness: 0.5, ..base };
        all.push((format!("preview coated {r}"), preview(coated)));
        for opacity in [0.0, 0.5, 0.9] {
            all.push((
                format!("preview opacity {opacity} {r}"),
                preview(PreviewParams { opacity, ..coated }),
            ));
        }
        let specular = PreviewParams { use_specular_workflow: true, specular_color: grey(0.5), ..base };
        all.push((format!("preview specular {r}"), preview(specular)));
    }
    let mixed = Bsdf::mix(&all[0].1, &Conductor::from_reflectance(grey(0.9), 0.3).into(), 0.4);
    all.push((
        "mixed".into(),
        Bsdf::mix(&mixed, &Dielectric::new(1.5, 0.3, grey(1.0), ScatterMode::Both).into(), 0.5),
    ));
    all
}

/// Towards the viewer: from normal to grazing, on both sides.
fn views() -> Vec<Vec3A> {
    [1.0f32, 0.8, 0.4, 0.1, 0.02, -0.6, -0.95]
        .map(|z| {
            let r = (1.0 - z * z).max(0.0).sqrt();
            Vec3A::new(r * 0.6, r * 0.8, z)
        })
        .to_vec()
}

fn frame() -> ShadingFrame {
    ShadingFrame::flat(Vec3A::Z)
}

fn draw(bsdf: &Bsdf, frame: &ShadingFrame, wo: Vec3A, rng: &mut Pcg) -> Option<BsdfSample> {
    bsdf.sample(frame, wo, [rng.next_f32(), rng.next_f32(), rng.next_f32()])
}

/// Scattered plus straight-through light where radiance 1 arrives from everywhere: radiance inside a body of index eta
/// is eta^2 times that outside. Straight-through and delta light counted; with the standard error.
fn furnace(bsdf: &Bsdf, frame: &ShadingFrame, wo: Vec3A, n: u32) -> (f32, f32) {
    let mut rng = Pcg::new(&[17]);
    let values: Vec<f64> = (0..n)
        .map(|_| draw(bsdf, frame, wo, &mut rng).map_or(0.0, |s| f64::from(s.weight.y * s.eta * s.eta)))
        .collect();
    let mean = values.iter().sum::<f64>() / f64::from(n);
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / f64::from(n);
    (mean as f32 + bsdf.transparency().y, (variance / f64::from(n)).sqrt() as f32)
}

#[test]
fn samples_follow_the_density_of_every_lobe() {
    let whole = Cap { frame: Frame::from_normal(Vec3A::new(0.1, -0.2, 0.97).normalize()), height: 2.0 };
    for (seed, (name, bsdf)) in bsdfs().into_iter().enumerate() {
        // Narrow lobes have their own test: the quadrature of the bins cannot resolve them.
        if bsdf.is_delta_only() || name.contains("0.15") {
            continue;
        }
        for wo in views() {
            let pdf = |wi| bsdf.pdf(&frame(), wo, wi);
            let sample =
                |rng: &mut Pcg| draw(&bsdf, &frame(), wo, rng).filter(|s| !s.is_delta).map(|s| s.direction);
            let p = whole.chi_square(seed as u64, 20_000, sample, pdf);
            assert!(p > 1e-6, "{name} from {wo}: p = {p:e}");
        }
    }
}

#[test]
fn narrow_lobes_follow_their_density() {
    for (bsdf, height) in [
        (Conductor::from_reflectance(grey(1.0), 0.15).into(), 0.008),
        (Dielectric::new(1.5, 0.15, grey(1.0), ScatterMode::Reflect).into(), 0.008),
        (Bsdf::from(Dielectric::new(1.5, 0.15, grey(1.0), ScatterMode::Transmit)), 0.001),
    ] {
        for wo in [Vec3A::new(0.48, 0.64, 0.6), Vec3A::new(0.0, 0.28, 0.96), Vec3A::new(0.3, 0.4, -0.866)] {
            let wo = wo.normalize();
            let mut rng = Pcg::new(&[2]);
            let axis = loop {
                if let Some(s) = draw(&bsdf, &frame(), wo, &mut rng) {
                    break s.direction;
                }
            };
            let cap = Cap { frame: Frame::from_normal(axis), height };
            let sample = |rng: &mut Pcg| draw(&bsdf, &frame(), wo, rng).map(|s| s.direction);
            let p = cap.chi_square(5, 40_000, sample, |wi| bsdf.pdf(&frame(), wo, wi));
            assert!(p > 1e-6, "from {wo}: p = {p:e}");
        }
    }
}

#[test]
fn weights_are_value_over_density() {
    for (name, bsdf) in bsdfs() {
        for wo in views() {
            let mut rng = Pcg::new(&[8]);
            for s in (0..300).filter_map(|_| draw(&bsdf, &frame(), wo, &mut rng)) {
                assert!((s.direction.length() - 1.0).abs() < 1e-5 && s.weight.is_finite());
                assert_eq!(s.is_transmission, s.direction.z * wo.z < 0.0, "{name}");
                if s.is_delta {
                    continue;
                }
                let value = bsdf.evaluate(&frame(), wo, s.direction);
                assert!((value.pdf / s.pdf - 1.0).abs() < 2e-2, "{name} {wo}: pdf {} {}", value.pdf, s.pdf);
                let weight = value.total() / value.pdf;
                assert!((weight - s.weight).length() < 2e-2 * s.weight.length() + 1e-4, "{name} {wo}");
            }
        }
    }
}

#[test]
fn no_lobe_makes_energy() {
    for (name, bsdf) in bsdfs() {
        for wo in views() {
            let (mean, sigma) = furnace(&bsdf, &frame(), wo, 10_000);
            assert!(mean <= 1.0 + 4.0 * sigma + 4e-3, "{name} from {wo}: {mean} +- {sigma}");
            assert!(bsdf.albedo(&frame(), wo).max_element() <= 1.0);
        }
    }
}

#[test]
fn reflection_is_reciprocal() {
    let mut rng = Pcg::new(&[6]);
    for (name, bsdf) in bsdfs() {
        for _ in 0..200 {
            let mut up = || {
                let u = glam::Vec2::new(rng.next_f32(), rng.next_f32());
                let d = tyndall_math::sampling::cosine_hemisphere(u);
                Vec3A::new(d.x, d.y, d.z.max(0.01)).normalize()
            };
            let (a, b) = (up(), up());
            let forth = bsdf.eval(&frame(), a, b) / b.z;
            let back = bsdf.eval(&frame(), b, a) / a.z;
            assert!((forth - back).length() <= 2e-3 * forth.length() + 1e-5, "{name}: {forth} {back}");
        }
    }
}

#[test]
fn transmission_obeys_the_reciprocity_of_radiance() {
    // f(wo, wi) / eta_i^2 = f(wi, wo) / eta_o^2 (Veach 1997, section 5.2).
    let bsdf = Bsdf::from(Dielectric::new(1.5, 0.5, grey(1.0), ScatterMode::Both));
    let mut rng = Pcg::new(&[6]);
    for wo in views().into_iter().filter(|wo| wo.z > 0.05) {
        for s in (0..200).filter_map(|_| draw(&bsdf, &frame(), wo, &mut rng)).filter(|s| s.is_transmission) {
            let wi = s.direction;
            let forth = bsdf.eval(&frame(), wo, wi).x / wi.z.abs();
            let back = bsdf.eval(&frame(), wi, wo).x / wo.z.abs();
            let expected = back / (1.5 * 1.5);
            assert!((forth / expected - 1.0).abs() < 2e-2, "{wo} {wi}: {forth} {expected}");
        }
    }
}

#[test]
fn shading_normals_do_not_leak_light_or_blacken_rims() {
    let tilted = ShadingFrame::new(Vec3A::Z, Vec3A::new(0.6, 0.0, 0.8));
    for (name, bsdf) in bsdfs() {
        let mut rng = Pcg::new(&[12]);
        for wo in views() {
            for s in (0..200).filter_map(|_| draw(&bsdf, &tilted, wo, &mut rng)) {
                assert_eq!(s.is_transmission, s.direction.z * wo.z < 0.0, "{name}");
                assert!(s.weight.is_finite() && s.weight.min_element() >= 0.0, "{name}");
            }
        }
    }
    // The shading normal faces away from this viewer.
    let wo = Vec3A::new(-0.99, 0.0, 0.14).normalize();
    let lambert = Bsdf::from(Diffuse::new(grey(1.0), 0.0));
    let mut rng = Pcg::new(&[1]);
    let n_drawn = (0..1000).filter(|_| draw(&lambert, &tilted, wo, &mut rng).is_some()).count();
    assert!(n_drawn > 300, "{n_drawn}");
}

#[test]
fn absurd_parameters_are_finite() {
    let bad = [f32::NAN, f32::INFINITY, -1.0, 1e30, 0.0];
    let mut rng = Pcg::new(&[20]);
    for x in bad {
        let c = grey(x);
        let preview = PreviewParams {
            diffuse_color: c,
            specular_color: c,
            use_specular_workflow: x == 0.0,
            metallic: x,
            roughness: x,
            clearcoat: x,
            clearcoat_roughness: x,
            opacity: x,
            ior: x,
            ..PreviewParams::default()
        };
        for bsdf in [
            Bsdf::from(Diffuse::new(c, x)),
            Conductor::from_reflectance(c, x).into(),
            Conductor::from_index(c, c, x).into(),
            Dielectric::new(x, x, c, ScatterMode::Both).into(),
            preview.bsdf(true),
            preview.bsdf(false),
        ] {
            assert!(bsdf.transparency().is_finite());
            for wo in views() {
                assert!(bsdf.albedo(&frame(), wo).is_finite());
                for s in (0..50).filter_map(|_| draw(&bsdf, &frame(), wo, &mut rng)) {
                    assert!(s.weight.is_finite() && s.direction.is_finite() && s.pdf.is_finite(), "{bsdf:?}");
                }
            }
        }
    }
}
