//! Python's prim dataclasses into the scene's structs. The dataclasses have validated shapes and types.

use crate::error::SceneError;
use glam::{DAffine3, DMat4, DVec2, Vec3};
use numpy::PyReadonlyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::{PyAny, PyDict, PyList};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use tyndall_scene::PrimPath;
use tyndall_scene::prim::*;

type Object<'a, 'py> = &'a Bound<'py, PyAny>;

/// An attribute of a dataclass.
fn get<'py, T>(object: Object<'_, 'py>, name: &str) -> PyResult<T>
where
    T: for<'a> FromPyObject<'a, 'py>,
    for<'a> <T as FromPyObject<'a, 'py>>::Error: Into<PyErr>,
{
    let value = object.getattr(name)?;
    value.extract::<T>().map_err(|e| {
        let e: PyErr = e.into();
        SceneError::new_err(format!("{name}: {e}"))
    })
}

fn array<T: numpy::Element + Copy>(object: Object, name: &str) -> PyResult<Vec<T>> {
    to_vec(&object.getattr(name)?, name)
}

fn to_vec<T: numpy::Element + Copy>(value: Object, name: &str) -> PyResult<Vec<T>> {
    let array: PyReadonlyArrayDyn<T> = value.extract().map_err(|_| {
        SceneError::new_err(format!("{name} must be a contiguous numpy array of its documented type"))
    })?;
    Ok(array.as_slice().map_err(|_| SceneError::new_err(format!("{name} must be contiguous")))?.to_vec())
}

fn path(object: Object, name: &str) -> PyResult<Option<PrimPath>> {
    Ok(get::<Option<String>>(object, name)?.map(PrimPath::from))
}

fn affine(numbers: &[f64]) -> DAffine3 {
    // numpy's rows are columns to glam.
    let rows: [f64; 16] = std::array::from_fn(|i| numbers.get(i).copied().unwrap_or(f64::NAN));
    DAffine3::from_mat4(DMat4::from_cols_array(&rows).transpose())
}

fn transform(object: Object, name: &str) -> PyResult<DAffine3> {
    Ok(affine(&array::<f64>(object, name)?))
}

fn unknown(what: &str, value: &str, known: &str) -> PyErr {
    SceneError::new_err(format!("{what} is {value:?}; it must be one of {known}"))
}

fn primvar(object: Object) -> PyResult<Primvar> {
    let name: String = get(object, "interpolation")?;
    let interpolation = Interpolation::from_name(&name)
        .ok_or_else(|| unknown("interpolation", &name, "constant, uniform, varying, vertex, faceVarying"))?;
    Ok(Primvar { interpolation, components: get(object, "components")?, values: array(object, "values")? })
}

fn primvars(object: Object) -> PyResult<BTreeMap<String, Primvar>> {
    let mut all = BTreeMap::new();
    for item in object.getattr("primvars")?.call_method0("items")?.try_iter()? {
        let (name, value): (String, Bound<PyAny>) = item?.extract()?;
        all.insert(name, primvar(&value)?);
    }
    Ok(all)
}

fn optional<T>(object: Object, name: &str, convert: impl Fn(Object) -> PyResult<T>) -> PyResult<Option<T>> {
    let value = object.getattr(name)?;
    if value.is_none() { Ok(None) } else { convert(&value).map(Some) }
}

fn subdivision(object: Object) -> PyResult<Subdivision> {
    let scheme: String = get(object, "scheme")?;
    Ok(Subdivision {
        scheme: match scheme.as_str() {
            "none" => SubdivisionScheme::None,
            "catmullClark" => SubdivisionScheme::CatmullClark,
            "loop" => SubdivisionScheme::Loop,
            "bilinear" => SubdivisionScheme::Bilinear,
            other => return Err(unknown("subdivision scheme", other, "none, catmullClark, loop, bilinear")),
        },
        crease_indices: array(object, "crease_indices")?,
        crease_lengths: array(object, "crease_lengths")?,
        crease_sharpnesses: array(object, "crease_sharpnesses")?,
        corner_indices: array(object, "corner_indices")?,
        corner_sharpnesses: array(object, "corner_sharpnesses")?,
    })
}

