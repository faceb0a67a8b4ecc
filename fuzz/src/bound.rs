//! A bound on work, which a busy machine does not move.

use std::time::Duration;

use rustix::time::{ClockId, clock_gettime};

/// Processor time that reading anything may take; measured in a debug build: below 8 ms.
const FIXED: Duration = Duration::from_millis(100);
/// What each byte may add; measured in a debug build: below 0.35 µs. What takes time in the square
/// of its length exceeds this well before a megabyte, and that is what it is here to find.
const PER_BYTE: Duration = Duration::from_micros(2);

/// What `work` on so many `bytes` returns.
///
/// # Panics
/// When it took more of the processor's time than such an input may take.
pub fn bounded<T>(bytes: usize, work: impl FnOnce() -> T) -> T {
    let before = processor_time();
    let result = work();
    let spent = processor_time().saturating_sub(before);
    let allowed = FIXED + PER_BYTE * u32::try_from(bytes).unwrap_or(u32::MAX);
    assert!(spent <= allowed, "{bytes} bytes took {spent:?} of processor time, above {allowed:?}");
    result
}

/// Of this thread.
fn processor_time() -> Duration {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    // Neither is ever negative.
    Duration::new(time.tv_sec.unsigned_abs(), u32::try_from(time.tv_nsec).unwrap_or(0))
}
