//! A limit on work, relative to the speed of the machine.

use std::hint::black_box;
use std::time::Duration;

use rustix::time::{ClockId, clock_gettime};

/// Processor time that is always accepted: reading a small input may take this long on any machine.
const FREE: Duration = Duration::from_millis(50);
/// Number of passes over each byte that reading it may be worth; below 250 were measured in a debug
/// build. A reader whose time grows with the square of the length exceeds this long before a
/// megabyte, and the purpose of the limit is to find such readers.
const PASSES: u32 = 2000;
/// Number of bytes in the passes by which the speed is measured.
const PACE_BYTES: usize = 1 << 16;

/// Returns the result of `work` on an input with this number of `bytes`.
///
/// # Panics
/// If it took more processor time than such an input may take. The duration of a simple pass over a
/// byte is measured right afterwards, so that a slow or busy machine slows down both.
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

/// Returns the processor time of one simple pass over [`PACE_BYTES`]: the slowest of three.
fn pace() -> Duration {
    let bytes = vec![1_u8; PACE_BYTES];
    let pass = || bytes.iter().fold(0_u64, |sum, &byte| (sum ^ u64::from(byte)).wrapping_mul(31));
    (0..3).map(|_| timed(|| black_box(pass())).1).max().unwrap_or_default()
}

/// Returns the result of `work`, and the processor time of this thread that it took.
fn timed<T>(work: impl FnOnce() -> T) -> (T, Duration) {
    let before = processor_time();
    let result = work();
    (result, processor_time().saturating_sub(before))
}

/// Returns the processor time of this thread.
fn processor_time() -> Duration {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    // Neither part is ever negative.
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
