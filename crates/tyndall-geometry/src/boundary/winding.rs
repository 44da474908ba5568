//! Counting crossings.

use crate::accel::Crossing;

/// Calls `emit(instance, t0, t1)` for the intervals in which the ray is inside, ordered by (instance, t0).
///
/// `crossings` must hold *all* crossings ahead of the origin of an unbounded ray, of any number of instances in any
/// order; they are sorted here. The winding is 0 at infinity and inside is where it is positive, so the winding at
/// the origin is the number of exits less the number of entries. Surfaces wound inward contain nothing.
pub fn inside_intervals(crossings: &mut [Crossing], mut emit: impl FnMut(u32, f32, f32)) {
    // At equal distances entries come first, so that regions which touch give one interval.
    crossings.sort_unstable_by(|a, b| {
        let key = |c: &Crossing| (c.instance, c.t.max(0.0).to_bits(), !c.entering, c.primitive);
        key(a).cmp(&key(b))
    });
    for of_instance in crossings.chunk_by(|a, b| a.instance == b.instance) {
        let instance = of_instance[0].instance;
        let step = |c: &Crossing| if c.entering { 1i64 } else { -1 };
        let mut winding: i64 = -of_instance.iter().map(step).sum::<i64>();
        let mut start = 0.0;
        for crossing in of_instance {
            let after = winding + step(crossing);
            if winding <= 0 && after > 0 {
                start = crossing.t;
            } else if winding > 0 && after <= 0 && start < crossing.t {
                emit(instance, start, crossing.t);
            }
            winding = after;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn intervals(list: &[(f32, u32, bool)]) -> Vec<(u32, f32, f32)> {
        let crossing = |&(t, instance, entering)| Crossing { t, instance, entering, primitive: 0 };
        let mut crossings: Vec<Crossing> = list.iter().map(crossing).collect();
        let mut out = Vec::new();
        inside_intervals(&mut crossings, |i, a, b| out.push((i, a, b)));
        out
    }

    #[test]
    fn from_outside_and_from_inside() {
        assert_eq!(intervals(&[(3.0, 0, false), (1.0, 0, true)]), [(0, 1.0, 3.0)]);
        assert_eq!(intervals(&[(3.0, 0, false)]), [(0, 0.0, 3.0)]);
        assert_eq!(intervals(&[]), []);
    }

    #[test]
    fn nested_coincident_and_touching() {
        let nested = [(1.0, 0, true), (2.0, 0, true), (3.0, 0, false), (4.0, 0, false)];
        assert_eq!(intervals(&nested), [(0, 1.0, 4.0)]);
        let coincident = [(1.0, 0, true), (1.0, 0, true), (2.0, 0, false), (2.0, 0, false)];
        assert_eq!(intervals(&coincident), [(0, 1.0, 2.0)]);
        let touching = [(1.0, 0, true), (2.0, 0, false), (2.0, 0, true), (3.0, 0, false)];
        assert_eq!(intervals(&touching), [(0, 1.0, 3.0)]);
        let two = [(1.0, 7, true), (1.0, 2, true), (2.0, 2, false), (3.0, 7, false)];
        assert_eq!(intervals(&two), [(2, 1.0, 2.0), (7, 1.0, 3.0)]);
    }

    #[test]
    fn holes_never_extend_to_infinity() {
        // An entry without an exit: negative winding before it, nothing after it.
        assert_eq!(intervals(&[(1.0, 0, true)]), []);
        assert_eq!(intervals(&[(1.0, 0, true), (2.0, 0, false), (3.0, 0, true)]), []);
    }
}
