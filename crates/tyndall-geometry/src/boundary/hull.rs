//! Says of most rays that meet no boundary that they don't, by the box around all of them.
//!
//! The question is asked for every segment of every path, and of a medium in one corner of a scene the answer is mostly
//! no: a few operations must be enough. First the box of the *segment* is compared, which takes no division and sorts
//! out whatever ends or leads elsewhere; then the line itself. Both are conservative, never exact: what the boundaries
//! themselves find must not depend on them.

use crate::bvh::Bounds;
use glam::Vec3A;
use tyndall_math::Ray;

/// The box grows by this, relative to its largest coordinates: what rounding to f32 takes from it.
const GROWTH: f32 = 1e-6;

/// Distances are taken to be longer by this: at most eight roundings of half a unit in the last place, and then as many
/// again.
const LONGER: f32 = 1.0 + 1e-6;

/// A box around all boundaries.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hull(Bounds);

impl Hull {
    /// Around `boxes`, of which `None` is unbounded and those with nothing inside are empty.
    pub(super) fn new(boxes: &[Option<Bounds>]) -> Self {
        let all = Bounds { min: Vec3A::NEG_INFINITY, max: Vec3A::INFINITY };
        let union = |a: Bounds, b: &Option<Bounds>| a.union(b.as_ref().unwrap_or(&all));
        Self(boxes.iter().fold(Bounds::EMPTY, union).grown(GROWTH))
    }

    /// The ray that begins at `ray.origin + low` certainly ends before it gets to the box along some axis.
    ///
    /// The gap, a difference, and the way, a product, are off by their own roundings alone, however far away the box is.
    #[inline(always)]
    pub(super) fn is_out_of_reach(&self, ray: &Ray, low: Vec3A) -> bool {
        let [to_min, to_max] = self.gaps(ray, low);
        let way = ray.direction * (ray.t_max * LONGER);
        // An endless ray that stays where it is along an axis gives NaN there, and so the second operand.
        let (up, down) = (way.max(Vec3A::ZERO), way.min(Vec3A::ZERO));
        (to_min.cmpgt(up) | to_max.cmplt(down)).any()
    }

    /// The ray that begins at `ray.origin + low` certainly goes past the box (Kay & Kajiya 1986).
    #[inline]
    pub(super) fn is_passed_by(&self, ray: &Ray, low: Vec3A) -> bool {
        let [to_min, to_max] = self.gaps(ray, low);
        let begins_inside = !(to_min.cmpgt(Vec3A::ZERO) | to_max.cmplt(Vec3A::ZERO)).any();
        if begins_inside {
            return false;
        }
        let inverse = ray.direction.recip();
        let (a, b) = (to_min * inverse, to_max * inverse);
        let (near, far) = (a.min(b).max_element(), a.max(b).min_element());
        near > far.min(ray.t_max) * LONGER || far < 0.0
    }

    /// From the ray's origin to the faces. `low` counts twice: where once would be too little, because the rounding of
    /// the difference is as large, that is less than the second.
    #[inline(always)]
    fn gaps(&self, ray: &Ray, low: Vec3A) -> [Vec3A; 2] {
        let slack = low.abs() * 2.0;
        [self.0.min - ray.origin - slack, self.0.max - ray.origin + slack]
    }
}

#[cfg(test)]
mod tests {
    use super::super::analytic::box_interval;
    use super::*;
    use glam::Vec3;
    use proptest::prelude::*;

    /// Numbers that meet each other, and numbers of all magnitudes.
    fn coordinate() -> impl Strategy<Value = f32> {
        prop_oneof![
            prop::sample::select(vec![0.0f32, -0.0, 1.0, -1.0, 1.0 + f32::EPSILON, 1e6, -1e-6, 1e30]),
            -2f32..2.0,
            (-30f32..30.0, any::<bool>()).prop_map(|(e, up)| 10f32.powf(e) * if up { 1.0 } else { -1.0 }),
        ]
    }

