//! Round trips, policy, and files that are not what they should be.

use super::*;
use crate::field::testing;
use crate::{ClassCosts, Moments, Strategy};
use proptest::prelude::*;
use std::sync::LazyLock;
use tyndall_math::random::Pcg;

fn image() -> ImageGuide {
    let mut rng = Pcg::new(&[5]);
    let mut guide = ImageGuide::new([0, 0], 31, 17, Strategy::Odds);
    for _ in 0..3 {
        let mut sum = || Moments::from_array(std::array::from_fn(|_| 4.0 * rng.next_f32()));
        let pass: Vec<_> = (0..31 * 17).map(|_| sum()).collect();
        guide.learn(&pass, &ClassCosts { volume: (31, 7), surface: (12, 9) }).unwrap();
    }
    guide
}

fn fingerprint(seed: u8) -> Fingerprint {
    Fingerprint::new(|section| [seed + section as u8; 16])
}

static CACHE: LazyLock<Cache> = LazyLock::new(|| Cache {
    renderer: "tyndall 0.1.0".into(),
    fingerprint: fingerprint(1),
    frames: vec![FrameRecord { frame: 1001.0, samples: 32 }, FrameRecord { frame: 1002.5, samples: 16 }],
    lessons: 11,
    samples: 48,
    origin: [1e6, -2.0, 0.5],
    view: View { near: 0.25, ..View::default() },
    field: Some(testing::trained_field()),
    image: Some(image()),
});
static BYTES: LazyLock<Vec<u8>> = LazyLock::new(|| CACHE.to_bytes());

fn present(fingerprint: Fingerprint) -> Present {
    Present { fingerprint, origin: CACHE.origin, view: CACHE.view, resolution: [31, 17] }
}

#[test]
fn what_is_written_comes_back_bit_for_bit() {
    for (field, image) in [(true, true), (true, false), (false, true), (false, false)] {
        let mut cache = CACHE.clone();
        cache.field = cache.field.filter(|_| field);
        cache.image = cache.image.filter(|_| image);
        let bytes = cache.to_bytes();
        let back = Cache::from_bytes(&bytes).unwrap();
        assert!(back == cache && back.to_bytes() == bytes, "field: {field}, image guide: {image}");
    }
    assert_eq!(Cache::from_bytes(&Cache::default().to_bytes()), Ok(Cache::default()));
}

#[test]
fn a_field_that_was_read_learns_on_like_the_one_that_was_written() {
    let mut read = Cache::from_bytes(&BYTES).unwrap().field.unwrap();
    let mut kept = CACHE.field.clone().unwrap();
    testing::teach(&mut read);
    testing::teach(&mut kept);
    assert!(read == kept && read != *CACHE.field.as_ref().unwrap());
}

#[test]
fn the_file_does_not_depend_on_the_number_of_threads() {
    let in_pool = |n: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
        pool.install(|| CACHE.to_bytes())
    };
    assert!(in_pool(1) == in_pool(3));
}

#[test]
fn ten_thousand_corruptions_are_refused() {
    let mut rng = Pcg::new(&[2024]);
    let mut below = |n: usize| ((rng.next_f32() * n as f32) as usize).min(n - 1);
    for i in 0..10_000 {
        let mut bytes = BYTES.clone();
        match i % 5 {
            // Half of the damage is done to the header and the table.
            0 => bytes[below(200)] ^= 1 << below(8),
            1 => {
                let at = below(bytes.len());
                bytes[at] ^= 1 << below(8);
            }
            2 => bytes.truncate(below(BYTES.len())),
            3 => {
                let (at, n) = (below(bytes.len()), 1 + below(64));
                let end = (at + n).min(bytes.len());
                bytes[at..end].iter_mut().for_each(|b| *b = below(256) as u8);
            }
            _ => {
                let at = below(bytes.len());
                bytes.splice(at..at, [below(256) as u8]);
            }
        }
        if bytes != *BYTES {
            assert!(Cache::from_bytes(&bytes).is_err(), "corruption {i} was accepted");
        }
    }
}

