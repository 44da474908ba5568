//! Four children of a node side by side, and what they may send to a receiver.
//!
//! Importance follows Conty Estevez & Kulla 2018, section 5.1: intensity times a bound of the cosine at the light over
//! the squared distance to the middle of the box. With theta the angle between the cone's axis and the receiver, and
//! theta_u the angle that the box fills, the light's cosine is that of max(theta - theta_o - theta_u, 0). Angles are
//! handled by their sines and cosines (Pharr, Jakob & Humphreys 2023, section 12.6.3): no lane needs trigonometry.

use crate::light::bounds::LightBounds;
use crate::light::receiver::segment_length;
use glam::{BVec4A, Vec3A, Vec4};
use std::f32::consts::{FRAC_PI_2, PI};
use std::f64::consts::FRAC_PI_2 as QUARTER_TURN;

/// Children side by side.
pub(super) const LANES: usize = 4;

/// Boxes grow by this much of their coordinates: what rounding in f32 moves lights and receivers by.
const GROWTH: f32 = 2.5e-7;

/// Cosines may be off by this much before a child counts as certainly dark.
const SLACK: f32 = 2e-6;

/// Largest importance of one child, so that the sum over a node is finite.
const MAX_IMPORTANCE: f32 = 1e37;

/// Four children. Absent ones have a `count` of 0.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lanes {
    center: Vectors,
    half: Vectors,
    axis: Vectors,
    /// How far the box reaches along the axis from its middle; infinite if light may leave against the axis.
    reach: Vec4,
    cos_o: Vec4,
    sin_o: Vec4,
    cos_e: Vec4,
    /// Relative to the brightest child of the node: only ratios matter, and they fit an f32.
    intensity: Vec4,
    /// Number of lights.
    count: Vec4,
    /// Where the children are: read by the tree alone.
    pub(super) child: [u32; LANES],
}

/// What four children may send: weights for the choice among them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Weights {
    /// Expected irradiance, in units of the node's brightest child; may round to 0.
    pub(super) importance: Vec4,
    /// Number of lights; 0 where certainly nothing arrives.
    pub(super) count: Vec4,
}

/// Four vectors.
#[derive(Debug, Clone, Copy)]
struct Vectors {
    x: Vec4,
    y: Vec4,
    z: Vec4,
}

/// A point, and the surface it lies on.
#[derive(Debug, Clone, Copy)]
pub(in crate::light) struct PointTarget {
    pub(super) position: Vec3A,
    pub(super) normal: Vec3A,
    pub(super) both_sides: bool,
}

/// A part of a ray.
#[derive(Debug, Clone, Copy)]
pub(in crate::light) struct SegmentTarget {
    start: Vec3A,
    direction: Vec3A,
    length: f32,
}

impl SegmentTarget {
    pub(super) fn new(origin: Vec3A, direction: Vec3A, t0: f32, t1: f32) -> Self {
        Self { start: origin + direction * t0, direction, length: segment_length(t0, t1) }
    }
}

impl Lanes {
    pub(super) const EMPTY: Self = Self {
        center: Vectors::ZERO,
        half: Vectors::ZERO,
        axis: Vectors::ZERO,
        reach: Vec4::ZERO,
        cos_o: Vec4::ZERO,
        sin_o: Vec4::ZERO,
        cos_e: Vec4::ZERO,
        intensity: Vec4::ZERO,
        count: Vec4::ZERO,
        child: [0; LANES],
    };

