//! What can guide the paths of a render, in combinations.

use serde::{Deserialize, Serialize};
use tyndall_guiding::Strategy;
use tyndall_scene::{DistanceSampling, Guiding, RenderSettings};

/// Renders of fewer samples a pixel end before a guide could return what it cost.
const FEWEST_SAMPLES: u32 = 128;

/// What guides a path.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Arm {
    /// Directions, by the field.
    pub directions: bool,
    /// The choice between volume and surface: on the camera's segment by the image guide, on others by the field.
    pub odds: bool,
}

impl Arm {
    /// Whether it is nothing.
    pub(super) fn is_empty(self) -> bool {
        self == Self::default()
    }

    /// What the settings leave open for a scene with or without media, the plainest first; never empty.
    pub(super) fn candidates(settings: &RenderSettings, has_media: bool) -> Vec<Self> {
        let is_long = settings.samples >= FEWEST_SAMPLES;
        let choices = |is_open: bool, is_fixed: bool| match (is_open, is_fixed) {
            (true, _) if is_long => &[false, true][..],
            (true, _) | (false, false) => &[false],
            (false, true) => &[true],
        };
        // With one event there is direct light only, and no direction to be guided.
        let has_indirect_light = settings.max_bounces > 1;
        let directions = choices(
            has_indirect_light && settings.guiding == Guiding::Auto,
            has_indirect_light && settings.guiding == Guiding::On,
        );
        // Who wants no guiding wants an image that does not depend on how it was made.
        let is_auto = settings.distance_sampling == DistanceSampling::Auto;
        let odds = choices(
            has_media && is_auto && settings.guiding != Guiding::Off,
            has_media && !is_auto && strategy(settings).is_some(),
        );
        odds.iter()
            .flat_map(|&odds| directions.iter().map(move |&directions| Self { directions, odds }))
            .collect()
    }

    /// Whether it asks the field under these settings.
    pub(super) fn needs_field(self, settings: &RenderSettings) -> bool {
        let has_field = settings.guiding != Guiding::Off && settings.max_bounces > 1;
        has_field && (self.directions || self.odds && settings.guiding == Guiding::Auto)
    }
}

/// How segments choose, if they are guided.
pub(super) fn strategy(settings: &RenderSettings) -> Option<Strategy> {
    match settings.distance_sampling {
        DistanceSampling::Auto | DistanceSampling::Odds => Some(Strategy::Odds),
        DistanceSampling::Target => Some(Strategy::Target),
        DistanceSampling::Nds => Some(Strategy::Normalized),
        DistanceSampling::NdsPlus => Some(Strategy::NormalizedPlus),
        DistanceSampling::Delta => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn candidates(guiding: Guiding, distance_sampling: DistanceSampling, samples: u32) -> Vec<[bool; 2]> {
        let settings = RenderSettings {
            guiding,
            distance_sampling,
            samples,
            max_bounces: 8,
            ..RenderSettings::default()
        };
        Arm::candidates(&settings, true).into_iter().map(|arm| [arm.directions, arm.odds]).collect()
    }

    #[test]
    fn what_is_open_is_tried_in_long_renders() {
        use DistanceSampling as D;
        let all = [[false, false], [true, false], [false, true], [true, true]];
        assert_eq!(candidates(Guiding::Auto, D::Auto, 128), all);
        assert_eq!(candidates(Guiding::Auto, D::Auto, 127), [[false, false]]);
        assert_eq!(candidates(Guiding::On, D::Auto, 128), [[true, false], [true, true]]);
        assert_eq!(candidates(Guiding::Off, D::Target, 128), [[false, true]]);
        assert_eq!(candidates(Guiding::Off, D::Auto, 128), [[false, false]]);
        assert_eq!(candidates(Guiding::Auto, D::Odds, 128), [[false, true], [true, true]]);
    }

    #[test]
    fn nothing_is_tried_that_cannot_matter() {
        let settings = RenderSettings { max_bounces: 1, samples: 256, ..RenderSettings::default() };
        assert_eq!(Arm::candidates(&settings, false), [Arm::default()]);
        let odds_only = [Arm::default(), Arm { directions: false, odds: true }];
        assert_eq!(Arm::candidates(&settings, true), odds_only);
        assert!(!odds_only[1].needs_field(&settings));
    }
}
