//! A read-only view of the learned field, in stage coordinates.

use crate::error::SettingsError;
use crate::prims::from_json;
use glam::{DVec3, Vec3A};
use numpy::{PyArray1, PyReadonlyArray2, ToPyArray};
use pyo3::prelude::*;
use serde_json::json;
use tyndall_guiding::EventClass;
use tyndall_guiding::directional::VmfMixture;
use tyndall_guiding::field::{self, Cell, Region};

/// A look-up that is not moved over the borders of regions.
const UNMOVED: f32 = 1.0 / 6.0;

/// What a render learned of the light, by place and direction.
#[pyclass(frozen, module = "tyndall")]
pub(crate) struct Field {
    field: field::Field,
    /// The stage's point at which the field has its origin.
    origin: DVec3,
}

impl Field {
    pub(crate) fn new(field: field::Field, origin: DVec3) -> Self {
        Self { field, origin }
    }
}

#[pymethods]
impl Field {
    /// Every region of vertices in media ("volume") or on surfaces ("surface"): `min`, `max` (infinite for the outermost),
    /// `pivot`, `samples`, `depth`, `fluence` and `lobes`.
    fn cells<'py>(&self, py: Python<'py>, vertices: &str) -> PyResult<Bound<'py, PyAny>> {
        let cells = self.field.cells(class_of(vertices)?);
        let cells = cells.iter().map(|cell| self.describe(cell)).collect();
        from_json(py, &serde_json::Value::Array(cells))
    }

    /// The lobes at `position`, moved to be seen from there; None where nothing was learned about such vertices.
    fn lobes<'py>(
        &self,
        py: Python<'py>,
        position: [f64; 3],
        vertices: &str,
    ) -> PyResult<Option<Bound<'py, PyAny>>> {
        let (local, region) = self.look_up(position, class_of(vertices)?);
        let lobes = region.map(|region| lobes_of(region.incident(local).mixture(), region));
        lobes.map(|lobes| from_json(py, &lobes)).transpose()
    }

    /// Radiance arriving at `position` from unit vectors, shape (n, 3); None where nothing was learned.
    fn radiance<'py>(
        &self,
        py: Python<'py>,
        position: [f64; 3],
        vertices: &str,
        directions: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Option<Bound<'py, PyArray1<f32>>>> {
        let directions = directions.as_array();
        if directions.ncols() != 3 {
            return Err(SettingsError::new_err("directions must have the shape (n, 3)"));
        }
        let (local, region) = self.look_up(position, class_of(vertices)?);
        Ok(region.map(|region| {
            let incident = region.incident(local);
            let at = |d: Vec3A| incident.radiance(d.normalize_or_zero());
            let rows = directions.rows().into_iter();
            let values: Vec<f32> = rows.map(|d| at(DVec3::new(d[0], d[1], d[2]).as_vec3a())).collect();
            values.to_pyarray(py)
        }))
    }
}

impl Field {
    /// A point of the stage in the field's coordinates, and its region.
    fn look_up(&self, position: [f64; 3], class: EventClass) -> (Vec3A, Option<&Region>) {
        let local = (DVec3::from(position) - self.origin).as_vec3a();
        (local, self.field.region(local, class, UNMOVED))
    }

    fn on_stage(&self, local: [f32; 3]) -> [f64; 3] {
        (DVec3::from(local.map(f64::from)) + self.origin).to_array()
    }

    fn describe(&self, cell: &Cell<'_>) -> serde_json::Value {
        let region = cell.region;
        let pivot = region.pivot();
        json!({
            "min": bounded(self.on_stage(cell.min)),
            "max": bounded(self.on_stage(cell.max)),
            "pivot": self.on_stage(pivot),
            "samples": region.n_samples(),
            "depth": region.depth(),
            "fluence": region.incident(pivot.into()).fluence(),
            "lobes": lobes_of(region.lobes(), region),
        })
    }
}

/// Coordinates of a box; what is infinite becomes None, which JSON's numbers cannot be.
fn bounded(corner: [f64; 3]) -> [Option<f64>; 3] {
    corner.map(|v| v.is_finite().then_some(v))
}

fn lobes_of(mixture: &VmfMixture, region: &Region) -> serde_json::Value {
    let lobes = mixture.lobes().zip(region.distances()).map(|((weight, lobe), distance)| {
        json!({
            "weight": weight,
            "mean": lobe.mean().to_array(),
            "kappa": lobe.kappa(),
            "distance": distance.is_finite().then_some(distance),
        })
    });
    serde_json::Value::Array(lobes.collect())
}

fn class_of(vertices: &str) -> PyResult<EventClass> {
    match vertices {
        "volume" => Ok(EventClass::Volume),
        "surface" => Ok(EventClass::Surface),
        other => Err(SettingsError::new_err(format!(
            "there are no vertices {other:?}; they are on a \"surface\" or in a \"volume\""
        ))),
    }
}
