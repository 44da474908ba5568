//! The render delegate and what it hands out.

use crate::error::{SceneError, guarded};
use crate::prims;
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use tyndall_io::FileAssets;
use tyndall_render::WorldCache;
use tyndall_scene as scene;
use tyndall_scene::{DirtyBits, PrimPath, Severity};

/// A message about what could not be rendered as asked.
#[pyclass(frozen, get_all, module = "tyndall")]
#[derive(Clone)]
pub(crate) struct Diagnostic {
    severity: String,
    path: String,
    what: String,
    action: String,
}

impl From<&scene::Diagnostic> for Diagnostic {
    fn from(d: &scene::Diagnostic) -> Self {
        Self {
            severity: d.severity.name().to_owned(),
            path: d.path.clone(),
            what: d.what.clone(),
            action: d.action.clone(),
        }
    }
}

#[pymethods]
impl Diagnostic {
    fn __str__(&self) -> String {
        let severity = Severity::from_name(&self.severity).unwrap_or(Severity::Warning);
        scene::Diagnostic {
            severity,
            path: self.path.clone(),
            what: self.what.clone(),
            action: self.action.clone(),
        }
        .to_string()
    }

    fn __repr__(&self) -> String {
        format!("Diagnostic({})", self.__str__())
    }
}

/// An immutable shot, with what may be reused between commits: decoded files and built geometry.
#[pyclass(frozen, module = "tyndall")]
pub(crate) struct Scene {
    pub(crate) scene: Arc<scene::Scene>,
    pub(crate) assets: Arc<FileAssets>,
    pub(crate) cache: Arc<Mutex<WorldCache>>,
}

#[pymethods]
impl Scene {
    /// Paths of all prims, sorted.
    #[getter]
    fn paths(&self) -> Vec<String> {
        self.scene.prims().map(|(path, _)| path.as_str().to_owned()).collect()
    }
}

/// Receives prims by path; see `tyndall.RenderDelegate`.
#[pyclass(frozen, module = "tyndall._core")]
pub(crate) struct RenderDelegate {
    state: Mutex<scene::RenderDelegate>,
    assets: Arc<FileAssets>,
    cache: Arc<Mutex<WorldCache>>,
}

impl RenderDelegate {
    fn with<T>(&self, action: impl FnOnce(&mut scene::RenderDelegate) -> T) -> T {
        action(&mut self.state.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn sync(&self, path: &str, prim: PyResult<scene::prim::Prim>, bits: u32) -> PyResult<()> {
        let prim = prim.map_err(|e| SceneError::new_err(format!("prim <{path}>: {e}")))?;
        self.with(|delegate| delegate.sync(PrimPath::from(path), prim, DirtyBits::from_bits(bits)));
        Ok(())
    }
}

#[pymethods]
impl RenderDelegate {
    #[new]
    fn new() -> Self {
        Self { state: Mutex::default(), assets: Arc::default(), cache: Arc::default() }
    }

    fn sync_mesh(&self, path: &str, prim: &Bound<'_, PyAny>, bits: u32) -> PyResult<()> {
        self.sync(path, prims::mesh(prim), bits)
    }

    fn sync_shape(&self, path: &str, prim: &Bound<'_, PyAny>, bits: u32) -> PyResult<()> {
        self.sync(path, prims::shape(prim), bits)
    }

    fn sync_instancer(&self, path: &str, prim: &Bound<'_, PyAny>, bits: u32) -> PyResult<()> {
        self.sync(path, prims::instancer(prim), bits)
    }

    fn sync_volume(&self, path: &str, prim: &Bound<'_, PyAny>, bits: u32) -> PyResult<()> {
        self.sync(path, prims::volume(prim), bits)
    }

    fn sync_field(&self, path: &str, prim: &Bound<'_, PyAny>, bits: u32) -> PyResult<()> {
        self.sync(path, prims::field(prim), bits)
    }

    fn sync_light(&self, path: &str, prim: &Bound<'_, PyAny>, bits: u32) -> PyResult<()> {
        self.sync(path, prims::light(prim), bits)
    }

    fn sync_material(&self, path: &str, prim: &Bound<'_, PyAny>, bits: u32) -> PyResult<()> {
        self.sync(path, prims::material(prim), bits)
    }

    fn sync_camera(&self, path: &str, prim: &Bound<'_, PyAny>, bits: u32) -> PyResult<()> {
        self.sync(path, prims::camera(prim), bits)
    }

    fn remove(&self, path: &str) -> bool {
        self.with(|delegate| delegate.remove(&PrimPath::from(path)))
    }

    fn report(&self, severity: &str, path: &str, what: &str, action: &str) -> PyResult<()> {
        let severity = Severity::from_name(severity).ok_or_else(|| {
            SceneError::new_err(format!("severity {severity:?} is not info, warning or error"))
        })?;
        self.with(|delegate| {
            delegate.report(scene::Diagnostic {
                severity,
                path: path.to_owned(),
                what: what.to_owned(),
                action: action.to_owned(),
            });
        });
        Ok(())
    }

    /// Decodes a grid that a later commit will ask for. What cannot be read is told then.
    fn read_ahead(&self, py: Python<'_>, path: PathBuf, grid: &str, index: Option<usize>) -> PyResult<()> {
        guarded(py, || drop(self.assets.vdb_grid(&path, grid, index)))
    }

    fn commit(&self) -> Scene {
        Scene {
            scene: self.with(scene::RenderDelegate::commit),
            assets: Arc::clone(&self.assets),
            cache: Arc::clone(&self.cache),
        }
    }
}
