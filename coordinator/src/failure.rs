//! Why a job fails for other reasons than its search.

use osteon_common::outcome::{Solved, encode};
use osteon_common::parameters::Point;
use thiserror::Error;

use crate::dispute::Contradiction;
use crate::search::ReplayError;

/// A failure of a job.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum Failure {
    /// Two answers for one index differ, and there is nobody to decide.
    #[error(
        "integrity error: realization {} at the point {:?} is {} by {} and {} by {}; one of them \
         computes wrongly, and no third worker was there to decide: attach three workers and \
         submit the job again, or run it on each machine alone and compare the digests",
        contradiction.index, point.0,
        shown(contradiction.answers[0].1), contradiction.answers[0].0,
        shown(contradiction.answers[1].1), contradiction.answers[1].0
    )]
    Contradiction {
        /// The answers.
        contradiction: Box<Contradiction>,
        /// The point.
        point: Point,
    },
    /// Workers vanish over one realization.
    #[error(
        "realization {index} was alone on {workers} workers that vanished ({hosts}); to reproduce \
         it, save the case file that follows as CASE.toml and run `osteon simulate CASE.toml`\n\
         {case}"
    )]
    LethalRealization {
        /// Index of the realization.
        index: u64,
        /// How many were lost.
        workers: usize,
        /// Their hosts.
        hosts: String,
        /// The realization, as a case file.
        case: String,
    },
    /// The stored evaluations are not those of the job's search.
    #[error(transparent)]
    Replay(#[from] ReplayError),
    /// A stored evaluation is gone.
    #[error("the store has no evaluation {number} of this job any more; submit it again")]
    Missing {
        /// Number of the evaluation.
        number: u64,
    },
}

/// Whether a job that failed for `reason` may end otherwise when it is run again: the reason lies in
/// machines, and not in the job.
pub fn lies_in_machines(reason: &str) -> bool {
    reason.starts_with("integrity error: ")
        || reason.contains(" workers that vanished")
        || reason.starts_with("stored evaluation ")
        || reason.starts_with("the store has no evaluation ")
}

/// An answer, for people.
pub(crate) fn shown(solved: Solved) -> String {
    match solved.outcome {
        Ok(velocity) => format!(
            "{velocity} m/s (bits {:016x}, estimated error {:?})",
            encode(solved.outcome).1.to_bits(),
            solved.estimated_error
        ),
        Err(kind) => kind.name().to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::worker_name::WorkerName;

    #[test]
    fn every_failure_of_this_kind_lies_in_machines() {
        let (point, index) = (Point([1.0; 7]), 3);
        let answer = |process| {
            let solved = Solved { outcome: Ok(3900.0), estimated_error: 0.0 };
            (WorkerName::new("node", process, 0), solved)
        };
        let contradiction = Box::new(Contradiction { index, answers: [answer(1), answer(2)] });
        let replay = ReplayError { number: 1, found: Box::new([0.0; 7]), expected: None };
        for failure in [
            Failure::Contradiction { contradiction, point },
            Failure::LethalRealization {
                index,
                workers: 3,
                hosts: "a, b".to_owned(),
                case: "[bone]".to_owned(),
            },
            Failure::Replay(replay),
            Failure::Missing { number: 2 },
        ] {
            assert!(lies_in_machines(&failure.to_string()), "{failure}");
        }
        for reason in ["", "no feasible point among the 9 evaluated", "3 of 9 realizations failed"]
        {
            assert!(!lies_in_machines(reason), "{reason}");
        }
    }
}
