//! Values over triangles.

use super::TriangleMesh;
use std::borrow::Cow;
use tyndall_scene::prim::{Interpolation, Mesh, Primvar};
use tyndall_scene::{Diagnostics, PrimPath};

/// Values an interpolation needs on a mesh.
pub(super) fn n_values(mesh: &Mesh, interpolation: Interpolation) -> usize {
    match interpolation {
        Interpolation::Constant => 1,
        Interpolation::Uniform => mesh.face_vertex_counts.len(),
        Interpolation::Varying | Interpolation::Vertex => mesh.points.len(),
        Interpolation::FaceVarying => mesh.face_vertex_indices.len(),
    }
}

/// Reports primvars of the wrong length.
pub(super) fn check(path: &PrimPath, mesh: &Mesh, diagnostics: &mut Diagnostics) {
    for (name, primvar) in &mesh.primvars {
        let needed = n_values(mesh, primvar.interpolation);
        let found = primvar.values.len() / primvar.components.max(1);
        if found != needed || !(1..=4).contains(&primvar.components) {
            let (interpolation, components) = (primvar.interpolation, primvar.components);
            diagnostics.warn(
                path,
                format!(
                    "primvar {name} has {found} values of {components} components where {interpolation:?} \
                     interpolation needs {needed} of 1 to 4"
                ),
                "missing values are zero and surplus ones are not used",
            );
        }
    }
}

impl TriangleMesh {
    /// The primvar as [`Self::primvar`] wants it: refined like the mesh if that is subdivided, else as it is. Do this
    /// once when the scene is built.
    pub fn refine<'a>(&self, primvar: &'a Primvar) -> Cow<'a, Primvar> {
        self.refinement.as_ref().map_or(Cow::Borrowed(primvar), |r| Cow::Owned(r.apply(primvar)))
    }

    /// A value at barycentric weights of a triangle's corners. `primvar` must have gone through [`Self::refine`].
    ///
    /// Components the primvar lacks are 0, the fourth 1; so are values beyond the end of its array.
    #[inline]
    pub fn primvar(&self, primvar: &Primvar, triangle: usize, barycentric: [f32; 3]) -> [f32; 4] {
        const ABSENT: [f32; 4] = [0.0, 0.0, 0.0, 1.0];
        let components = primvar.components;
        let value = |i: u32| {
            let mut out = ABSENT;
            let start = (i as usize).saturating_mul(components);
            if let Some(values) = primvar.values.get(start..start.saturating_add(components)) {
                out.iter_mut().zip(values).for_each(|(o, v)| *o = *v);
            }
            out
        };
        let mix = |ids: Option<&[u32; 3]>| {
            let Some(&ids) = ids else { return ABSENT };
            let [a, b, c] = ids.map(value);
            std::array::from_fn(|i| a[i] * barycentric[0] + b[i] * barycentric[1] + c[i] * barycentric[2])
        };
        match primvar.interpolation {
            Interpolation::Constant => value(0),
            Interpolation::Uniform => self.face.get(triangle).map_or(ABSENT, |&f| value(f)),
            Interpolation::Varying | Interpolation::Vertex => mix(self.indices.get(triangle)),
            Interpolation::FaceVarying => mix(self.corner.get(triangle)),
        }
    }
}
