//! How many lobes a region takes.
//!
//! Source: Ruppert et al. 2020, doi:10.1145/3386569.3392421, section 5: a lobe is split where the chi-square divergence of
//! the mixture from the light is large, and two are merged (`similar`) where that of one lobe from both is small.

use super::Region;
use super::parallax::Observation;
use crate::directional::{
    Assigner, LobeSums, MAX_CONCENTRATION, SufficientStatistics, VmfLobe, VmfMixture,
    concentration_from_mean_cosine,
};
use glam::Vec3A;
use tyndall_math::Frame;

/// A lobe's part of the divergence above which it is split.
const SPLIT_ABOVE: f32 = 0.5;
/// Effective samples a lobe needs to be split: the divergence is noise below.
const MIN_SAMPLES: f32 = 6.0;
/// Samples per partial sum.
const CHUNK: usize = 4096;

/// Per lobe: Σγ (w/Φ)² p/q, Σγw, and Σγw ωωᵀ as xx, xy, xz, yy, yz, zz.
type Misfit = LobeSums<8>;

/// Splits the lobes that stand for what they do not look like, the worst first while there is room. `latest` holds the
/// present samples, assigned to the present lobes. Says whether any was split.
pub(super) fn split_poor(
    region: &mut Region,
    observations: &[Observation],
    latest: &SufficientStatistics,
    max_lobes: usize,
) -> bool {
    let n = region.mixture.len();
    let fluence = latest.mean_weight();
    if n >= max_lobes || fluence <= 0.0 {
        return false;
    }
    let misfit = misfit(&region.mixture, observations, fluence);
    // ∫ γ_k (p - q)²/q dω, with ∫ γ_k q = π_k and ∫ γ_k p = the lobe's share of the samples.
    let divergence =
        |k: usize| misfit.0[0][k] / latest.n_samples() - 2.0 * latest.share(k) + region.mixture.lobe(k).0;
    let mut poor: Vec<(usize, f32)> = (0..n)
        .filter(|&k| latest.effective_count(k) >= MIN_SAMPLES)
        .map(|k| (k, divergence(k)))
        .filter(|(_, d)| *d > SPLIT_ABOVE)
        .collect();
    poor.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    poor.truncate(max_lobes - n);
    let mut lobes: Vec<_> = region.mixture.lobes().collect();
    for &(k, _) in &poor {
        let [one, other] = halves(&lobes[k].1, &misfit, latest, k);
        let (new, weight) = (lobes.len(), 0.5 * lobes[k].0);
        lobes[k] = (weight, one);
        lobes.push((weight, other));
        region.statistics.split(k, new);
        region.statistics.aim(k, &one);
        region.statistics.aim(new, &other);
        region.moments.halve(k, new);
    }
    region.mixture = VmfMixture::from_lobes(lobes);
    !poor.is_empty()
}

fn misfit(mixture: &VmfMixture, observations: &[Observation], fluence: f32) -> Misfit {
    let assigner = Assigner::new(mixture);
    let mut total = Misfit::default();
    for chunk in observations.chunks(CHUNK) {
        let mut sums = Misfit::default();
        for observation in chunk {
            let Some(assignment) = assigner.assign(observation.light.direction) else { continue };
            let (w, d) = (observation.light.weight, observation.light.direction);
            let ratio = w / fluence;
            let square = ratio * ratio * observation.pdf * (-assignment.log_pdf).exp().min(1e12);
            let values = [
                square,
                w,
                w * d.x * d.x,
                w * d.x * d.y,
                w * d.x * d.z,
                w * d.y * d.y,
                w * d.y * d.z,
                w * d.z * d.z,
            ];
            sums.add(&assignment.shares, assigner.n_groups(), &values);
        }
        total.merge(&sums);
    }
    total
}

/// Two lobes for one: to both sides along the direction in which its samples spread most. A uniform lobe stays, beside one
/// that stands for the mean of its samples.
fn halves(lobe: &VmfLobe, misfit: &Misfit, latest: &SufficientStatistics, k: usize) -> [VmfLobe; 2] {
    if lobe.kappa() == 0.0 {
        let mean = latest.mean_direction(k);
        let axis = mean.try_normalize().unwrap_or(Vec3A::Z);
        return [*lobe, VmfLobe::new(axis, concentration_from_mean_cosine(mean.length()).max(1.0))];
    }
    let frame = Frame::from_normal(lobe.mean());
    let (tt, tb, bb) = tangential_moments(misfit, k, &frame);
    let (middle, half_difference) = (0.5 * (tt + bb), (0.5 * (tt - bb)).hypot(tb));
    let (largest, least) = (middle + half_difference, (middle - half_difference).max(0.0));
    let (sin, cos) = (0.5 * (2.0 * tb).atan2(tt - bb)).sin_cos();
    // The halves of a normal distribution: their means are √(2/π) deviations from its own, and 1 - 2/π of the variance is
    // left within.
    let offset = (largest * std::f32::consts::FRAC_2_PI).sqrt().min(1.0);
    let variance = 0.5 * ((1.0 - std::f32::consts::FRAC_2_PI) * largest + least);
    let kappa = (1.0 / variance).clamp(lobe.kappa(), MAX_CONCENTRATION);
    let step = (frame.tangent * cos + frame.bitangent * sin) * offset;
    [lobe.mean() + step, lobe.mean() - step].map(|mean| VmfLobe::new(mean.normalize(), kappa))
}

/// Second moments of the samples of a lobe in the plane across it: along the tangent, mixed, along the bitangent.
fn tangential_moments(misfit: &Misfit, k: usize, frame: &Frame) -> (f32, f32, f32) {
    let weight = misfit.0[1][k].max(f32::MIN_POSITIVE);
    let [xx, xy, xz, yy, yz, zz] = [2, 3, 4, 5, 6, 7].map(|i| misfit.0[i][k] / weight);
    let times = |v: Vec3A| {
        Vec3A::new(
            xx * v.x + xy * v.y + xz * v.z,
            xy * v.x + yy * v.y + yz * v.z,
            xz * v.x + yz * v.y + zz * v.z,
        )
    };
    let (t, b) = (frame.tangent, frame.bitangent);
    (t.dot(times(t)).max(0.0), b.dot(times(t)), b.dot(times(b)).max(0.0))
}
