//! Fog before a wall, both at known depths, seen from another place.

use super::*;
use crate::{ClassCosts, Strategy};
use glam::{DAffine3, DQuat, DVec3};

const SIZE: [usize; 2] = [40, 20];
/// Sees 4 x 2 units at depth 4: pixels there have a side of 0.1.
const VIEW: View = View {
    world_from_camera: DAffine3::IDENTITY,
    window_min: DVec2::new(-0.5, -0.25),
    window_size: DVec2::new(1.0, 0.5),
    near: 0.0,
    is_parallel: false,
};

fn moved(offset: DVec3) -> View {
    View { world_from_camera: DAffine3::from_translation(offset), ..VIEW }
}

/// Eight samples a pixel: light from the medium at depth `volume` and from the wall at depth `surface`, by column.
fn guide(light: impl Fn(usize) -> f32, depths: impl Fn(usize) -> [f64; 2]) -> ImageGuide {
    let pixel = |i: usize| {
        let (x, y) = (i % SIZE[0], i / SIZE[0]);
        let place = DVec2::new((x as f64 + 0.5) / SIZE[0] as f64, (y as f64 + 0.5) / SIZE[1] as f64);
        // Distances along the ray of what has these depths.
        let slant = VIEW.point(place, 1.0).z.abs().recip();
        let [volume, surface] = depths(x).map(|depth| (depth * slant) as f32);
        let (w, t, n) = (2.4, 5.6, 8.0);
        Moments {
            volume_x2: light(x),
            volume_x: 0.5 * light(x),
            surface_x2: 3.0 * light(x),
            surface_x: light(x),
            w2: 0.9,
            t2: 4.0,
            w,
            t,
            w_depth: w * volume,
            t_depth: t * surface,
            n,
        }
    };
    let moments = (0..SIZE[0] * SIZE[1]).map(pixel).collect();
    ImageGuide::from_sums([0, 0], SIZE, Strategy::Odds, moments, ClassCosts::default())
}

fn assert_close(a: f32, b: f32, what: &str) {
    assert!((a - b).abs() <= 2e-3 * b.abs().max(1.0), "{what}: {a} is not {b}");
}

fn each_pixel(mut check: impl FnMut(usize, usize, usize)) {
    (0..SIZE[0] * SIZE[1]).for_each(|i| check(i, i % SIZE[0], i / SIZE[0]));
}

#[test]
fn seen_from_the_same_place_nothing_changes() {
    let before = guide(|x| 1.0 + x as f32, |_| [2.0, 4.0]);
    for view in [VIEW, View { near: 1.5, ..VIEW }] {
        let after = before.reprojected(&view, &view, SIZE);
        each_pixel(|i, x, _| {
            let (a, b) = (after.moments[i].to_array(), before.moments[i].to_array());
            a.iter().zip(b).for_each(|(a, b)| assert_close(*a, b, &format!("column {x}")));
        });
    }
}

#[test]
fn medium_and_wall_move_by_their_own_depths() {
    let light = |x: usize| 1.0 + x as f32;
    let before = guide(light, |_| [2.0, 4.0]);
    // To the right by three pixels of the wall, which are six of the fog half as far away; and up by two of the wall.
    let after = before.reprojected(&VIEW, &moved(DVec3::new(0.3, 0.2, 0.0)), SIZE);
    each_pixel(|i, x, y| {
        let m = &after.moments[i];
        // Upwards the lowest rows of the picture stay, the highest are new.
        if x + 6 >= SIZE[0] || y < 4 {
            return;
        }
        let what = format!("pixel {x}, {y}");
        assert_close(m.n, 8.0, &what);
        assert_close(m.surface_x2, 3.0 * light(x + 3), &what);
        assert_close(m.volume_x2, light(x + 6), &what);
        // Depths are those seen from the new place: the same planes.
        let expected = guide(light, |_| [2.0, 4.0]).moments[i];
        assert_close(m.t_depth, expected.t_depth, &what);
        assert_close(m.w_depth, expected.w_depth, &what);
    });
    let new_columns = (0..SIZE[1]).map(|y| after.moments[y * SIZE[0] + SIZE[0] - 1]);
    assert!(new_columns.into_iter().all(|m| m == Moments::default()), "what was out of sight is not known");
}

