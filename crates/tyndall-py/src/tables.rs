//! The tables front ends are made from: AOVs, settings, node kinds.

use crate::prims::from_json;
use pyo3::prelude::*;
use tyndall_render::aov;
use tyndall_scene::RenderSettings;

/// An AOV that can be asked for.
#[pyclass(frozen, get_all, module = "tyndall")]
pub(crate) struct AovInfo {
    name: &'static str,
    channels: Vec<&'static str>,
    doc: &'static str,
}

/// Every AOV.
#[pyfunction]
pub(crate) fn list_aovs() -> Vec<AovInfo> {
    aov::AOVS.iter().map(|a| AovInfo { name: a.name, channels: a.channels.to_vec(), doc: a.doc }).collect()
}

/// Every render setting: name, kind, min, max, choices, doc, default.
#[pyfunction]
pub(crate) fn setting_specs(py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
    let defaults: serde_json::Value =
        serde_json::from_str(&RenderSettings::default().to_json()).unwrap_or_default();
    let specs: Vec<_> = RenderSettings::SPECS
        .iter()
        .map(|spec| {
            let mut value = serde_json::to_value(spec).unwrap_or_default();
            value["default"] = defaults[spec.name].clone();
            value
        })
        .collect();
    from_json(py, &serde_json::Value::Array(specs))
}