    fn point() -> impl Strategy<Value = Vec3A> {
        prop::array::uniform3(coordinate()).prop_map(|p| Vec3::from_array(p).into())
    }

    fn end() -> impl Strategy<Value = f32> {
        prop_oneof![Just(f32::INFINITY), Just(f32::MAX), Just(0.0), coordinate().prop_map(f32::abs)]
    }

    fn hull(a: Vec3A, b: Vec3A) -> (Hull, Bounds) {
        let bounds = Bounds { min: a.min(b), max: a.max(b) };
        (Hull::new(&[Some(bounds)]), bounds)
    }

    /// Where the ray is in the box, in f64.
    fn meets(bounds: &Bounds, ray: &Ray, low: Vec3A) -> bool {
        let origin = ray.origin.as_dvec3() + low.as_dvec3();
        let (min, max) = (bounds.min.as_dvec3(), bounds.max.as_dvec3());
        box_interval(origin, ray.direction.as_dvec3(), min, max)
            .is_some_and(|[t0, t1]| t0.max(0.0) < t1.min(f64::from(ray.t_max)))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]

        #[test]
        fn what_meets_the_box_is_never_sorted_out(
            [a, b, origin, direction] in [point(), point(), point(), point()],
            t_max in end(),
            low in prop_oneof![Just(Vec3A::ZERO), point().prop_map(|p| p * 1e-7)],
        ) {
            let (hull, bounds) = hull(a, b);
            let ray = Ray { origin, direction, t_max };
            if meets(&bounds, &ray, low) {
                prop_assert!(!hull.is_out_of_reach(&ray, low) && !hull.is_passed_by(&ray, low));
            }
        }

        /// Rays at the box's corners, where rounding decides.
        #[test]
        fn nor_is_what_meets_a_corner(
            [a, b, from] in [point(), point(), point()],
            corner in prop::array::uniform3(any::<bool>()),
        ) {
            let (hull, bounds) = hull(a, b);
            let [x, y, z] = std::array::from_fn(|i| if corner[i] { bounds.max[i] } else { bounds.min[i] });
            let ray = Ray::new(from, Vec3A::new(x, y, z) - from);
            for ray in [ray, ray.up_to(1.0)] {
                if ray.direction.is_finite() && meets(&bounds, &ray, Vec3A::ZERO) {
                    prop_assert!(!hull.is_out_of_reach(&ray, Vec3A::ZERO) && !hull.is_passed_by(&ray, Vec3A::ZERO));
                }
            }
        }
    }

    #[test]
    fn what_leads_elsewhere_is() {
        let (hull, _) = hull(Vec3A::splat(2.0), Vec3A::splat(3.0));
        let reaches = |direction, t_max| {
            let ray = Ray { origin: Vec3A::ZERO, direction, t_max };
            (!hull.is_out_of_reach(&ray, Vec3A::ZERO), !hull.is_passed_by(&ray, Vec3A::ZERO))
        };
        assert_eq!(reaches(Vec3A::ONE, f32::INFINITY), (true, true));
        assert_eq!(reaches(Vec3A::ONE, 1.9), (false, false));
        assert_eq!(reaches(Vec3A::new(1.0, 1.0, -1.0), f32::INFINITY), (false, false));
        // Past it, in the same octant.
        assert_eq!(reaches(Vec3A::new(1.0, 1.0, 0.1), f32::INFINITY), (true, false));
        assert_eq!(reaches(Vec3A::new(1.0, 1.0, 0.0), f32::INFINITY), (false, false));
    }

    #[test]
    fn all_of_space_and_nothing_at_all() {
        let ray = Ray::new(Vec3A::splat(1e30), Vec3A::X);
        let everywhere = Hull::new(&[Some(Bounds::EMPTY), None]);
        assert!(
            !everywhere.is_out_of_reach(&ray, Vec3A::ZERO) && !everywhere.is_passed_by(&ray, Vec3A::ZERO)
        );
    }
}
