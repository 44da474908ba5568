//! Implicit shapes as triangles: boxes exactly, surfaces of revolution finely with smooth normals.

use super::TriangleMesh;
use glam::{DVec2, DVec3, Vec3};
use std::f64::consts::{FRAC_PI_2, TAU};
use tyndall_scene::prim::ShapeKind;

/// Segments around the axis: an inscribed polygon of as many sides lacks 0.02 % of the circle's area.
const AROUND: usize = 192;

/// Rings of a half sphere.
const RINGS: usize = 48;

/// A stretch of the outline that is turned around z: two (radius, z) points and their outward normals.
struct Stretch {
    points: [DVec2; 2],
    normals: [DVec2; 2],
}

impl TriangleMesh {
    /// The triangles of a shape: closed (but for the plane), wound outward, centred on the shape's origin. Spheres
    /// are better rendered as [`crate::Blas::unit_sphere`]. Sizes that are negative count as positive; a size that is
    /// not finite gives an empty mesh.
    pub fn from_shape(kind: &ShapeKind) -> Self {
        match *kind {
            ShapeKind::Cube { size } => cube(size.abs() * 0.5),
            ShapeKind::Plane { width, length } => plane(width.abs() * 0.5, length.abs() * 0.5),
            ShapeKind::Sphere { radius } => capsule(radius.abs(), radius.abs(), 0.0),
            ShapeKind::Capsule { radius_top, radius_bottom, height } => {
                capsule(radius_top.abs(), radius_bottom.abs(), height.abs())
            }
            ShapeKind::Cylinder { radius_top, radius_bottom, height } => {
                frustum(radius_top.abs(), radius_bottom.abs(), height.abs())
            }
            ShapeKind::Cone { radius, height } => frustum(0.0, radius.abs(), height.abs()),
        }
    }
}

fn cube(half: f64) -> TriangleMesh {
    let position = |i: u32| {
        let sign = |bit: u32| if i >> bit & 1 == 1 { half } else { -half };
        DVec3::new(sign(0), sign(1), sign(2)).as_vec3()
    };
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    from_quads((0..8).map(position).collect(), &quads)
}

fn plane(x: f64, y: f64) -> TriangleMesh {
    let corners = [(-x, -y), (x, -y), (x, y), (-x, y)];
    from_quads(corners.map(|(x, y)| DVec3::new(x, y, 0.0).as_vec3()).to_vec(), &[[0, 1, 2, 3]])
}

fn from_quads(positions: Vec<Vec3>, quads: &[[u32; 4]]) -> TriangleMesh {
    let mut mesh = TriangleMesh { positions, ..TriangleMesh::default() };
    if !mesh.positions.iter().all(|p| p.is_finite()) {
        return TriangleMesh::default();
    }
    for (face, quad) in (0u32..).zip(quads) {
        for triangle in [[0, 1, 2], [0, 2, 3]] {
            mesh.indices.push(triangle.map(|i| quad[i as usize]));
            mesh.corner.push(triangle.map(|i| 4 * face + i));
            mesh.face.push(face);
            mesh.subset.push(0);
        }
    }
    mesh
}

fn frustum(top: f64, bottom: f64, height: f64) -> TriangleMesh {
    let z = height * 0.5;
    let (a, b) = (DVec2::new(bottom, -z), DVec2::new(top, z));
    let cap =
        |z: f64, from: DVec2, to: DVec2| Stretch { points: [from, to], normals: [DVec2::new(0.0, z); 2] };
    revolve(&[cap(-1.0, DVec2::new(0.0, -z), a), side(a, b), cap(1.0, b, DVec2::new(0.0, z))])
}

fn side(a: DVec2, b: DVec2) -> Stretch {
    let normal = DVec2::new(b.y - a.y, a.x - b.x).try_normalize().unwrap_or(DVec2::X);
    Stretch { points: [a, b], normals: [normal; 2] }
}

