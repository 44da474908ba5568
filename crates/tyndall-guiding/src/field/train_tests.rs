//! Expectation maximisation against its slow twin; lobes that are split and merged.

use super::super::tests::samples;
use super::*;
use crate::directional::{
    DirectionSample, SufficientStatistics, VmfLobe, VmfMixture, concentration_from_mean_cosine,
};
use glam::{DVec3, Vec2};
use tyndall_math::INV_4PI;
use tyndall_math::random::Pcg;
use tyndall_math::sampling::uniform_sphere;

/// A lobe in f64.
#[derive(Clone, Copy)]
struct SlowLobe {
    weight: f64,
    kappa: f64,
    mean: DVec3,
}

impl SlowLobe {
    fn density(&self, d: DVec3) -> f64 {
        if self.kappa == 0.0 {
            return self.weight * 0.25 * std::f64::consts::FRAC_1_PI;
        }
        let peak = self.kappa / (std::f64::consts::TAU * -(-2.0 * self.kappa).exp_m1());
        self.weight * peak * (self.kappa * (self.mean.dot(d) - 1.0)).exp()
    }
}

/// One step of expectation maximisation, as it is written in the books, with the priors of `directional::statistics`.
fn slow_step(lobes: &[SlowLobe], samples: &[DirectionSample]) -> Vec<SlowLobe> {
    let n = samples.len() as f64;
    let total: f64 = samples.iter().map(|s| f64::from(s.weight)).sum();
    let new = |lobe: &SlowLobe| {
        let (mut weight, mut squares, mut sum) = (0.0, 0.0, DVec3::ZERO);
        for s in samples {
            let (d, w) = (s.direction.as_dvec3(), f64::from(s.weight));
            let share = lobe.density(d) / lobes.iter().map(|l| l.density(d)).sum::<f64>();
            weight += share * w;
            squares += share * w * w;
            sum += d * share * w;
        }
        let prior_weight = (weight / total * n + 0.01) / (n + 0.01 * lobes.len() as f64);
        if lobe.kappa == 0.0 {
            return SlowLobe { weight: prior_weight.max(0.01), ..*lobe };
        }
        let count = (weight * weight / squares).max(1.0);
        let mean_cosine = sum.length() / weight * count / (count + 0.02);
        let kappa = f64::from(concentration_from_mean_cosine(mean_cosine as f32));
        SlowLobe { weight: prior_weight, kappa, mean: sum.normalize() }
    };
    let mut lobes: Vec<_> = lobes.iter().map(new).collect();
    let total: f64 = lobes.iter().map(|l| l.weight).sum();
    lobes.iter_mut().for_each(|l| l.weight /= total);
    lobes
}

fn lights(n: usize) -> Vec<DirectionSample> {
    let mut rng = Pcg::new(&[31]);
    let truth = VmfMixture::from_lobes([
        (0.6, VmfLobe::new(Vec3A::Z, 40.0)),
        (0.4, VmfLobe::new(Vec3A::new(0.6, 0.8, 0.0), 8.0)),
    ]);
    (0..n)
        .map(|_| {
            let direction = uniform_sphere(Vec2::new(rng.next_f32(), rng.next_f32()));
            DirectionSample { direction, weight: truth.pdf(direction) / INV_4PI, inverse_distance: 0.5 }
        })
        .collect()
}

#[test]
fn steps_equal_those_of_the_slow_twin() {
    let samples = lights(3000);
    let mut fast = VmfMixture::with_background(8);
    let slow_lobe = |(weight, lobe): (f32, VmfLobe)| SlowLobe {
        weight: weight.into(),
        kappa: lobe.kappa().into(),
        mean: lobe.mean().as_dvec3(),
    };
    let mut slow: Vec<_> = fast.lobes().map(slow_lobe).collect();
    for step in 0..8 {
        fast = SufficientStatistics::from_samples(&fast, &samples).maximise(&fast);
        slow = slow_step(&slow, &samples);
        for ((weight, lobe), twin) in fast.lobes().zip(&slow) {
            let same = (f64::from(weight) - twin.weight).abs() < 1e-4
                && (f64::from(lobe.kappa()) - twin.kappa).abs() < 2e-3 * (1.0 + twin.kappa)
                && lobe.mean().as_dvec3().dot(twin.mean) > 1.0 - 1e-5;
            assert!(
                same,
                "step {step}: {weight} {lobe:?}, twin {} {} {}",
                twin.weight, twin.kappa, twin.mean
            );
        }
    }
}

