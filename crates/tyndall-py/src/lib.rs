//! The Python module `tyndall._core`: arrays in, arrays out, errors, progress, cancellation.
//!
//! Translation only. Arrays cross as numpy buffers (`tyndall.prims` has made them contiguous and of the right type),
//! the GIL is released while the core works, and Rust panics arrive as `tyndall.RenderError`.

mod cache;
mod checkpoint;
mod delegate;
mod error;
mod field;
mod film;
mod prims;
mod session;
mod tables;
mod vdb;

/// The compiled half of the package `tyndall`.
#[pyo3::pymodule(gil_used = false)]
mod _core {
    #[pymodule_export]
    use crate::cache::{merge_caches, prune_cache, read_cache_info};
    #[pymodule_export]
    use crate::delegate::{Diagnostic, RenderDelegate, Scene};
    #[pymodule_export]
    use crate::error::{Error, FileError, RenderError, SceneError, SettingsError};
    #[pymodule_export]
    use crate::field::Field;
    #[pymodule_export]
    use crate::film::Film;
    #[pymodule_export]
    use crate::session::{Progress, Session};
    #[pymodule_export]
    use crate::tables::{AovInfo, list_aovs, setting_specs};
    #[pymodule_export]
    use crate::vdb::{read_vdb_info, write_vdb};

    #[pymodule_init]
    fn init(module: &pyo3::Bound<'_, pyo3::types::PyModule>) -> pyo3::PyResult<()> {
        use pyo3::types::PyModuleMethods;
        module.add("sample_grid", tyndall_render::SAMPLE_GRID)?;
        module.add("version", env!("CARGO_PKG_VERSION"))
    }
}
