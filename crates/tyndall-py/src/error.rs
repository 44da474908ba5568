//! Exceptions, and the border that no panic crosses.

use pyo3::create_exception;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::panic::{AssertUnwindSafe, catch_unwind};

create_exception!(tyndall, Error, PyRuntimeError, "Anything Tyndall refuses or fails at.");
create_exception!(tyndall, SceneError, Error, "The scene cannot be rendered as it is.");
create_exception!(tyndall, SettingsError, Error, "A setting is unknown, of the wrong type or out of range.");
create_exception!(tyndall, FileError, Error, "A file cannot be read or written.");
create_exception!(tyndall, RenderError, Error, "Rendering failed.");

/// Runs `work` without the GIL; a panic inside becomes [`RenderError`] (pyo3's own `PanicException` would slip
/// through `except Exception`).
pub(crate) fn guarded<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    py.detach(|| catch_unwind(AssertUnwindSafe(work))).map_err(|panic| {
        let text = panic
            .downcast_ref::<String>()
            .map(String::as_str)
            .or_else(|| panic.downcast_ref::<&str>().copied())
            .unwrap_or("unknown");
        RenderError::new_err(format!("internal error: {text}; this is a bug in Tyndall, please report it"))
    })
}
