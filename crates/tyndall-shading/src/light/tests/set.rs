//! The choice of a light.

use super::*;
use crate::{LightSet, Receiver};

fn at(position: Vec3A) -> Receiver {
    Receiver::Point { position }
}

fn ball(at: DVec3, intensity: f32) -> Light {
    build(&prim::Light { world_from_light: DAffine3::from_translation(at), intensity, ..prim(sphere(0.1)) })
}

fn check(set: &LightSet, from: Vec3A) {
    let n = 20_000;
    let mut counts = vec![0u32; set.lights.len()];
    for i in 0..n {
        let u = (i as f32 + 0.5) / n as f32;
        let (index, p) = set.sample_light(&at(from), u).expect("a light");
        assert_eq!(p, set.probability(&at(from), index));
        counts[index] += 1;
    }
    let total: f64 = (0..set.lights.len()).map(|i| f64::from(set.probability(&at(from), i))).sum();
    assert!((total - 1.0).abs() < 1e-4, "{total}");
    for (index, count) in counts.iter().enumerate() {
        let p = set.probability(&at(from), index);
        assert!((*count as f32 / n as f32 - p).abs() < 3e-4, "light {index}: {count} of {n}, p {p}");
    }
}

#[test]
fn frequencies_are_probabilities() {
    for n in [1, 2, 7, 16, 17, 60] {
        let lights = (0..n).map(|i| ball(DVec3::X * f64::from(i), 1.0 + i as f32)).collect();
        let set = LightSet::build(lights, 100.0);
        for from in [Vec3A::ZERO, Vec3A::new(5.0, 1.0, 0.0)] {
            check(&set, from);
        }
    }
    assert!(LightSet::build(Vec::new(), 1.0).sample_light(&at(Vec3A::ZERO), 0.5).is_none());
}

#[test]
fn near_lights_are_preferred() {
    let set = LightSet::build(vec![ball(DVec3::X, 1.0), ball(DVec3::X * 100.0, 1.0)], 100.0);
    assert!(set.probability(&at(Vec3A::ZERO), 0) > 0.85);
    assert!(set.probability(&at(Vec3A::X * 99.0), 1) > 0.85);
}

#[test]
fn extreme_powers_keep_every_light_possible() {
    let sun = build(&prim::Light { intensity: 1e20, ..prim(LightKind::Distant { angle: 0.5 }) });
    for n in [2, 30] {
        let mut lights: Vec<_> =
            (0..n).map(|i| ball(DVec3::X * f64::from(i), if i == 0 { 1e20 } else { 1.0 })).collect();
        lights.push(sun.clone());
        let set = LightSet::build(lights, 1e6);
        for index in 0..set.lights.len() {
            let p = set.probability(&at(Vec3A::Y), index);
            assert!(p.is_finite() && p > 1e-3, "{index}: {p}");
        }
        check(&set, Vec3A::Y);
    }
}

#[test]
fn lights_that_face_away_are_not_asked() {
    let card = build(&prim(rect(1.0, 1.0)));
    let set = LightSet::build(vec![card.clone(), card], 10.0);
    assert!(set.sample_light(&at(Vec3A::Z), 0.3).is_none());
    assert!(set.sample_light(&at(-Vec3A::Z), 0.3).is_some());
}

