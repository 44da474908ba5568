//! Catmull, Clark 1978, "Recursively generated B-spline surfaces on arbitrary topological meshes"; also bilinear.

use super::edges::{Sharpness, Topology};
use super::stencil::Level;
use crate::mesh::Cage;

/// One step: points of the coarse mesh, then of its edges, then of its faces. `linear` leaves the shape as it is.
pub(super) fn level(cage: &Cage, sharpness: &mut Sharpness, linear: bool) -> Level {
    let topology = Topology::new(cage, sharpness);
    let mut level = Level::default();
    for point in 0..cage.points.len() as u32 {
        level.linear.push([(point, 1.0)]);
        if linear {
            level.smooth.push([(point, 1.0)]);
        } else {
            level.smooth.push(point_row(cage, &topology, point, sharpness.points.get(&point).copied()));
        }
    }
    for edge in &topology.edges {
        level.linear.push_mean(edge.points.into_iter());
        let smooth = if linear { 0.0 } else { 1.0 - f64::from(edge.sharpness.clamp(0.0, 1.0)) };
        // Sharp: the middle. Smooth: the mean of the ends and the two face points.
        let ends = edge.points.map(|p| (p, 0.5 - 0.25 * smooth));
        let faces = edge.faces.iter().flat_map(|&f| face_row(cage, f, 0.25 * smooth));
        level.smooth.push(ends.into_iter().chain(faces.filter(|(_, w)| *w != 0.0)));
    }
    for face in &cage.faces {
        let points = &cage.corners[face.range()];
        level.linear.push_mean(points.iter().copied());
        level.smooth.push_mean(points.iter().copied());
    }
    push_faces(cage, &topology, &mut level);
    let n_points = cage.points.len() as u32;
    topology.refine_sharpness(sharpness, |edge| n_points + edge);
    level
}

/// The face point's stencil times `weight`.
fn face_row(cage: &Cage, face: u32, weight: f64) -> impl Iterator<Item = (u32, f64)> + '_ {
    let points = &cage.corners[cage.faces[face as usize].range()];
    let each = weight / points.len() as f64;
    points.iter().map(move |&p| (p, each))
}

fn point_row(cage: &Cage, topology: &Topology, point: u32, authored: Option<f32>) -> Vec<(u32, f64)> {
    let edges = &topology.edges_of_point[point as usize];
    let faces = &topology.faces_of_point[point as usize];
    if faces.is_empty() {
        return vec![(point, 1.0)];
    }
    let rule = topology.point_rule(point, authored);
    let (crease, smooth) = (f64::from(rule.crease), f64::from(rule.smooth));
    let mut row = vec![(point, f64::from(rule.corner))];
    if let (true, Some([a, b])) = (crease > 0.0, topology.crease_ends(point)) {
        row.extend([(point, 0.75 * crease), (a, 0.125 * crease), (b, 0.125 * crease)]);
    }
    if smooth > 0.0 {
        // (F + 2 R + (n - 3) P) / n with R the mean of edge middles: P's share of R makes it (F + E + (n - 2) P) / n.
        let n = edges.len() as f64;
        row.push((point, smooth * (n - 2.0) / n));
        row.extend(edges.iter().map(|&e| (topology.other_end(e, point), smooth / (n * n))));
        let each = smooth / (n * faces.len() as f64);
        row.extend(faces.iter().flat_map(|&f| face_row(cage, f, each)));
    }
    row
}

fn push_faces(cage: &Cage, topology: &Topology, level: &mut Level) {
    let n_points = cage.points.len() as u32;
    let n_edges = topology.edges.len() as u32;
    let mut middle = Vec::new();
    for (face_idx, face) in (0u32..).zip(&cage.faces) {
        let range = face.range();
        middle.clear();
        middle.extend(range.clone().map(|c| (c as u32, 1.0 / range.len() as f64)));
        for at in range.clone() {
            let next = if at + 1 == range.end { range.start } else { at + 1 };
            let last = if at == range.start { range.end - 1 } else { at - 1 };
            let points = [
                cage.corners[at],
                n_points + topology.edge_of_corner[at],
                n_points + n_edges + face_idx,
                n_points + topology.edge_of_corner[last],
            ];
            let half = |other: usize| [(at as u32, 0.5), (other as u32, 0.5)];
            level.push_face(face.source, points, [&[(at as u32, 1.0)], &half(next), &middle, &half(last)]);
        }
    }
}