pub(crate) fn mesh(object: Object) -> PyResult<Prim> {
    let points: Vec<f32> = array(object, "points")?;
    let mut subsets = Vec::new();
    for subset in object.getattr("subsets")?.try_iter()? {
        let subset = subset?;
        subsets.push(Subset { faces: array(&subset, "faces")?, material: path(&subset, "material")? });
    }
    Ok(Prim::Mesh(Arc::new(Mesh {
        world_from_object: transform(object, "world_from_object")?,
        motion: keys(object, transform_key)?,
        points: points.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect(),
        face_vertex_counts: array(object, "face_vertex_counts")?,
        face_vertex_indices: array(object, "face_vertex_indices")?,
        hole_indices: array(object, "hole_indices")?,
        left_handed: get(object, "left_handed")?,
        double_sided: get(object, "double_sided")?,
        subdivision: subdivision(&object.getattr("subdivision")?)?,
        normals: optional(object, "normals", primvar)?,
        primvars: primvars(object)?,
        material: path(object, "material")?,
        subsets,
        instancer: path(object, "instancer")?,
        visible: get(object, "visible")?,
    })))
}

/// A required entry of a `params` mapping.
fn param<'py, T>(params: Object<'_, 'py>, name: &str) -> PyResult<T>
where
    T: for<'a> FromPyObject<'a, 'py>,
    for<'a> <T as FromPyObject<'a, 'py>>::Error: Into<PyErr>,
{
    let value = params.get_item(name).map_err(|_| SceneError::new_err(format!("params lack {name:?}")))?;
    value.extract::<T>().map_err(|e| {
        let e: PyErr = e.into();
        SceneError::new_err(format!("params[{name:?}]: {e}"))
    })
}

fn flag(params: Object, name: &str) -> PyResult<bool> {
    if params.contains(name)? { param(params, name) } else { Ok(false) }
}

fn file(params: Object, name: &str) -> PyResult<Option<PathBuf>> {
    if params.contains(name)? { param::<Option<PathBuf>>(params, name) } else { Ok(None) }
}

pub(crate) fn shape(object: Object) -> PyResult<Prim> {
    let kind: String = get(object, "kind")?;
    let params = object.getattr("params")?;
    let number = |name: &str| param::<f64>(&params, name);
    let kind = match kind.as_str() {
        "sphere" => ShapeKind::Sphere { radius: number("radius")? },
        "cube" => ShapeKind::Cube { size: number("size")? },
        "cylinder" => ShapeKind::Cylinder {
            radius_top: number("radius_top")?,
            radius_bottom: number("radius_bottom")?,
            height: number("height")?,
        },
        "cone" => ShapeKind::Cone { radius: number("radius")?, height: number("height")? },
        "capsule" => ShapeKind::Capsule {
            radius_top: number("radius_top")?,
            radius_bottom: number("radius_bottom")?,
            height: number("height")?,
        },
        "plane" => ShapeKind::Plane { width: number("width")?, length: number("length")? },
        other => return Err(unknown("shape kind", other, "sphere, cube, cylinder, cone, capsule, plane")),
    };
    Ok(Prim::Shape(Arc::new(Shape {
        world_from_object: transform(object, "world_from_object")?,
        motion: keys(object, transform_key)?,
        kind,
        primvars: primvars(object)?,
        material: path(object, "material")?,
        instancer: path(object, "instancer")?,
        visible: get(object, "visible")?,
    })))
}

pub(crate) fn instancer(object: Object) -> PyResult<Prim> {
    Ok(Prim::Instancer(Arc::new(Instancer {
        transforms: transforms(object)?,
        motion: keys(object, |key| {
            Ok(InstancerKey { time: get(key, "time")?, transforms: transforms(key)? })
        })?,
        parent: path(object, "parent")?,
        visible: get(object, "visible")?,
    })))
}

