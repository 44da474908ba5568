//! Unbiased ray marching (Kettunen, d'Eon, Pantaleoni & Novák 2021, "An unbiased ray-marching transmittance estimator",
//! doi:10.1145/3450626.3459937).
//!
//! exp(-τ) is expanded about an estimate of -τ, the *pivot*. Estimates are *combs*: equidistant look-ups with one random
//! offset. Mostly one comb is all, which is ray marching; with probability [`P_HIGHER`] further combs pay for what
//! that is biased by.

use crate::estimators::{Estimator, Shot};
use tyndall_math::random::Pcg;
use tyndall_math::{Ray, Rgb};
use tyndall_volume::majorant::{GridStep, GridWalk};

/// Probability of more than the term of order 0: the paper's 1 - p_Z.
const P_HIGHER: f64 = 0.1;
/// Then at least the terms up to this order, the paper's K, are evaluated ...
const SURE_ORDER: usize = 2;
/// ... and that of order k + 1 with probability c / (k + 1) (Bhanot & Kennedy 1985).
const C: f64 = 2.0;
/// Mean number of combs with these: 1 + (1 - p_Z) (K + c/3 + c²/12 + c³/60 + ...).
const MEAN_COMBS: f64 = 1.319_45;

/// How the ray is cut into pieces with bounds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Pieces {
    /// One, between 0 and the largest density on it: look-ups are equidistant on the ray.
    WholeRay,
    /// The cells of the grid: their minima are the control, and look-ups are equidistant in what lies between bounds.
    ByBounds,
}

/// The estimator with its memory.
pub(crate) struct RayMarching {
    cut: Pieces,
    pieces: Vec<Piece>,
    combs: Vec<f64>,
}

struct Piece {
    step: GridStep,
    /// ∫ (max - min) dt up to the piece's end.
    bound: f32,
}

impl RayMarching {
    pub(crate) fn new(cut: Pieces) -> Self {
        Self { cut, pieces: Vec::new(), combs: Vec::new() }
    }

    /// Finds the pieces; returns the integrals of the minima, and of what is between minima and maxima.
    fn cut(&mut self, walk: &mut GridWalk<'_>) -> [f32; 2] {
        let (mut control, mut bound) = (0.0, 0.0);
        self.pieces.clear();
        for step in walk {
            let length = step.t1 - step.t0;
            control += step.min * length;
            bound += (step.max - step.min) * length;
            if step.max > step.min {
                self.pieces.push(Piece { step, bound });
            }
        }
        [control, bound]
    }

    /// ∫ (density - min) dt by `m` look-ups at equal steps of the bound.
    fn comb_by_bounds(&self, walk: &GridWalk<'_>, m: usize, bound: f32, u: f32) -> f64 {
        let (mut sum, mut pieces, mut before) = (0.0, self.pieces.iter(), 0.0);
        let Some(mut piece) = pieces.next() else { return 0.0 };
        for i in 0..m {
            let target = (i as f32 + u) / m as f32 * bound;
            while target >= piece.bound {
                let Some(next) = pieces.next() else { break };
                (before, piece) = (piece.bound, next);
            }
            let GridStep { t0, t1, max, min, .. } = piece.step;
            let t = (t0 + (target - before) / (max - min)).min(t1);
            sum += f64::from((walk.density(&piece.step, t) - min) / (max - min));
        }
        sum * f64::from(bound) / m as f64
    }
}

