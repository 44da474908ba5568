//! Media at one point of a ray, for techniques that choose the distance themselves.

use crate::medium::{Medium, Span};
use crate::phase::PhaseMix;
use crate::walk::Segment;
use glam::Vec3A;
use tyndall_math::random::Pcg;
use tyndall_math::{Ray, Rgb};

/// The phase function and the scattering coefficient at `t` on the ray; `None` where nothing scatters.
///
/// `channels` are weights that guide a choice between media whose phase functions don't mix, see [`Segment::scatter`].
pub fn scattering_at(
    media: &[Medium],
    spans: &[Span],
    ray: &Ray,
    t: f64,
    channels: Vec3A,
    rng: &mut Pcg,
) -> Option<(PhaseMix, Rgb)> {
    let mut segment = Segment::at(media, spans, ray, t);
    // A first cell further on means that grids are empty here.
    let cell = segment.next_cell().filter(|cell| cell.t0 <= t && cell.scatters)?;
    if !segment.coefficients_at(&cell, t).scatters() {
        return None;
    }
    Some(segment.scatter(channels, rng))
}

/// A stand-in for the density, per unit of `t`, with which [`crate::sample_collision`] finds a collision at `t`.
///
/// It is that density (for grey light) where all media are homogeneous, and uniform between `t0` and `t1` where grids
/// are: a pure function of its arguments, as the weights of multiple importance sampling must be.
pub fn collision_density(media: &[Medium], spans: &[Span], ray: &Ray, t: f64, [t0, t1]: [f32; 2]) -> f32 {
    let (mut sigma_t, mut tau) = (Rgb::ZERO, Rgb::ZERO);
    for span in spans {
        let (Some([from, to]), Some(medium)) = (span.clipped(ray), media.get(span.medium as usize)) else {
            continue;
        };
        if medium.density.is_some() {
            return (t1 - t0).recip();
        }
        let c = medium.coefficients();
        if from <= t && t < to {
            sigma_t += c.sigma_t;
        }
        if t > from {
            tau += c.sigma_t * (t.min(to) - from) as f32;
        }
    }
    (sigma_t * (-tau).exp()).element_sum() / 3.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::phase::Isotropic;
    use crate::{Emission, Phase};

    fn medium(sigma_s: f32) -> Medium {
        Medium {
            sigma_a: Rgb::ZERO,
            sigma_s: Rgb::splat(sigma_s),
            emission: Emission::Glow(Rgb::ZERO),
            phase: PhaseMix::single(Phase::Isotropic(Isotropic)),
            density: None,
            tint: None,
        }
    }

    fn span(t0: f64, t1: f64, medium: u32) -> Span {
        Span { t0, t1, medium }
    }

    #[test]
    fn media_add_where_they_overlap_and_end_where_they_end() {
        let media = [medium(1.0), medium(2.0)];
        let spans = [span(0.0, 2.0, 0), span(1.0, 3.0, 1)];
        let ray = Ray::new(Vec3A::ZERO, Vec3A::X);
        let mut rng = Pcg::new(&[1]);
        let mut sigma_s = |t| scattering_at(&media, &spans, &ray, t, Vec3A::ONE, &mut rng).map(|(_, s)| s.x);
        assert_eq!([0.5, 1.5, 2.5, 3.5].map(&mut sigma_s), [Some(1.0), Some(3.0), Some(2.0), None]);
    }

    #[test]
    fn many_media_are_not_forgotten() {
        let media: Vec<_> = (0..40).map(|_| medium(0.25)).collect();
        let spans: Vec<_> = (0..40).map(|i| span(0.0, 1.0, i)).collect();
        let ray = Ray::new(Vec3A::ZERO, Vec3A::X);
        let found = scattering_at(&media, &spans, &ray, 0.5, Vec3A::ONE, &mut Pcg::new(&[2]));
        assert!((found.unwrap().1.x - 10.0).abs() < 1e-4);
    }

    #[test]
    fn the_density_integrates_to_the_chance_of_a_collision() {
        let media = [medium(0.7), medium(1.5)];
        let spans = [span(0.0, 2.0, 0), span(1.0, 3.0, 1)];
        let ray = Ray::new(Vec3A::ZERO, Vec3A::X);
        let n = 30_000;
        let sum: f64 = (0..n)
            .map(|i| {
                f64::from(collision_density(
                    &media,
                    &spans,
                    &ray,
                    (f64::from(i) + 0.5) * 3.0 / f64::from(n),
                    [0.0, 3.0],
                ))
            })
            .sum();
        let expected = -(-(2.0 * 0.7 + 2.0 * 1.5f64)).exp_m1();
        assert!((sum * 3.0 / f64::from(n) - expected).abs() < 1e-4);
    }
}
