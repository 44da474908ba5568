//! The scattering of a hit: a few weighted lobes, and the fraction that passes straight through.

use super::frame::{LocalFrame, Side};
use super::{BsdfSample, BsdfValue, Diffuse, Lobe, ShadingFrame, Spread};
use glam::Vec3A;
use tyndall_math::{Rgb, luminance};

/// Most lobes a [`Bsdf`] holds.
pub const MAX_LOBES: usize = 4;

#[derive(Debug, Clone, Copy, PartialEq)]
struct WeightedLobe {
    lobe: Lobe,
    weight: Rgb,
}

/// How a surface scatters at one hit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bsdf {
    lobes: [WeightedLobe; MAX_LOBES],
    n_lobes: usize,
    transparency: Rgb,
}

impl Default for Bsdf {
    fn default() -> Self {
        Self::black()
    }
}

impl<T: Into<Lobe>> From<T> for Bsdf {
    fn from(lobe: T) -> Self {
        let mut bsdf = Self::black();
        bsdf.add(lobe.into(), Rgb::ONE);
        bsdf
    }
}

impl Bsdf {
    /// Absorbs everything.
    pub fn black() -> Self {
        let unused = WeightedLobe { lobe: Diffuse::new(Rgb::ZERO, 0.0).into(), weight: Rgb::ZERO };
        Self { lobes: [unused; MAX_LOBES], n_lobes: 0, transparency: Rgb::ZERO }
    }

    /// Lets everything pass.
    pub fn transparent() -> Self {
        Self { transparency: Rgb::ONE, ..Self::black() }
    }

    /// Adds `lobe` times `weight`. Index-matched dielectrics become transparency. Returns whether there was room.
    pub fn add(&mut self, lobe: Lobe, weight: Rgb) -> bool {
        if let Lobe::Dielectric(dielectric) = &lobe
            && let Some(passing) = dielectric.straight_through()
        {
            self.add_transparency(weight * passing);
            return true;
        }
        if weight == Rgb::ZERO {
            return true;
        }
        if self.n_lobes == MAX_LOBES {
            return false;
        }
        self.lobes[self.n_lobes] = WeightedLobe { lobe, weight };
        self.n_lobes += 1;
        if let Lobe::PreviewSurface(preview) = &lobe {
            self.add_transparency(weight * preview.transparency());
        }
        true
    }

    /// Lets a further fraction of the light pass straight through.
    pub fn add_transparency(&mut self, fraction: Rgb) {
        self.transparency = (self.transparency + fraction).min(Rgb::ONE);
    }

    /// Adds all of `other` times `weight`. Returns whether there was room for all its lobes.
    pub fn add_scaled(&mut self, other: &Self, weight: Rgb) -> bool {
        let mut has_room = true;
        for it in other.active().iter().filter(|_| weight != Rgb::ZERO) {
            has_room = self.n_lobes < MAX_LOBES;
            if has_room {
                self.lobes[self.n_lobes] = WeightedLobe { lobe: it.lobe, weight: it.weight * weight };
                self.n_lobes += 1;
            }
        }
        self.add_transparency(other.transparency * weight);
        has_room
    }

    /// `(1 - t)` times `a` plus `t` times `b`; lobes beyond [`MAX_LOBES`] are dropped.
    pub fn mix(a: &Self, b: &Self, t: f32) -> Self {
        let mut mixed = Self::black();
        mixed.add_scaled(a, Rgb::splat(1.0 - t));
        mixed.add_scaled(b, Rgb::splat(t));
        mixed
    }

    fn active(&self) -> &[WeightedLobe] {
        &self.lobes[..self.n_lobes]
    }

    /// Chances of the lobes: proportional to weight times albedo.
    fn chances(&self, local: &LocalFrame, wo: Vec3A) -> [f32; MAX_LOBES] {
        let mut chances = [0.0; MAX_LOBES];
        if self.n_lobes == 1 {
            chances[0] = 1.0;
            return chances;
        }
        let mut total = 0.0;
        for (chance, it) in chances.iter_mut().zip(self.active()) {
            // A floor on the guess keeps the choice valid where it says 0 and the lobe does not.
            *chance = luminance(it.weight * (it.lobe.albedo(local, wo) + Rgb::splat(1e-3)));
            total += *chance;
        }
        chances.map(|c| if total > 0.0 { c / total } else { 0.0 })
    }

