//! Phase functions as data.

use super::terms::VolumeCompiler;

pub(super) const LOBES: &str = "henyey_greenstein";
pub(super) const CHOICES: &str = "henyey_greenstein|rayleigh|draine|droplets";

/// Largest |g|: beyond it the phase function is a delta function in f32.
const MAX_G: f32 = 0.99999;

/// Where scattered light goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PhaseModel {
    /// Henyey-Greenstein, one lobe or two.
    Lobes {
        /// Mean cosine of the first lobe.
        g: f32,
        /// Mean cosine of the second.
        g2: f32,
        /// Part of the light in the second.
        mix: f32,
    },
    /// Particles much smaller than the wavelength.
    Rayleigh,
    /// Draine's function.
    Draine {
        /// Anisotropy of its lobe.
        g: f32,
        /// Strength of the cosine squared.
        alpha: f32,
    },
    /// Water droplets.
    Droplets {
        /// In micrometres.
        diameter: f32,
    },
}

impl PhaseModel {
    /// One Henyey-Greenstein lobe.
    pub fn lobe(g: f32) -> Self {
        Self::Lobes { g, g2: 0.0, mix: 0.0 }
    }
}

impl VolumeCompiler<'_> {
    pub(super) fn phase(&mut self, index: usize) -> PhaseModel {
        let kind = self.choice(index, "phase", LOBES, CHOICES);
        let (model, used): (PhaseModel, &[&str]) = match kind.as_str() {
            "rayleigh" => (PhaseModel::Rayleigh, &[]),
            "draine" => {
                let (g, alpha) =
                    (self.anisotropy(index, "anisotropy"), self.number(index, "alpha", 1.0, [0.0, 1e6]));
                (PhaseModel::Draine { g, alpha }, &["anisotropy", "alpha"])
            }
            "droplets" => {
                let diameter = self.number(index, "dropletDiameter", 20.0, [0.0, 50.0]);
                (PhaseModel::Droplets { diameter }, &["dropletDiameter"])
            }
            _ => {
                let (g, g2) = (self.anisotropy(index, "anisotropy"), self.anisotropy(index, "anisotropy2"));
                let mix = self.number(index, "lobeMix", 0.0, [0.0, 1.0]);
                (PhaseModel::Lobes { g, g2, mix }, &["anisotropy", "anisotropy2", "lobeMix"])
            }
        };
        self.report_unused(index, &kind, used);
        model
    }

    /// One message about the authored inputs that this phase function does not have.
    fn report_unused(&mut self, index: usize, kind: &str, used: &[&str]) {
        let all = ["anisotropy", "anisotropy2", "lobeMix", "alpha", "dropletDiameter"];
        let unused: Vec<_> =
            all.into_iter().filter(|name| !used.contains(name) && self.is_authored(index, name)).collect();
        if !unused.is_empty() {
            let what = format!("node {index} (volume): phase {kind:?} has no {}", unused.join(", "));
            self.warn(what, "they were ignored; choose another phase function");
        }
    }

    fn anisotropy(&mut self, index: usize, name: &str) -> f32 {
        self.number(index, name, 0.0, [-1.0, 1.0]).clamp(-MAX_G, MAX_G)
    }
}
