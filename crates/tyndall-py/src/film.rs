//! The image of a session.

use crate::checkpoint::replace;
use crate::error::{FileError, RenderError, SettingsError, guarded};
use numpy::{IntoPyArray, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use tyndall_render::aov::cryptomatte::{self, Matte};
use tyndall_render::aov::{self, Precision, Source};
use tyndall_render::{GuideState, SavedFilm};

/// An image with its AOVs.
#[pyclass(frozen, module = "tyndall")]
pub(crate) struct Film {
    pub(crate) film: Arc<tyndall_render::Film>,
    /// What the guides of a checkpoint's render had learned.
    pub(crate) guide: Option<GuideState>,
    pixel_aspect: f32,
    #[pyo3(get)]
    was_interrupted: bool,
}

impl Film {
    pub(crate) fn new(film: Arc<tyndall_render::Film>, pixel_aspect: f32, was_interrupted: bool) -> Self {
        Self { film, guide: None, pixel_aspect, was_interrupted }
    }
}

#[pymethods]
impl Film {
    /// The film and the text in a file by `write_state` or a session's checkpoint.
    #[staticmethod]
    fn read_state(py: Python<'_>, path: PathBuf) -> PyResult<(Self, String)> {
        let read = guarded(py, || {
            let bytes = tyndall_io::read_bytes(&path).map_err(|e| e.to_string())?;
            tyndall_render::Film::read_state(&bytes).map_err(|e| format!("{}: {e}", path.display()))
        })?;
        let SavedFilm { film, description, guide } = read.map_err(FileError::new_err)?;
        Ok((Self { guide, ..Self::new(Arc::new(film), 1.0, false) }, description))
    }

    /// Writes all that is known of the samples, for `joined`.
    fn write_state(&self, py: Python<'_>, path: PathBuf, description: &str) -> PyResult<()> {
        guarded(py, || replace(&path, |file| self.film.write_state(description, file)))?
            .map_err(FileError::new_err)
    }

    /// This film with the samples of `following`, which begin where its own end.
    fn joined(&self, py: Python<'_>, following: &Self) -> PyResult<Self> {
        let joined = guarded(py, || {
            let mut film = Arc::clone(&self.film);
            Arc::make_mut(&mut film).append(&following.film).map(|()| film)
        })?;
        Ok(Self::new(joined.map_err(RenderError::new_err)?, self.pixel_aspect, false))
    }

    /// This film with pixels so many times as wide as high.
    fn with_pixel_aspect(&self, pixel_aspect: f32) -> Self {
        Self::new(Arc::clone(&self.film), pixel_aspect, self.was_interrupted)
    }

    /// Indices of the samples that every pixel has: the first, and the one after the last.
    #[getter]
    fn sample_range(&self) -> (u32, u32) {
        (self.film.first_sample(), self.film.next_sample())
    }

    /// Samples every pixel has at least.
    #[getter]
    fn samples(&self) -> u32 {
        self.film.min_samples()
    }

    /// Samples a pixel has on average.
    #[getter]
    fn mean_samples(&self) -> f64 {
        self.film.mean_samples()
    }

    /// Pixels across and down.
    #[getter]
    fn resolution(&self) -> (u32, u32) {
        (self.film.width(), self.film.height())
    }

    /// Names of the AOVs in it.
    #[getter]
    fn aov_names(&self) -> Vec<&'static str> {
        self.film.aovs().iter().map(|a| a.name).collect()
    }

    /// The AOV as an array of shape (height, width, channels), float32, row 0 on top.
    fn aov<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let image = guarded(py, || self.film.image(name))?.map_err(SettingsError::new_err)?;
        let channels = aov::find(name).map_err(SettingsError::new_err)?.channels.len();
        let shape = [self.film.height() as usize, self.film.width() as usize, channels];
        image.into_pyarray(py).reshape(shape)
    }

    /// What readers of the film's cryptomattes look for in a file's header, text by key, if their layers' names begin
    /// with `prefix`.
    #[pyo3(signature = (prefix = ""))]
    fn cryptomatte_metadata(&self, prefix: &str) -> BTreeMap<String, String> {
        let mattes = self.film.aovs().iter().filter_map(|aov| match aov.source {
            Source::Coverage(matte) => Some(self.metadata_of(matte, prefix)),
            _ => None,
        });
        mattes.flatten().collect()
    }

    /// Writes a multi-layer `.exr`, or a `.png` of `rgba` through the default view transform.
    #[pyo3(signature = (path, aovs = None, metadata = None))]
    fn write(
        &self,
        py: Python<'_>,
        path: PathBuf,
        aovs: Option<Vec<String>>,
        metadata: Option<BTreeMap<String, String>>,
    ) -> PyResult<()> {
        let metadata: Vec<_> = metadata
            .unwrap_or_default()
            .into_iter()
            .map(|(key, value)| (key, tyndall_io::MetaValue::Text(value)))
            .collect();
        let names = aovs.unwrap_or_else(|| self.aov_names().iter().map(ToString::to_string).collect());
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("exr") => guarded(py, || self.write_exr(&path, &names, &metadata))?,
            Some("png") => guarded(py, || self.write_png(&path, &metadata))?,
            _ => Err(format!(
                "{}: images are written as .exr or .png; change the file's ending",
                path.display()
            )),
        }
        .map_err(FileError::new_err)
    }
}

