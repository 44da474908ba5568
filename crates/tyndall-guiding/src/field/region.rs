//! What a region has learned.

use super::parallax::{lobes_seen_from, seen_from};
use super::refine::Cloud;
use super::{FieldSettings, Incident};
use crate::Moments;
use crate::directional::{Group, LobeSums, PerLobe, SufficientStatistics, VmfMixture, groups_of};
use glam::Vec3A;

/// The sums of scattering odds per lobe: [`Moments`] without depths.
pub(super) type LobeMoments = LobeSums<9>;

/// A part of space: the light that arrives there, and the odds of what it came through.
#[derive(Debug, Clone, PartialEq)]
pub struct Region {
    /// Lobes are as seen from here.
    pub(super) pivot: [f32; 3],
    /// Standard deviation of the samples' positions when the region was made.
    pub(super) spread: [f32; 3],
    pub(super) depth: u32,
    /// Samples so far, a quarter of the former region's included.
    pub(super) n_samples: f32,
    pub(super) mixture: VmfMixture,
    /// 1 / distance of each lobe; 0 for infinitely far.
    pub(super) inverse_distance: PerLobe,
    pub(super) statistics: SufficientStatistics,
    pub(super) moments: LobeMoments,
}

impl Region {
    pub(super) fn new(settings: &FieldSettings) -> Self {
        Self {
            pivot: [0.0; 3],
            spread: [0.0; 3],
            depth: 0,
            n_samples: 0.0,
            mixture: VmfMixture::with_background(settings.initial_lobes as usize),
            inverse_distance: PerLobe::ZERO,
            statistics: SufficientStatistics::default(),
            moments: LobeMoments::default(),
        }
    }

    /// Makes this the region around `cloud`: lobes are moved, and what was learned counts for `factor` of its samples.
    pub(super) fn narrow(&mut self, cloud: &Cloud, depth: u32, factor: f32) {
        let offset = Vec3A::from(self.pivot) - Vec3A::from(cloud.mean);
        self.mixture = seen_from(&self.mixture, &self.inverse_distance, offset).0;
        self.statistics.decay(factor);
        for (k, (_, lobe)) in self.mixture.lobes().enumerate() {
            self.statistics.aim(k, &lobe);
        }
        self.moments.scale(factor);
        self.n_samples *= factor;
        (self.pivot, self.spread, self.depth) = (cloud.mean, cloud.deviation, depth);
    }

    /// Light from everywhere is at no distance.
    pub(super) fn set_background_distance(&mut self) {
        for (k, (_, lobe)) in self.mixture.lobes().enumerate() {
            if lobe.kappa() == 0.0 {
                self.inverse_distance[k] = 0.0;
            }
        }
    }

    /// What arrives at `position`, which should be in or near the region. On the stack; does not allocate.
    #[inline]
    pub fn incident(&self, position: Vec3A) -> Incident {
        Incident::new(self, position)
    }

    /// What the light at `position` has beyond where a surface of this normal looks for it by its cosine, and how often a
    /// direction should come from there; see [`VmfMixture::product_with_cosine`].
    #[inline]
    pub fn narrower_than_cosine(&self, position: Vec3A, normal: Vec3A) -> (VmfMixture, f32) {
        self.mixture.narrower_than_cosine(normal, self.as_seen_from(position))
    }

    /// The same for a collision that scatters to `wo` by a phase function of mean cosine `g`; see
    /// [`VmfMixture::product_with_hg`].
    #[inline]
    pub fn narrower_than_hg(&self, position: Vec3A, wo: Vec3A, g: f32) -> (VmfMixture, f32) {
        self.mixture.narrower_than_hg(wo, g, self.as_seen_from(position))
    }

    #[inline(always)]
    fn as_seen_from(&self, position: Vec3A) -> impl Fn(usize, Group) -> Group {
        let offset = Vec3A::from(self.pivot) - position;
        move |g, lobes| lobes_seen_from(lobes, self.inverse_distance.0[g], offset)
    }

    /// L(ω) as seen from the middle of the region.
    #[inline]
    pub fn radiance_towards(&self, direction: Vec3A) -> f32 {
        self.mixture.pdf(direction) * self.statistics.mean_weight()
    }

    /// The sums of the segments that left about in this direction, lobes sharing by their densities *before* any product,
    /// as seen from the middle of the region: odds change little with parallax, and moving lobes is half of their cost.
    #[inline]
    pub fn moments_towards(&self, direction: Vec3A) -> Moments {
        let (shares, _) = self.mixture.shares(direction);
        from_values(self.moments.blend(&shares, groups_of(self.mixture.len())))
    }

    /// The lobes as seen from the middle of the region.
    pub fn lobes(&self) -> &VmfMixture {
        &self.mixture
    }

    /// Where lobes are seen from: the mean of the samples' positions when the region was made.
    pub fn pivot(&self) -> [f32; 3] {
        self.pivot
    }

    /// How far the light of each lobe comes from, as seen from the middle of the region; infinite for background.
    pub fn distances(&self) -> impl Iterator<Item = f32> + '_ {
        (0..self.mixture.len()).map(|k| 1.0 / self.inverse_distance[k].max(0.0))
    }

    /// Planes above the region.
    pub fn depth(&self) -> u32 {
        self.depth
    }

    /// Samples so far; fewer where the region was made from a larger one.
    pub fn n_samples(&self) -> f32 {
        self.n_samples
    }

    /// The sums over all lobes.
    pub fn moments(&self) -> Moments {
        from_values(self.moments.0.each_ref().map(|sums| sums.total() as f32))
    }
}

/// In the order of [`from_values`].
#[inline]
pub(super) fn values_of(m: &Moments) -> [f32; 9] {
    [m.volume_x2, m.volume_x, m.surface_x2, m.surface_x, m.w2, m.t2, m.w, m.t, m.n]
}

/// Without depths.
#[inline]
pub(super) fn from_values(v: [f32; 9]) -> Moments {
    let [volume_x2, volume_x, surface_x2, surface_x, w2, t2, w, t, n] = v;
    Moments { volume_x2, volume_x, surface_x2, surface_x, w2, t2, w, t, n, w_depth: 0.0, t_depth: 0.0 }
}
