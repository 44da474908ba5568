//! What a render can write: one file per AOV, one line here.
//!
//! An AOV is either a mean over samples of something the path recorded ([`Source::Sample`]) or a statistic of the pixel
//! ([`Source::Pixel`]).

mod albedo;
pub mod cryptomatte;
mod depth;
mod direct;
mod emission;
mod guide;
mod indirect;
mod normal;
mod position;
mod rgba;
mod samples;
mod surface;
mod transmittance;
mod variance;
mod volume;
mod volume_depth;
mod vsp;
mod vsp_target;

use cryptomatte::Matte;
use tyndall_math::Rgb;

/// Everything a path tells about itself, for AOVs. Radiances include the camera's exposure.
#[derive(Debug, Clone, Copy)]
pub struct SampleRecord {
    /// Radiance along the camera ray.
    pub radiance: Rgb,
    /// The part whose first scattering event (or emission) lies in a medium.
    pub volume_radiance: Rgb,
    /// The part that has not scattered: of what is seen directly.
    pub unscattered: Rgb,
    /// The part that scattered once.
    pub direct: Rgb,
    /// 1 if anything was met before the background, else the part that was absorbed.
    pub alpha: f32,
    /// Reflectance of the first surface, or single-scattering albedo of the first volume event.
    pub albedo: Rgb,
    /// Shading normal of the first surface in world space; zero if there is none.
    pub normal: glam::Vec3A,
    /// Where the first scattering was, on the stage; infinite if there was none.
    pub position: glam::Vec3A,
    /// Depth of the first surface along the viewing axis, stage units; infinite if there is none.
    pub depth: f32,
    /// Estimate of the media's transmittance up to the first surface.
    pub transmittance: Rgb,
    /// Probability with which the camera's segment was to end in a scattering; 0 where it was tracked.
    pub scatter_probability: f32,
    /// 1 if the camera's segment ended in a scattering.
    pub scatters: f32,
    /// Depth of the first scattering in a medium along the viewing axis, stage units; infinite if there is none.
    pub volume_depth: f32,
    /// Ids of the object and the material of the first surface.
    pub mattes: [u32; 2],
    /// How much these count; 0 if the first scattering was in a medium, or none.
    pub coverage: f32,
    /// 1, training samples and lobes of the first vertex whose direction was guided; zeros if there was none.
    pub guide: [f32; 3],
}

impl Default for SampleRecord {
    fn default() -> Self {
        Self {
            radiance: Rgb::ZERO,
            volume_radiance: Rgb::ZERO,
            unscattered: Rgb::ZERO,
            direct: Rgb::ZERO,
            alpha: 0.0,
            albedo: Rgb::ZERO,
            normal: Rgb::ZERO,
            position: glam::Vec3A::INFINITY,
            depth: f32::INFINITY,
            transmittance: Rgb::ZERO,
            scatter_probability: 0.0,
            scatters: 0.0,
            volume_depth: f32::INFINITY,
            mattes: [0; 2],
            coverage: 0.0,
            guide: [0.0; 3],
        }
    }
}

/// Statistics of a pixel's radiance.
#[derive(Debug, Clone, Copy, Default)]
pub struct PixelStatistics {
    /// Samples taken.
    pub count: u32,
    /// Sum of radiance.
    pub sum: [f64; 3],
    /// Sum of squared radiance.
    pub sum_of_squares: [f64; 3],
}

impl PixelStatistics {
    /// Adds those of further samples.
    pub(crate) fn merge(&mut self, other: &Self) {
        self.count += other.count;
        for c in 0..3 {
            self.sum[c] += other.sum[c];
            self.sum_of_squares[c] += other.sum_of_squares[c];
        }
    }
}

/// How the mean over samples is formed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mean {
    /// Over all samples.
    All,
    /// Over samples with a finite first value only; pixels without any get [`NO_HIT_DEPTH`].
    Finite,
    /// The same, but pixels without any get 0.
    FiniteOrZero,
}

impl Mean {
    /// Whether samples that are not finite don't count.
    pub(crate) fn is_of_finite(self) -> bool {
        self != Self::All
    }
}

/// Depth written where no sample hit a surface: finite, and far beyond any scene (Blender's convention).
pub const NO_HIT_DEPTH: f32 = 1e10;

