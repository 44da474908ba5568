//! Tests that every kind of light must pass, and irradiance on a white card against closed forms.

mod irradiance;
mod many;
mod robustness;
mod set;

use super::bounds::Outreach;
use super::{Light, LightSample};
use crate::testing::{Cap, Images, messages};
use glam::{DAffine3, DMat3, DVec3, Vec2, Vec3A};
use std::path::PathBuf;
use tyndall_math::random::Pcg;
use tyndall_math::{Frame, Ray, Rgb};
use tyndall_scene::prim::{self, DomeTexture, LightKind, Shaping};
use tyndall_scene::{Diagnostics, PrimPath};

/// A white light of intensity 1 at the origin.
fn prim(kind: LightKind) -> prim::Light {
    prim::Light {
        world_from_light: DAffine3::IDENTITY,
        kind,
        intensity: 1.0,
        exposure: 0.0,
        color: [1.0; 3],
        normalize: false,
        diffuse: 1.0,
        specular: 1.0,
        shaping: Shaping::default(),
        visible: true,
        camera_visible: true,
        opaque: true,
    }
}

fn build_with(light: &prim::Light, images: &Images) -> (Option<Light>, Vec<String>) {
    let mut diags = Diagnostics::default();
    let path = PrimPath::from("/World/Light");
    let light = Light::from_prim(&path, light, DVec3::ZERO, images, &mut diags);
    (light, messages(&diags))
}

fn build(light: &prim::Light) -> Light {
    let (light, messages) = build_with(light, &images());
    assert!(messages.is_empty(), "{messages:?}");
    light.expect("a light that shines")
}

const SKY: &str = "sky.exr";

/// A dim sky with a black quarter and a sun.
fn images() -> Images {
    let (w, h) = (16, 8);
    let texel = |i: usize| match (i % w, i / w) {
        (5, 2) => [300.0, 200.0, 100.0, 1.0],
        (x, _) if x >= 12 => [0.0, 0.0, 0.0, 1.0],
        (x, y) => [0.1 + 0.05 * x as f32, 0.3, 0.2 * y as f32, 1.0],
    };
    Images::with(SKY, w, (0..w * h).map(texel).collect())
}

fn sphere(radius: f64) -> LightKind {
    LightKind::Sphere { radius, as_point: false }
}

fn rect(width: f64, height: f64) -> LightKind {
    LightKind::Rect { width, height, texture: None }
}

fn cylinder(length: f64, radius: f64) -> LightKind {
    LightKind::Cylinder { length, radius, as_line: false }
}

fn turned(scale: DVec3) -> DAffine3 {
    let axis = DVec3::new(0.2, 0.7, -0.4).normalize();
    DAffine3 {
        matrix3: DMat3::from_axis_angle(axis, 0.6) * DMat3::from_diagonal(scale),
        translation: DVec3::new(0.2, -0.1, 0.3),
    }
}

/// Every kind that has a density, plainly and under rotation, scale, mirroring and shear, shaped and textured.
fn lights_with_density() -> Vec<(String, prim::Light)> {
    let kinds = [
        sphere(0.8),
        rect(1.2, 0.7),
        LightKind::Disk { radius: 0.7 },
        cylinder(1.5, 0.4),
        LightKind::Distant { angle: 40.0 },
        LightKind::Distant { angle: 250.0 },
        LightKind::Dome { texture: None },
        LightKind::Dome { texture: Some(DomeTexture { path: PathBuf::from(SKY) }) },
        LightKind::Rect { width: 2.0, height: 1.0, texture: Some(PathBuf::from(SKY)) },
    ];
    let shear = DMat3::from_cols(DVec3::X, DVec3::new(0.6, 1.0, 0.0), DVec3::new(0.1, 0.3, 1.0));
    let transforms = [
        ("identity", DAffine3::IDENTITY),
        ("scaled", turned(DVec3::new(1.3, 0.6, 0.9))),
        ("mirrored", turned(DVec3::new(1.0, 1.0, -1.0))),
        ("sheared", DAffine3 { matrix3: shear, translation: DVec3::ZERO }),
    ];
    let mut all = Vec::new();
    for (name, world_from_light) in transforms {
        for kind in &kinds {
            let base = prim(kind.clone());
            let shaping = Shaping { focus: 1.5, cone_angle: 70.0, cone_softness: 0.5, ..Shaping::default() };
            all.push((format!("{kind:?} {name}"), prim::Light { world_from_light, ..base.clone() }));
            if name == "scaled" {
                all.push((format!("{kind:?} shaped"), prim::Light { world_from_light, shaping, ..base }));
            }
        }
    }
    all
}

const RECEIVERS: [Vec3A; 4] = [
    Vec3A::new(0.3, 0.2, -1.1),
    Vec3A::new(-2.0, 1.0, 0.4),
    Vec3A::new(0.6, 1.6, 1.0),
    Vec3A::new(0.1, -0.3, -4.0),
];