/// A cryptomatte's image as layers of two pairs each.
fn cryptomatte_layers(matte: Matte, image: &[f32]) -> Vec<tyndall_io::Layer> {
    let of_layer = |i: usize| {
        let pixels = image.chunks_exact(2 * cryptomatte::RANKS);
        let data = pixels.flat_map(|pixel| &pixel[4 * i..4 * i + 4]).copied().collect();
        tyndall_io::Layer::new(
            format!("{}{i:02}", matte.layer_name()),
            "RGBA",
            data,
            tyndall_io::SampleType::Float,
        )
    };
    (0..cryptomatte::RANKS / 2).map(of_layer).collect()
}

type Metadata = [(String, tyndall_io::MetaValue)];

impl Film {
    fn write_exr(&self, path: &std::path::Path, names: &[String], metadata: &Metadata) -> Result<(), String> {
        let mut layers = Vec::with_capacity(names.len());
        let mut metadata = metadata.to_vec();
        for name in names {
            let aov = aov::find(name)?;
            if let Source::Coverage(matte) = aov.source {
                layers.extend(cryptomatte_layers(matte, &self.film.image(name)?));
                let entries = self.metadata_of(matte, "").into_iter();
                metadata.extend(entries.map(|(key, value)| (key, tyndall_io::MetaValue::Text(value))));
                continue;
            }
            layers.push(tyndall_io::Layer {
                name: name.clone(),
                channels: aov.channels.iter().map(ToString::to_string).collect(),
                data: self.film.image(name)?,
                sample_type: match aov.precision {
                    Precision::Half => tyndall_io::SampleType::Half,
                    Precision::Float => tyndall_io::SampleType::Float,
                    Precision::Uint => tyndall_io::SampleType::Uint,
                },
            });
        }
        let (width, height) = (self.film.width() as usize, self.film.height() as usize);
        let compression = tyndall_io::ExrCompression::default();
        tyndall_io::write_exr(path, width, height, self.pixel_aspect, &layers, &metadata, compression)
            .map_err(|e| e.to_string())
    }

    /// What readers of a cryptomatte look for in the file's header.
    fn metadata_of(&self, matte: Matte, prefix: &str) -> Vec<(String, String)> {
        let name = format!("{prefix}{}", matte.layer_name());
        let keys = cryptomatte::metadata_prefix(&name);
        let entry = |key: &str, value: String| (format!("{keys}{key}"), value);
        vec![
            entry("name", name),
            entry("hash", "MurmurHash3_32".to_owned()),
            entry("conversion", "uint32_to_float32".to_owned()),
            entry("manifest", cryptomatte::manifest(self.film.matte_names(matte))),
        ]
    }

    fn write_png(&self, path: &std::path::Path, metadata: &Metadata) -> Result<(), String> {
        let (width, height) = (self.film.width() as usize, self.film.height() as usize);
        // A background that is part of the picture should show: opaque, as viewers display the EXR's colour.
        let mut rgba = self.film.image("rgba")?;
        rgba.chunks_exact_mut(4).for_each(|pixel| pixel[3] = 1.0);
        let view = tyndall_io::ViewTransform::default();
        tyndall_io::write_png(path, width, height, &rgba, view, metadata).map_err(|e| e.to_string())
    }
}
