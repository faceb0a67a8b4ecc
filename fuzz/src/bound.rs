//! A bound on work, in the pace of the machine that does it.

use std::hint::black_box;
use std::time::Duration;

use rustix::time::{ClockId, clock_gettime};

/// Processor time that nobody asks about: what reading anything small takes, on any machine.
const FREE: Duration = Duration::from_millis(50);
/// Passes over each byte that reading it may be worth; measured in a debug build: below 250. What
/// takes time in the square of its length exceeds this long before a megabyte, and that is what
/// it is here to find.
const PASSES: u32 = 2000;
/// Bytes whose passes stand for the pace.
const PACE_BYTES: usize = 1 << 16;

/// What `work` on so many `bytes` returns.
///
/// # Panics
/// When it took more of the processor's time than such an input may take. How long a simple pass
/// over a byte takes is measured right after it: a slow or a busy machine slows down both.
pub fn bounded<T>(bytes: usize, work: impl FnOnce() -> T) -> T {
    let (result, spent) = timed(work);
    if spent > FREE {
        let allowed = FREE.max(pace() * PASSES).mul_f64(1.0 + bytes as f64 / PACE_BYTES as f64);
        assert!(
            spent <= allowed,
            "{bytes} bytes took {spent:?} of processor time, above {allowed:?}"
        );
    }
    result
}

/// Processor time of one simple pass over [`PACE_BYTES`]: the slowest of three.
fn pace() -> Duration {
    let bytes = vec![1_u8; PACE_BYTES];
    let pass = || bytes.iter().fold(0_u64, |sum, &byte| (sum ^ u64::from(byte)).wrapping_mul(31));
    (0..3).map(|_| timed(|| black_box(pass())).1).max().unwrap_or_default()
}

/// What `work` returns, and the processor time of this thread that it took.
fn timed<T>(work: impl FnOnce() -> T) -> (T, Duration) {
    let before = processor_time();
    let result = work();
    (result, processor_time().saturating_sub(before))
}

/// Of this thread.
fn processor_time() -> Duration {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    // Neither is ever negative.
    Duration::new(time.tv_sec.unsigned_abs(), u32::try_from(time.tv_nsec).unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quadratic(bytes: usize) -> usize {
        (0..bytes).map(|i| (0..i).fold(0, |sum, j| black_box(sum ^ j))).sum()
    }

    #[test]
    fn a_few_passes_are_within_the_bound() {
        let bytes = 400_000;
        bounded(bytes, || (0..10 * bytes).fold(0, |sum, j| black_box(sum ^ j)));
    }

    #[test]
    #[should_panic(expected = "of processor time")]
    fn the_square_of_a_length_is_not() {
        bounded(20_000, || quadratic(20_000));
    }
}