    /// Draws a direction. `u[2]` chooses the lobe. `None` if the light is absorbed.
    pub fn sample(&self, frame: &ShadingFrame, wo: Vec3A, u: [f32; 3]) -> Option<BsdfSample> {
        let local = frame.local(wo);
        let wo_local = local.frame.local_from_world(wo);
        let chances = self.chances(&local, wo_local);
        let (index, rest) = choose(&chances, u[2])?;
        let chosen = &self.lobes[index];
        let drawn = chosen.lobe.sample(&local, wo_local, [u[0], u[1], rest])?;
        let direction = local.frame.world_from_local(drawn.wi).normalize();
        let side = local.side(direction, drawn.wi)?;
        let (weight, pdf) = match drawn.delta_weight {
            Some(weight) => (chosen.weight * weight / chances[index], 1.0),
            None => {
                let value = self.evaluate_local(&local, &chances, wo_local, drawn.wi);
                if !(value.pdf > 0.0 && value.pdf.is_finite()) {
                    return None;
                }
                (value.total() / value.pdf, value.pdf)
            }
        };
        Some(BsdfSample {
            direction,
            weight,
            pdf,
            is_delta: drawn.delta_weight.is_some(),
            is_transmission: side == Side::Transmission,
            roughness: drawn.roughness,
            eta: drawn.eta,
        })
    }

    fn evaluate_local(
        &self,
        local: &LocalFrame,
        chances: &[f32; MAX_LOBES],
        wo: Vec3A,
        wi: Vec3A,
    ) -> BsdfValue {
        let mut sum = BsdfValue::default();
        for (it, chance) in self.active().iter().zip(chances) {
            let value = it.lobe.evaluate(local, wo, wi);
            sum.diffuse += it.weight * value.diffuse;
            sum.glossy += it.weight * value.glossy;
            sum.pdf += chance * value.pdf;
        }
        sum
    }

    /// BSDF times |cos theta_i|, diffuse and glossy lobes apart, and the density of [`Self::sample`]; without delta lobes.
    pub fn evaluate(&self, frame: &ShadingFrame, wo: Vec3A, wi: Vec3A) -> BsdfValue {
        let local = frame.local(wo);
        let wi_local = local.frame.local_from_world(wi);
        if local.side(wi, wi_local).is_none() {
            return BsdfValue::default();
        }
        let wo_local = local.frame.local_from_world(wo);
        let chances = self.chances(&local, wo_local);
        self.evaluate_local(&local, &chances, wo_local, wi_local)
    }

    /// BSDF times |cos theta_i|, without delta lobes.
    pub fn eval(&self, frame: &ShadingFrame, wo: Vec3A, wi: Vec3A) -> Rgb {
        self.evaluate(frame, wo, wi).total()
    }

    /// Density per steradian of [`Self::sample`], without delta lobes.
    pub fn pdf(&self, frame: &ShadingFrame, wo: Vec3A, wi: Vec3A) -> f32 {
        self.evaluate(frame, wo, wi).pdf
    }

    /// Whether no direction but the sampled ones scatters: light sampling is pointless.
    pub fn is_delta_only(&self) -> bool {
        self.active().iter().all(|it| it.lobe.is_delta_only())
    }

    /// How widely the widest lobe scatters.
    pub fn spread(&self) -> Spread {
        self.active().iter().map(|it| it.lobe.spread()).max().unwrap_or(Spread::Narrow)
    }

    /// Whether nothing scatters.
    pub fn is_black(&self) -> bool {
        self.n_lobes == 0
    }

    /// The fraction that passes straight through: not a scattering event, and what shadow rays see. The lobes are
    /// already reduced by it.
    #[inline]
    pub fn transparency(&self) -> Rgb {
        self.transparency
    }

    /// Scattered fraction towards `wo`, for the albedo AOV. The straight-through part is not in it.
    pub fn albedo(&self, frame: &ShadingFrame, wo: Vec3A) -> Rgb {
        let local = frame.local(wo);
        let wo_local = local.frame.local_from_world(wo);
        self.active().iter().map(|it| it.weight * it.lobe.albedo(&local, wo_local)).sum::<Rgb>().min(Rgb::ONE)
    }
}

/// The entry that `u` selects among `chances` (which add up to 1 or are all 0), and `u` made uniform again.
pub(super) fn choose<const N: usize>(chances: &[f32; N], u: f32) -> Option<(usize, f32)> {
    let mut left = u;
    let mut last = None;
    for (index, &chance) in chances.iter().enumerate().filter(|(_, c)| **c > 0.0) {
        last = Some((index, (left / chance).clamp(0.0, 1.0 - f32::EPSILON)));
        if left < chance {
            break;
        }
        left -= chance;
    }
    last
}
