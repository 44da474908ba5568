//! Loop 1987, "Smooth subdivision surfaces based on triangles".

use super::edges::{Sharpness, Topology};
use super::stencil::Level;
use crate::mesh::Cage;

/// One step: points of the coarse mesh, then of its edges. All faces must be triangles.
pub(super) fn level(cage: &Cage, sharpness: &mut Sharpness) -> Level {
    let topology = Topology::new(cage, sharpness);
    let mut level = Level::default();
    for point in 0..cage.points.len() as u32 {
        level.linear.push([(point, 1.0)]);
        level.smooth.push(point_row(&topology, point, sharpness.points.get(&point).copied()));
    }
    for edge in &topology.edges {
        level.linear.push_mean(edge.points.into_iter());
        let smooth = 1.0 - f64::from(edge.sharpness.clamp(0.0, 1.0));
        // Sharp: the middle. Smooth: 3/8 of each end and 1/8 of each opposite corner.
        let ends = edge.points.map(|p| (p, 0.5 - 0.125 * smooth));
        let opposite = edge.faces.iter().flat_map(|&f| &cage.corners[cage.faces[f as usize].range()]);
        let opposite =
            opposite.filter(|p| smooth > 0.0 && !edge.points.contains(p)).map(|&p| (p, 0.125 * smooth));
        level.smooth.push(ends.into_iter().chain(opposite));
    }
    push_faces(cage, &topology, &mut level);
    let n_points = cage.points.len() as u32;
    topology.refine_sharpness(sharpness, |edge| n_points + edge);
    level
}

fn point_row(topology: &Topology, point: u32, authored: Option<f32>) -> Vec<(u32, f64)> {
    let edges = &topology.edges_of_point[point as usize];
    if edges.is_empty() {
        return vec![(point, 1.0)];
    }
    let rule = topology.point_rule(point, authored);
    let (crease, smooth) = (f64::from(rule.crease), f64::from(rule.smooth));
    let mut row = vec![(point, f64::from(rule.corner))];
    if let (true, Some([a, b])) = (crease > 0.0, topology.crease_ends(point)) {
        row.extend([(point, 0.75 * crease), (a, 0.125 * crease), (b, 0.125 * crease)]);
    }
    if smooth > 0.0 {
        let n = edges.len() as f64;
        let c = 0.375 + 0.25 * (std::f64::consts::TAU / n).cos();
        let beta = (0.625 - c * c) / n;
        row.push((point, smooth * (1.0 - n * beta)));
        row.extend(edges.iter().map(|&e| (topology.other_end(e, point), smooth * beta)));
    }
    row
}

fn push_faces(cage: &Cage, topology: &Topology, level: &mut Level) {
    let n_points = cage.points.len() as u32;
    for face in &cage.faces {
        let start = face.first_corner;
        let edge = |i: u32| n_points + topology.edge_of_corner[(start + i % 3) as usize];
        let half = |i: u32, j: u32| [(start + i % 3, 0.5), (start + j % 3, 0.5)];
        for i in 0..3 {
            let points = [cage.corners[(start + i) as usize], edge(i), edge(i + 2)];
            level.push_face(face.source, points, [&[(start + i, 1.0)], &half(i, i + 1), &half(i + 2, i)]);
        }
        let points = [edge(0), edge(1), edge(2)];
        level.push_face(face.source, points, [&half(0, 1), &half(1, 2), &half(2, 0)]);
    }
}
