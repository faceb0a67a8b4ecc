//! The machine's peak of f64 fused multiply-adds, measured beside what is compared with it.
//!
//! Written with intrinsics and not with the solver's own registers: what keeps the solver from the
//! peak must not lower the peak.

#![expect(unsafe_code, reason = "intrinsics")]

use std::hint::black_box;
use std::time::Instant;

/// Rounds of a slice: some 40 µs.
const ROUNDS: usize = 20_000;

/// Floating-point operations per second of one slice on the widest registers that this machine has; a
/// fused multiply-add counts as two.
///
/// The largest of many slices is the peak: a clock that varies, and neighbours, only lower it.
pub(crate) fn slice() -> f64 {
    let rounds = black_box(ROUNDS);
    let start = Instant::now();
    let numbers = run(rounds);
    let seconds = start.elapsed().as_secs_f64();
    2.0 * (numbers * rounds) as f64 / seconds
}

/// Returns how many numbers each round has multiplied and added.
#[cfg(target_arch = "x86_64")]
fn run(rounds: usize) -> usize {
    if is_x86_feature_detected!("avx512f") {
        // SAFETY: the instruction set was just detected.
        unsafe { avx512(rounds) }
    } else if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
        // SAFETY: as above.
        unsafe { avx2(rounds) }
    } else {
        portable(rounds)
    }
}

#[cfg(not(target_arch = "x86_64"))]
fn run(rounds: usize) -> usize {
    portable(rounds)
}

/// Sixteen independent accumulators, of 32 registers.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn avx512(rounds: usize) -> usize {
    use std::arch::x86_64::{_mm512_fmadd_pd, _mm512_set1_pd};
    let (factor, addend) = (_mm512_set1_pd(black_box(0.75)), _mm512_set1_pd(black_box(0.25)));
    let mut sums = [_mm512_set1_pd(black_box(0.5)); 16];
    for _ in 0..rounds {
        for sum in &mut sums {
            *sum = _mm512_fmadd_pd(*sum, factor, addend);
        }
    }
    black_box(sums);
    8 * sums.len()
}

/// Twelve independent accumulators, of 16 registers.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn avx2(rounds: usize) -> usize {
    use std::arch::x86_64::{_mm256_fmadd_pd, _mm256_set1_pd};
    let (factor, addend) = (_mm256_set1_pd(black_box(0.75)), _mm256_set1_pd(black_box(0.25)));
    let mut sums = [_mm256_set1_pd(black_box(0.5)); 12];
    for _ in 0..rounds {
        for sum in &mut sums {
            *sum = _mm256_fmadd_pd(*sum, factor, addend);
        }
    }
    black_box(sums);
    4 * sums.len()
}

/// What the compiler makes of 32 independent accumulators.
fn portable(rounds: usize) -> usize {
    let (factor, addend) = (black_box(0.75_f64), black_box(0.25));
    let mut sums = [black_box(0.5_f64); 32];
    for _ in 0..rounds {
        for sum in &mut sums {
            *sum = sum.mul_add(factor, addend);
        }
    }
    black_box(sums);
    sums.len()
}
