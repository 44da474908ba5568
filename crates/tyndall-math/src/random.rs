//! Random numbers as pure functions of who asks for them.
//!
//! Every number is determined by (seed, pixel, sample, position in the path), never by a thread or by time, so the same
//! settings give the same bits on any machine with any number of threads.
//! Decisions of fixed count near the camera use Owen-scrambled Sobol points ([`PathSampler`]); everything of unbounded
//! count (free-flight candidates, ratio tracking) draws from a PCG stream of its own ([`Pcg`]).

mod path_sampler;
mod pcg;
mod sobol;

pub use path_sampler::PathSampler;
pub use pcg::Pcg;

/// Mixes a key of any length into 64 well-distributed bits (the finaliser of MurmurHash3, chained).
#[inline]
pub fn hash_key(key: &[u64]) -> u64 {
    let mut h = 0x9e37_79b9_7f4a_7c15u64;
    for &word in key {
        h = mix(h ^ word.wrapping_mul(0xbf58_476d_1ce4_e5b9));
    }
    h
}

#[inline]
fn mix(mut h: u64) -> u64 {
    h ^= h >> 33;
    h = h.wrapping_mul(0xff51_afd7_ed55_8ccd);
    h ^= h >> 33;
    h = h.wrapping_mul(0xc4ce_b9fe_1a85_ec53);
    h ^ (h >> 33)
}
