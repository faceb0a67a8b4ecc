//! Which batches are computed twice, by different workers.

use crate::ids::JobId;

/// Whether a batch of `job` is audited that begins at index `first` of evaluation `number`. A
/// function of these alone: whoever computes it cannot know, since no worker learns the numbers
/// of jobs and evaluations, and a restart chooses the same.
pub(crate) fn is_chosen(job: JobId, number: u64, first: u64, fraction: f64) -> bool {
    let mut hasher = blake3::Hasher::new();
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
            let batches = (0..10_000).filter(|i| is_chosen(JobId(i % 7), i % 90, i * 16, fraction));
            let chosen = batches.count();
            assert!((least..=most).contains(&chosen), "{chosen} at {fraction}");
        }
    }
}
