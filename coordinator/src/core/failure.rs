//! Failures of a job that are not caused by its search.

use osteon_common::observables::ObservedValues;
use osteon_common::outcome::{RealizationResult, encode};
use osteon_common::parameters::Point;
use osteon_common::results::JobFailure;
use osteon_search::ReplayError;
use thiserror::Error;

use crate::core::ballot::Contradiction;

/// A failure of a job.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum RunFailure {
    /// Answers for one index differ, and no answer has the majority of the hosts.
    #[error(
        "integrity error: realization {} at the point {} is {} by {} and {} by {}; one of them computes \
         wrongly, and the answers of {} give no majority. Run `osteon doctor` on each of them, and submit the \
         job again without the wrong one, or with workers on more hosts: at least three, most of them sound",
        contradiction.index, point,
        describe_answer(contradiction.answers[0].1), contradiction.answers[0].0,
        describe_answer(contradiction.answers[1].1), contradiction.answers[1].0,
        hosts(&contradiction.hosts)
    )]
    Contradiction {
        /// The answers.
        contradiction: Box<Contradiction>,
        /// The point.
        point: Point,
    },
    /// Workers are lost over one realization.
    #[error(
        "{workers} workers ({hosts}) were lost while they computed only realization {index}; to \
         reproduce \
         it, save the case file that follows as CASE.toml and run `osteon simulate CASE.toml`\n\
         {case}"
    )]
    PoisonRealization {
        /// Index of the realization.
        index: u64,
        /// Number of lost workers.
        workers: usize,
        /// Their hosts.
        hosts: String,
        /// The realization, as a case file.
        case: String,
    },
    /// The stored evaluations are not those of the job's search.
    #[error(transparent)]
    Replay(#[from] ReplayError),
    /// A stored evaluation is missing.
    #[error("the store no longer has evaluation {number} of this job; submit the job again")]
    Missing {
        /// Number of the evaluation.
        number: u64,
    },
}

impl RunFailure {
    /// Returns the kind of the failure.
    pub fn kind(&self) -> JobFailure {
        match self {
            Self::Contradiction { .. } => JobFailure::IntegrityError,
            Self::PoisonRealization { .. } => JobFailure::PoisonRealization,
            Self::Replay(_) | Self::Missing { .. } => JobFailure::Store,
        }
    }
}

/// Lists hosts, for people.
fn hosts(hosts: &[String]) -> String {
    match hosts {
        [one] => format!("host {one} contradict each other and"),
        hosts => format!("hosts {}", hosts.join(", ")),
    }
}

fn describe_observables(observables: &ObservedValues) -> String {
    let present = observables.iter().filter(|(_, value)| **value != 0.0);
    present.map(|(one, value)| format!(", {} {value:?}", one.name())).collect()
}

/// Describes an answer, for people.
pub(crate) fn describe_answer(solved: RealizationResult) -> String {
    match solved.outcome {
        Ok(velocity) => format!(
            "{velocity} m/s (bits {:016x}, estimated error {:?}{})",
            encode(solved.outcome).1.to_bits(),
            solved.estimated_error,
            describe_observables(&solved.observables)
        ),
        Err(kind) => kind.name().to_owned(),
    }
}