#[test]
fn what_was_out_of_sight_asks_its_neighbours() {
    let mut after =
        guide(|_| 9.0, |_| [2.0, 4.0]).reprojected(&VIEW, &moved(DVec3::new(0.3, 0.0, 0.0)), SIZE);
    after.make_odds();
    let probability = |x| after.lookup(x, 9).select_probability(0.3, 0.7, f32::INFINITY);
    let (known, new) = (probability(20), probability(39));
    let ignorant = crate::SegmentGuide::default().select_probability(0.3, 0.7, f32::INFINITY);
    assert!((known - new).abs() < 0.1 * (known - ignorant).abs(), "{new} is not {known} but {ignorant}");
}

#[test]
fn near_walls_hide_far_ones() {
    // The left half is near and dark, the right half far and bright; both move under each other.
    let light = |x: usize| if x < 20 { 1.0 } else { 1000.0 };
    let before = guide(light, |x| [1.0, if x < 20 { 2.0 } else { 8.0 }]);
    let after = before.reprojected(&VIEW, &moved(DVec3::new(-0.4, 0.0, 0.0)), SIZE);
    // To the right the near half moves by eight pixels, the far one by two: it is hidden up to column 27. The fog moves by
    // sixteen: pixels before it know nothing of it.
    each_pixel(|i, x, _| {
        let bright = after.moments[i].surface_x2;
        if (16..28).contains(&x) {
            assert_close(bright, 3.0, &format!("column {x} shows the near wall"));
        } else if x >= 29 {
            assert_close(bright, 3000.0, &format!("column {x} shows the far wall"));
        }
    });
}

#[test]
fn turning_moves_the_sky() {
    let light = |x: usize| 1.0 + x as f32;
    let before = guide(light, |_| [1e9, 1e9]);
    // By the angle from the middle of the image to ten pixels to its right.
    let turned = DQuat::from_rotation_y(-(0.25f64.atan()));
    let view = View { world_from_camera: DAffine3::from_quat(turned), ..VIEW };
    let after = before.reprojected(&VIEW, &view, SIZE);
    let middle = 10 * SIZE[0] + 19;
    // Tangents do not add: half a pixel to either side of the middle.
    let seen = 0.5 * (after.moments[middle].surface_x2 + after.moments[middle + 1].surface_x2)
        / (0.5 * (after.moments[middle].n + after.moments[middle + 1].n));
    assert!((seen / (3.0 * 30.5 / 8.0) - 1.0).abs() < 0.02, "{seen}");
}

#[test]
fn images_of_other_sizes_know_as_much() {
    let before = guide(|_| 5.0, |_| [2.0, 4.0]);
    for size in [[20, 10], [61, 33], [1, 1]] {
        let after = before.reprojected(&VIEW, &VIEW, size);
        assert_eq!((after.width(), after.height()), (size[0], size[1]));
        for m in after.moments.iter().filter(|m| m.n > 0.0) {
            assert!((m.surface_x2 / m.t2 / (15.0 / 4.0) - 1.0).abs() < 1e-3);
            assert!((m.volume_x2 / m.w2 / (5.0 / 0.9) - 1.0).abs() < 1e-3);
        }
    }
}

#[test]
fn absurd_sums_teach_nothing() {
    let mut before = guide(|_| 1.0, |_| [2.0, 4.0]);
    before.moments.iter_mut().for_each(|m| *m = Moments::from_array([f32::MAX; Moments::N_SUMS]));
    let after = before.reprojected(&VIEW, &moved(DVec3::new(0.01, 0.0, 3.0)), [3, 2]);
    assert!(after.moments.iter().all(|m| m.to_array().iter().all(|v| v.is_finite())));
    let behind = View { world_from_camera: DAffine3::from_rotation_y(std::f64::consts::PI), ..VIEW };
    assert!(before.reprojected(&VIEW, &behind, SIZE).moments.iter().all(|m| *m == Moments::default()));
}