#[test]
fn refusals_say_why() {
    let why = |change: &dyn Fn(&mut Vec<u8>)| {
        let mut bytes = BYTES.clone();
        change(&mut bytes);
        Cache::from_bytes(&bytes).unwrap_err()
    };
    assert_eq!(why(&|b| b.clear()), CacheError::NotACache);
    assert_eq!(why(&|b| b[0] = b'P'), CacheError::NotACache);
    assert_eq!(why(&|b| b[12] = 9), CacheError::Newer { found: 9, known: FORMAT });
    assert!(matches!(why(&|b| b[12] = 0), CacheError::Foreign(_)));
    assert!(matches!(why(&|b| b[8..12].reverse()), CacheError::Foreign(_)));
    assert!(matches!(why(&|b| b.truncate(50)), CacheError::Length { expected: 64, actual: 50 }));
    assert!(matches!(why(&|b| b.truncate(b.len() - 1)), CacheError::Length { .. }));
    assert!(matches!(why(&|b| b.push(0)), CacheError::Length { .. }));
    assert_eq!(why(&|b| b[40] ^= 1), CacheError::Checksum("header"));
    assert_eq!(why(&|b| *b.last_mut().unwrap() ^= 1), CacheError::Checksum("image guide"));
}

#[test]
fn light_that_changed_is_forgotten_and_moved_things_are_doubted() {
    let now = |changed: &[Section]| {
        Fingerprint::new(|s| if changed.contains(&s) { [99; 16] } else { CACHE.fingerprint.of(s) })
    };
    let after = |changed: &[Section]| {
        let mut cache = CACHE.clone();
        let reuse = cache.reuse(&present(now(changed)));
        assert_eq!(reuse.changes, changed);
        assert_eq!((reuse.field, reuse.image), (cache.field.is_some(), cache.image.is_some()));
        cache
    };
    assert_eq!(after(&[]), *CACHE);
    assert_eq!((after(&[]).samples, after(&[Section::Geometry]).samples), (48, 0));
    for section in [Section::Materials, Section::Lights, Section::Integrator] {
        assert_eq!((after(&[section]).field, after(&[section]).image), (None, None));
    }
    let count = |cache: &Cache| {
        let (_, regions) = cache.field.as_ref().unwrap().parts(crate::EventClass::Volume);
        regions.iter().map(|region| region.n_samples()).sum::<f32>()
    };
    for section in [Section::Geometry, Section::Media] {
        let cache = after(&[section]);
        assert!((count(&cache) / count(&CACHE) - 0.25).abs() < 1e-5);
        assert_eq!(cache.image.unwrap().moments()[3].n, 0.25 * CACHE.image.as_ref().unwrap().moments()[3].n);
    }
    let moved = after(&[Section::Camera]);
    assert!(moved.field.is_some() && moved.image.is_some_and(|image| image.width() == 31));
}

#[test]
fn the_field_stays_in_its_place_when_the_origin_moves() {
    use glam::Vec3A;
    let mut cache = CACHE.clone();
    cache.reuse(&Present { origin: [1e6 + 0.5, -2.0, 0.25], ..present(CACHE.fingerprint) });
    let (old, new) = (CACHE.field.as_ref().unwrap(), cache.field.as_ref().unwrap());
    let mut rng = Pcg::new(&[1]);
    for _ in 0..100 {
        let p = Vec3A::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
        let moved = p + Vec3A::new(-0.5, 0.0, 0.25);
        let a = old.region(p, crate::EventClass::Volume, 0.5).unwrap().lobes();
        let b = new.region(moved, crate::EventClass::Volume, 0.5).unwrap().lobes();
        assert_eq!(a, b);
    }
}

/// Caches of one scene by machines with other seeds.
fn machines() -> Vec<Cache> {
    let of = |lessons: u32| {
        let mut cache = CACHE.clone();
        (0..lessons).for_each(|_| testing::teach(cache.field.as_mut().unwrap()));
        cache.frames = vec![FrameRecord { frame: f64::from(lessons), samples: 8 }];
        Cache { lessons, ..cache }
    };
    (1..4).map(of).collect()
}

