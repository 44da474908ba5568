//! Edges of a cage with their faces, and how sharp they are.

use crate::mesh::Cage;
use rustc_hash::FxHashMap;
use tyndall_scene::prim::Subdivision;
use tyndall_scene::{Diagnostics, PrimPath};

/// At and above this a crease never becomes smooth (USD's and OpenSubdiv's SHARPNESS_INFINITE).
const INFINITE: f32 = 10.0;

/// Authored sharpness of the current level's edges and points.
#[derive(Debug, Default)]
pub(super) struct Sharpness {
    pub(super) edges: FxHashMap<(u32, u32), f32>,
    pub(super) points: FxHashMap<u32, f32>,
}

/// Key of an edge.
pub(super) fn key(a: u32, b: u32) -> (u32, u32) {
    (a.min(b), a.max(b))
}

/// Sharpness one level on.
pub(super) fn decayed(sharpness: f32) -> f32 {
    if sharpness >= INFINITE { sharpness } else { (sharpness - 1.0).max(0.0) }
}

impl Sharpness {
    /// From USD's arrays: creases are chains, with one sharpness a chain or one an edge.
    pub(super) fn from_prim(
        path: &PrimPath,
        cage: &Cage,
        subdivision: &Subdivision,
        diagnostics: &mut Diagnostics,
    ) -> Self {
        let mut out = Self::default();
        let point = |i: &i32| u32::try_from(*i).ok().filter(|&i| (i as usize) < cage.points.len());
        let mut is_wrong = subdivision.corner_indices.len() != subdivision.corner_sharpnesses.len();
        for (index, &sharpness) in subdivision.corner_indices.iter().zip(&subdivision.corner_sharpnesses) {
            match point(index) {
                Some(i) if sharpness > 0.0 => _ = out.points.insert(i, sharpness),
                Some(_) => {}
                None => is_wrong = true,
            }
        }
        let n_edges: usize = subdivision
            .crease_lengths
            .iter()
            .map(|&n| usize::try_from(n.saturating_sub(1)).unwrap_or(0))
            .sum();
        let is_per_edge =
            subdivision.crease_sharpnesses.len() == n_edges && subdivision.crease_lengths.len() != n_edges;
        let (mut start, mut edge) = (0usize, 0usize);
        for (chain, &length) in subdivision.crease_lengths.iter().enumerate() {
            let end = start.saturating_add(usize::try_from(length).unwrap_or(0));
            let Some(points) = subdivision.crease_indices.get(start..end) else {
                is_wrong = true;
                break;
            };
            for pair in points.windows(2) {
                let sharpness = subdivision.crease_sharpnesses.get(if is_per_edge { edge } else { chain });
                edge += 1;
                match (point(&pair[0]), point(&pair[1]), sharpness) {
                    (Some(a), Some(b), Some(&s)) if s > 0.0 => _ = out.edges.insert(key(a, b), s),
                    (Some(_), Some(_), Some(_)) => {}
                    _ => is_wrong = true,
                }
            }
            start = end;
        }
        if is_wrong {
            let what = "creases or corners name points or sharpnesses that do not exist";
            diagnostics.warn(path, what, "these were ignored");
        }
        out
    }
}

/// An edge of the cage.
#[derive(Debug, Clone)]
pub(super) struct Edge {
    pub(super) points: [u32; 2],
    /// Faces on it.
    pub(super) faces: Vec<u32>,
    /// Authored sharpness, or infinite on a boundary.
    pub(super) sharpness: f32,
}

/// Who is next to whom.
#[derive(Debug, Default)]
pub(super) struct Topology {
    pub(super) edges: Vec<Edge>,
    /// Edge from each corner to the next of its face, numbered as [`Cage::corners`].
    pub(super) edge_of_corner: Vec<u32>,
    /// Edges of each point, ascending.
    pub(super) edges_of_point: Vec<Vec<u32>>,
    /// Faces of each point, ascending.
    pub(super) faces_of_point: Vec<Vec<u32>>,
}