pub(crate) fn volume(object: Object) -> PyResult<Prim> {
    let fields: Vec<(String, String)> = get(object, "fields")?;
    Ok(Prim::Volume(Arc::new(Volume {
        fields: fields.into_iter().map(|(name, path)| (name, PrimPath::from(path))).collect(),
        material: path(object, "material")?,
        world_from_object: transform(object, "world_from_object")?,
        instancer: path(object, "instancer")?,
        visible: get(object, "visible")?,
    })))
}

pub(crate) fn field(object: Object) -> PyResult<Prim> {
    let source = match get::<Option<PathBuf>>(object, "path")? {
        Some(path) => FieldSource::File { path, name: get(object, "grid")?, index: get(object, "index")? },
        None => {
            let values = object.getattr("values")?;
            let dims: (usize, usize, usize) = values.getattr("shape")?.extract()?;
            FieldSource::Dense {
                dims: [dims.0, dims.1, dims.2],
                values: Arc::new(to_vec(&values, "values")?),
                origin: Vec3::from(get::<[f32; 3]>(object, "origin")?),
                voxel_size: get(object, "voxel_size")?,
            }
        }
    };
    Ok(Prim::Field(Arc::new(Field { world_from_field: transform(object, "world_from_field")?, source })))
}

fn cone_profile(name: &str) -> PyResult<ConeProfile> {
    match name {
        "angle" => Ok(ConeProfile::Angle),
        "cosine" => Ok(ConeProfile::Cosine),
        "honeycomb" => Ok(ConeProfile::Honeycomb),
        other => Err(unknown("cone profile", other, "angle, cosine, honeycomb")),
    }
}

pub(crate) fn light(object: Object) -> PyResult<Prim> {
    let kind: String = get(object, "kind")?;
    let params = object.getattr("params")?;
    let number = |name: &str| param::<f64>(&params, name);
    let kind = match kind.as_str() {
        "sphere" => LightKind::Sphere { radius: number("radius")?, as_point: flag(&params, "as_point")? },
        "rect" => LightKind::Rect {
            width: number("width")?,
            height: number("height")?,
            texture: file(&params, "texture")?,
        },
        "disk" => LightKind::Disk { radius: number("radius")? },
        "cylinder" => LightKind::Cylinder {
            length: number("length")?,
            radius: number("radius")?,
            as_line: flag(&params, "as_line")?,
        },
        "distant" => LightKind::Distant { angle: number("angle")? },
        "dome" => LightKind::Dome { texture: file(&params, "texture")?.map(|path| DomeTexture { path }) },
        other => return Err(unknown("light kind", other, "sphere, rect, disk, cylinder, distant, dome")),
    };
    let shaping = object.getattr("shaping")?;
    Ok(Prim::Light(Arc::new(Light {
        world_from_light: transform(object, "world_from_light")?,
        kind,
        intensity: get(object, "intensity")?,
        exposure: get(object, "exposure")?,
        color: get(object, "color")?,
        normalize: get(object, "normalize")?,
        diffuse: get(object, "diffuse")?,
        specular: get(object, "specular")?,
        shaping: Shaping {
            focus: get(&shaping, "focus")?,
            focus_tint: get(&shaping, "focus_tint")?,
            cone_angle: get(&shaping, "cone_angle")?,
            cone_softness: get(&shaping, "cone_softness")?,
            cone_profile: cone_profile(&get::<String>(&shaping, "cone_profile")?)?,
        },
        visible: get(object, "visible")?,
        camera_visible: get(object, "camera_visible")?,
        opaque: get(object, "opaque")?,
    })))
}