    /// Puts a child of `count` lights in `lane`; `unit` is the intensity of the node's brightest child.
    pub(super) fn set(&mut self, lane: usize, bounds: &LightBounds, count: usize, unit: f64) {
        let center = bounds.center();
        let half = (bounds.max - center).max(center - bounds.min);
        let half = half + (center.abs() + half) * GROWTH;
        let axis = bounds.cone.axis.as_vec3a();
        let (theta_o, theta_e) = (bounds.cone.theta_o, bounds.cone.theta_e);
        let is_one_sided = theta_o + theta_e <= QUARTER_TURN + 1e-9;
        self.center.set(lane, center);
        self.half.set(lane, half);
        self.axis.set(lane, axis);
        self.reach[lane] = if is_one_sided { axis.abs().dot(half) } else { f32::INFINITY };
        self.cos_o[lane] = theta_o.cos() as f32;
        self.sin_o[lane] = theta_o.sin() as f32;
        self.cos_e[lane] = theta_e.cos() as f32;
        self.intensity[lane] = if unit > 0.0 { (bounds.intensity / unit) as f32 } else { 0.0 };
        self.count[lane] = count as f32;
    }

    /// The bounds of a child as they are stored, for tests.
    #[cfg(test)]
    pub(super) fn stored(&self, lane: usize) -> Stored {
        Stored {
            center: self.center.get(lane),
            half: self.half.get(lane),
            axis: self.axis.get(lane),
            theta_o: f64::from(self.sin_o[lane]).atan2(self.cos_o[lane].into()),
            theta_e: f64::from(self.cos_e[lane]).acos(),
            intensity: self.intensity[lane].into(),
            count: self.count[lane] as usize,
        }
    }

    /// What arrives at a point. Without `ORIENTED` all cones are the whole sphere, without `SURFACE` there is no
    /// normal, and the compiler leaves both out.
    #[inline(always)]
    pub(super) fn at_point<const ORIENTED: bool, const SURFACE: bool>(
        &self,
        target: &PointTarget,
    ) -> Weights {
        let from_light = Vectors::splat(target.position).minus(&self.center);
        let near = Nearness::new(from_light.length2(), self.half.length2());
        let inverse_distance = near.inverse_distance2.sqrt();
        let mut importance = self.intensity * near.inverse_distance2;
        let mut is_lit = self.count.cmpgt(Vec4::ZERO);
        if ORIENTED {
            let along = from_light.dot(&self.axis);
            let light = self.light_side(along * inverse_distance, &near);
            let is_in_front = !(along + self.reach + near.distance2.sqrt() * SLACK).cmplt(Vec4::ZERO);
            is_lit &= light.is_lit & is_in_front;
            importance *= light.cosine;
        }
        if SURFACE {
            let normal = Vectors::splat(target.normal);
            let height = -from_light.dot(&normal);
            let cosine = height * inverse_distance;
            let cosine = if target.both_sides { cosine.abs() } else { cosine };
            importance *= narrowed(cosine, &near).max(Vec4::ZERO);
            if !target.both_sides {
                let highest = height + self.half.dot(&normal.abs());
                is_lit &= !(highest + near.distance2.sqrt() * SLACK).cmplt(Vec4::ZERO);
            }
        }
        self.weights(importance, is_lit)
    }

