//! Sets of many lights: probabilities, frequencies, estimates and certain darkness.

use super::*;
use crate::{LightSet, Receiver};
use proptest::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF};

fn direction(rng: &mut Pcg) -> DVec3 {
    let mut next = || f64::from(rng.next_f32()) * 2.0 - 1.0;
    DVec3::new(next(), next(), next()).normalize_or(DVec3::X)
}

fn position(rng: &mut Pcg) -> DVec3 {
    DVec3::new(rng.next_f32().into(), rng.next_f32().into(), rng.next_f32().into()) * 20.0 - 10.0
}

fn placed(rng: &mut Pcg) -> DAffine3 {
    let turn = DMat3::from_axis_angle(direction(rng), f64::from(rng.next_f32()) * 6.3);
    DAffine3 { matrix3: turn, translation: position(rng) }
}

/// Every kind of light with a place, some shaped, and the kinds of lights at infinity if `with_infinite`.
fn mixed(seed: u64, n: usize, with_infinite: bool) -> Vec<Light> {
    let mut rng = Pcg::new(&[seed]);
    let local = [
        sphere(0.3),
        rect(0.5, 1.0),
        LightKind::Disk { radius: 0.4 },
        cylinder(1.0, 0.1),
        LightKind::Sphere { radius: 0.1, as_point: true },
        LightKind::Cylinder { length: 0.7, radius: 0.1, as_line: true },
    ];
    let infinite = [
        LightKind::Distant { angle: 0.0 },
        LightKind::Distant { angle: 3.0 },
        LightKind::Dome { texture: None },
    ];
    let light = |i: usize| {
        let kind = match i {
            0..=2 if with_infinite => infinite[i].clone(),
            _ => local[i % local.len()].clone(),
        };
        let shaping = match i % 4 {
            0 => Shaping { cone_angle: 40.0, cone_softness: 0.3, ..Shaping::default() },
            1 => Shaping { cone_angle: 110.0, focus: 2.0, ..Shaping::default() },
            _ => Shaping::default(),
        };
        let intensity = 10f32.powf(rng.next_f32() * 4.0 - 2.0);
        build(&prim::Light { world_from_light: placed(&mut rng), shaping, intensity, ..prim(kind) })
    };
    (0..n).map(light).collect()
}

