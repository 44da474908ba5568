//! Faces that make sense.

use glam::DVec3;
use std::ops::Range;
use tyndall_scene::prim::Mesh;
use tyndall_scene::{Diagnostics, PrimPath};

/// A polygon of a [`Cage`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Face {
    /// Face of the prim it comes from.
    pub(crate) source: u32,
    /// First entry in [`Cage::corners`], and number of it for face-varying values.
    pub(crate) first_corner: u32,
    pub(crate) n_corners: u32,
}

impl Face {
    pub(crate) fn range(&self) -> Range<usize> {
        self.first_corner as usize..(self.first_corner + self.n_corners) as usize
    }
}

/// A polygon mesh whose faces have at least three corners, each a finite point.
#[derive(Debug, Clone, Default)]
pub(crate) struct Cage {
    pub(crate) points: Vec<DVec3>,
    /// Point of each face-vertex; those outside all faces are meaningless.
    pub(crate) corners: Vec<u32>,
    pub(crate) faces: Vec<Face>,
}

/// Faces dropped for one reason.
#[derive(Default)]
struct Dropped {
    count: usize,
    first: usize,
}

impl Dropped {
    fn add(&mut self, face: usize) {
        if self.count == 0 {
            self.first = face;
        }
        self.count += 1;
    }

    fn report(&self, path: &PrimPath, why: &str, diagnostics: &mut Diagnostics) {
        let Self { count, first } = self;
        if *count > 0 {
            let what = format!("{count} faces {why} (the first is face {first})");
            diagnostics.warn(path, what, "these faces were left out");
        }
    }
}

/// Why a face can't be used.
#[derive(Clone, Copy)]
enum Flaw {
    TooFewCorners,
    PointOutOfRange,
    PointNotFinite,
}

impl Flaw {
    const ALL: [(Self, &str); 3] = [
        (Self::TooFewCorners, "have fewer than three corners"),
        (Self::PointOutOfRange, "have points out of range"),
        (Self::PointNotFinite, "have points that are not finite"),
    ];

    /// What is wrong with a face of `count` corners, of which `points` exist.
    fn of_face(count: usize, points: Option<&[i32]>, finite: &[bool]) -> Option<Self> {
        let is_finite = |i: &i32| usize::try_from(*i).ok().and_then(|i| finite.get(i)).copied();
        if count < 3 {
            return Some(Self::TooFewCorners);
        }
        let Some(points) = points else { return Some(Self::PointOutOfRange) };
        if points.iter().any(|i| is_finite(i).is_none()) {
            return Some(Self::PointOutOfRange);
        }
        points.iter().any(|i| is_finite(i) == Some(false)).then_some(Self::PointNotFinite)
    }
}

impl Cage {
    pub(crate) fn from_prim(path: &PrimPath, mesh: &Mesh, diagnostics: &mut Diagnostics) -> Self {
        let indices = &mesh.face_vertex_indices;
        let finite: Vec<bool> = mesh.points.iter().map(|p| p.iter().all(|x| x.is_finite())).collect();
        let is_hole = holes(mesh);
        let mut dropped: [Dropped; 3] = Default::default();
        let mut faces = Vec::with_capacity(is_hole.len());
        let mut start = 0usize;
        for (source, &count) in mesh.face_vertex_counts.iter().enumerate() {
            let count = usize::try_from(count).unwrap_or(0);
            let range = start..start.saturating_add(count);
            start = range.end;
            match Flaw::of_face(count, indices.get(range.clone()), &finite) {
                Some(flaw) => dropped[flaw as usize].add(source),
                None if is_hole[source] => {}
                None => {
                    let (source, first_corner, n_corners) = (source as u32, range.start as u32, count as u32);
                    faces.push(Face { source, first_corner, n_corners });
                }
            }
        }
        for ((_, why), dropped) in Flaw::ALL.iter().zip(&dropped) {
            dropped.report(path, why, diagnostics);
        }
        let point =
            |(p, &ok): (&[f32; 3], &bool)| if ok { DVec3::from(p.map(f64::from)) } else { DVec3::ZERO };
        let points = mesh.points.iter().zip(&finite).map(point).collect();
        let corners = indices.iter().map(|&i| u32::try_from(i).unwrap_or(0)).collect();
        Self { points, corners, faces }
    }

    /// Middle of the box around the points in use; the origin if there are none.
    pub(crate) fn center(&self) -> DVec3 {
        let used = self.faces.iter().flat_map(|f| &self.corners[f.range()]).map(|&c| self.points[c as usize]);
        let (min, max) = used.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(a, b), p| (a.min(p), b.max(p)));
        let center = (min + max) * 0.5;
        if center.is_finite() { center } else { DVec3::ZERO }
    }
}

/// Whether each face is a hole.
fn holes(mesh: &Mesh) -> Vec<bool> {
    let mut is_hole = vec![false; mesh.face_vertex_counts.len()];
    for hole in mesh.hole_indices.iter().filter_map(|&h| usize::try_from(h).ok()) {
        if let Some(flag) = is_hole.get_mut(hole) {
            *flag = true;
        }
    }
    is_hole
}
