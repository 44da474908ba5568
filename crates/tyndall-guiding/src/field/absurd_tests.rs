//! No input makes a field hang, panic or answer with what is not a distribution.

use super::tests::{SURFACE, VOLUME, samples, trained};
use super::*;
use glam::Vec2;
use proptest::prelude::*;

/// Asks everything at a point.
fn check(field: &Field, position: Vec3A, direction: Vec3A) -> Result<(), TestCaseError> {
    for class in [VOLUME, SURFACE] {
        for u in [0.0, 0.4, 0.999_999_9] {
            let Some(region) = field.region(position, class, u) else { continue };
            let incident = region.incident(position);
            let hg = incident.product_with_hg(direction, 0.8);
            for mixture in [incident.mixture(), &incident.product_with_cosine(direction), &hg] {
                let drawn = mixture.sample(Vec2::new(u, 0.3));
                prop_assert!((drawn.direction.length() - 1.0).abs() < 1e-4, "{drawn:?}");
                prop_assert!(drawn.pdf.is_finite() && drawn.pdf > 0.0, "{drawn:?}");
                prop_assert!((mixture.lobes().map(|(w, _)| w).sum::<f32>() - 1.0).abs() < 1e-5);
            }
            prop_assert!(incident.pdf(direction) > 0.0 && incident.pdf(direction).is_finite());
            prop_assert!(incident.fluence() >= 0.0 && incident.fluence().is_finite());
            prop_assert!(
                incident.irradiance(direction) >= 0.0 && incident.in_scattered(direction, 0.3) >= 0.0
            );
            prop_assert!((1e-3..=1e3).contains(&region.moments_towards(direction).odds().kappa()));
        }
    }
    Ok(())
}

#[test]
fn degenerate_clouds_end() {
    let at = |place: fn(f32) -> [f32; 3]| {
        let mut batch = samples(9, 5000, |_, d| d.z.max(0.0));
        batch.iter_mut().for_each(|s| s.position = place(s.position[0]));
        batch
    };
    let clouds = [
        at(|_| [0.0; 3]),
        at(|_| [1e30, -1e30, 0.0]),
        at(|t| [t, t, t]),
        at(|t| [1e30 * t, 0.0, 0.0]),
        at(|t| [1.0 + 1e-7 * (t * 2.0).floor(), 0.0, 0.0]),
        at(|t| [t.powi(40), 1e-40 * t, 0.0]),
        at(|_| [f32::NAN, 0.0, 0.0]),
        at(|t| [f32::INFINITY * t, 0.0, 0.0]),
    ];
    for (i, cloud) in clouds.iter().enumerate() {
        let field = trained(&[cloud.clone(), cloud.clone()]);
        let statistics = field.statistics();
        assert!(statistics.max_depth <= 32);
        let expected = if i < 6 { (10_000, 0) } else { (0, 10_000) };
        assert_eq!((statistics.n_samples, statistics.n_rejected), expected, "cloud {i}");
        for position in [Vec3A::ZERO, Vec3A::splat(1e30), Vec3A::NAN, Vec3A::NEG_INFINITY] {
            check(&field, position, Vec3A::Z).unwrap();
        }
    }
}

fn any_float() -> impl Strategy<Value = f32> {
    prop_oneof![-1f32..1.0, any::<f32>(), Just(0.0), Just(1e30), Just(f32::NAN), Just(f32::INFINITY)]
}

prop_compose! {
    fn absurd_sample()(
        position in prop::array::uniform3(any_float()), direction in prop::array::uniform3(any_float()),
        v in prop::array::uniform7(any_float()), vertex in any::<bool>(), end in any::<bool>(),
    ) -> TrainingSample {
        let class = |volume| if volume { VOLUME } else { SURFACE };
        TrainingSample {
            position,
            direction: PackedDirection::new(Vec3A::from(direction)),
            radiance: v[0].abs(),
            emission: v[1].abs(),
            pdf: v[2].abs(),
            distance: v[3],
            selection_probability: v[4],
            w: v[5],
            t_hat: v[6],
            vertex: class(vertex),
            end: class(end),
        }
    }
}

proptest! {
    #[test]
    fn absurd_samples_do_no_harm(
        first in prop::collection::vec(absurd_sample(), 0..150), second in prop::collection::vec(absurd_sample(), 0..150),
        position in prop::array::uniform3(any_float()), (x, y) in (-1f32..1.0, -1f32..1.0),
    ) {
        let mut field = Field::new(FieldSettings { region_samples: 64, ..Default::default() });
        field.update(&first);
        field.update(&second);
        check(&field, Vec3A::from(position), Vec3A::new(x, y, 0.2).normalize())?;
    }
}
