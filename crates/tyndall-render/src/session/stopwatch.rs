//! Seconds, by a clock that the caller lends: this crate has none.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// Adds up how long pieces of work take; always 0 without a clock.
#[derive(Debug, Default)]
pub(super) struct Stopwatch {
    clock: Option<fn() -> Duration>,
    nanoseconds: AtomicU64,
}

impl Stopwatch {
    /// By `clock`, the time since any fixed moment.
    pub(super) fn new(clock: fn() -> Duration) -> Self {
        Self { clock: Some(clock), nanoseconds: AtomicU64::new(0) }
    }

    /// Counts the time of `work`.
    pub(super) fn time<T>(&self, work: impl FnOnce() -> T) -> T {
        let Some(clock) = self.clock else { return work() };
        let start = clock();
        let done = work();
        let taken = clock().saturating_sub(start).as_nanos();
        self.nanoseconds.fetch_add(u64::try_from(taken).unwrap_or(u64::MAX), Ordering::Relaxed);
        done
    }

    /// All of it so far.
    pub(super) fn total(&self) -> Duration {
        Duration::from_nanos(self.nanoseconds.load(Ordering::Relaxed))
    }
}
