//! Irradiance on a white card that faces the light, against closed forms, and UsdLux's units.

use super::*;
use std::f32::consts::PI;

/// The card's irradiance by sampling; the card lies at `from` with unit `normal`.
fn irradiance(light: &prim::Light, from: Vec3A, normal: Vec3A) -> f32 {
    let light = build(light);
    let n = 200;
    let mut sum = 0.0f64;
    for i in 0..n * n {
        let u = Vec2::new((i % n) as f32 + 0.5, (i / n) as f32 + 0.5) / n as f32;
        if let Some(s) = light.sample(from, u) {
            sum += f64::from(s.radiance.x / s.pdf * normal.dot(s.direction).max(0.0));
        }
    }
    (sum / f64::from(n * n)) as f32
}

fn check(name: &str, got: f32, expected: f32, tolerance: f32) {
    assert!((got / expected - 1.0).abs() < tolerance, "{name}: {got} instead of {expected}");
}

const CARD: Vec3A = Vec3A::new(0.0, 0.0, -3.0);

#[test]
fn closed_forms() {
    let facing = |kind| irradiance(&prim(kind), CARD, Vec3A::Z);
    check("sphere", facing(sphere(1.5)), PI * 1.5 * 1.5 / 9.0, 1e-4);
    check("disk", facing(LightKind::Disk { radius: 2.0 }), PI * 4.0 / (9.0 + 4.0), 1e-3);
    let corner = |a: f32, b: f32| {
        let (a1, b1) = ((1.0 + a * a).sqrt(), (1.0 + b * b).sqrt());
        0.5 * (a / a1 * (b / a1).atan() + b / b1 * (a / b1).atan())
    };
    check("rect", facing(rect(4.0, 2.0)), 4.0 * corner(2.0 / 3.0, 1.0 / 3.0), 1e-3);
    check("small rect", facing(rect(0.02, 0.04)), 4.0 * corner(0.01 / 3.0, 0.02 / 3.0), 1e-3);
    check("dome", facing(LightKind::Dome { texture: None }), PI, 1e-3);
}

#[test]
fn distant_lights_follow_the_schema() {
    let at = |angle: f64, normalize: bool| {
        let light = prim::Light { normalize, ..prim(LightKind::Distant { angle }) };
        irradiance(&light, CARD, Vec3A::Z)
    };
    for angle in [0.0, 1e-4, 0.53, 20.0, 90.0, 179.0] {
        check("normalized", at(angle, true), 1.0, 2e-3);
    }
    check("beam", at(0.0, false), 1.0, 1e-6);
    for angle in [0.53, 60.0, 180.0] {
        let theta = (0.5 * angle as f32).to_radians();
        check("plain", at(angle, false), PI * theta.sin().powi(2), 2e-3);
    }
}

#[test]
fn normalized_area_lights_have_power_pi_times_intensity() {
    // In W/sr: a card's power is pi times that along its normal, a round body's 4 pi times its mean.
    let scale = DAffine3::from_scale(DVec3::splat(0.5));
    let cards = [rect(0.02, 0.03), LightKind::Disk { radius: 0.02 }].map(|kind| (kind, PI));
    let bodies = [sphere(0.02), cylinder(0.02, 0.01)].map(|kind| (kind, 4.0 * PI));
    for (kind, solid_angle) in cards.into_iter().chain(bodies) {
        let light =
            prim::Light { normalize: true, world_from_light: scale, exposure: 1.0, ..prim(kind.clone()) };
        let light = build(&light);
        let Outreach::Local(bounds) = light.outreach() else { panic!("{} has a place", light.kind()) };
        check(light.kind(), bounds.intensity as f32 * solid_angle, 2.0 * PI, 1e-3);
    }
}

#[test]
fn a_normalized_point_has_a_quarter_of_the_intensity() {
    for radius in [0.0, 0.3] {
        let kind = LightKind::Sphere { radius, as_point: true };
        let light = prim::Light { normalize: true, intensity: 36.0, ..prim(kind) };
        check("point", irradiance(&light, CARD, Vec3A::Z), 1.0, 1e-5);
    }
    let not_normalized = prim(LightKind::Sphere { radius: 0.3, as_point: true });
    check("as sphere", irradiance(&not_normalized, CARD, Vec3A::Z), PI * 0.09 / 9.0, 1e-4);
    let implicit = prim::Light { normalize: true, intensity: 36.0, ..prim(sphere(0.0)) };
    assert!(build(&implicit).is_delta());
}