#[test]
fn absurd_sets_and_receivers_keep_every_light_possible() {
    let lights_at = |position: DVec3, n: i32, intensity: f32| {
        (0..n).map(move |i| ball(position, if i % 7 == 0 { intensity } else { 1.0 }))
    };
    let mut lights: Vec<Light> = lights_at(DVec3::ZERO, 40, 1e20).collect();
    lights.extend(lights_at(DVec3::X, 40, 1e-30));
    lights.extend(lights_at(DVec3::Y * 1e15, 40, 1.0));
    lights.push(build(&prim(LightKind::Sphere { radius: 1.0, as_point: true })));
    lights.push(build(&prim::Light { intensity: 1e-30, ..prim(LightKind::Dome { texture: None }) }));
    let n = lights.len();
    let set = LightSet::build(lights, 1e15);
    let far = Vec3A::new(1e18, -1e18, 1e18);
    let segment = |t0: f32, t1: f32| Receiver::Segment { origin: Vec3A::ZERO, direction: Vec3A::X, t0, t1 };
    let receivers = [
        at(Vec3A::ZERO),
        at(Vec3A::Z * 1e-30),
        at(far),
        at(Vec3A::splat(f32::MAX)),
        at(Vec3A::NAN),
        Receiver::Surface { position: Vec3A::ZERO, normal: Vec3A::Y, both_sides: true },
        Receiver::Surface { position: far, normal: Vec3A::Y, both_sides: true },
        segment(0.0, 1.0),
        segment(0.0, f32::INFINITY),
        segment(0.5, 0.5),
        segment(1e10, 1e18),
    ];
    for receiver in receivers {
        let all: Vec<f32> = (0..n).map(|i| set.probability(&receiver, i)).collect();
        let sum: f64 = all.iter().map(|p| f64::from(*p)).sum();
        assert!((sum - 1.0).abs() < 1e-5, "{receiver:?}: {sum}");
        let least = all.iter().copied().fold(f32::INFINITY, f32::min);
        assert!(least > 0.1 / n as f32, "{receiver:?}: {least:e}");
        for i in 0..1000 {
            let (index, p) = set.sample_light(&receiver, i as f32 / 1000.0).expect("a light");
            assert_eq!(p, all[index]);
        }
    }
}

#[test]
fn lights_at_infinity_alone_are_the_same_everywhere() {
    let sun = build(&prim::Light { intensity: 3.0, ..prim(LightKind::Distant { angle: 0.0 }) });
    let sky = build(&prim(LightKind::Dome { texture: None }));
    let set = LightSet::build(vec![sun.clone(), sky.clone()], 10.0);
    let expected = 0.8 * 3.0 / (3.0 + std::f32::consts::PI) + 0.1;
    for receiver in [at(Vec3A::ZERO), at(Vec3A::X * 1e6)] {
        assert!((set.probability(&receiver, 0) - expected).abs() < 1e-6);
    }
    check(&set, Vec3A::ZERO);
    // A lamp that cannot be seen from here takes nothing away from them.
    let with_lamp = LightSet::build(vec![sun, sky, build(&prim(rect(1.0, 1.0)))], 10.0);
    assert_eq!(with_lamp.probability(&at(Vec3A::Z * 5.0), 2), 0.0);
    assert_eq!(with_lamp.probability(&at(Vec3A::Z * 5.0), 0), set.probability(&at(Vec3A::ZERO), 0));
    check(&with_lamp, Vec3A::Z * 5.0);
    check(&with_lamp, -Vec3A::Z * 5.0);
}

#[test]
fn surfaces_do_not_ask_what_lies_behind_them() {
    let set = LightSet::build(vec![ball(DVec3::Y * 5.0, 1.0), ball(DVec3::Y * -5.0, 1.0)], 10.0);
    let floor = |both_sides| Receiver::Surface { position: Vec3A::ZERO, normal: Vec3A::Y, both_sides };
    assert_eq!(set.probability(&floor(false), 0), 1.0);
    assert_eq!(set.probability(&floor(false), 1), 0.0);
    assert_eq!(set.probability(&floor(true), 1), 0.5);
}

#[test]
fn segments_prefer_what_they_pass() {
    let set = LightSet::build(vec![ball(DVec3::new(5.0, 1.0, 0.0), 1.0), ball(DVec3::Y * 30.0, 1.0)], 30.0);
    let along = Receiver::Segment { origin: Vec3A::ZERO, direction: Vec3A::X, t0: 0.0, t1: 10.0 };
    assert!(set.probability(&along, 0) > 0.85);
}
