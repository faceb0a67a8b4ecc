//! Noise of recorders, and what differs from one receiver to the next.

use osteon_common::special::standard_normal_quantile;
use rand_chacha::ChaCha20Rng;
use rand_chacha::rand_core::{Rng as _, SeedableRng as _};

/// Bytes 8 to 12 of the key, where that of germs has zeros: noise is independent of bones.
const OF_NOISE: &[u8; 5] = b"noise";

/// A stream of random numbers.
pub(super) struct NoiseStream(ChaCha20Rng);

impl NoiseStream {
    /// Returns the numbers of a device, the same for all its series.
    pub(super) fn of_device(seed: u64) -> Self {
        Self::numbered(seed, 0)
    }

    /// Returns the numbers of a series.
    pub(super) fn of_series(seed: u64, index: u64) -> Self {
        Self::numbered(seed, index + 1)
    }

    fn numbered(seed: u64, number: u64) -> Self {
        let mut key = [0; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        key[8..13].copy_from_slice(OF_NOISE);
        let mut random = ChaCha20Rng::from_seed(key);
        random.set_stream(number);
        Self(random)
    }

    /// Returns a seed.
    pub(super) fn seed(&mut self) -> u64 {
        self.0.next_u64() >> 1
    }

    /// Returns a uniform number between 0 and 1.
    pub(super) fn uniform(&mut self) -> f64 {
        // Half a step away from 0; of 52 bits, so that the largest is a double below 1.
        ((self.0.next_u64() >> 12) as f64 + 0.5) / (1_u64 << 52) as f64
    }

    /// Returns a standard normal number.
    pub(super) fn normal(&mut self) -> f64 {
        standard_normal_quantile(self.uniform())
    }
}
