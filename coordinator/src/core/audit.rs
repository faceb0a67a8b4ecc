//! Audits: decides which realizations are computed a second time on another host.

use std::fmt;

use osteon_proto::identity::{self, NoRandomness};

use crate::core::ids::{BatchId, JobId, LeaseId};
use crate::core::indices::Indices;

/// Key that decides which realizations are audited. It is a secret of a running coordinator, since a
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

/// Returns whether the saved results of `job` that begin at index `first` of evaluation `number` are
/// audited: a function of these and the key.
pub(crate) fn is_saved_part_chosen(
    key: &AuditKey,
    job: JobId,
    number: u64,
    first: u64,
    fraction: f64,
) -> bool {
    // 0 chooses nothing, 1 everything.
    uniform(key, [job.0, number, first]) < fraction
}

/// When answers of a worker are audited next, and how many of their realizations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct NextAudit {
    /// Number of realizations that it computes until then.
    pub(crate) left: f64,
    /// Number of realizations that are audited then, unless the answer has fewer.
    pub(crate) length: u64,
}

impl NextAudit {
    /// Returns the first audit of a worker with `slots` slots.
    pub(crate) fn first((key, fraction): (&AuditKey, f64), lease: LeaseId, slots: u32) -> Self {
        let u = uniform(key, [lease.0, 0, 2]);
        Self { left: interval(fraction, slots.into(), u), length: slots.into() }
    }
}

/// Returns which of the realizations `answered` by a worker are audited, `None` if none are due, and the audit
/// after this one. Few realizations, but at least `least`, are audited at a time and often, so that a machine that
/// breaks is found soon. The time of the next audit is random, so that no worker can foresee it; the interval is
/// at most twice the mean.
pub(crate) fn choose(
    (key, fraction): (&AuditKey, f64),
    (batch, least): (BatchId, u64),
    answered: Indices,
    due: NextAudit,
) -> (Option<Indices>, NextAudit) {
    let draw = |what| uniform(key, [batch.0, answered.first, what]);
    let left = due.left - answered.count as f64;
    if left > 0.0 {
        return (None, NextAudit { left, ..due });
    }
    let share = (fraction * answered.count as f64).ceil() as u64;
    let length = share.max(due.length).clamp(1, answered.count);
    let room = answered.count - length + 1;
    let offset = ((draw(0) * room as f64) as u64).min(room - 1);
    let audited = Indices { first: answered.first + offset, count: length };
    if fraction >= 1.0 {
        return (Some(audited), NextAudit { left: 0.0, length });
    }
    // The audit was due -`left` realizations ago. These, and those audited beyond the plan, move the next one, so that
    // the fraction is kept.
    let unplanned = (length as f64 - due.length as f64) / fraction;
    let next = share.max(least).min(answered.count);
    let left = left + unplanned + interval(fraction, next, draw(1));
    (Some(audited), NextAudit { left, length: next })
}

/// Returns a random number of realizations to the next audit, whose mean is `audited` / `fraction`; `u` is uniform
/// in [0, 1).
fn interval(fraction: f64, audited: u64, u: f64) -> f64 {
    if fraction >= 1.0 { 0.0 } else { 2.0 * u * audited as f64 / fraction }
}

/// Returns a uniform number in [0, 1): a function of the key and of these numbers, of which the last tells draws of
/// different purposes apart.
fn uniform(key: &AuditKey, of: [u64; 3]) -> f64 {
    let mut hasher = blake3::Hasher::new_keyed(&key.0);
    for part in of {
        hasher.update(&part.to_le_bytes());
    }
    let mut word = [0; 8];
    hasher.finalize_xof().fill(&mut word);
    (u64::from_le_bytes(word) >> 11) as f64 / (1_u64 << 53) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fraction_is_kept() {
        for (fraction, least, most) in
            [(0.0, 0, 0), (0.01, 70, 130), (0.5, 4800, 5200), (1.0, 10_000, 10_000)]
        {
            let chosen = chosen_batches(&AuditKey([7; 32]), fraction).len();
            assert!((least..=most).contains(&chosen), "{chosen} at {fraction}");
        }
    }

    /// Returns which of many batches are chosen.
    fn chosen_batches(key: &AuditKey, fraction: f64) -> Vec<u64> {
        let is_audited =
            |i: &u64| is_saved_part_chosen(key, JobId(i % 7), i % 90, i * 16, fraction);
        (0..10_000).filter(is_audited).collect()
    }

    /// Returns the fraction of the realizations that is audited, and the most that a worker computes between
    /// two audits, over many batches of this size.
    fn audited_share(fraction: f64, slots: u32, count: u64) -> (f64, u64) {
        let mut due = NextAudit::first((&AuditKey([7; 32]), fraction), LeaseId(1), slots);
        let (mut audited, mut since, mut longest) = (0, 0, 0);
        let batches = 400_000 / count;
        for batch in 0..batches {
            let answered = Indices { first: batch * count, count };
            let key = &AuditKey([7; 32]);
            let (chosen, next) =
                choose((key, fraction), (BatchId(batch), slots.into()), answered, due);
            due = next;
            since += count;
            if let Some(chosen) = chosen {
                assert!(chosen.first >= answered.first && chosen.end() <= answered.end());
                audited += chosen.count;
                longest = longest.max(since);
                since = 0;
            }
        }
        (audited as f64 / (batches * count) as f64, longest)
    }

    #[test]
    fn realizations_are_audited_often_and_few_at_a_time() {
        for (fraction, slots, count) in [
            (0.01, 1, 1),
            (0.01, 1, 100),
            (0.01, 16, 7),
            (0.01, 16, 3000),
            (0.3, 2, 40),
            (0.01, 4, 50),
        ] {
            let (found, longest) = audited_share(fraction, slots, count);
            assert!((0.9..1.15).contains(&(found / fraction)), "{found} of {fraction}");
            let most = 2.0 * f64::from(slots).max(fraction * count as f64 + 1.0) / fraction;
            assert!(longest as f64 <= most + count as f64, "{longest}, {most} with {count}");
        }
        assert_eq!(audited_share(0.0, 1, 100).0, 0.0);
        assert_eq!(audited_share(1.0, 8, 3).0, 1.0);
        assert_eq!(audited_share(1.0, 1, 100).0, 1.0);
    }

    #[test]
    fn who_does_not_know_the_key_does_not_know_the_choice() {
        let keys = [AuditKey::default(), AuditKey::random().unwrap(), AuditKey::random().unwrap()];
        assert_ne!(keys[1], keys[2]);
        let [known, one, other] = keys.map(|key| chosen_batches(&key, 0.5));
        for (one, other) in [(&known, &one), (&known, &other), (&one, &other)] {
            let both = one.iter().filter(|i| other.contains(i)).count();
            // A quarter of 10,000, with a standard deviation of 43.
            assert!((2200..2800).contains(&both), "{both}");
        }
        assert_eq!(format!("{:?}", keys[1]), "AuditKey(secret)");
    }
}
