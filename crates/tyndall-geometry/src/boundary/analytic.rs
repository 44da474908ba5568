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
        let (first, last) = if d > 0.0 { (min[axis], max[axis]) } else { (max[axis], min[axis]) };
        let (near, far) = ((first - o) * inverse, (last - o) * inverse);
        // One instruction each, which `f64::max` is not; NaN changes nothing either.
        enter = if near > enter { near } else { enter };
        exit = if far < exit { far } else { exit };
    }
    (enter < exit).then_some([enter, exit])
}

/// Parameters between which the line is inside the unit sphere, or nothing.
#[inline]
pub(super) fn sphere_interval(origin: DVec3, direction: DVec3) -> Option<[f64; 2]> {
    let [enter, exit] = sphere_roots(origin, direction);
    (enter < exit).then_some([enter, exit])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

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