fn receivers(rng: &mut Pcg) -> [Receiver; 4] {
    let (a, b) = (position(rng).as_vec3a(), position(rng).as_vec3a());
    let normal = direction(rng).as_vec3a();
    [
        Receiver::Point { position: a },
        Receiver::Surface { position: a, normal, both_sides: false },
        Receiver::Surface { position: a, normal, both_sides: true },
        Receiver::Segment { origin: a, direction: (b - a).normalize(), t0: 0.0, t1: a.distance(b) },
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn probabilities_and_the_chance_of_nothing_add_up(seed: u64, n in 1usize..200, with_infinite: bool) {
        let set = LightSet::build(mixed(seed, n, with_infinite), 20.0);
        for receiver in receivers(&mut Pcg::new(&[seed, 2])) {
            let sum: f64 = (0..n).map(|i| f64::from(set.probability(&receiver, i))).sum();
            let n_strata = 8192;
            let mut n_none = 0;
            for i in 0..n_strata {
                match set.sample_light(&receiver, (i as f32 + 0.5) / n_strata as f32) {
                    None => n_none += 1,
                    Some((index, p)) => {
                        prop_assert!(p > 0.0 && p <= 1.0);
                        prop_assert_eq!(p, set.probability(&receiver, index));
                    }
                }
            }
            let none = f64::from(n_none) / f64::from(n_strata);
            // Each change from one light to the next moves the count by one stratum at most.
            let tolerance = (4 * n + 8) as f64 / f64::from(n_strata);
            prop_assert!(sum <= 1.0 + 1e-5 && (sum + none - 1.0).abs() < tolerance, "{} + {}", sum, none);
        }
    }
}

#[test]
fn frequencies_follow_probabilities() {
    for (seed, with_infinite) in [(1, false), (2, true), (3, true)] {
        let set = LightSet::build(mixed(seed, 300, with_infinite), 20.0);
        for receiver in receivers(&mut Pcg::new(&[seed, 3])) {
            let n = 200_000;
            let (mut counts, mut n_none) = (vec![0u32; set.lights.len()], 0u32);
            let mut rng = Pcg::new(&[seed, 4]);
            for _ in 0..n {
                match set.sample_light(&receiver, rng.next_f32()) {
                    Some((index, _)) => counts[index] += 1,
                    None => n_none += 1,
                }
            }
            let mut expected: Vec<f64> =
                (0..counts.len()).map(|i| f64::from(set.probability(&receiver, i))).collect();
            expected.push((1.0 - expected.iter().sum::<f64>()).max(0.0));
            counts.push(n_none);
            let p = p_value(&counts, &expected, n);
            assert!(p > 1e-4, "seed {seed}, {receiver:?}: p = {p:e}");
        }
    }
}

/// Pearson's test; cells that expect few are pooled.
fn p_value(counts: &[u32], expected: &[f64], n: u32) -> f64 {
    let (mut statistic, mut n_cells) = (0.0, 0);
    let (mut few_counted, mut few_expected) = (0.0, 0.0);
    for (&count, &p) in counts.iter().zip(expected) {
        let e = p * f64::from(n);
        assert!(e > 0.0 || count == 0 || p < 1e-6);
        if e < 10.0 {
            few_counted += f64::from(count);
            few_expected += e;
        } else {
            statistic += (f64::from(count) - e).powi(2) / e;
            n_cells += 1;
        }
    }
    if few_expected > 5.0 {
        statistic += (few_counted - few_expected).powi(2) / few_expected;
        n_cells += 1;
    }
    1.0 - ChiSquared::new(f64::from(n_cells - 1)).expect("some cells").cdf(statistic)
}

/// Lights without area, so that what each sends has a closed form: points, spots and parallel beams.
fn delta_lights(seed: u64, n: usize) -> Vec<Light> {
    let mut rng = Pcg::new(&[seed, 5]);
    let light = |i: usize| {
        let is_beam = i.is_multiple_of(100);
        let kind = if is_beam {
            LightKind::Distant { angle: 0.0 }
        } else {
            LightKind::Sphere { radius: 1.0, as_point: true }
        };
        let shaping = Shaping { cone_angle: 70.0, cone_softness: 0.5, ..Shaping::default() };
        let shaping = if i % 2 == 1 { shaping } else { Shaping::default() };
        let intensity = if is_beam { 1e-2 } else { rng.next_f32() };
        let world_from_light = placed(&mut rng);
        build(&prim::Light { world_from_light, shaping, intensity, normalize: true, ..prim(kind) })
    };
    (0..n).map(light).collect()
}

/// What light `light` sends to a point of the receiver; the point on segments is that at fraction `along`.
fn sent(light: &Light, receiver: &Receiver, along: f32) -> f64 {
    let (from, facing) = match *receiver {
        Receiver::Point { position } => (position, None),
        Receiver::Surface { position, normal, both_sides } => (position, Some((normal, both_sides))),
        Receiver::Segment { origin, direction, t0, t1 } => {
            (origin + direction * (t0 + (t1 - t0) * along), None)
        }
    };
    let Some(sample) = light.sample(from, Vec2::splat(0.5)) else { return 0.0 };
    let cosine = match facing {
        None => 1.0,
        Some((normal, false)) => normal.dot(sample.direction).max(0.0),
        Some((normal, true)) => normal.dot(sample.direction).abs(),
    };
    f64::from(sample.radiance.x * cosine)
}

struct Estimate {
    mean: f64,
    variance: f64,
}

fn estimate(n: u32, mut draw: impl FnMut() -> f64) -> Estimate {
    let values: Vec<f64> = (0..n).map(|_| draw()).collect();
    let mean = values.iter().sum::<f64>() / f64::from(n);
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / f64::from(n - 1);
    Estimate { mean, variance }
}

fn estimate_guided(set: &LightSet, receiver: &Receiver, seed: u64, n: u32) -> Estimate {
    let mut rng = Pcg::new(&[seed, 6]);
    estimate(n, || match set.sample_light(receiver, rng.next_f32()) {
        Some((index, p)) => sent(&set.lights[index], receiver, rng.next_f32()) / f64::from(p),
        None => 0.0,
    })
}

#[test]
fn a_thousand_lights_are_estimated_without_bias() {
    let mut z_sum = 0.0;
    let mut n_estimates = 0.0;
    for seed in 0..6 {
        let set = LightSet::build(delta_lights(seed, 1000), 20.0);
        for receiver in receivers(&mut Pcg::new(&[seed, 7])) {
            let n_along = if matches!(receiver, Receiver::Segment { .. }) { 2000 } else { 1 };
            let all_sent = |along: f32| set.lights.iter().map(|l| sent(l, &receiver, along)).sum::<f64>();
            let exact = (0..n_along).map(|i| all_sent((i as f32 + 0.5) / n_along as f32)).sum::<f64>();
            let exact = exact / f64::from(n_along);
            let n = 100_000;
            let got = estimate_guided(&set, &receiver, seed, n);
            let sigma = (got.variance / f64::from(n)).sqrt();
            let z = (got.mean - exact) / sigma;
            assert!(z.abs() < 4.0, "seed {seed}, {receiver:?}: {} instead of {exact}, z {z}", got.mean);
            z_sum += z;
            n_estimates += 1.0f64;
        }
    }
    assert!(z_sum.abs() / n_estimates.sqrt() < 3.0, "all together: {z_sum} over {n_estimates}");
}

#[test]
fn the_tree_is_no_worse_than_uniform_on_clusters() {
    for seed in 0..4 {
        let mut rng = Pcg::new(&[seed, 8]);
        let centers: Vec<DVec3> = (0..10).map(|_| position(&mut rng)).collect();
        let lights = (0..1000)
            .map(|i| {
                let at = centers[i % centers.len()] + direction(&mut rng) * 0.3;
                let kind = LightKind::Sphere { radius: 1.0, as_point: true };
                build(&prim::Light { world_from_light: DAffine3::from_translation(at), ..prim(kind) })
            })
            .collect();
        let set = LightSet::build(lights, 20.0);
        for receiver in receivers(&mut Pcg::new(&[seed, 9])) {
            let guided = estimate_guided(&set, &receiver, seed, 20_000);
            let mut rng = Pcg::new(&[seed, 10]);
            let n = set.lights.len();
            let uniform = estimate(20_000, || {
                let index = ((rng.next_f32() * n as f32) as usize).min(n - 1);
                sent(&set.lights[index], &receiver, rng.next_f32()) * n as f64
            });
            assert!(
                guided.variance <= uniform.variance,
                "seed {seed}, {receiver:?}: {} {}",
                guided.variance,
                uniform.variance
            );
        }
    }
}

/// Narrow spots that all point down, among which the receivers are.
fn ceiling_spots(seed: u64, n: usize) -> Vec<Light> {
    let mut rng = Pcg::new(&[seed, 12]);
    let shaping = Shaping { cone_angle: 15.0, ..Shaping::default() };
    let mut spot = || {
        let world_from_light = DAffine3::from_translation(position(&mut rng));
        build(&prim::Light { world_from_light, shaping, ..prim(sphere(0.1)) })
    };
    (0..n).map(|_| spot()).collect()
}

#[test]
fn what_has_no_probability_sends_nothing() {
    let mut n_dark = 0;
    for seed in 0..30 {
        let lights = match seed % 3 {
            0 => ceiling_spots(seed, 120),
            i => mixed(seed, 120, i == 1),
        };
        let set = LightSet::build(lights, 20.0);
        let mut rng = Pcg::new(&[seed, 11]);
        for receiver in (0..10).flat_map(|_| receivers(&mut rng)).collect::<Vec<_>>() {
            for (index, light) in set.lights.iter().enumerate() {
                if set.probability(&receiver, index) > 0.0 {
                    continue;
                }
                n_dark += 1;
                for _ in 0..20 {
                    let [u, v, along] = [rng.next_f32(), rng.next_f32(), rng.next_f32()];
                    let (from, normal) = match receiver {
                        Receiver::Point { position } => (position, Vec3A::ZERO),
                        Receiver::Surface { position, both_sides: true, .. } => (position, Vec3A::ZERO),
                        Receiver::Surface { position, normal, .. } => (position, normal),
                        Receiver::Segment { origin, direction, t1, .. } => {
                            (origin + direction * (t1 * along), Vec3A::ZERO)
                        }
                    };
                    let Some(s) = light.sample(from, Vec2::new(u, v)) else { continue };
                    let is_behind = normal != Vec3A::ZERO && s.direction.dot(normal) <= 1e-4;
                    assert!(
                        s.radiance == Rgb::ZERO || is_behind,
                        "seed {seed}, light {index}, {}: {receiver:?} gets {}",
                        light.kind(),
                        s.radiance
                    );
                }
            }
        }
    }
    assert!(n_dark > 10_000, "{n_dark} dark pairs");
}