#[test]
fn ellipsoids_agree_with_their_point() {
    let world_from_light = DAffine3::from_scale(DVec3::new(0.02, 0.03, 0.01));
    let ellipsoid = prim::Light { normalize: true, world_from_light, ..prim(sphere(1.0)) };
    let mean: f32 = (0..64)
        .map(|i| {
            let from = tyndall_math::sampling::uniform_sphere(Vec2::new(
                (i % 8) as f32 / 8.0 + 0.06,
                (i / 8) as f32 / 8.0 + 0.06,
            ));
            irradiance(&ellipsoid, from * 2.0, -from) / 64.0
        })
        .sum();
    check("mean intensity", mean, 0.25 / 4.0, 0.02);
}

#[test]
fn lines_and_thin_tubes() {
    // E = 2 r L D^2 times the integral of ds / (D^2 + s^2)^2 over the line.
    let (half, d, r) = (2.0f32, 3.0f32, 0.01f32);
    let integral = half / (d * d * (d * d + half * half)) + (half / d).atan() / (d * d * d);
    let expected = 2.0 * r * d * d * integral;
    let kind = |as_line| LightKind::Cylinder { length: 4.0, radius: 0.01, as_line };
    check("line", irradiance(&prim(kind(true)), CARD, Vec3A::Z), expected, 1e-3);
    check("tube", irradiance(&prim(kind(false)), CARD, Vec3A::Z), expected, 6e-3);
    let normalized = |as_line| prim::Light { normalize: true, ..prim(kind(as_line)) };
    let (line, tube) = (normalized(true), normalized(false));
    check("both", irradiance(&line, CARD, Vec3A::Z), irradiance(&tube, CARD, Vec3A::Z), 6e-3);
}

#[test]
fn exposure_color_and_origin() {
    let mut light = prim(sphere(1.0));
    (light.exposure, light.intensity, light.color) = (3.0, 0.5, [1.0, 0.5, 0.0]);
    light.world_from_light.translation = DVec3::new(1e7, 0.0, 5.0);
    let mut diags = Diagnostics::default();
    let origin = DVec3::new(1e7, 0.0, 0.0);
    let light = Light::from_prim(&"/L".into(), &light, origin, &images(), &mut diags).expect("a light");
    assert_eq!(light.radiance(Vec3A::ZERO, Vec3A::Z), Rgb::new(4.0, 2.0, 0.0));
    assert_eq!(light.intersect(&Ray::new(Vec3A::ZERO, Vec3A::Z)), Some(4.0));
}

#[test]
fn rectangles_show_their_image_upright_to_the_viewer() {
    // The viewer at -z looks along +z with +y up: +x is on his left, where the image begins.
    let px = |v: f32| [v, v, v, 1.0];
    let images = Images::with(SKY, 2, vec![px(1.0), px(2.0), px(3.0), px(4.0)]);
    let kind = LightKind::Rect { width: 4.0, height: 4.0, texture: Some(PathBuf::from(SKY)) };
    let light = build_with(&prim(kind), &images).0.expect("a light");
    let at = |x: f32, y: f32| {
        let d = (Vec3A::new(x, y, 0.0) - CARD).normalize();
        light.radiance(CARD, d).x
    };
    assert_eq!([at(1.9, 1.9), at(-1.9, 1.9), at(1.9, -1.9), at(-1.9, -1.9)], [1.0, 2.0, 3.0, 4.0]);
}

#[test]
fn domes_turn_with_their_transform() {
    let sun = |u: f32| {
        let mut pixels = vec![[0.0, 0.0, 0.0, 1.0]; 64 * 32];
        pixels[16 * 64 + (u * 64.0) as usize] = [1.0, 1.0, 1.0, 1.0];
        Images::with(SKY, 64, pixels)
    };
    let mut light = prim(LightKind::Dome { texture: Some(DomeTexture { path: PathBuf::from(SKY) }) });
    let x = |light: &prim::Light| {
        let light = build_with(light, &sun(0.25)).0.expect("a light");
        light.sample(Vec3A::ZERO, Vec2::splat(0.5)).expect("a sample").direction
    };
    assert!((x(&light) - Vec3A::X).length() < 0.1);
    light.world_from_light = DAffine3::from_rotation_y(std::f64::consts::FRAC_PI_2);
    assert!((x(&light) + Vec3A::Z).length() < 0.1);
}