/// A cap around the light as seen from `from`; off its middle, so that no ring of bins runs along its edge.
fn cap(light: &Light, from: Vec3A) -> Cap {
    let Some((low, high)) = light.bounds() else { return Cap::sphere() };
    let radius = (high - low).length() * 0.5;
    let to_center = (low + high) * 0.5 - from + Vec3A::new(0.11, -0.07, 0.05) * radius;
    let radius = radius * 1.15;
    let distance = to_center.length();
    if distance <= radius * 1.05 {
        return Cap::sphere();
    }
    let cos = (1.0 - (radius / distance).powi(2)).sqrt();
    Cap { frame: Frame::from_normal(to_center / distance), height: 1.0 - cos }
}

fn sample(light: &Light, from: Vec3A, rng: &mut Pcg) -> Option<LightSample> {
    light.sample(from, Vec2::new(rng.next_f32(), rng.next_f32()))
}

#[test]
fn samples_follow_the_density_of_every_kind() {
    for (seed, (name, light)) in lights_with_density().into_iter().enumerate() {
        let light = build(&light);
        for from in RECEIVERS {
            let p = cap(&light, from).chi_square(
                seed as u64,
                20_000,
                |rng| sample(&light, from, rng).map(|s| s.direction),
                |d| light.pdf(from, d),
            );
            assert!(p > 1e-6, "{name} from {from}: p = {p:e}");
        }
    }
}

#[test]
fn samples_agree_with_pdf_radiance_and_intersection() {
    for (name, light) in lights_with_density() {
        let light = build(&light);
        for from in RECEIVERS {
            let mut rng = Pcg::new(&[3]);
            let (mut n, mut n_off) = (0, 0);
            for s in (0..2000).filter_map(|_| sample(&light, from, &mut rng)) {
                n += 1;
                assert!((s.direction.length() - 1.0).abs() < 1e-5 && !s.is_delta && s.pdf > 0.0);
                let is_same = |a: f32, b: f32| (a - b).abs() <= 2e-3 * a.abs().max(b.abs()) + 1e-6;
                let radiance = light.radiance(from, s.direction);
                let mut agrees = is_same(light.pdf(from, s.direction), s.pdf);
                agrees &= (radiance - s.radiance).length() <= 4e-3 * s.radiance.length() + 1e-5;
                if let Some(t) = light.intersect(&Ray::new(from, s.direction)) {
                    agrees &= is_same(t, s.distance);
                } else {
                    agrees &= light.is_infinite();
                }
                n_off += i32::from(!agrees);
            }
            // Rounding puts a few samples on the other side of an edge.
            assert!(n_off <= n / 50, "{name} from {from}: {n_off} of {n} disagree");
        }
    }
}

#[test]
fn sampled_irradiance_equals_the_quadrature_of_visible_radiance() {
    for (name, light) in lights_with_density() {
        let light = build(&light);
        for from in RECEIVERS {
            let arriving = |d: Vec3A| {
                let is_seen = light.is_infinite() || light.intersect(&Ray::new(from, d)).is_some();
                if is_seen { f64::from(light.radiance(from, d).y) } else { 0.0 }
            };
            let exact = cap(&light, from).integral(arriving);
            let mut rng = Pcg::new(&[11]);
            let n = 20_000;
            let values: Vec<f64> = (0..n)
                .map(|_| sample(&light, from, &mut rng).map_or(0.0, |s| f64::from(s.radiance.y / s.pdf)))
                .collect();
            let mean = values.iter().sum::<f64>() / f64::from(n);
            let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / f64::from(n);
            let sigma = (variance / f64::from(n)).sqrt();
            assert!(
                (mean - exact).abs() < 4.5 * sigma + 6e-3 * exact + 1e-6,
                "{name} from {from}: {mean} {exact}"
            );
        }
    }
}

#[test]
fn bounds_contain_every_hit() {
    for (name, light) in lights_with_density() {
        let light = build(&light);
        let Some((low, high)) = light.bounds() else { continue };
        let margin = (high - low).length() * 1e-4;
        for from in RECEIVERS {
            let mut rng = Pcg::new(&[5]);
            for s in (0..500).filter_map(|_| sample(&light, from, &mut rng)) {
                let p = from + s.direction * s.distance;
                assert!(p.cmpge(low - margin).all() && p.cmple(high + margin).all(), "{name}");
            }
        }
    }
}

#[test]
fn every_kind_has_a_table_entry() {
    let names: Vec<_> = Light::KINDS.iter().map(|k| k.name).collect();
    assert_eq!(names, ["sphere", "point", "rect", "disk", "cylinder", "line", "distant", "dome"]);
    for (_, light) in lights_with_density() {
        assert!(names.contains(&build(&light).kind()));
    }
}
