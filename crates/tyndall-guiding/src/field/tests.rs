//! The field as its users see it: refinement, odds, determinism.

use super::*;
use crate::directional::test_support::{grid, integrate_sphere};
use glam::Vec2;
use tyndall_math::INV_4PI;
use tyndall_math::random::Pcg;
use tyndall_math::sampling::uniform_sphere;

pub(super) const VOLUME: EventClass = EventClass::Volume;
pub(super) const SURFACE: EventClass = EventClass::Surface;

fn u2(rng: &mut Pcg) -> Vec2 {
    Vec2::new(rng.next_f32(), rng.next_f32())
}

/// A sample of a uniform direction at a uniform point of the unit cube.
fn sample(rng: &mut Pcg, radiance: impl Fn(Vec3A, Vec3A) -> f32) -> TrainingSample {
    let position = Vec3A::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
    let direction = uniform_sphere(u2(rng));
    TrainingSample {
        position: position.into(),
        direction: PackedDirection::new(direction),
        radiance: radiance(position, direction),
        emission: 0.0,
        pdf: INV_4PI,
        distance: f32::INFINITY,
        selection_probability: 0.5,
        w: 0.5,
        t_hat: 0.5,
        vertex: VOLUME,
        end: VOLUME,
    }
}

pub(super) fn samples(seed: u64, n: usize, radiance: impl Fn(Vec3A, Vec3A) -> f32) -> Vec<TrainingSample> {
    let mut rng = Pcg::new(&[77, seed]);
    (0..n).map(|_| sample(&mut rng, &radiance)).collect()
}

/// A disk of light of 0.3 rad around `axis`.
fn disk(axis: Vec3A, direction: Vec3A) -> f32 {
    if axis.dot(direction) > 0.955 { 10.0 } else { 0.0 }
}

fn lit_from_two_sides(position: Vec3A, direction: Vec3A) -> f32 {
    disk(if position.x < 0.5 { Vec3A::Z } else { Vec3A::Y }, direction) + 0.01
}

pub(super) fn trained(batches: &[Vec<TrainingSample>]) -> Field {
    let mut field = Field::new(FieldSettings { region_samples: 2000, ..Default::default() });
    batches.iter().for_each(|batch| field.update(batch));
    field
}

fn in_pool(threads: usize, work: impl FnOnce() -> Field + Send) -> Field {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(work)
}

#[test]
fn nothing_is_known_at_first_and_classes_are_apart() {
    let mut field = Field::new(FieldSettings::default());
    assert_eq!(field.region(Vec3A::ZERO, VOLUME, 0.5), None);
    field.update(&[]);
    assert_eq!(field.region(Vec3A::ZERO, VOLUME, 0.5), None);
    field.update(&samples(0, 100, |_, _| 1.0));
    assert!(field.region(Vec3A::ZERO, VOLUME, 0.5).is_some());
    assert_eq!(field.region(Vec3A::ZERO, SURFACE, 0.5), None);
}

#[test]
fn a_sample_and_a_region_stay_small() {
    assert_eq!(size_of::<TrainingSample>(), 48);
    assert_eq!(size_of::<Node>(), 8);
    assert!(size_of::<Region>() <= 800, "{} bytes", size_of::<Region>());
}

#[test]
fn packed_directions_are_precise() {
    let mut rng = Pcg::new(&[3]);
    for i in 0..200_000 {
        let d = match i {
            0..6 => [Vec3A::X, Vec3A::Y, Vec3A::Z, Vec3A::NEG_X, Vec3A::NEG_Y, Vec3A::NEG_Z][i],
            _ => uniform_sphere(u2(&mut rng)),
        };
        let error = (PackedDirection::new(d).unpack() - d).length();
        assert!(error < 6.5e-5, "{d} is off by {error}");
    }
    assert!(PackedDirection::new(Vec3A::NAN).unpack().is_normalized());
}

