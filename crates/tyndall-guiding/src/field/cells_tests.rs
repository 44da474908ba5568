use super::super::tests::{SURFACE, VOLUME, samples, trained};
use glam::Vec3A;
use tyndall_math::random::Pcg;

/// Where a look-up is not moved.
const UNMOVED: f32 = 1.0 / 6.0;

#[test]
fn every_point_is_in_the_one_box_of_its_region() {
    let field = trained(&[samples(1, 20_000, |p, d| (p.x + d.z).max(0.0)), samples(2, 20_000, |p, _| p.y)]);
    let cells = field.cells(VOLUME);
    assert_eq!(cells.len(), field.statistics().n_volume_regions);
    assert!(cells.len() > 4);
    assert!(field.cells(SURFACE).is_empty());
    let mut rng = Pcg::new(&[8]);
    for _ in 0..1000 {
        let p = Vec3A::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 1.4 - 0.2;
        let has = |min: [f32; 3], max: [f32; 3]| (0..3).all(|i| min[i] <= p[i] && p[i] < max[i]);
        let mut around = cells.iter().filter(|cell| has(cell.min, cell.max));
        let (Some(cell), None) = (around.next(), around.next()) else { panic!("{p} is in none or several") };
        assert!(std::ptr::eq(cell.region, field.region(p, VOLUME, UNMOVED).unwrap()));
    }
}
