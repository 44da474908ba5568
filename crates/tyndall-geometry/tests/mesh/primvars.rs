//! Values over triangles.

use crate::{cube, triangles};
use std::borrow::Cow;
use tyndall_scene::prim::{Interpolation, Mesh, Primvar};

const ALL: [(Interpolation, usize); 5] = [
    (Interpolation::Constant, 1),
    (Interpolation::Uniform, 6),
    (Interpolation::Varying, 8),
    (Interpolation::Vertex, 8),
    (Interpolation::FaceVarying, 24),
];

#[test]
fn values_are_found_by_their_interpolation() {
    let (mesh, _) = triangles(&cube());
    let bary = [0.2, 0.3, 0.5];
    for (interpolation, n) in ALL {
        let values = (0..n).flat_map(|i| [i as f32, -(i as f32)]).collect();
        let primvar = Primvar { interpolation, components: 2, values };
        assert!(matches!(mesh.refine(&primvar), Cow::Borrowed(_)));
        for t in 0..mesh.len() {
            let mix = |ids: [u32; 3]| ids.iter().zip(bary).map(|(i, w)| *i as f32 * w).sum::<f32>();
            let expected = match interpolation {
                Interpolation::Constant => 0.0,
                Interpolation::Uniform => mesh.face[t] as f32,
                Interpolation::Varying | Interpolation::Vertex => mix(mesh.indices[t]),
                Interpolation::FaceVarying => mix(mesh.corner[t]),
            };
            let [x, y, z, w] = mesh.primvar(&primvar, t, bary);
            assert!((x - expected).abs() < 1e-5 && (y + expected).abs() < 1e-5 && z == 0.0 && w == 1.0);
        }
    }
}

#[test]
fn short_long_and_absurd_arrays_are_reported_and_never_panic() {
    let (mesh, _) = triangles(&cube());
    for (interpolation, n) in ALL {
        for (components, n_values) in
            [(0, 5), (3, 0), (3, 3 * n - 1), (4, 4 * n + 4), (7, 7 * n), (usize::MAX, 9)]
        {
            let primvar = Primvar { interpolation, components, values: vec![1.0; n_values] };
            for t in 0..mesh.len() + 2 {
                assert!(mesh.primvar(&primvar, t, [0.1, 0.1, 0.8]).iter().all(|x| x.is_finite()));
            }
            let primvars = [("st".to_owned(), primvar)].into();
            let (_, messages) = triangles(&Mesh { primvars, ..cube() });
            assert!(messages.len() == 1 && messages[0].contains("st"), "{messages:?}");
        }
    }
}