#[test]
fn two_lights_in_two_halves_of_space_are_told_apart() {
    let field = trained(&[samples(1, 40_000, lit_from_two_sides), samples(2, 40_000, lit_from_two_sides)]);
    for (x, bright, dark) in [(0.2, Vec3A::Z, Vec3A::Y), (0.8, Vec3A::Y, Vec3A::Z)] {
        let position = Vec3A::new(x, 0.4, 0.6);
        let incident = field.region(position, VOLUME, 0.5).unwrap().incident(position);
        let (there, elsewhere) = (incident.pdf(bright), incident.pdf(dark));
        assert!(there > 50.0 * elsewhere, "at x = {x}: {there} and {elsewhere}");
        // Lobes are no disks: too bright in the middle, and the best one leaves 13 % of its light outside.
        let within: Vec<_> = grid(400, 800).into_iter().filter(|d| bright.dot(*d) > 0.955).collect();
        let mean = within.iter().map(|&d| incident.radiance(d)).sum::<f32>() / within.len() as f32;
        assert!((mean / 10.0 - 1.0).abs() < 0.25, "{mean}");
        let fluence = f64::from(10.0f32) * std::f64::consts::TAU * 0.045 + 0.01 * 4.0 * std::f64::consts::PI;
        assert!((f64::from(incident.fluence()) / fluence - 1.0).abs() < 0.15, "{}", incident.fluence());
        let pdf = integrate_sphere(|d| f64::from(incident.pdf(d)));
        assert!((pdf - 1.0).abs() < 1e-3, "{pdf}");
    }
    let statistics = field.statistics();
    assert!(statistics.n_volume_regions > 20 && statistics.max_depth >= 4, "{statistics:?}");
    assert_eq!((statistics.n_samples, statistics.n_updates, statistics.n_surface_regions), (80_000, 2, 0));
}

#[test]
fn threads_do_not_change_a_bit() {
    let batches = [samples(1, 30_000, lit_from_two_sides), samples(2, 60_000, lit_from_two_sides)];
    let one = in_pool(1, || trained(&batches));
    for threads in [2, 5] {
        assert!(one == in_pool(threads, || trained(&batches)), "{threads} threads");
    }
}

/// Segments that end in volume of radiance 8 and at surfaces of radiance 2 about the zenith, the other way round about the
/// nadir, and in the dark elsewhere.
fn segments(seed: u64, n: usize, probability: f32) -> Vec<TrainingSample> {
    let mut rng = Pcg::new(&[78, seed]);
    let mut segment = || {
        let mut s = sample(&mut rng, |_, _| 0.0);
        let (volume, surface) = match s.direction.unpack().z {
            0.8.. => (8.0, 2.0),
            ..-0.8 => (2.0, 8.0),
            _ => (0.0, 0.0),
        };
        (s.w, s.t_hat) = (0.4, 0.6);
        if rng.next_f32() < probability {
            (s.end, s.selection_probability, s.radiance) = (VOLUME, probability, volume * 0.4 / probability);
        } else {
            let p = 1.0 - probability;
            (s.end, s.selection_probability, s.radiance) = (SURFACE, p, surface * 0.6 / p);
        }
        s
    };
    (0..n).map(|_| segment()).collect()
}

#[test]
fn odds_are_ratios_of_radiance_whatever_they_were_sampled_with() {
    for probability in [0.2, 0.4, 0.9] {
        let mut field = Field::new(FieldSettings {
            region_samples: 1 << 20,
            effective_samples: 1 << 20,
            ..Default::default()
        });
        field.update(&segments(1, 20_000, probability));
        field.update(&segments(2, 20_000, probability));
        let position = Vec3A::splat(0.5);
        let region = field.region(position, VOLUME, 0.5).unwrap();
        let kappa = |direction| region.moments_towards(direction).odds().kappa();
        let (up, down) = (kappa(Vec3A::Z), kappa(Vec3A::NEG_Z));
        assert!((up / 4.0 - 1.0).abs() < 0.2 && (down * 4.0 - 1.0).abs() < 0.2, "{up}, {down}");
        // By contribution: 0.4·8 against 0.6·2.
        let target = region.moments_towards(Vec3A::Z).contribution_target().unwrap();
        assert!((target - 3.2 / 4.4).abs() < 0.06, "{target}");
    }
}