fn node_input(value: Object) -> PyResult<NodeInput> {
    if let Ok(number) = value.extract::<f32>() {
        return Ok(NodeInput::Float(number));
    }
    if let Ok(text) = value.extract::<String>() {
        return Ok(NodeInput::Text(text));
    }
    if let Ok(index) = value.getattr("index").and_then(|i| i.extract::<usize>()) {
        return Ok(NodeInput::Node(index));
    }
    if let Ok(numbers) = value.getattr("values").and_then(|values| values.extract()) {
        return Ok(NodeInput::Numbers(numbers));
    }
    value
        .extract::<[f32; 3]>()
        .map(NodeInput::Vector)
        .map_err(|_| SceneError::new_err("it must be a number, three numbers, text, a NodeRef or a Table"))
}

pub(crate) fn material(object: Object) -> PyResult<Prim> {
    let mut nodes = Vec::new();
    for node in object.getattr("nodes")?.try_iter()? {
        let node = node?;
        let kind: String = get(&node, "kind")?;
        let mut inputs = BTreeMap::new();
        for item in node.getattr("inputs")?.call_method0("items")?.try_iter()? {
            let (name, value): (String, Bound<PyAny>) = item?.extract()?;
            let input = node_input(&value)
                .map_err(|e| SceneError::new_err(format!("input {name:?} of node {kind:?}: {e}")))?;
            inputs.insert(name, input);
        }
        nodes.push(ShadingNode { kind, inputs });
    }
    Ok(Prim::Material(Arc::new(Material {
        nodes,
        surface: get(object, "surface")?,
        volume: get(object, "volume")?,
    })))
}

pub(crate) fn camera(object: Object) -> PyResult<Prim> {
    let projection: String = get(object, "projection")?;
    Ok(Prim::Camera(Arc::new(Camera {
        world_from_camera: transform(object, "world_from_camera")?,
        motion: keys(object, transform_key)?,
        projection: match projection.as_str() {
            "perspective" => Projection::Perspective,
            "orthographic" => Projection::Orthographic,
            other => return Err(unknown("projection", other, "perspective, orthographic")),
        },
        aperture: DVec2::from_array(get(object, "aperture")?),
        aperture_offset: DVec2::from_array(get(object, "aperture_offset")?),
        focal_length: get(object, "focal_length")?,
        lens_radius: get(object, "lens_radius")?,
        focus_distance: get(object, "focus_distance")?,
        clipping_range: get(object, "clipping_range")?,
        exposure_scale: get(object, "exposure_scale")?,
    })))
}

/// The keys of a prim's motion.
fn keys<T>(object: Object, convert: impl Fn(Object) -> PyResult<T>) -> PyResult<Vec<T>> {
    object.getattr("motion")?.try_iter()?.map(|key| convert(&key?)).collect()
}

fn transforms(object: Object) -> PyResult<Vec<DAffine3>> {
    Ok(array::<f64>(object, "transforms")?.chunks_exact(16).map(affine).collect())
}

fn transform_key(key: Object) -> PyResult<TransformKey> {
    Ok(TransformKey { time: get(key, "time")?, world_from_object: transform(key, "world_from_object")? })
}

/// A JSON value as a Python object.
pub(crate) fn from_json<'py>(py: Python<'py>, value: &serde_json::Value) -> PyResult<Bound<'py, PyAny>> {
    use serde_json::Value;
    Ok(match value {
        Value::Null => py.None().into_bound(py),
        Value::Bool(b) => b.into_pyobject(py)?.to_owned().into_any(),
        Value::Number(n) => match (n.as_u64(), n.as_i64()) {
            (Some(u), _) => u.into_pyobject(py)?.into_any(),
            (None, Some(i)) => i.into_pyobject(py)?.into_any(),
            _ => n.as_f64().into_pyobject(py)?.into_any(),
        },
        Value::String(s) => s.into_pyobject(py)?.into_any(),
        Value::Array(items) => {
            let list = PyList::empty(py);
            for item in items {
                list.append(from_json(py, item)?)?;
            }
            list.into_any()
        }
        Value::Object(map) => {
            let dict = PyDict::new(py);
            for (key, item) in map {
                dict.set_item(key, from_json(py, item)?)?;
            }
            dict.into_any()
        }
    })
}
