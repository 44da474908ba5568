//! The tree against its slow twin, and what it is made of.

use super::*;
use crate::light::bounds::{Cone, LightBounds};
use glam::{DVec3, Vec3A};
use lanes::Stored;
use proptest::prelude::*;
use std::f64::consts::PI;
use tyndall_math::random::Pcg;

const N: usize = 150;

struct Built {
    tree: LightTree,
    trails: Vec<Trail>,
    lights: Vec<LightBounds>,
}

fn direction(rng: &mut Pcg) -> DVec3 {
    let mut next = || f64::from(rng.next_f32()) * 2.0 - 1.0;
    DVec3::new(next(), next(), next()).normalize_or(DVec3::X)
}

fn position(rng: &mut Pcg) -> Vec3A {
    Vec3A::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 20.0 - 10.0
}

/// Boxes of all sizes, some without extent; cones of all kinds if `is_oriented`; intensities over eight decades.
fn random_lights(seed: u64, n: usize, is_oriented: bool) -> Vec<LightBounds> {
    let mut rng = Pcg::new(&[seed]);
    let main_axis = direction(&mut rng);
    (0..n)
        .map(|i| {
            let center = position(&mut rng);
            let half = if i % 3 == 0 { Vec3A::ZERO } else { position(&mut rng).abs() * 0.02 };
            let axis = (main_axis + direction(&mut rng) * 0.5).normalize();
            let cone = match i % 5 {
                _ if !is_oriented => Cone::SPHERE,
                0..=2 => Cone::hemisphere(axis.as_vec3a()),
                3 => Cone::beam(axis, 0.2, 0.6),
                _ => Cone::beam(axis, 1.0, 2.5),
            };
            let intensity = 10f64.powf(f64::from(rng.next_f32()) * 8.0 - 4.0);
            LightBounds::new((center - half, center + half), cone, intensity)
        })
        .collect()
}

fn build(lights: Vec<LightBounds>) -> Built {
    let mut trails = vec![Trail::default(); lights.len()];
    let items = lights.iter().zip(0..).map(|(bounds, light)| TreeLight { light, bounds: *bounds }).collect();
    let tree = LightTree::build(items, |light, trail| trails[light] = trail).expect("there are lights");
    Built { tree, trails, lights }
}

/// The importance of one child by angles, in f64; `None` in the neighbourhood of the threshold where the fast one may
/// take a dark child for a lit one.
fn importance(child: &Stored, receiver: &Receiver) -> Option<f64> {
    let radius = child.half.length();
    let angle = |a: DVec3, b: DVec3| a.normalize_or(DVec3::X).angle_between(b.normalize_or(DVec3::X));
    let covered = |distance: f64| if distance <= radius { PI } else { (radius / distance).asin() };
    let theta_is = |points: &[DVec3]| {
        points.iter().map(|p| angle(*p - child.center, child.axis)).fold(f64::INFINITY, f64::min)
    };
    let is_one_sided = child.theta_o + child.theta_e <= PI / 2.0 + 1e-6;
    let reach = child.axis.abs().dot(child.half);
    let in_front = |points: &[DVec3]| {
        let highest =
            points.iter().map(|p| (*p - child.center).dot(child.axis)).fold(f64::NEG_INFINITY, f64::max);
        if is_one_sided { highest + reach } else { f64::INFINITY }
    };
    let light_side = |theta: f64, theta_u: f64| {
        let beyond = (theta - child.theta_o - theta_u).max(0.0);
        let is_marginal = (beyond - child.theta_e).abs() < 4e-3;
        (!is_marginal).then(|| if beyond < child.theta_e { beyond.cos() } else { 0.0 })
    };
    let is_marginal = |height: f64| height.abs() < 1e-3;
    match *receiver {
        Receiver::Segment { origin, direction, t0, t1 } => {
            let (o, d) = (origin.as_dvec3(), direction.as_dvec3());
            let (t0, t1) = (f64::from(t0), f64::from(t1));
            let n = 20_000;
            let points: Vec<DVec3> =
                (0..=n).map(|i| o + d * (t0 + (t1 - t0) * f64::from(i) / f64::from(n))).collect();
            let nearest = points.iter().map(|p| p.distance(child.center)).fold(f64::INFINITY, f64::min);
            let foot = (child.center - o).dot(d);
            let line = (o + d * foot).distance(child.center).max(radius);
            let angles = ((t1 - foot) / line).atan() - ((t0 - foot) / line).atan();
            let height = in_front(&points);
            let cosine = light_side(theta_is(&points), covered(nearest))?;
            (!is_marginal(height)).then_some(if height > 0.0 {
                child.intensity * cosine * angles / (line * (t1 - t0))
            } else {
                0.0
            })
        }
        Receiver::Point { position } | Receiver::Surface { position, .. } => {
            let p = position.as_dvec3();
            let distance = p.distance(child.center);
            let theta_u = covered(distance);
            let height = in_front(&[p]);
            let cosine = light_side(theta_is(&[p]), theta_u)?;
            let mut value = child.intensity * cosine / distance.max(radius).powi(2);
            let mut heights = vec![height];
            if let Receiver::Surface { normal, both_sides, .. } = receiver {
                let normal = normal.as_dvec3();
                let theta_i = angle(normal, child.center - p);
                let theta_i = if *both_sides { theta_i.min(PI - theta_i) } else { theta_i };
                value *= (theta_i - theta_u).max(0.0).cos().max(0.0);
                if !both_sides {
                    heights.push((child.center - p).dot(normal) + normal.abs().dot(child.half));
                }
            }
            let is_sure = !heights.iter().any(|h| is_marginal(*h));
            is_sure.then_some(if heights.iter().all(|h| *h > 0.0) { value } else { 0.0 })
        }
    }
}

