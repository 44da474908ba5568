//! Render settings: one list of names for Rust, Python, USD attributes and the command line.

use crate::PrimPath;
use serde::{Deserialize, Serialize};

/// Pixel reconstruction filter, applied by importance sampling: every sample belongs to one pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "kebab-case")]
pub enum PixelFilter {
    /// Blackman-Harris, four pixels wide in all.
    #[default]
    BlackmanHarris,
    /// The pixel's own square; for measurements.
    Box,
}

/// How the distance to the next scattering is sampled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "kebab-case")]
pub enum DistanceSampling {
    /// What pays, which renders of 128 samples a pixel and more find out by trying unless [`Guiding::Off`]; else by
    /// transmittance.
    #[default]
    Auto,
    /// Volume scattering probability guiding by learned odds.
    Odds,
    /// Volume scattering probability guiding by a learned probability, as published.
    Target,
    /// Normalised free flights, for comparison.
    Nds,
    /// Normalised free flights that take more candidates as collisions, for comparison.
    #[serde(rename = "nds+")]
    NdsPlus,
    /// By transmittance alone.
    Delta,
}

/// Where on the camera's segment light is sampled in media, if distances are resampled ([`DistanceSampling::Odds`] and
/// [`DistanceSampling::Target`]); the others have no candidates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "kebab-case")]
pub enum LightSampling {
    /// At the event, if the path scatters.
    #[default]
    Event,
    /// At the candidate, whether or not the path scatters there: decoupled.
    Candidate,
}

/// Whether directions are guided.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "kebab-case")]
pub enum Guiding {
    /// Where it pays, which renders of 128 samples a pixel and more find out by trying.
    #[default]
    Auto,
    /// Always.
    On,
    /// Never.
    Off,
}

/// What a guiding cache is used for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "kebab-case")]
pub enum CacheMode {
    /// It is read before a render and written after it.
    #[default]
    Auto,
    /// It is read only.
    Read,
    /// It is written only: learned from nothing.
    Train,
    /// It is left alone.
    Off,
}

/// What a render is asked for. Field names in camelCase are the names everywhere else ([`RenderSettings::SPECS`]).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields, default)]
pub struct RenderSettings {
    /// Path of the camera prim; `None` takes the only camera of the scene.
    pub camera: Option<String>,
    /// Pixels across and down.
    pub resolution: [u32; 2],
    /// Width of a pixel divided by its height.
    pub pixel_aspect: f32,
    /// Samples per pixel.
    pub samples: u32,
    /// Standard error of a pixel, over the root of its brightness (white is 1), at which it gets no more samples; 0 gives
    /// all pixels all samples.
    pub noise_threshold: f32,
    /// Seconds of rendering after which no new pass begins; 0 is no limit.
    pub time_limit: f32,
    /// How often light may scatter: reflections, refractions and volume events each count one; index-matched
    /// boundaries and null collisions none.
    pub max_bounces: u32,
    /// Random seed.
    pub seed: u64,
    /// Worker threads; 0 is all cores.
    pub threads: u32,
    /// Pixel filter.
    pub filter: PixelFilter,
    /// How the distance to the next scattering is sampled.
    pub distance_sampling: DistanceSampling,
    /// Where on the camera's segment light is sampled in media.
    pub light_sampling: LightSampling,
    /// Whether directions are guided.
    pub guiding: Guiding,
    /// The guiding cache's file; empty for none.
    pub cache_path: String,
    /// What the cache is used for.
    pub cache_mode: CacheMode,
    /// Most voxels along an axis of a procedural medium; those with little detail get fewer.
    pub procedural_resolution: u32,
    /// AOVs to write, by name.
    pub aovs: Vec<String>,
}

impl Default for RenderSettings {
    fn default() -> Self {
        Self {
            camera: None,
            resolution: [1280, 720],
            pixel_aspect: 1.0,
            samples: 1024,
            noise_threshold: 0.0,
            time_limit: 0.0,
            max_bounces: 64,
            seed: 0,
            threads: 0,
            filter: PixelFilter::default(),
            distance_sampling: DistanceSampling::default(),
            light_sampling: LightSampling::default(),
            guiding: Guiding::default(),
            cache_path: String::new(),
            cache_mode: CacheMode::default(),
            procedural_resolution: 256,
            aovs: vec!["rgba".to_owned()],
        }
    }
}

/// One setting as help texts, schemas and panels show it.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct SettingSpec {
    /// Name in camelCase.
    pub name: &'static str,
    /// `int`, `float`, `string`, `token`, `int2` or `token[]`.
    pub kind: &'static str,
    /// Smallest value, for numbers.
    pub min: f64,
    /// Largest value, for numbers.
    pub max: f64,
    /// For tokens, what is allowed.
    pub choices: &'static [&'static str],
    /// One sentence.
    pub doc: &'static str,
}

/// Why settings are refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SettingsError {
    /// Not a setting, or not of its type.
    #[error("render settings: {0}; known: {known}", known = RenderSettings::known_names())]
    Malformed(String),
    /// A number out of its range.
    #[error("render setting {name} is {value}; it must lie in [{min}, {max}]")]
    OutOfRange {
        /// Setting.
        name: &'static str,
        /// Its value.
        value: f64,
        /// Smallest allowed.
        min: f64,
        /// Largest allowed.
        max: f64,
    },
}

const fn number(
    name: &'static str,
    kind: &'static str,
    min: f64,
    max: f64,
    doc: &'static str,
) -> SettingSpec {
    SettingSpec { name, kind, min, max, choices: &[], doc }
}