impl Topology {
    pub(super) fn new(cage: &Cage, sharpness: &Sharpness) -> Self {
        let n_points = cage.points.len();
        let mut out = Self {
            edge_of_corner: vec![0; cage.corners.len()],
            edges_of_point: vec![Vec::new(); n_points],
            faces_of_point: vec![Vec::new(); n_points],
            edges: Vec::new(),
        };
        let mut edge_of_key = FxHashMap::<(u32, u32), u32>::default();
        for (face_idx, face) in (0u32..).zip(&cage.faces) {
            let range = face.range();
            for at in range.clone() {
                let next = if at + 1 == range.end { range.start } else { at + 1 };
                let (a, b) = (cage.corners[at], cage.corners[next]);
                let edge = *edge_of_key.entry(key(a, b)).or_insert_with(|| {
                    let sharpness = sharpness.edges.get(&key(a, b)).copied().unwrap_or(0.0);
                    out.edges.push(Edge { points: [a, b], faces: Vec::with_capacity(2), sharpness });
                    out.edges.len() as u32 - 1
                });
                out.edges[edge as usize].faces.push(face_idx);
                out.edge_of_corner[at] = edge;
                if !out.faces_of_point[a as usize].contains(&face_idx) {
                    out.faces_of_point[a as usize].push(face_idx);
                }
            }
        }
        for (edge_idx, edge) in (0u32..).zip(&mut out.edges) {
            // Boundaries, and edges of three or more faces, can only be sharp.
            if edge.faces.len() != 2 || edge.points[0] == edge.points[1] {
                edge.sharpness = f32::INFINITY;
            }
            for point in edge.points {
                out.edges_of_point[point as usize].push(edge_idx);
            }
        }
        out
    }

    /// Sharpness of the finer level: halves of an edge inherit it, less one.
    pub(super) fn refine_sharpness(&self, sharpness: &mut Sharpness, point_of_edge: impl Fn(u32) -> u32) {
        let mut finer = Sharpness::default();
        for (edge_idx, edge) in (0u32..).zip(&self.edges) {
            let s = decayed(edge.sharpness);
            if s > 0.0 {
                for end in edge.points {
                    finer.edges.insert(key(end, point_of_edge(edge_idx)), s);
                }
            }
        }
        for (&point, &s) in &sharpness.points {
            if decayed(s) > 0.0 {
                finer.points.insert(point, decayed(s));
            }
        }
        *sharpness = finer;
    }

    /// Edges of a point, sharpest first.
    fn by_sharpness(&self, point: u32) -> Vec<(f32, u32)> {
        let edges = self.edges_of_point[point as usize].iter();
        let mut sharp: Vec<(f32, u32)> = edges.map(|&e| (self.edges[e as usize].sharpness, e)).collect();
        sharp.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        sharp
    }

    /// The neighbours along the two sharpest edges of a point, if two are sharp.
    pub(super) fn crease_ends(&self, point: u32) -> Option<[u32; 2]> {
        match self.by_sharpness(point)[..] {
            [(_, a), (s, b), ..] if s > 0.0 => Some([self.other_end(a, point), self.other_end(b, point)]),
            _ => None,
        }
    }

    pub(super) fn other_end(&self, edge: u32, point: u32) -> u32 {
        let [a, b] = self.edges[edge as usize].points;
        if a == point { b } else { a }
    }

    /// The rule of a point: how much of the smooth rule, of the crease rule and of staying put.
    pub(super) fn point_rule(&self, point: u32, authored: Option<f32>) -> PointRule {
        let sharpness = self.by_sharpness(point);
        let of = |i: usize| sharpness.get(i).map_or(0.0, |s| s.0);
        // A corner of a single face is sharp by the boundary rule edgeAndCorner; so is where three sharp edges meet,
        // for as long as the third of them lasts.
        let is_lone = self.faces_of_point[point as usize].len() == 1;
        let corner = if is_lone { f32::INFINITY } else { of(2).max(authored.unwrap_or(0.0)) };
        let corner = corner.clamp(0.0, 1.0);
        // A corner softens into a crease if the other two edges outlast the third, else into a smooth point.
        let crease = if of(2) > 0.0 && of(1) < 1.0 { 0.0 } else { of(1).clamp(0.0, 1.0) };
        let crease = crease * (1.0 - corner);
        PointRule { corner, crease, smooth: 1.0 - corner - crease }
    }
}

/// Weights of the three rules of a point; they sum to one.
#[derive(Debug, Clone, Copy)]
pub(super) struct PointRule {
    pub(super) corner: f32,
    pub(super) crease: f32,
    pub(super) smooth: f32,
}
