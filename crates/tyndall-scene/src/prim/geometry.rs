//! Surfaces: polygon meshes and implicit shapes.

use super::TransformKey;
use crate::PrimPath;
use glam::DAffine3;
use serde::Serialize;
use std::collections::BTreeMap;

/// Over what a primvar varies (UsdGeomPrimvar's words).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
pub enum Interpolation {
    /// One value for the prim.
    Constant,
    /// One value a face.
    Uniform,
    /// One value a point, linear across faces.
    Varying,
    /// One value a point, following subdivision.
    Vertex,
    /// One value a face corner.
    FaceVarying,
}

impl Interpolation {
    /// From USD's token.
    pub fn from_name(name: &str) -> Option<Self> {
        Some(match name {
            "constant" => Self::Constant,
            "uniform" => Self::Uniform,
            "varying" => Self::Varying,
            "vertex" => Self::Vertex,
            "faceVarying" => Self::FaceVarying,
            _ => return None,
        })
    }
}

/// Values over a mesh, indices already resolved.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Primvar {
    /// What the values belong to.
    pub interpolation: Interpolation,
    /// Numbers per value: 1 to 4.
    pub components: usize,
    /// `components` numbers a value.
    pub values: Vec<f32>,
}

/// Subdivision rule of a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize)]
pub enum SubdivisionScheme {
    /// A polygon mesh.
    #[default]
    None,
    /// Catmull-Clark.
    CatmullClark,
    /// Loop; triangles only.
    Loop,
    /// Bilinear.
    Bilinear,
}

/// How a mesh is subdivided.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Subdivision {
    /// The rule.
    pub scheme: SubdivisionScheme,
    /// Point indices of crease chains, end to end.
    pub crease_indices: Vec<i32>,
    /// Points of each chain.
    pub crease_lengths: Vec<i32>,
    /// Sharpness, one a chain or one an edge.
    pub crease_sharpnesses: Vec<f32>,
    /// Points that stay sharp.
    pub corner_indices: Vec<i32>,
    /// Their sharpness.
    pub corner_sharpnesses: Vec<f32>,
}

/// Faces with a material of their own.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Subset {
    /// Face indices.
    pub faces: Vec<i32>,
    /// The material; `None` leaves the mesh's.
    pub material: Option<PrimPath>,
}

/// A polygon mesh in object space.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Mesh {
    /// Places the object at the time of the frame; for instanced prims relative to the instance.
    pub world_from_object: DAffine3,
    /// Where it is while the shutter is open, in the order of time; fewer than two of an object that stands still.
    pub motion: Vec<TransformKey>,
    /// Point positions.
    pub points: Vec<[f32; 3]>,
    /// Corners of each face.
    pub face_vertex_counts: Vec<i32>,
    /// Point index of each corner.
    pub face_vertex_indices: Vec<i32>,
    /// Faces that are not there.
    pub hole_indices: Vec<i32>,
    /// Whether corners run clockwise seen from outside.
    pub left_handed: bool,
    /// Whether both sides are lit; otherwise too, since a renderer of light has no invisible backs, but emission and
    /// one-sided shading look at it.
    pub double_sided: bool,
    /// Subdivision.
    pub subdivision: Subdivision,
    /// Authored normals, three components; ignored on subdivided meshes.
    pub normals: Option<Primvar>,
    /// Other primvars by name (`st`, `displayColor`, ...).
    pub primvars: BTreeMap<String, Primvar>,
    /// Bound material.
    pub material: Option<PrimPath>,
    /// Faces with their own material.
    pub subsets: Vec<Subset>,
    /// Set if this prim is a prototype: it is drawn once per instance and not by itself.
    pub instancer: Option<PrimPath>,
    /// Shown or hidden.
    pub visible: bool,
}

impl Default for Mesh {
    fn default() -> Self {
        Self {
            world_from_object: DAffine3::IDENTITY,
            motion: Vec::new(),
            points: Vec::new(),
            face_vertex_counts: Vec::new(),
            face_vertex_indices: Vec::new(),
            hole_indices: Vec::new(),
            left_handed: false,
            double_sided: false,
            subdivision: Subdivision::default(),
            normals: None,
            primvars: BTreeMap::new(),
            material: None,
            subsets: Vec::new(),
            instancer: None,
            visible: true,
        }
    }
}

/// An implicit shape around the object's origin. Cylinder, cone and capsule stand along z; the plane faces +z.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub enum ShapeKind {
    /// A sphere.
    Sphere {
        /// Radius.
        radius: f64,
    },
    /// A cube.
    Cube {
        /// Edge length.
        size: f64,
    },
    /// A closed cylinder, possibly with two radii.
    Cylinder {
        /// Radius at the top (+z).
        radius_top: f64,
        /// Radius at the bottom.
        radius_bottom: f64,
        /// Height.
        height: f64,
    },
    /// A closed cone with its apex at +z.
    Cone {
        /// Base radius.
        radius: f64,
        /// Height.
        height: f64,
    },
    /// A cylinder with half spheres at both ends.
    Capsule {
        /// Radius at the top.
        radius_top: f64,
        /// Radius at the bottom.
        radius_bottom: f64,
        /// Height of the cylindrical part.
        height: f64,
    },
    /// A rectangle in the xy plane.
    Plane {
        /// Extent along x.
        width: f64,
        /// Extent along y.
        length: f64,
    },
}

/// An implicit shape with its placement and material.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Shape {
    /// Places the object at the time of the frame; for instanced prims relative to the instance. The axis of UsdGeom is
    /// folded in.
    pub world_from_object: DAffine3,
    /// As of a mesh.
    pub motion: Vec<TransformKey>,
    /// The shape.
    pub kind: ShapeKind,
    /// Constant primvars by name (`displayColor`, ...).
    pub primvars: BTreeMap<String, Primvar>,
    /// Bound material.
    pub material: Option<PrimPath>,
    /// Set if this prim is a prototype.
    pub instancer: Option<PrimPath>,
    /// Shown or hidden.
    pub visible: bool,
}
