//! Sums, and parts that add up.

use super::*;
use crate::aov::{NO_HIT_DEPTH, SampleRecord};
use tyndall_math::Rgb;

fn film(width: u32, height: u32) -> Film {
    let names = ["depth", "samples", "variance"].map(String::from);
    Film::new(width, height, &names).unwrap()
}

/// Brings a film to `end` samples in the passes of a session.
fn take_samples(film: &mut Film, first: u32, end: u32, sample: impl Fn([u32; 2], u32) -> SampleRecord) {
    let mut done = first;
    while done < end {
        let target = leaf_end(done).min(end);
        for tile in film.tiles_mut() {
            for number in tile.begin(target)..target {
                for index in 0..tile.len() {
                    let (x, y) = tile.pixel(index);
                    tile.add(index, sample([x, y], number));
                }
            }
            tile.finish();
        }
        done = target;
    }
}

/// Numbers whose sum depends on the order: of all magnitudes, some not finite.
fn unruly([x, y]: [u32; 2], sample: u32) -> SampleRecord {
    let bits = blake3::hash(format!("{x} {y} {sample}").as_bytes());
    let number = |i: usize| {
        let [a, b, ..] = bits.as_bytes()[2 * i..] else { return 0.0 };
        f32::from(a) * 10f32.powi(i32::from(b) / 12 - 10)
    };
    let radiance = if sample % 50 == 7 { Rgb::NAN } else { Rgb::new(number(0), number(1), number(2)) };
    let depth = if sample.is_multiple_of(3) { f32::INFINITY } else { number(3) };
    SampleRecord { radiance, depth, alpha: number(4), ..Default::default() }
}

fn bits(film: &Film) -> Vec<u32> {
    let images = film.aovs().iter().flat_map(|aov| film.image(aov.name).unwrap());
    images.map(f32::to_bits).collect()
}

fn part(first: u32, end: u32) -> Film {
    let names = ["depth", "samples", "variance"].map(String::from);
    let mut part = Film::starting_at(first, 19, 17, &names).unwrap();
    take_samples(&mut part, first, end, unruly);
    part
}

#[test]
fn parts_add_up_to_the_bits_of_the_whole() {
    let whole = part(0, 420);
    for borders in [&[0, 32, 420][..], &[0, 96, 128, 384, 420], &[0, 64, 96, 416, 420], &[0, 224, 256, 420]] {
        let mut merged = part(borders[0], borders[1]);
        for range in borders[1..].windows(2) {
            merged.append(&part(range[0], range[1])).unwrap();
        }
        assert_eq!(bits(&merged), bits(&whole), "{borders:?}");
        assert_eq!(merged.non_finite_samples(), whole.non_finite_samples());
    }
}

#[test]
fn parts_that_do_not_fit_are_refused() {
    assert!(Film::starting_at(40, 1, 1, &[]).is_err_and(|e| e.contains("multiple of 32")));
    let other_size = Film::starting_at(32, 9, 17, &[]).unwrap();
    let other_aovs = Film::starting_at(32, 19, 17, &[]).unwrap();
    for (next, word) in [(other_size, "pixels"), (other_aovs, "AOVs"), (part(64, 96), "sample 64")] {
        let error = part(0, 32).append(&next).unwrap_err();
        assert!(error.contains(word), "{error}");
    }
}

#[test]
fn a_stopped_pass_is_rendered_again() {
    let mut film = part(0, 40);
    for tile in film.tiles_mut().iter_mut().skip(1) {
        tile.begin(64);
        tile.add(0, unruly([0, 0], 0));
    }
    assert_eq!(film.next_sample(), 40);
    let mut bytes = Vec::new();
    film.write_state("", &mut bytes).unwrap();
    let mut again = Film::read_state(&bytes).unwrap().film;
    take_samples(&mut again, 40, 100, unruly);
    take_samples(&mut film, 40, 100, unruly);
    assert_eq!(bits(&again), bits(&part(0, 100)));
    assert_eq!(bits(&film), bits(&again));
}

#[test]
fn states_round_trip_and_damage_is_found() {
    let film = part(64, 200);
    let mut bytes = Vec::new();
    film.write_state("a text", &mut bytes).unwrap();
    let SavedFilm { film: read, description: text, .. } = Film::read_state(&bytes).unwrap();
    assert_eq!((bits(&read), text.as_str()), (bits(&film), "a text"));
    assert_eq!((read.first_sample(), read.next_sample()), (64, 200));
    for len in (0..bytes.len()).step_by(97) {
        assert!(Film::read_state(&bytes[..len]).is_err(), "cut off after {len} bytes");
    }
    for at in (0..bytes.len()).step_by(89) {
        let mut damaged = bytes.clone();
        damaged[at] ^= 0x10;
        assert!(Film::read_state(&damaged).is_err(), "byte {at} changed");
    }
    let of = |bytes: &[u8]| Film::read_state(bytes).err().unwrap();
    assert_eq!(of(b"something else altogether, long enough"), StateError::Foreign);
    bytes[8] = 9;
    assert_eq!(of(&bytes), StateError::Version(9));
}

#[test]
fn every_pixel_belongs_to_exactly_one_tile() {
    for (w, h) in [(1, 1), (1, 77), (33, 16), (17, 47)] {
        let mut film = film(w, h);
        for tile in film.tiles_mut() {
            tile.begin(1);
            for i in 0..tile.len() {
                tile.add(i, SampleRecord::default());
            }
            tile.finish();
        }
        assert_eq!(film.total_samples(), u64::from(w) * u64::from(h));
        assert!(film.image("samples").unwrap().iter().all(|&n| n == 1.0));
    }
}

#[test]
fn a_million_ones_are_one() {
    let mut film = film(1, 1);
    let one = SampleRecord { radiance: Rgb::ONE, alpha: 1.0, ..Default::default() };
    take_samples(&mut film, 0, 1_000_000, |_, _| one);
    assert_eq!(film.image("rgba").unwrap(), [1.0; 4]);
    assert_eq!(film.image("variance").unwrap(), [0.0; 3]);
}

#[test]
fn non_finite_samples_are_black_and_counted() {
    let mut film = film(1, 1);
    let values = [f32::NAN, f32::INFINITY, 4.0, 4.0];
    take_samples(&mut film, 0, 4, |_, sample| SampleRecord {
        radiance: Rgb::splat(values[sample as usize]),
        ..Default::default()
    });
    assert_eq!(film.non_finite_samples(), 2);
    assert_eq!(film.image("rgba").unwrap()[0], 2.0);
}

#[test]
fn depth_is_the_mean_of_hits_only() {
    let mut film = film(2, 1);
    let depths = [2.0, f32::INFINITY, 4.0];
    take_samples(&mut film, 0, 3, |pixel, sample| SampleRecord {
        depth: if pixel == [0, 0] { depths[sample as usize] } else { f32::INFINITY },
        ..Default::default()
    });
    assert_eq!(film.image("depth").unwrap(), [3.0, NO_HIT_DEPTH]);
}

#[test]
fn unknown_aovs_are_refused_by_name() {
    let error = Film::new(1, 1, &["beauty".to_owned()]).err().unwrap();
    assert!(error.contains("beauty") && error.contains("transmittance"), "{error}");
    assert!(film(1, 1).image("albedo").is_err());
}
