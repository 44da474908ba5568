//! Distances to random points, one in every cell of a lattice (Worley 1996).

use super::hash::pcg3d;
use super::lerp;
use glam::Vec3A;

/// What is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Feature {
    /// The nearest point.
    #[default]
    F1,
    /// The second nearest.
    F2,
    /// The nearest, without edges between cells.
    SmoothF1,
    /// How far the edge of the cell is.
    DistanceToEdge,
}

/// How distances are measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Metric {
    #[default]
    Euclidean,
    Manhattan,
    Chebychev,
    Minkowski,
}

/// The texture.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Voronoi {
    pub(crate) feature: Feature,
    pub(crate) metric: Metric,
    /// Of Minkowski's metric.
    pub(crate) exponent: f32,
    /// Octaves after the first.
    pub(crate) detail: f32,
    pub(crate) roughness: f32,
    pub(crate) lacunarity: f32,
    /// Of [`Feature::SmoothF1`], in [0, 1].
    pub(crate) smoothness: f32,
    /// How far points leave the corner of their cell, in [0, 1].
    pub(crate) randomness: f32,
    /// Whether distances are brought to [0, 1].
    pub(crate) is_normalized: bool,
}

/// What was found.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Found {
    pub(crate) distance: f32,
    /// Random, one a cell.
    pub(crate) color: Vec3A,
    /// Of the point.
    pub(crate) position: Vec3A,
}

impl Found {
    fn lerp(self, other: Self, t: f32) -> Self {
        Self {
            distance: lerp(self.distance, other.distance, t),
            color: self.color.lerp(other.color, t),
            position: self.position.lerp(other.position, t),
        }
    }
}

/// A point, and the cell's random numbers.
struct Cell {
    point: Vec3A,
    random: Vec3A,
}

impl Voronoi {
    /// The texture at `p`.
    pub(crate) fn at(&self, p: Vec3A) -> Found {
        if !p.is_finite() {
            return Found::default();
        }
        let clean = Self {
            detail: self.detail.clamp(0.0, super::Octaves::MOST),
            roughness: self.roughness.clamp(0.0, 1.0),
            smoothness: (self.smoothness / 2.0).clamp(0.0, 0.5),
            randomness: self.randomness.clamp(0.0, 1.0),
            ..*self
        };
        if self.feature == Feature::DistanceToEdge {
            return Found { distance: clean.fractal_edge(p), ..Default::default() };
        }
        clean.fractal(p)
    }

    fn has_octaves(&self) -> bool {
        self.detail != 0.0 && self.roughness != 0.0
    }

    /// Weight of octave `i`: the last one counts in part.
    fn share(&self, octave: u32) -> f32 {
        if octave as f32 <= self.detail { 1.0 } else { self.detail.fract() }
    }

    fn fractal(&self, p: Vec3A) -> Found {
        let half = 0.5 + 0.5 * self.randomness;
        let most = self.length(Vec3A::splat(half)) * if self.feature == Feature::F2 { 2.0 } else { 1.0 };
        let (mut sum, mut total) = (self.one(p), 1.0);
        if self.has_octaves() {
            (sum, total) = (Found::default(), 0.0);
            let (mut scale, mut amplitude) = (1.0, 1.0);
            for octave in 0..=self.detail.ceil() as u32 {
                let share = self.share(octave);
                let found = self.one(p * scale);
                total += share * amplitude;
                sum.distance += share * amplitude * found.distance;
                sum.color += share * amplitude * found.color;
                sum.position = sum.position.lerp(found.position / scale, share * amplitude);
                scale *= self.lacunarity;
                amplitude *= self.roughness;
            }
        }
        if self.is_normalized {
            sum.distance /= total * most;
            sum.color /= total;
        }
        sum
    }

    fn fractal_edge(&self, p: Vec3A) -> f32 {
        let most = 0.5 + 0.5 * self.randomness;
        let (mut distance, mut total) = (self.edge(p), most);
        if self.has_octaves() {
            distance = 8.0;
            let (mut scale, mut amplitude) = (1.0, 1.0);
            for octave in 0..=self.detail.ceil() as u32 {
                let share = self.share(octave);
                let nearer = lerp(distance, distance.min(self.edge(p * scale) / scale), amplitude);
                total = lerp(total, lerp(total, most / scale, amplitude), share);
                distance = lerp(distance, distance.min(nearer), share);
                scale *= self.lacunarity;
                amplitude *= self.roughness;
            }
        }
        if self.is_normalized { distance / total } else { distance }
    }

