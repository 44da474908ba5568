//! Lights at infinity: what they send is the same everywhere, so their probabilities are computed once.

/// The distant lights and domes of a set, in the order in which they were added.
#[derive(Debug, Clone, Default)]
pub(super) struct InfiniteLights {
    /// Index in the set of each.
    lights: Vec<usize>,
    /// Part of the irradiance of all of them that comes from each.
    shares: Vec<f64>,
    /// Running sums of `shares`, the last of which is 1.
    cumulative: Vec<f64>,
    irradiance: f64,
}

impl InfiniteLights {
    /// From the index in the set and a guess of the irradiance of each, W/m^2.
    pub(super) fn new(lights: &[(usize, f64)]) -> Self {
        // What is not a number counts as 0; the sum stays finite.
        let limit = f64::MAX / (lights.len().max(1) as f64);
        let irradiances = || lights.iter().map(|(_, irradiance)| irradiance.max(0.0).min(limit));
        let total: f64 = irradiances().sum();
        let even = 1.0 / lights.len() as f64;
        let shares: Vec<f64> = irradiances().map(|it| if total > 0.0 { it / total } else { even }).collect();
        let running = |sum: &mut f64, share: &f64| {
            *sum += share;
            Some(*sum)
        };
        let mut cumulative: Vec<f64> = shares.iter().scan(0.0, running).collect();
        if let Some(last) = cumulative.last_mut() {
            *last = 1.0;
        }
        Self {
            lights: lights.iter().map(|(index, _)| *index).collect(),
            shares,
            cumulative,
            irradiance: total,
        }
    }

    pub(super) fn len(&self) -> usize {
        self.lights.len()
    }

    /// Of all of them together, W/m^2.
    pub(super) fn irradiance(&self) -> f64 {
        self.irradiance
    }

    /// Index in the set of number `i`.
    pub(super) fn light(&self, i: usize) -> usize {
        self.lights[i]
    }

    /// Part of the irradiance that comes from number `i`.
    pub(super) fn share(&self, i: usize) -> f64 {
        self.shares[i]
    }

    /// The one that `u` falls on by irradiance. There must be one.
    pub(super) fn choose(&self, u: f64) -> usize {
        self.cumulative.partition_point(|&c| c <= u).min(self.len() - 1)
    }

    /// The one that `u` falls on if all are alike. There must be one.
    pub(super) fn choose_evenly(&self, u: f64) -> usize {
        ((u * self.len() as f64) as usize).min(self.len() - 1)
    }
}