impl Estimator for RayMarching {
    fn name(&self) -> &'static str {
        match self.cut {
            Pieces::WholeRay => "ray marching",
            Pieces::ByBounds => "ray marching by bounds",
        }
    }

    fn estimate(&mut self, shot: &Shot<'_>, ray: &Ray, rng: &mut Pcg, lookups: &mut u64) -> Rgb {
        let largest = shot.sigma_t.max_element();
        let mut walk = GridWalk::new(shot.density, ray, [0.0, ray.t_max], largest);
        let [mut control, mut bound] = self.cut(&mut walk);
        if self.cut == Pieces::WholeRay {
            (control, bound) = (0.0, control + bound);
        }
        let m = look_ups_of_comb(f64::from(largest * bound));
        let mut combs = std::mem::take(&mut self.combs);
        combs.clear();
        if bound > 0.0 {
            let n = order(rng) + 1;
            *lookups += (n * m) as u64;
            if self.cut == Pieces::WholeRay {
                let slope = density_at(shot, ray, ray.t_max) - density_at(shot, ray, 0.0);
                *lookups += 2;
                combs.extend((0..n).map(|_| comb_on_ray(shot, ray, m, rng.next_f32(), slope)));
            } else {
                combs.extend((0..n).map(|_| self.comb_by_bounds(&walk, m, bound, rng.next_f32())));
            }
        }
        let series = |sigma_t: f32| series(&combs, -f64::from(sigma_t)) as f32;
        let through = Rgb::new(series(shot.sigma_t.x), series(shot.sigma_t.y), series(shot.sigma_t.z));
        self.combs = combs;
        through * (-shot.sigma_t * control).exp()
    }
}

/// ∫ density dt by `m` look-ups at equal distances. A straight line from end to end, with this slope over the whole ray,
/// is integrated exactly, so that the rest is periodic: the paper's endpoint matching.
fn comb_on_ray(shot: &Shot<'_>, ray: &Ray, m: usize, u: f32, slope: f64) -> f64 {
    let sum: f64 = (0..m).map(|i| density_at(shot, ray, (i as f32 + u) / m as f32 * ray.t_max)).sum();
    (sum - slope * (f64::from(u) - 0.5)) / m as f64 * f64::from(ray.t_max)
}

fn density_at(shot: &Shot<'_>, ray: &Ray, t: f32) -> f64 {
    f64::from(shot.density.grid.density(shot.density.index_from_world.transform_point3a(ray.at(t))))
}

/// Look-ups of one comb where the optical depth is at most `bound`: the paper's fit of what the p-series CMF estimator
/// would take, shared out among the combs.
fn look_ups_of_comb(bound: f64) -> usize {
    let by_cmf = ((0.015 + bound) * (0.65 + bound) * (60.3 + bound)).cbrt().ceil();
    (by_cmf / MEAN_COMBS).floor().max(1.0) as usize
}

/// The highest order that is evaluated.
fn order(rng: &mut Pcg) -> usize {
    if f64::from(rng.next_f32()) >= P_HIGHER {
        return 0;
    }
    let mut k = SURE_ORDER;
    while f64::from(rng.next_f32()) < C / (k + 1) as f64 {
        k += 1;
    }
    k
}

/// An estimate of exp(`factor` times the mean of a comb). Every comb is the pivot once; of the others the mean of all
/// products of k different ones, a U-statistic, estimates the power k.
fn series(combs: &[f64], factor: f64) -> f64 {
    let n = combs.len();
    if n == 0 {
        return 1.0;
    }
    let about = |pivot: usize| {
        let others = (0..n).filter(|&i| i != pivot).map(|i| factor * (combs[i] - combs[pivot]));
        (factor * combs[pivot]).exp() * expansion(others, n - 1)
    };
    (0..n).map(about).sum::<f64>() / n as f64
}

/// Σ over k of m_k / (k! P(order >= k)), with the elementary symmetric means m_k of `n` numbers.
fn expansion(numbers: impl Iterator<Item = f64>, n: usize) -> f64 {
    if n == 0 {
        return 1.0;
    }
    let mut elementary = vec![0.0; n + 1];
    elementary[0] = 1.0;
    for x in numbers {
        for k in (1..=n).rev() {
            elementary[k] += elementary[k - 1] * x;
        }
    }
    // Of binomial(n, k) products k! cancels.
    let (mut sum, mut arrangements, mut probability) = (1.0, 1.0, 1.0);
    for (k, elementary) in elementary.iter().enumerate().skip(1) {
        arrangements *= (n + 1 - k) as f64;
        probability *= match k {
            1 => P_HIGHER,
            k if k <= SURE_ORDER => 1.0,
            k => C / k as f64,
        };
        sum += elementary / (arrangements * probability);
    }
    sum
}