    /// The mean along a segment of what arrives there. In place of the inverse squared distance stands its mean,
    /// (theta_b - theta_a) / (D length): D is the distance of the line, theta the angles of equi-angular sampling.
    /// Cosines are the largest along the segment (section 6 of the paper).
    #[inline(always)]
    pub(super) fn along_segment<const ORIENTED: bool>(&self, target: &SegmentTarget) -> Weights {
        let direction = Vectors::splat(target.direction);
        let length = Vec4::splat(target.length);
        let to_light = self.center.minus(&Vectors::splat(target.start));
        let foot = to_light.dot(&direction);
        let across = to_light.minus(&direction.times(foot));
        let line_distance2 = across.length2();
        let beside = foot.max(Vec4::ZERO).min(length) - foot;
        let near = Nearness::new(line_distance2 + beside * beside, self.half.length2());
        let clamped = line_distance2.max(near.radius2).max(Vec4::splat(f32::MIN_POSITIVE));
        let mut importance =
            self.intensity * angle_ratio(clamped.sqrt() * length, clamped - foot * (length - foot));
        let mut is_lit = self.count.cmpgt(Vec4::ZERO);
        if ORIENTED {
            let slope = self.axis.dot(&direction);
            let height = -across.dot(&self.axis);
            // The cosine at s along the line from the foot; on a great circle it has one maximum, which lies on the
            // segment only if the circle passes in front of the axis.
            let cosine_at = |s: Vec4| {
                let distance2 = (line_distance2 + s * s).max(Vec4::splat(f32::MIN_POSITIVE));
                (height + slope * s) / distance2.sqrt()
            };
            let (a, b) = (-foot, length - foot);
            let best = (line_distance2 * slope / height.max(Vec4::splat(f32::MIN_POSITIVE))).max(a).min(b);
            let cosine = cosine_at(a).max(cosine_at(b)).max(cosine_at(best));
            let light = self.light_side(cosine, &near);
            let highest = height + (slope * a).max(slope * b);
            let size = line_distance2.sqrt() + a.abs().max(b.abs());
            is_lit &= light.is_lit & !(highest + self.reach + size * SLACK).cmplt(Vec4::ZERO);
            importance *= light.cosine;
        }
        self.weights(importance, is_lit)
    }

    /// The light's side: the cosine bound for a receiver at `cosine` from the axis.
    #[inline(always)]
    fn light_side(&self, cosine: Vec4, near: &Nearness) -> LightSide {
        let cosine = cosine.clamp(Vec4::NEG_ONE, Vec4::ONE);
        let sine = (Vec4::ONE - cosine * cosine).sqrt();
        let is_in_cone = cosine.cmpge(self.cos_o);
        let cos_beyond = Vec4::select(is_in_cone, Vec4::ONE, cosine * self.cos_o + sine * self.sin_o);
        let sin_beyond = Vec4::select(is_in_cone, Vec4::ZERO, sine * self.cos_o - cosine * self.sin_o);
        let is_covered = near.is_inside | cos_beyond.cmpge(near.cos_u);
        let cosine = Vec4::select(is_covered, Vec4::ONE, cos_beyond * near.cos_u + sin_beyond * near.sin_u);
        // Not "at least": what is not a number stays possible.
        let is_lit = !cosine.cmplt(self.cos_e - SLACK);
        LightSide { cosine: cosine.max(Vec4::ZERO), is_lit }
    }

    #[inline(always)]
    fn weights(&self, importance: Vec4, is_lit: BVec4A) -> Weights {
        let is_number = importance.cmpge(Vec4::ZERO);
        let importance = Vec4::select(is_number & is_lit, importance, Vec4::ZERO);
        Weights {
            importance: importance.min(Vec4::splat(MAX_IMPORTANCE)),
            count: Vec4::select(is_lit, self.count, Vec4::ZERO),
        }
    }
}

/// The bounds of one child.
#[cfg(test)]
#[derive(Debug, Clone, Copy)]
pub(super) struct Stored {
    pub(super) center: glam::DVec3,
    pub(super) half: glam::DVec3,
    pub(super) axis: glam::DVec3,
    pub(super) theta_o: f64,
    pub(super) theta_e: f64,
    pub(super) intensity: f64,
    pub(super) count: usize,
}

/// What a light's orientation leaves of it.
struct LightSide {
    cosine: Vec4,
    is_lit: BVec4A,
}

/// The distance of a box and the angle theta_u that the sphere around it fills.
struct Nearness {
    distance2: Vec4,
    radius2: Vec4,
    /// The distance is never taken as smaller than half the diagonal.
    inverse_distance2: Vec4,
    is_inside: BVec4A,
    cos_u: Vec4,
    sin_u: Vec4,
}

impl Nearness {
    #[inline(always)]
    fn new(distance2: Vec4, radius2: Vec4) -> Self {
        let inverse_distance2 = distance2.max(radius2).max(Vec4::splat(f32::MIN_POSITIVE)).recip();
        let sin2_u = (radius2 * inverse_distance2).min(Vec4::ONE);
        Self {
            distance2,
            radius2,
            inverse_distance2,
            is_inside: distance2.cmple(radius2),
            cos_u: (Vec4::ONE - sin2_u).sqrt(),
            sin_u: sin2_u.sqrt(),
        }
    }
}

