//! Why a worker ends before it is told to.

use std::fmt;

use osteon_common::germ_source::{GermScheme, GermSource};
use osteon_common::parameters::{Parameter, Point};
use osteon_proto::endpoint::Endpoint;
use osteon_proto::identity::NoRandomness;
use osteon_proto::malformed::Malformed;
use osteon_proto::tls_failure::TlsFailure;
use thiserror::Error;
use tonic::Code;

/// Why a worker ends before it is told to.
#[derive(Debug, Error)]
pub enum WorkerError {
    /// The number of threads is not allowed.
    #[error("a worker cannot have {threads} threads; give 1 to {max}")]
    Threads {
        /// What was asked for.
        threads: u32,
        /// Most threads of a worker.
        max: u32,
    },
    /// The operating system gives no threads.
    #[error("cannot start {threads} threads: {source}")]
    Pool {
        /// What was asked for.
        threads: u32,
        /// The thread pool's error.
        source: rayon::ThreadPoolBuildError,
    },
    /// Nothing would tell it from other workers.
    #[error(transparent)]
    NoRandomness(#[from] NoRandomness),
    /// The coordinator does not take this worker; trying again would change nothing.
    #[error("the coordinator at {endpoint} rejected this worker: {reason}")]
    Refused {
        /// Address of the coordinator.
        endpoint: Endpoint,
        /// The status.
        code: Code,
        /// What the coordinator says.
        reason: String,
    },
    /// There is no trust between coordinator and worker.
    #[error("no trust between this worker and the coordinator at {endpoint}: {failure}")]
    Distrust {
        /// Address of the coordinator.
        endpoint: Endpoint,
        /// Why.
        failure: TlsFailure,
    },
    /// No coordinator for longer than was asked for.
    #[error("gave up after {seconds} s without the coordinator at {endpoint}; last: {last}")]
    GaveUp {
        /// Address of the coordinator.
        endpoint: Endpoint,
        /// Seconds without it.
        seconds: f64,
        /// What the last attempt met.
        last: String,
    },
    /// A batch that cannot be read; guessing would give wrong numbers.
    #[error("the coordinator at {endpoint} sent a batch that cannot be read: {source}")]
    Malformed {
        /// Address of the coordinator.
        endpoint: Endpoint,
        /// What is wrong with it.
        source: Malformed,
    },
    /// The solver panicked: a mistake in the program, never an outcome.
    #[error(
        "the solver panicked ({message}) on {case}; this is a mistake in osteon, please report it with this line"
    )]
    Panicked {
        /// The realization.
        case: Box<PanickedCase>,
        /// The panic's message.
        message: String,
    },
}

/// What is needed to reproduce a realization.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PanickedCase {
    /// Index of the realization.
    pub index: u64,
    /// Where the germs come from.
    pub germs: GermSource,
    /// The point (a, δ).
    pub point: Point,
}

impl fmt::Display for PanickedCase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "realization {} of seed {}", self.index, self.germs.seed)?;
        if let GermScheme::Sobol { points } = self.germs.scheme {
            write!(f, " (sobol, {points} points per scramble)")?;
        }
        f.write_str(" at")?;
        for (i, parameter) in Parameter::ALL.into_iter().enumerate() {
            let comma = if i == 0 { "" } else { "," };
            write!(f, "{comma} {} = {:?}", parameter.name(), self.point.get(parameter))?;
        }
        Ok(())
    }
}