/// Where an AOV's numbers come from.
#[derive(Clone, Copy)]
pub enum Source {
    /// A mean over samples; unused channels are ignored.
    Sample(fn(&SampleRecord) -> [f32; 4], Mean),
    /// The ids that samples show, and how much of the pixel each covers.
    Coverage(Matte),
    /// A function of the pixel's statistics.
    Pixel(fn(&PixelStatistics) -> [f32; 4]),
}

/// How precisely an AOV is stored in files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// 16 bits suffice.
    Half,
    /// 32 bits.
    Float,
    /// A whole number.
    Uint,
}

/// An AOV.
#[derive(Clone, Copy)]
pub struct Aov {
    /// Name on the command line, in files and in Python.
    pub name: &'static str,
    /// Channel names in files.
    pub channels: &'static [&'static str],
    /// One sentence with unit and meaning.
    pub doc: &'static str,
    /// Storage.
    pub precision: Precision,
    /// Where its numbers come from.
    pub source: Source,
}

/// Every AOV. Adding one is a file and a line.
pub const AOVS: &[Aov] = &[
    rgba::AOV,
    albedo::AOV,
    normal::AOV,
    depth::AOV,
    volume::AOV,
    surface::AOV,
    transmittance::AOV,
    samples::AOV,
    variance::AOV,
    vsp::AOV,
    vsp_target::AOV,
    guide::AOV,
    volume_depth::AOV,
    position::AOV,
    emission::AOV,
    direct::AOV,
    indirect::AOV,
    cryptomatte::OBJECT,
    cryptomatte::MATERIAL,
];

/// The AOV called `name`.
///
/// # Errors
/// There is none; the text lists those there are.
pub fn find(name: &str) -> Result<&'static Aov, String> {
    AOVS.iter().find(|aov| aov.name == name).ok_or_else(|| {
        let known: Vec<_> = AOVS.iter().map(|a| a.name).collect();
        format!("unknown AOV {name:?}; known: {}", known.join(", "))
    })
}

pub(crate) fn rgb(c: Rgb) -> [f32; 4] {
    [c.x, c.y, c.z, 0.0]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_channels_fit() {
        for (i, aov) in AOVS.iter().enumerate() {
            let most = if matches!(aov.source, Source::Coverage(_)) { 2 * cryptomatte::RANKS } else { 4 };
            assert!((1..=most).contains(&aov.channels.len()), "{}", aov.name);
            assert!(AOVS[..i].iter().all(|other| other.name != aov.name));
            assert!(aov.doc.ends_with('.'));
        }
    }

    #[test]
    fn parts_add_up_to_the_beauty() {
        let record = SampleRecord {
            radiance: Rgb::new(3.0, 2.0, 1.0),
            volume_radiance: Rgb::new(1.0, 0.5, 1.0),
            unscattered: Rgb::new(0.5, 0.0, 0.25),
            direct: Rgb::new(1.5, 1.0, 0.25),
            ..Default::default()
        };
        let value = |aov: &Aov| match aov.source {
            Source::Sample(f, _) => f(&record),
            _ => panic!("a sample AOV"),
        };
        for c in 0..3 {
            assert_eq!(value(&volume::AOV)[c] + value(&surface::AOV)[c], value(&rgba::AOV)[c]);
            let by_order = [&emission::AOV, &direct::AOV, &indirect::AOV].map(|aov| value(aov)[c]);
            assert_eq!(by_order.iter().sum::<f32>(), value(&rgba::AOV)[c]);
        }
    }

    #[test]
    fn variance_is_that_of_the_mean() {
        let pixel = PixelStatistics { count: 4, sum: [8.0, 4.0, 0.0], sum_of_squares: [24.0, 4.0, 0.0] };
        let Source::Pixel(f) = variance::AOV.source else { panic!("a pixel AOV") };
        // Samples such as 0, 2, 2, 4: sample variance 8/3, of the mean 2/3.
        assert!((f(&pixel)[0] - 2.0 / 3.0).abs() < 1e-6);
        assert_eq!(f(&pixel)[1], 0.0);
        assert_eq!(f(&PixelStatistics { count: 1, ..pixel })[0], 0.0);
    }
}