#[test]
fn merged_caches_do_not_depend_on_their_order() {
    let caches = machines();
    let merged = |order: [usize; 3]| Cache::merged(order.map(|i| caches[i].clone()).to_vec()).unwrap().cache;
    let first = merged([0, 1, 2]);
    for order in [[0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
        assert!(merged(order).to_bytes() == first.to_bytes(), "{order:?}");
    }
    assert_eq!((first.lessons, first.samples, first.frames.len()), (6, 144, 3));
    let n =
        |cache: &Cache| cache.image.as_ref().unwrap().moments().iter().map(|m| f64::from(m.n)).sum::<f64>();
    assert!((n(&first) / caches.iter().map(n).sum::<f64>() - 1.0).abs() < 1e-6);
    let samples = |cache: &Cache| cache.field.as_ref().unwrap().statistics().n_samples;
    assert_eq!(samples(&first), caches.iter().map(samples).sum::<u64>());
    assert!(Cache::from_bytes(&first.to_bytes()).unwrap() == first, "what was merged can be read");
}

#[test]
fn caches_of_other_light_are_not_merged() {
    let caches = |changed: Section| {
        let mut caches = machines();
        caches[2].fingerprint =
            Fingerprint::new(|s| if s == changed { [99; 16] } else { CACHE.fingerprint.of(s) });
        caches[2].view.near += 1.0;
        caches
    };
    for section in [Section::Lights, Section::Materials, Section::Integrator] {
        let error = Cache::merged(caches(section)).unwrap_err();
        assert_eq!(error, MergeError::Differ { pair: [0, 2], section });
        assert!(error.to_string().contains(section.name()));
    }
    for section in [Section::Geometry, Section::Media, Section::Camera] {
        let merged = Cache::merged(caches(section)).unwrap();
        let others = caches(section).into_iter().filter(|cache| cache.view != merged.cache.view);
        assert_eq!(merged.images_left_out, others.count(), "image guides of two cameras cannot be added");
    }
    assert_eq!(Cache::merged(Vec::new()), Err(MergeError::Nothing));
}

#[test]
fn caches_shrink_to_what_is_allowed() {
    let full = BYTES.len();
    for most in [full, full - 1, full / 3, 6000] {
        let mut cache = CACHE.clone();
        assert!(cache.shrink_to(most), "{most} of {full}");
        let bytes = cache.to_bytes();
        assert!(bytes.len() <= most && Cache::from_bytes(&bytes).unwrap() == cache);
        assert_eq!(cache.image.is_some(), most == full);
    }
    assert!(!CACHE.clone().shrink_to(10));
}

proptest! {
    /// What checksums keep away from the decoders in a damaged file, a liar can put there.
    #[test]
    fn sections_of_liars_are_refused_or_usable(
        which in 0..3usize,
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u32>()), 1..8),
        cut in prop::option::of(any::<prop::sample::Index>()),
    ) {
        let file = Opened::from_bytes(&BYTES).unwrap();
        let raw = |kind: Kind| {
            let mut section = file.section(kind).unwrap().unwrap();
            (kind, section.take(section.left()).unwrap().rest().to_vec())
        };
        let sections = Kind::ALL.map(raw).to_vec();
        let mut container = Container { renderer: file.renderer.clone(), sections };
        let raw = &mut container.sections[which].1;
        for (at, value) in edits {
            let at = at.index(raw.len() / 4) * 4;
            raw[at..at + 4].copy_from_slice(&value.to_le_bytes());
        }
        if let Some(cut) = cut {
            raw.truncate(cut.index(raw.len()));
        }
        if let Ok(mut cache) = Cache::from_bytes(&container.to_bytes()) {
            cache.reuse(&Present { origin: [0.0; 3], ..present(fingerprint(2)) });
            if let Some(field) = &mut cache.field {
                testing::teach(field);
            }
            let again = cache.to_bytes();
            prop_assert!(!again.is_empty());
        }
    }
}
