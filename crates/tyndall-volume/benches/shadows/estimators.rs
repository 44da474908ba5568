//! The estimators behind one face.

use crate::media::Scene;
use crate::ray_marching::{Pieces, RayMarching};
use tyndall_math::random::Pcg;
use tyndall_math::{Ray, Rgb};
use tyndall_volume::majorant::GridWalk;
use tyndall_volume::phase::Isotropic;
use tyndall_volume::{Emission, GridDensity, Medium, Phase, PhaseMix, Span, WalkStats, transmittance};

/// Below this ratio tracking plays roulette, as the crate does.
const FAINT: f32 = 0.05;
const SURVIVAL: f32 = 0.25;
const SPANS: [Span; 1] = [Span { t0: 0.0, t1: f64::INFINITY, medium: 0 }];

/// A scene with an extinction at density 1.
pub(crate) struct Shot<'a> {
    pub(crate) density: &'a GridDensity,
    pub(crate) rays: &'a [Ray],
    pub(crate) sigma_t: Rgb,
    media: [Medium; 1],
}

impl<'a> Shot<'a> {
    pub(crate) fn new(scene: &'a Scene, sigma_t: Rgb) -> Self {
        let medium = Medium {
            sigma_a: Rgb::ZERO,
            sigma_s: sigma_t,
            emission: Emission::NONE,
            phase: PhaseMix::single(Phase::Isotropic(Isotropic)),
            density: Some(scene.density.clone()),
            tint: None,
        };
        Self { density: &scene.density, rays: &scene.rays, sigma_t, media: [medium] }
    }
}

/// Unbiased estimates of transmittance.
pub(crate) trait Estimator {
    fn name(&self) -> &'static str;

    fn estimate(&mut self, shot: &Shot<'_>, ray: &Ray, rng: &mut Pcg, lookups: &mut u64) -> Rgb;
}

/// Residual ratio tracking first.
pub(crate) fn all() -> Vec<Box<dyn Estimator>> {
    vec![
        Box::new(Ratio { is_residual: true }),
        Box::new(Ratio { is_residual: false }),
        Box::new(RayMarching::new(Pieces::WholeRay)),
        Box::new(RayMarching::new(Pieces::ByBounds)),
        Box::new(Crate),
    ]
}

/// What the crate does.
struct Crate;

impl Estimator for Crate {
    fn name(&self) -> &'static str {
        "the crate"
    }

    fn estimate(&mut self, shot: &Shot<'_>, ray: &Ray, rng: &mut Pcg, lookups: &mut u64) -> Rgb {
        let mut stats = WalkStats::default();
        let estimate = transmittance(&shot.media, &SPANS, ray, rng, &mut stats);
        *lookups += stats.lookups;
        estimate
    }
}

/// Ratio tracking of what lies above a control, which is exact (Novák, Selle & Jarosz 2014), with roulette.
struct Ratio {
    /// The control is the cell's minimum, or else nothing.
    is_residual: bool,
}

impl Estimator for Ratio {
    fn name(&self) -> &'static str {
        if self.is_residual { "residual ratio tracking" } else { "ratio tracking" }
    }

    fn estimate(&mut self, shot: &Shot<'_>, ray: &Ray, rng: &mut Pcg, lookups: &mut u64) -> Rgb {
        let mut largest = shot.sigma_t.max_element();
        let mut walk = GridWalk::new(shot.density, ray, [0.0, ray.t_max], largest);
        let (mut through, mut control, mut remaining) = (Rgb::ONE, 0.0, rng.next_exponential());
        while let Some(step) = walk.next() {
            let min = if self.is_residual { step.min } else { 0.0 };
            let (mut t, residual) = (step.t0, step.max - min);
            while remaining < (step.t1 - t) * (largest * residual) {
                t += remaining / (largest * residual);
                remaining = rng.next_exponential();
                *lookups += 1;
                let excess = (walk.density(&step, t) - min) / residual;
                through *= Rgb::ONE - shot.sigma_t * (excess / largest);
                // Channels end alone; the majorant then follows those that are left.
                let is_faint = through.cmplt(Rgb::splat(FAINT));
                if is_faint.any() {
                    let survivors = if rng.next_f32() < SURVIVAL { through / SURVIVAL } else { Rgb::ZERO };
                    through = Rgb::select(is_faint, survivors, through);
                    let is_live = through.cmpne(Rgb::ZERO);
                    largest = Rgb::select(is_live, shot.sigma_t, Rgb::ZERO).max_element();
                    if largest == 0.0 {
                        return Rgb::ZERO;
                    }
                }
            }
            remaining -= (step.t1 - t) * (largest * residual);
            control += min * (step.t1 - step.t0);
        }
        through * (-shot.sigma_t * control).exp()
    }
}
