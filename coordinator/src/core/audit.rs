//! Audits: decides which batches are computed a second time by another worker.

use std::fmt;

use osteon_proto::identity::{self, NoRandomness};

use crate::core::ids::JobId;

/// Key that decides which batches are audited. It is a secret of a running coordinator, since a
/// worker that knew it could return wrong answers where they are not checked. It changes no result.
#[derive(Clone, Copy, PartialEq, Eq, Default)]
pub struct AuditKey([u8; 32]);

impl AuditKey {
    /// Returns a random key.
    ///
    /// # Errors
    /// When the operating system provides no random numbers.
    pub(crate) fn random() -> Result<Self, NoRandomness> {
        identity::random_bytes().map(Self)
    }
}

impl fmt::Debug for AuditKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("AuditKey(secret)")
    }
}

/// Returns whether the batch of `job` that begins at index `first` of evaluation `number` is
/// audited: a function of these and the key.
pub(crate) fn is_chosen(
    key: &AuditKey,
    job: JobId,
    number: u64,
    first: u64,
    fraction: f64,
) -> bool {
    let mut hasher = blake3::Hasher::new_keyed(&key.0);
    for part in [job.0, number, first] {
        hasher.update(&part.to_le_bytes());
    }
    let mut word = [0; 8];
    hasher.finalize_xof().fill(&mut word);
    // The 53 bits of a uniform number in [0, 1): 0 chooses nothing, 1 everything.
    let uniform = (u64::from_le_bytes(word) >> 11) as f64 / (1_u64 << 53) as f64;
    uniform < fraction
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fraction_is_kept() {
        for (fraction, least, most) in
            [(0.0, 0, 0), (0.01, 70, 130), (0.5, 4800, 5200), (1.0, 10_000, 10_000)]
        {
            let chosen = chosen(&AuditKey([7; 32]), fraction).len();
            assert!((least..=most).contains(&chosen), "{chosen} at {fraction}");
        }
    }

    /// Returns which of many batches are chosen.
    fn chosen(key: &AuditKey, fraction: f64) -> Vec<u64> {
        let of = |i: &u64| is_chosen(key, JobId(i % 7), i % 90, i * 16, fraction);
        (0..10_000).filter(of).collect()
    }

    #[test]
    fn who_does_not_know_the_key_does_not_know_the_choice() {
        let keys = [AuditKey::default(), AuditKey::random().unwrap(), AuditKey::random().unwrap()];
        assert_ne!(keys[1], keys[2]);
        let [known, one, other] = keys.map(|key| chosen(&key, 0.5));
        for (one, other) in [(&known, &one), (&known, &other), (&one, &other)] {
            let both = one.iter().filter(|i| other.contains(i)).count();
            // A quarter of 10,000, with a standard deviation of 43.
            assert!((2200..2800).contains(&both), "{both}");
        }
        assert_eq!(format!("{:?}", keys[1]), "AuditKey(secret)");
    }
}
