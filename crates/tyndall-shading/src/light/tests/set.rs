//! The choice of a light.

use super::*;
use crate::LightSet;

fn ball(at: DVec3, intensity: f32) -> Light {
    build(&prim::Light { world_from_light: DAffine3::from_translation(at), intensity, ..prim(sphere(0.1)) })
}

fn check(set: &LightSet, from: Vec3A) {
    let n = 20_000;
    let mut counts = vec![0u32; set.lights.len()];
    for i in 0..n {
        let u = (i as f32 + 0.5) / n as f32;
        let (index, p) = set.sample_light(from, u).expect("a light");
        assert_eq!(p, set.probability(from, index));
        counts[index] += 1;
    }
    let total: f64 = (0..set.lights.len()).map(|i| f64::from(set.probability(from, i))).sum();
    assert!((total - 1.0).abs() < 1e-4, "{total}");
    for (index, count) in counts.iter().enumerate() {
        let p = set.probability(from, index);
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
    assert!(LightSet::build(Vec::new(), 1.0).sample_light(Vec3A::ZERO, 0.5).is_none());
}

#[test]
fn near_lights_are_preferred() {
    let set = LightSet::build(vec![ball(DVec3::X, 1.0), ball(DVec3::X * 100.0, 1.0)], 100.0);
    assert!(set.probability(Vec3A::ZERO, 0) > 0.85);
    assert!(set.probability(Vec3A::X * 99.0, 1) > 0.85);
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
            let p = set.probability(Vec3A::Y, index);
            assert!(p.is_finite() && p > 1e-3, "{index}: {p}");
        }
        check(&set, Vec3A::Y);
    }
}

#[test]
fn lights_that_face_away_are_not_asked() {
    let card = build(&prim(rect(1.0, 1.0)));
    let set = LightSet::build(vec![card.clone(), card], 10.0);
    assert!(set.sample_light(Vec3A::Z, 0.3).is_none());
    assert!(set.sample_light(-Vec3A::Z, 0.3).is_some());
}
