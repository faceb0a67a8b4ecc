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
        "realization {index} was alone on three workers that vanished; to reproduce it, fix \
         [parameters] at {:?} (density, longitudinal_young_modulus, longitudinal_poisson_ratio, \
         longitudinal_shear_modulus, transverse_young_modulus, transverse_poisson_ratio, \
         dispersion) and run `osteon draw JOB.toml --index {index}`, then `osteon simulate`",
        point.0
    )]
    LethalRealization {
        /// Index of the realization.
        index: u64,
        /// The point.
        point: Point,
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