/// A region after one update with uniform samples of this light.
fn region_in(radiance: impl Fn(Vec3A, Vec3A) -> f32, max_lobes: u32) -> Region {
    let settings = FieldSettings { initial_lobes: 4, max_lobes, ..Default::default() };
    let samples = samples(3, 30_000, radiance);
    let group: Vec<u32> = (0..samples.len() as u32).collect();
    let mut region = Region::new(&settings);
    train(&mut region, &samples, &group, &settings);
    region
}

#[test]
fn lobes_are_split_until_they_look_like_the_light() {
    let axes =
        [Vec3A::X, Vec3A::Y, Vec3A::Z, Vec3A::NEG_X, Vec3A::new(0.0, -0.6, -0.8), Vec3A::new(0.6, 0.8, 0.0)];
    let light = |_, d: Vec3A| axes.iter().map(|axis| (80.0 * (axis.dot(d) - 1.0)).exp()).sum::<f32>();
    let region = region_in(light, 8);
    for axis in axes {
        let mixture = region.lobes();
        let nearest = mixture.lobes().map(|(_, lobe)| lobe.mean().dot(axis)).fold(-1.0, f32::max);
        assert!(nearest > 0.99 && mixture.pdf(axis) > 1.0, "{axis}: {nearest}, {}", mixture.pdf(axis));
    }
    assert!(region_in(light, 5).lobes().len() <= 5);
}

#[test]
fn alike_lobes_are_merged_and_their_samples_are_kept() {
    let settings = FieldSettings { max_iterations: 1, max_lobes: 4, ..Default::default() };
    let batch = samples(3, 10_000, |_, d| (20.0 * (d.z - 1.0)).exp() + (20.0 * (d.x - 1.0)).exp());
    let group: Vec<u32> = (0..batch.len() as u32).collect();
    let mut region = Region::new(&settings);
    let lobe = |axis: Vec3A| VmfLobe::new(axis, 20.0);
    let twins = [(0.25, lobe(Vec3A::Z)), (0.5, lobe(Vec3A::X)), (0.25, lobe(Vec3A::Z))];
    region.mixture = VmfMixture::from_lobes(twins);
    train(&mut region, &batch, &group, &settings);
    let lobes: Vec<_> = region.lobes().lobes().collect();
    assert_eq!(lobes.len(), 2);
    for ((weight, lobe), axis) in lobes.into_iter().zip([Vec3A::Z, Vec3A::X]) {
        assert!((weight - 0.5).abs() < 0.05 && lobe.mean().dot(axis) > 0.99, "{weight} {lobe:?}");
    }
    assert!((region.statistics.share(0) + region.statistics.share(1) - 1.0).abs() < 1e-5);
    assert_eq!(region.moments().n.round(), 10_000.0);
}

#[test]
fn a_single_outlier_makes_a_broad_lobe_that_later_light_outweighs() {
    let settings = FieldSettings::default();
    let mut batch = samples(4, 2000, |_, d| d.z.max(0.0));
    batch[17].radiance = 1e6;
    let outlier = batch[17].direction.unpack();
    let group: Vec<u32> = (0..batch.len() as u32).collect();
    let mut region = Region::new(&settings);
    train(&mut region, &batch, &group, &settings);
    assert!(region.lobes().pdf(outlier) < 10.0, "{}", region.lobes().pdf(outlier));
    assert!(region.lobes().pdf(-outlier) > 1e-4);
}
