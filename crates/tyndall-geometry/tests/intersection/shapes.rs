//! What the tests are made of.

use glam::{DVec3, Vec3, Vec3A};
use std::collections::HashMap;
use tyndall_geometry::SimdLevel;
use tyndall_math::random::Pcg;

/// A closed sphere of 20 * 4^level triangles, wound outward, scaled and then moved in f64.
pub(crate) fn icosphere(level: usize, scale: f64, offset: DVec3) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let phi = (1.0 + 5f64.sqrt()) / 2.0;
    let mut points: Vec<DVec3> = [
        (-1.0, phi, 0.0),
        (1.0, phi, 0.0),
        (-1.0, -phi, 0.0),
        (1.0, -phi, 0.0),
        (0.0, -1.0, phi),
        (0.0, 1.0, phi),
        (0.0, -1.0, -phi),
        (0.0, 1.0, -phi),
        (phi, 0.0, -1.0),
        (phi, 0.0, 1.0),
        (-phi, 0.0, -1.0),
        (-phi, 0.0, 1.0),
    ]
    .map(|(x, y, z)| DVec3::new(x, y, z).normalize())
    .to_vec();
    #[rustfmt::skip]
    let mut faces: Vec<[u32; 3]> = vec![
        [0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4], [11, 10, 2], [10, 7, 6],
        [7, 1, 8], [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9], [4, 9, 5], [2, 4, 11], [6, 2, 10],
        [8, 6, 7], [9, 8, 1],
    ];
    for _ in 0..level {
        let mut middle = HashMap::new();
        let mut split = |a: u32, b: u32| {
            *middle.entry((a.min(b), a.max(b))).or_insert_with(|| {
                points.push(((points[a as usize] + points[b as usize]) * 0.5).normalize());
                points.len() as u32 - 1
            })
        };
        let divide = |[a, b, c]: [u32; 3]| {
            let (ab, bc, ca) = (split(a, b), split(b, c), split(c, a));
            [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
        };
        faces = faces.into_iter().flat_map(divide).collect();
    }
    (points.into_iter().map(|p| (p * scale + offset).as_vec3()).collect(), faces)
}

/// `n` triangles of all sizes, scattered in a cube.
pub(crate) fn soup(n: usize, seed: u64) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let mut rng = Pcg::new(&[seed]);
    let mut positions = Vec::new();
    for _ in 0..n {
        let center = cube(&mut rng);
        let size = 10f32.powf(-2.0 * rng.next_f32());
        positions.extend([0; 3].map(|_| Vec3::from(center + cube(&mut rng) * size)));
    }
    (positions, (0..n as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
}

/// Uniform in [-1, 1]^3.
pub(crate) fn cube(rng: &mut Pcg) -> Vec3A {
    Vec3A::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 2.0 - 1.0
}

/// Uniform on the unit sphere.
pub(crate) fn direction(rng: &mut Pcg) -> Vec3A {
    loop {
        let v = cube(rng);
        if (1e-4..=1.0).contains(&v.length_squared()) {
            return v.normalize();
        }
    }
}

/// Both kernels (the same one twice where there is no other).
pub(crate) fn levels() -> [SimdLevel; 2] {
    [SimdLevel::portable(), SimdLevel::detect()]
}
