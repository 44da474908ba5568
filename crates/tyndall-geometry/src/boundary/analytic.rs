//! Intervals of lines inside boxes and spheres, in f64.

use crate::blas::sphere_roots;
use glam::DVec3;

/// Parameters between which the line is inside the half-open box [min, max), or nothing.
///
/// A direction component of zero is inside or outside on its axis as a whole: a ray in the plane of a face is inside
/// the box whose lower face it is, and outside the one whose upper face it is.
#[inline]
pub(super) fn box_interval(origin: DVec3, direction: DVec3, min: DVec3, max: DVec3) -> Option<[f64; 2]> {
    let (mut enter, mut exit) = (f64::NEG_INFINITY, f64::INFINITY);
    for axis in 0..3 {
        let (o, d) = (origin[axis], direction[axis]);
        if d == 0.0 {
            if !(min[axis] <= o && o < max[axis]) {
                return None;
            }
            continue;
        }
        let inverse = 1.0 / d;
        let (a, b) = ((min[axis] - o) * inverse, (max[axis] - o) * inverse);
        enter = enter.max(a.min(b));
        exit = exit.min(a.max(b));
    }
    (enter < exit).then_some([enter, exit])
}

/// Parameters between which the line is inside the unit sphere, or nothing.
#[inline]
pub(super) fn sphere_interval(origin: DVec3, direction: DVec3) -> Option<[f64; 2]> {
    let [enter, exit] = sphere_roots(origin, direction);
    (enter < exit).then_some([enter, exit])
}

/// The part of [t0, t1] in [0, t_max] as f32, widened to the next f32 if it would vanish in rounding only.
#[inline]
pub(super) fn round_outward(t0: f64, t1: f64, t_max: f32) -> Option<[f32; 2]> {
    let is_interval = t0 < t1;
    let (t0, t1) = (t0.max(0.0), t1.min(f64::from(t_max)));
    if !is_interval || t0 >= t1 {
        return None;
    }
    let (near, far) = (t0 as f32, t1 as f32);
    if near < far {
        return Some([near, far]);
    }
    // The interval lies between two neighbouring f32: take those around it, of which `t_max` may be the upper.
    let near = if f64::from(near) > t0 || near >= t_max { near.next_down() } else { near };
    Some([near, near.next_up()])
}

/// Length of the part of [t0, t1] in [0, t_max], divided by that of [near, far], what [`round_outward`] made of it.
#[inline]
pub(super) fn share(t0: f64, t1: f64, near: f32, far: f32, t_max: f32) -> f32 {
    if far == f32::INFINITY {
        return 1.0;
    }
    let exact = t1.min(f64::from(t_max)) - t0.max(0.0);
    (exact / (f64::from(far) - f64::from(near))) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn rounding_never_loses_or_exceeds() {
        for (t0, t1, t_max) in [(1.0, 1.0 + 1e-9, 5.0), (1.0 - 1e-12, 1.0, 1.0), (1e6, 1e6 + 1e-7, 1e7)] {
            let [near, far] = round_outward(t0, t1, t_max).unwrap();
            assert!(near < far && far <= t_max && near >= 0.0, "{near} {far}");
            assert!(far - near <= near * 2.4e-7);
            let length = f64::from(share(t0, t1, near, far, t_max)) * (f64::from(far) - f64::from(near));
            assert!((length / (t1 - t0) - 1.0).abs() < 1e-6, "{length} for {}", t1 - t0);
        }
        assert_eq!(round_outward(2.0, 2.0, 9.0), None);
        assert_eq!(round_outward(-2.0, 0.0, 9.0), None);
        assert_eq!(round_outward(-1.0, f64::INFINITY, f32::INFINITY), Some([0.0, f32::INFINITY]));
        assert_eq!(round_outward(f64::NAN, f64::NAN, 1.0), None);
    }

    proptest! {
        #[test]
        fn points_in_the_interval_are_in_the_box(o in prop::array::uniform3(-4f64..4.0), d in prop::array::uniform3(-1f64..1.0)) {
            let (o, d) = (DVec3::from_array(o), DVec3::from_array(d));
            prop_assume!(d.length() > 1e-3);
            let interval = box_interval(o, d, DVec3::NEG_ONE, DVec3::ONE);
            for i in -200..=200 {
                let t = f64::from(i) * 0.1;
                let p = (o + d * t).abs().max_element();
                let inside = interval.is_some_and(|[a, b]| a <= t && t <= b);
                prop_assert!((p - 1.0).abs() < 1e-12 || inside == (p < 1.0));
            }
        }
    }
}