/// Guided probabilities of all lights below a node, by recursion; false if some child was at a threshold.
fn recurse(tree: &LightTree, node: Node, share: f64, receiver: &Receiver, out: &mut [f64]) -> bool {
    let slots = 0..if node.is_wide { WIDTH } else { LANES };
    let stored = |slot: usize| tree.lanes[node.first + slot / LANES].stored(slot % LANES);
    let weights: Vec<Option<f64>> = slots
        .map(stored)
        .map(|child| if child.count == 0 { Some(0.0) } else { importance(&child, receiver) })
        .collect();
    let Some(weights) = weights.into_iter().collect::<Option<Vec<f64>>>() else { return false };
    let total: f64 = weights.iter().sum();
    weights.iter().enumerate().filter(|(_, w)| **w > 0.0).all(|(slot, weight)| {
        let share = share * weight / total;
        match tree.child(node, slot) {
            Child::Light(light) => {
                out[light] = share;
                true
            }
            Child::Node(node) => recurse(tree, node, share, receiver, out),
        }
    })
}

fn receivers(seed: u64) -> [Receiver; 4] {
    let mut rng = Pcg::new(&[seed, 1]);
    let (a, b) = (position(&mut rng) * 1.5, position(&mut rng) * 1.5);
    let normal = direction(&mut rng).as_vec3a();
    [
        Receiver::Point { position: a },
        Receiver::Surface { position: a, normal, both_sides: false },
        Receiver::Surface { position: a, normal, both_sides: true },
        Receiver::Segment { origin: a, direction: (b - a).normalize(), t0: 0.5, t1: a.distance(b) + 0.6 },
    ]
}

#[test]
fn probabilities_are_those_of_the_slow_twin() {
    let mut n_compared = 0;
    for seed in 0..12 {
        let built = build(random_lights(seed, N, seed % 3 != 0));
        for receiver in receivers(seed) {
            let mut expected = vec![0.0; N];
            if !recurse(&built.tree, built.tree.root, 1.0, &receiver, &mut expected) {
                continue;
            }
            let target = Target::new(&receiver);
            let root = built.tree.weigh_root(&target);
            n_compared += 1;
            for (light, &expected) in expected.iter().enumerate() {
                let got = built.tree.shares(&target, &root, built.trails[light]).guided;
                assert!(
                    (got - expected).abs() <= 2e-3 * expected + 1e-6,
                    "seed {seed}, light {light}, {receiver:?}: {got} instead of {expected}"
                );
            }
        }
    }
    assert!(n_compared >= 12, "{n_compared} cases away from all thresholds");
}