#[test]
fn few_samples_mean_delta_tracking() {
    let mut field = Field::new(FieldSettings::default());
    field.update(&segments(1, 2, 0.5));
    let region = field.region(Vec3A::ZERO, VOLUME, 0.5).unwrap();
    let kappa = region.moments_towards(Vec3A::Z).odds().kappa();
    assert!((0.5..2.0).contains(&kappa), "{kappa}");
    assert!(region.lobes().lobes().all(|(_, lobe)| lobe.kappa() < 10.0));
}

#[test]
fn dark_samples_count() {
    let (bright, all) =
        (samples(1, 1000, |_, _| 1.0), samples(1, 2000, |p, _| if p.y < 0.5 { 1.0 } else { 0.0 }));
    let fluence = |samples: &[TrainingSample]| {
        // One region.
        let mut field = Field::new(FieldSettings { max_depth: 0, ..Default::default() });
        field.update(samples);
        field.region(Vec3A::ZERO, VOLUME, 0.5).unwrap().incident(Vec3A::splat(0.5)).fluence()
    };
    assert!((fluence(&bright) / (4.0 * std::f32::consts::PI) - 1.0).abs() < 1e-3);
    assert!((fluence(&all) / fluence(&bright) - 0.5).abs() < 0.05);
}

#[test]
fn lobes_follow_near_light_of_surfaces() {
    for (position, brightest, centre) in seen_by_four(SURFACE) {
        let cos = brightest.dot((centre - position).normalize());
        assert!(cos > 0.97, "from {position}: {cos}");
    }
}

#[test]
fn light_that_media_scatter_is_nowhere() {
    let seen = seen_by_four(VOLUME);
    for (position, brightest, _) in &seen {
        assert!(brightest.distance(seen[0].1) < 1e-5, "from {position}: {brightest}");
    }
}

/// A small ball of light above the middle of the cube, half a unit over it: four points, the mean of the brightest lobe
/// there, and the middle of the ball. Segments that see it end with `end`.
fn seen_by_four(end: EventClass) -> Vec<(Vec3A, Vec3A, Vec3A)> {
    let (centre, radius) = (Vec3A::new(0.5, 0.5, 1.5), 0.15);
    let mut rng = Pcg::new(&[5]);
    let batch: Vec<_> = (0..40_000)
        .map(|_| {
            let mut s = sample(&mut rng, |_, _| 0.0);
            let to = centre - Vec3A::from(s.position);
            let along = s.direction.unpack().dot(to);
            let hit = along > 0.0 && to.length_squared() - along * along < radius * radius;
            if hit {
                (s.radiance, s.distance, s.end) = (5.0, along, end);
            }
            s
        })
        .collect();
    let mut field = Field::new(FieldSettings {
        region_samples: 1 << 20,
        effective_samples: 1 << 20,
        ..Default::default()
    });
    field.update(&batch);
    assert_eq!(field.statistics().n_volume_regions, 1);
    let points = [Vec3A::splat(0.1), Vec3A::new(0.9, 0.1, 0.5), Vec3A::splat(0.5), Vec3A::new(0.5, 0.9, 0.2)];
    let seen = points.map(|position| {
        let incident = field.region(position, VOLUME, 0.5).unwrap().incident(position);
        let brightest = incident.mixture().lobes().max_by(|a, b| a.0.total_cmp(&b.0)).unwrap().1;
        (position, brightest.mean(), centre)
    });
    seen.into()
}

#[test]
fn products_of_what_was_learned_are_distributions() {
    let field = trained(&[samples(1, 40_000, lit_from_two_sides)]);
    let position = Vec3A::new(0.2, 0.5, 0.5);
    let incident = field.region(position, VOLUME, 0.5).unwrap().incident(position);
    for mixture in [
        incident.product_with_cosine(Vec3A::Y),
        incident.product_with_cosine(Vec3A::NEG_Z),
        incident.product_with_hg(Vec3A::X, 0.9),
        incident.product_with_hg(Vec3A::Z, -0.4),
        incident.product_with_hg(Vec3A::Z, 0.0),
    ] {
        let pdf = integrate_sphere(|d| f64::from(mixture.pdf(d)));
        assert!((pdf - 1.0).abs() < 2e-3, "{pdf}");
        assert!((mixture.lobes().map(|(w, _)| w).sum::<f32>() - 1.0).abs() < 1e-5);
    }
}
