//! Integers into random integers.

/// Bob Jenkins' lookup3 (2006) of up to four numbers.
#[inline]
pub(super) fn jenkins<const N: usize>(key: [u32; N]) -> u32 {
    const { assert!(N >= 1 && N <= 4) };
    let start = 0xdead_beef_u32.wrapping_add((N as u32) << 2).wrapping_add(13);
    let mut state = [start; 3];
    for (word, value) in state.iter_mut().zip(&key) {
        *word = word.wrapping_add(*value);
    }
    if N == 4 {
        mix(&mut state);
        state[0] = state[0].wrapping_add(key[N - 1]);
    }
    finish(state)
}

/// Three words made dependent on each other, reversibly.
#[inline]
fn mix([a, b, c]: &mut [u32; 3]) {
    let step = |x: &mut u32, y: &mut u32, z: u32, bits: u32| {
        *x = x.wrapping_sub(*y) ^ y.rotate_left(bits);
        *y = y.wrapping_add(z);
    };
    step(a, c, *b, 4);
    step(b, a, *c, 6);
    step(c, b, *a, 8);
    step(a, c, *b, 16);
    step(b, a, *c, 19);
    step(c, b, *a, 4);
}

/// The last word after all have been stirred into it.
#[inline]
fn finish([mut a, mut b, mut c]: [u32; 3]) -> u32 {
    let step = |x: &mut u32, y: u32, bits: u32| *x = (*x ^ y).wrapping_sub(y.rotate_left(bits));
    step(&mut c, b, 14);
    step(&mut a, c, 11);
    step(&mut b, a, 25);
    step(&mut c, b, 16);
    step(&mut a, c, 4);
    step(&mut b, a, 14);
    step(&mut c, b, 24);
    c
}

/// A number in [0, 1].
#[inline]
pub(super) fn unit(hash: u32) -> f32 {
    hash as f32 / u32::MAX as f32
}

/// PCG3D of Jarzynski and Olano (2020), on signed numbers: a point of the unit cube.
#[inline]
pub(super) fn pcg3d(key: [i32; 3]) -> [f32; 3] {
    let stir = |[x, y, z]: &mut [i32; 3]| {
        *x = x.wrapping_add(y.wrapping_mul(*z));
        *y = y.wrapping_add(z.wrapping_mul(*x));
        *z = z.wrapping_add(x.wrapping_mul(*y));
    };
    let mut v = key.map(|k| k.wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
    stir(&mut v);
    v = v.map(|x| x ^ (x >> 16));
    stir(&mut v);
    v.map(|x| (x & i32::MAX) as f32 * (1.0 / i32::MAX as f32))
}
