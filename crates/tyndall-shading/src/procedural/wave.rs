//! Bands and rings.

use super::fractal::Octaves;
use glam::Vec3A;
use std::f32::consts::{FRAC_PI_2, TAU};

/// Where waves go.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Direction {
    /// Bands along a direction.
    Bands(Vec3A),
    /// Rings around an axis: the components that count.
    Rings(Vec3A),
}

/// The height over a period.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Profile {
    #[default]
    Sine,
    Saw,
    Triangle,
}

/// A wave.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Wave {
    pub(crate) direction: Direction,
    pub(crate) profile: Profile,
    pub(crate) phase: f32,
    /// How far noise shifts it.
    pub(crate) distortion: f32,
    /// Frequency of that noise.
    pub(crate) distortion_scale: f32,
    pub(crate) octaves: Octaves,
}

impl Wave {
    /// The height at `p`, in [0, 1].
    pub(crate) fn at(&self, p: Vec3A) -> f32 {
        // Off the numbers at which unit coordinates would flicker, as far as Blender.
        let p = (p + 1e-6) * 0.999_999;
        let way = match self.direction {
            Direction::Bands(along) => p.dot(along),
            Direction::Rings(counts) => (p * counts).length(),
        };
        let mut angle = 20.0 * way + self.phase;
        if self.distortion != 0.0 {
            let noise = self.octaves.at(&(p * self.distortion_scale).to_array());
            angle += self.distortion * (2.0 * noise - 1.0);
        }
        let turns = angle / TAU;
        let height = match self.profile {
            Profile::Sine => 0.5 + 0.5 * (angle - FRAC_PI_2).sin(),
            Profile::Saw => turns - turns.floor(),
            Profile::Triangle => (turns - (turns + 0.5).floor()).abs() * 2.0,
        };
        crate::material::unit(height)
    }
}