#[test]
fn stored_bounds_hold_every_light_below() {
    fn lights_below(tree: &LightTree, child: Child, out: &mut Vec<usize>) {
        match child {
            Child::Light(light) => out.push(light),
            Child::Node(node) => {
                let n_slots = if node.is_wide { WIDTH } else { LANES };
                let present =
                    |slot: &usize| tree.lanes[node.first + slot / LANES].stored(slot % LANES).count > 0;
                (0..n_slots).filter(present).for_each(|slot| lights_below(tree, tree.child(node, slot), out));
            }
        }
    }
    for seed in 0..4 {
        let Built { tree, lights, .. } = build(random_lights(seed, 3000, true));
        for (lanes, lane) in tree.lanes.iter().flat_map(|lanes| (0..LANES).map(move |lane| (lanes, lane))) {
            let stored = lanes.stored(lane);
            if stored.count == 0 {
                continue;
            }
            let mut below = Vec::new();
            lights_below(&tree, Child::decode(lanes.child[lane]), &mut below);
            assert_eq!(below.len(), stored.count);
            for light in below.into_iter().map(|i| lights[i]) {
                let (min, max) = (light.min.as_dvec3(), light.max.as_dvec3());
                assert!(min.cmpge(stored.center - stored.half).all());
                assert!(max.cmple(stored.center + stored.half).all());
                let apart = stored.axis.normalize().angle_between(light.cone.axis);
                let is_inside = apart + light.cone.theta_o <= stored.theta_o + 1e-3;
                assert!(is_inside || stored.theta_o > PI - 1e-3, "{light:?} in {stored:?}");
                assert!(light.cone.theta_e <= stored.theta_e + 1e-3);
            }
        }
    }
}

#[test]
fn every_light_is_at_the_end_of_its_trail_in_any_arrangement() {
    let at = |x: f32| LightBounds::new((Vec3A::splat(x), Vec3A::splat(x)), Cone::SPHERE, 1.0);
    let arrangements: [(&str, Vec<LightBounds>); 5] = [
        ("one", vec![at(0.0)]),
        ("coincident", vec![at(1.0); 5000]),
        ("spaced exponentially", (0..3000).map(|i| at(2f32.powf(i as f32 * 0.08 - 120.0))).collect()),
        ("black", vec![LightBounds { intensity: 0.0, ..at(0.0) }; 1000]),
        ("huge", (0..1000).map(|i| at((i as f32 - 500.0) * 6e35)).collect()),
    ];
    for (name, lights) in arrangements {
        let Built { tree, trails, lights } = build(lights);
        let depth = |trail: Trail| (64 - trail.0.leading_zeros()).div_ceil(SLOT_BITS);
        assert!(trails.iter().all(|trail| depth(*trail) <= 21), "{name}");
        for (light, trail) in trails.iter().enumerate() {
            let mut rest = trail.0;
            let mut at = tree.root;
            loop {
                match tree.child(at, rest as usize & (WIDTH - 1)) {
                    Child::Light(found) => {
                        assert_eq!(found, light, "{name}");
                        break;
                    }
                    Child::Node(node) => at = node,
                }
                rest >>= SLOT_BITS;
            }
        }
        let target = Target::new(&Receiver::Point { position: Vec3A::ONE });
        let root = tree.weigh_root(&target);
        let sum: f64 = trails.iter().map(|trail| tree.shares(&target, &root, *trail).even).sum();
        assert!((sum - 1.0).abs() < 1e-5, "{name}: {sum} over {} lights", lights.len());
    }
}

#[test]
fn building_is_a_function_of_the_lights() {
    let (a, b) = (build(random_lights(7, 2000, true)), build(random_lights(7, 2000, true)));
    assert_eq!(a.trails, b.trails);
}

proptest! {
    #[test]
    fn both_ways_add_up_to_one(seed: u64, n in 1usize..400) {
        // Without orientation nothing is dark, so nothing is lost below the root.
        let built = build(random_lights(seed, n, false));
        for receiver in receivers(seed) {
            if matches!(receiver, Receiver::Surface { both_sides: false, .. }) {
                continue;
            }
            let target = Target::new(&receiver);
            let root = built.tree.weigh_root(&target);
            let all = built.trails.iter().map(|trail| built.tree.shares(&target, &root, *trail));
            let (guided, even) = all.fold((0.0, 0.0), |sum, s| (sum.0 + s.guided, sum.1 + s.even));
            prop_assert!((guided - 1.0).abs() < 1e-5 && (even - 1.0).abs() < 1e-5, "{guided} {even}");
        }
    }
}