    fn one(&self, p: Vec3A) -> Found {
        match self.feature {
            Feature::F2 => self.second(p),
            Feature::SmoothF1 if self.smoothness > 0.0 => self.smooth(p),
            _ => self.nearest(p),
        }
    }

    fn length(&self, v: Vec3A) -> f32 {
        let v = v.abs();
        match self.metric {
            Metric::Euclidean => v.length(),
            Metric::Manhattan => v.element_sum(),
            Metric::Chebychev => v.max_element(),
            Metric::Minkowski => {
                let sum: f32 = v.to_array().iter().map(|x| x.powf(self.exponent)).sum();
                sum.powf(1.0 / self.exponent)
            }
        }
    }

    /// Calls `visit` with the points of the cells around `p`, relative to that of `p`.
    #[inline]
    fn around(&self, p: Vec3A, reach: i32, mut visit: impl FnMut(Cell)) {
        let corner = p.floor().as_ivec3();
        for z in -reach..=reach {
            for y in -reach..=reach {
                for x in -reach..=reach {
                    let key = [corner.x.wrapping_add(x), corner.y.wrapping_add(y), corner.z.wrapping_add(z)];
                    let random = Vec3A::from_array(pcg3d(key));
                    let point = Vec3A::new(x as f32, y as f32, z as f32) + random * self.randomness;
                    visit(Cell { point, random });
                }
            }
        }
    }

    fn nearest(&self, p: Vec3A) -> Found {
        let local = p - p.floor();
        let mut found = Found { distance: f32::MAX, ..Default::default() };
        self.around(p, 1, |Cell { point, random }| {
            let distance = self.length(point - local);
            if distance < found.distance {
                found = Found { distance, color: random, position: point };
            }
        });
        Found { position: found.position + p.floor(), ..found }
    }

    fn second(&self, p: Vec3A) -> Found {
        let local = p - p.floor();
        let far = Found { distance: f32::MAX, ..Default::default() };
        let (mut first, mut second) = (far, far);
        self.around(p, 1, |Cell { point, random }| {
            let found = Found { distance: self.length(point - local), color: random, position: point };
            if found.distance < first.distance {
                (first, second) = (found, first);
            } else if found.distance < second.distance {
                second = found;
            }
        });
        Found { position: second.position + p.floor(), ..second }
    }

    /// A minimum that changes over within the smoothness.
    fn smooth(&self, p: Vec3A) -> Found {
        let local = p - p.floor();
        let mut found = Found::default();
        let mut is_first = true;
        self.around(p, 2, |Cell { point, random }| {
            let cell = Found { distance: self.length(point - local), color: random, position: point };
            let mut share = 1.0;
            if !std::mem::take(&mut is_first) {
                let t = (0.5 + 0.5 * (found.distance - cell.distance) / self.smoothness).clamp(0.0, 1.0);
                share = t * t * (3.0 - 2.0 * t);
            }
            let below = self.smoothness * share * (1.0 - share);
            found = found.lerp(cell, share);
            found.distance -= below;
            let below = below / (1.0 + 3.0 * self.smoothness);
            found.color -= below;
            found.position -= below;
        });
        Found { position: found.position + p.floor(), ..found }
    }

    /// Distance from the plane between the two nearest points.
    fn edge(&self, p: Vec3A) -> f32 {
        /// Squared distance of points that are the same.
        const SAME: f32 = 1e-4;
        let local = p - p.floor();
        let (mut to_nearest, mut least) = (Vec3A::ZERO, f32::MAX);
        self.around(p, 1, |cell| {
            let way = cell.point - local;
            if way.length_squared() < least {
                (to_nearest, least) = (way, way.length_squared());
            }
        });
        let mut distance = f32::MAX;
        self.around(p, 1, |cell| {
            let way = cell.point - local;
            let across = way - to_nearest;
            if across.length_squared() > SAME {
                distance = distance.min((to_nearest + way).dot(across.normalize()) * 0.5);
            }
        });
        distance
    }
}