const fn text(
    name: &'static str,
    kind: &'static str,
    choices: &'static [&'static str],
    doc: &'static str,
) -> SettingSpec {
    SettingSpec { name, kind, min: 0.0, max: 0.0, choices, doc }
}

impl RenderSettings {
    /// Every setting.
    pub const SPECS: &'static [SettingSpec] = &[
        text("camera", "string", &[], "Path of the camera prim."),
        number("resolution", "int2", 1.0, 65_536.0, "Pixels across and down."),
        number("pixelAspect", "float", 1e-3, 1e3, "Width of a pixel divided by its height."),
        number("samples", "int", 1.0, 4_294_967_295.0, "Samples per pixel."),
        number(
            "noiseThreshold",
            "float",
            0.0,
            1e3,
            "Standard error over the root of the brightness at which a pixel gets no more samples; 0: never.",
        ),
        number("timeLimit", "float", 0.0, 1e9, "Seconds after which no new pass begins; 0 is no limit."),
        number("maxBounces", "int", 0.0, 1e6, "How often light may scatter, in media and at surfaces."),
        number(
            "seed",
            "int",
            0.0,
            9_007_199_254_740_991.0,
            "Random seed; the same seed gives the same image.",
        ),
        number("threads", "int", 0.0, 1024.0, "Worker threads; 0 is all cores."),
        text("filter", "token", &["blackman-harris", "box"], "Pixel filter."),
        text(
            "distanceSampling",
            "token",
            &["auto", "odds", "target", "nds", "nds+", "delta"],
            "How camera rays choose where to scatter; auto is delta in this version.",
        ),
        text(
            "lightSampling",
            "token",
            &["event", "candidate"],
            "Where camera rays sample light in media with odds or target: candidate does so where they pass too.",
        ),
        text(
            "guiding",
            "token",
            &["auto", "on", "off"],
            "Whether directions are guided; auto is off in this version.",
        ),
        text(
            "cachePath",
            "string",
            &[],
            "File of the guiding cache, which keeps what is learned for the next render; empty for none.",
        ),
        text(
            "cacheMode",
            "token",
            &["auto", "read", "train", "off"],
            "What the cache is used for: auto reads and writes, read only reads, train only writes.",
        ),
        number(
            "proceduralResolution",
            "int",
            8.0,
            2048.0,
            "Most voxels along an axis of a procedural medium; those with little detail get fewer.",
        ),
        text("aovs", "token[]", &[], "AOVs to write, by name."),
    ];

    /// From a JSON object of settings; absent ones have their defaults.
    ///
    /// # Errors
    /// A name that is no setting, a value of the wrong type or out of range.
    pub fn from_json(json: &str) -> Result<Self, SettingsError> {
        let settings: Self =
            serde_json::from_str(json).map_err(|e| SettingsError::Malformed(e.to_string()))?;
        settings.validate()?;
        Ok(settings)
    }

    /// As a JSON object, every setting present.
    pub fn to_json(&self) -> String {
        serde_json::to_string(self).unwrap_or_default()
    }

    /// The camera as a prim path.
    pub fn camera_path(&self) -> Option<PrimPath> {
        self.camera.as_deref().map(PrimPath::from)
    }

    fn validate(&self) -> Result<(), SettingsError> {
        let values = [
            ("resolution", f64::from(self.resolution[0])),
            ("resolution", f64::from(self.resolution[1])),
            ("pixelAspect", f64::from(self.pixel_aspect)),
            ("samples", f64::from(self.samples)),
            ("noiseThreshold", f64::from(self.noise_threshold)),
            ("timeLimit", f64::from(self.time_limit)),
            ("maxBounces", f64::from(self.max_bounces)),
            ("threads", f64::from(self.threads)),
            ("proceduralResolution", f64::from(self.procedural_resolution)),
        ];
        for (name, value) in values {
            if let Some(spec) = Self::SPECS.iter().find(|s| s.name == name)
                && !(spec.min..=spec.max).contains(&value)
            {
                return Err(SettingsError::OutOfRange { name, value, min: spec.min, max: spec.max });
            }
        }
        Ok(())
    }

    fn known_names() -> String {
        Self::SPECS.iter().map(|s| s.name).collect::<Vec<_>>().join(", ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_lists_exactly_the_fields() {
        let json: serde_json::Value = serde_json::from_str(&RenderSettings::default().to_json()).unwrap();
        let mut fields: Vec<_> = json.as_object().unwrap().keys().map(String::as_str).collect();
        let mut specs: Vec<_> = RenderSettings::SPECS.iter().map(|s| s.name).collect();
        fields.sort_unstable();
        specs.sort_unstable();
        assert_eq!(fields, specs);
    }

    #[test]
    fn bad_settings_are_refused_by_name() {
        let unknown = RenderSettings::from_json(r#"{"maxBounce": 3}"#).unwrap_err().to_string();
        assert!(unknown.contains("maxBounce") && unknown.contains("maxBounces"), "{unknown}");
        let zero = RenderSettings::from_json(r#"{"resolution": [0, 4]}"#).unwrap_err().to_string();
        assert!(zero.contains("resolution") && zero.contains('0'), "{zero}");
        assert!(RenderSettings::from_json(r#"{"timeLimit": -1}"#).is_err());
    }

    #[test]
    fn json_round_trips() {
        let settings = RenderSettings { seed: 7, filter: PixelFilter::Box, ..RenderSettings::default() };
        assert_eq!(RenderSettings::from_json(&settings.to_json()), Ok(settings));
    }
}