fn capsule(top: f64, bottom: f64, height: f64) -> TriangleMesh {
    let mut outline = Vec::new();
    let mut half_sphere = |radius: f64, z: f64, from: f64| {
        // The pole and the equator are exact: the sine and cosine there are not.
        let on_circle = |ring: usize| match from + FRAC_PI_2 * ring as f64 / RINGS as f64 {
            _ if ring == 0 && from < 0.0 => DVec2::NEG_Y,
            _ if ring == RINGS && from == 0.0 => DVec2::Y,
            _ if ring == 0 || ring == RINGS => DVec2::X,
            angle => DVec2::from_angle(angle),
        };
        for ring in 0..RINGS {
            let normals = [on_circle(ring), on_circle(ring + 1)];
            outline.push(Stretch { points: normals.map(|n| n * radius + DVec2::new(0.0, z)), normals });
        }
    };
    half_sphere(bottom, -height * 0.5, -FRAC_PI_2);
    half_sphere(top, height * 0.5, 0.0);
    let (a, b) = (outline[RINGS - 1].points[1], outline[RINGS].points[0]);
    if a != b {
        outline.insert(RINGS, side(a, b));
    }
    revolve(&outline)
}

/// A point or normal of the outline, turned around z to segment border `j`.
fn turned(p: DVec2, j: f64) -> Vec3 {
    let (sin, cos) = (TAU * j / AROUND as f64).sin_cos();
    DVec3::new(p.x * cos, p.x * sin, p.y).as_vec3()
}

/// Points of a ring: one if it is on the axis.
fn ring_size(p: DVec2) -> usize {
    if p.x == 0.0 { 1 } else { AROUND }
}

/// Turns an outline, which runs from the lowest point of the axis to the highest, around z.
fn revolve(outline: &[Stretch]) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let mut starts = Vec::with_capacity(outline.len() + 1);
    let top = outline.last().map(|s| s.points[1]);
    for p in outline.iter().map(|s| s.points[0]).chain(top) {
        starts.push(mesh.positions.len() as u32);
        mesh.positions.extend((0..ring_size(p)).map(|j| turned(p, j as f64)));
    }
    let mut normals = Vec::new();
    for (k, stretch) in outline.iter().enumerate() {
        for j in 0..AROUND {
            let point = |end: usize, j: usize| starts[k + end] + (j % ring_size(stretch.points[end])) as u32;
            let quad = [point(0, j), point(0, j + 1), point(1, j + 1), point(1, j)];
            push_quad(&mut mesh, &mut normals, (k * AROUND + j) as u32, quad, stretch.quad_normals(j));
        }
    }
    mesh.normals = Some(normals);
    if mesh.positions.iter().all(|p| p.is_finite()) { mesh } else { TriangleMesh::default() }
}

impl Stretch {
    /// Normals of segment `j`: bottom left, bottom right, top right, top left.
    fn quad_normals(&self, j: usize) -> [Vec3; 4] {
        let normal = |end: usize, j: f64, middle: f64| {
            // At a point on the axis the normal is that of the middle of the segment.
            turned(self.normals[end], if ring_size(self.points[end]) == 1 { middle } else { j })
        };
        let (left, right) = (j as f64, (j + 1) as f64);
        let middle = left + 0.5;
        [normal(0, left, middle), normal(0, right, middle), normal(1, right, middle), normal(1, left, middle)]
    }
}

/// Adds the triangles of a quad that haven't collapsed.
fn push_quad(
    mesh: &mut TriangleMesh,
    all_normals: &mut Vec<[Vec3; 3]>,
    face: u32,
    quad: [u32; 4],
    normals: [Vec3; 4],
) {
    for triangle in [[0usize, 1, 2], [0, 2, 3]] {
        let indices = triangle.map(|i| quad[i]);
        if indices[0] != indices[1] && indices[1] != indices[2] && indices[2] != indices[0] {
            mesh.indices.push(indices);
            mesh.corner.push(triangle.map(|i| 4 * face + i as u32));
            mesh.face.push(face);
            mesh.subset.push(0);
            all_normals.push(triangle.map(|i| normals[i]));
        }
    }
}
