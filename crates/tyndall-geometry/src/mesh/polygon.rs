//! Polygons into triangles: a fan where it is right, ear clipping where it must be.

use glam::{DVec2, DVec3};

/// Cuts polygons; keeps its memory between them.
#[derive(Default)]
pub(super) struct Triangulator {
    points: Vec<DVec3>,
    plane: Vec<[f64; 2]>,
    triangles: Vec<u32>,
    earcut: earcut::Earcut<f64>,
}

impl Triangulator {
    /// Calls `emit` with the corner numbers of each triangle, wound as the polygon. A polygon of n corners gives n - 2
    /// triangles, fewer if corners coincide.
    pub(super) fn triangulate(
        &mut self,
        points: impl Iterator<Item = DVec3>,
        mut emit: impl FnMut([u32; 3]),
    ) {
        self.points.clear();
        self.points.extend(points);
        match self.points.len() {
            0..=2 => {}
            3 => emit([0, 1, 2]),
            4 => self.quad(&mut emit),
            _ => self.polygon(&mut emit),
        }
    }

    /// Newell's normal: that of the best plane, also of concave and warped polygons; its length is twice the area.
    fn normal(&self) -> DVec3 {
        let p = &self.points;
        let origin = p[0];
        let edges = p.iter().zip(p.iter().cycle().skip(1));
        edges.map(|(a, b)| (*a - origin).cross(*b - origin)).sum()
    }

    /// The diagonal both of whose triangles face the polygon's way; of two such the shorter one, on a tie 0-2.
    fn quad(&self, emit: &mut impl FnMut([u32; 3])) {
        let p = &self.points;
        let normal = self.normal();
        let faces = |t: [u32; 3]| {
            let [a, b, c] = t.map(|i| p[i as usize]);
            (b - a).cross(c - a).dot(normal)
        };
        let (first, second) = ([[0, 1, 2], [0, 2, 3]], [[1, 2, 3], [1, 3, 0]]);
        let worst = |pair: [[u32; 3]; 2]| faces(pair[0]).min(faces(pair[1]));
        let take_second = match (worst(first) > 0.0, worst(second) > 0.0) {
            (true, true) => p[1].distance_squared(p[3]) < p[0].distance_squared(p[2]),
            (false, true) => true,
            (true, false) => false,
            (false, false) => worst(second) > worst(first),
        };
        (if take_second { second } else { first }).into_iter().for_each(emit);
    }

    fn polygon(&mut self, emit: &mut impl FnMut([u32; 3])) {
        let normal = self.normal();
        let n = self.points.len() as u32;
        if self.is_convex(normal) || normal == DVec3::ZERO {
            (1..n - 1).for_each(|i| emit([0, i, i + 1]));
            return;
        }
        self.project(normal);
        self.earcut.earcut(self.plane.iter().copied(), &[], &mut self.triangles);
        let (plane, triangles) = (&self.plane, &self.triangles);
        for t in triangles.chunks_exact(3) {
            // `plane` is counter-clockwise; the library doesn't promise which way its triangles run.
            let [a, b, c] = [t[0], t[1], t[2]].map(|i| DVec2::from(plane[i as usize]));
            let is_clockwise = (b - a).perp_dot(c - a) < 0.0;
            emit(if is_clockwise { [t[0], t[2], t[1]] } else { [t[0], t[1], t[2]] });
        }
    }

    /// Whether the polygon turns the same way at every corner and goes around once.
    fn is_convex(&self, normal: DVec3) -> bool {
        let n = self.points.len();
        let p = |i: usize| self.points[i % n];
        let turns = (0..n).all(|i| (p(i + 1) - p(i)).cross(p(i + 2) - p(i + 1)).dot(normal) > 0.0);
        turns && (1..n - 1).all(|i| (p(i) - p(0)).cross(p(i + 1) - p(0)).dot(normal) > 0.0)
    }

    /// Drops the axis along which the normal is longest, keeping the polygon counter-clockwise.
    fn project(&mut self, normal: DVec3) {
        let size = normal.abs();
        let origin = self.points[0];
        let axes = match size.max_element() {
            m if m == size.x => {
                if normal.x > 0.0 {
                    (1, 2)
                } else {
                    (2, 1)
                }
            }
            m if m == size.y => {
                if normal.y > 0.0 {
                    (2, 0)
                } else {
                    (0, 2)
                }
            }
            _ => {
                if normal.z > 0.0 {
                    (0, 1)
                } else {
                    (1, 0)
                }
            }
        };
        self.plane.clear();
        self.plane.extend(self.points.iter().map(|p| [(*p - origin)[axes.0], (*p - origin)[axes.1]]));
    }
}