/// The cosine of an angle made smaller by theta_u.
#[inline(always)]
fn narrowed(cosine: Vec4, near: &Nearness) -> Vec4 {
    let cosine = cosine.clamp(Vec4::NEG_ONE, Vec4::ONE);
    let sine = (Vec4::ONE - cosine * cosine).sqrt();
    let is_covered = near.is_inside | cosine.cmpge(near.cos_u);
    Vec4::select(is_covered, Vec4::ONE, cosine * near.cos_u + sine * near.sin_u)
}

/// atan2(y, x) / y for y >= 0, also where y vanishes; to 1e-5 (Abramowitz & Stegun, formula 4.4.49).
#[inline(always)]
fn angle_ratio(y: Vec4, x: Vec4) -> Vec4 {
    let size = x.abs();
    let larger = y.max(size).max(Vec4::splat(f32::MIN_POSITIVE));
    let z = y.min(size) / larger;
    let z2 = z * z;
    let series = z2 * (z2 * (z2 * (z2 * 0.0208351 - 0.085133) + 0.180141) - 0.3302995) + 0.999866;
    let is_steep = y.cmpgt(size);
    let is_behind = x.cmplt(Vec4::ZERO);
    let turned =
        Vec4::select(is_steep, Vec4::splat(FRAC_PI_2), Vec4::select(is_behind, Vec4::splat(PI), Vec4::ZERO));
    let is_subtracted = is_steep ^ is_behind;
    let angle = turned + Vec4::select(is_subtracted, -z * series, z * series);
    Vec4::select(!is_steep & !is_behind, series / larger, angle / y.max(Vec4::splat(f32::MIN_POSITIVE)))
}

impl Vectors {
    const ZERO: Self = Self { x: Vec4::ZERO, y: Vec4::ZERO, z: Vec4::ZERO };

    #[inline(always)]
    fn splat(v: Vec3A) -> Self {
        Self { x: Vec4::splat(v.x), y: Vec4::splat(v.y), z: Vec4::splat(v.z) }
    }

    fn set(&mut self, lane: usize, v: Vec3A) {
        (self.x[lane], self.y[lane], self.z[lane]) = (v.x, v.y, v.z);
    }

    #[cfg(test)]
    fn get(&self, lane: usize) -> glam::DVec3 {
        glam::Vec3::new(self.x[lane], self.y[lane], self.z[lane]).as_dvec3()
    }

    #[inline(always)]
    fn minus(&self, other: &Self) -> Self {
        Self { x: self.x - other.x, y: self.y - other.y, z: self.z - other.z }
    }

    #[inline(always)]
    fn times(&self, factor: Vec4) -> Self {
        Self { x: self.x * factor, y: self.y * factor, z: self.z * factor }
    }

    #[inline(always)]
    fn dot(&self, other: &Self) -> Vec4 {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    #[inline(always)]
    fn length2(&self) -> Vec4 {
        self.dot(self)
    }

    #[inline(always)]
    fn abs(&self) -> Self {
        Self { x: self.x.abs(), y: self.y.abs(), z: self.z.abs() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angle_ratios_are_arc_tangents() {
        for y in [1e-30f32, 1e-3, 0.3, 1.0, 2.5, 1e6] {
            for x in [-1e6f32, -3.0, -1.0, -0.2, 0.2, 1.0, 4.0, 1e6] {
                let exact = f64::from(y).atan2(f64::from(x)) / f64::from(y);
                let got = f64::from(angle_ratio(Vec4::splat(y), Vec4::splat(x)).x);
                assert!((got / exact - 1.0).abs() < 1e-3, "{y} {x}: {got} {exact}");
            }
        }
    }
}
