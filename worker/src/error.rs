//! Errors that end a worker.

use std::fmt;

use crate::self_test::KNOWN_DIGEST;
use osteon_common::germ_source::{GermScheme, GermSource};
use osteon_common::parameters::Point;
use osteon_proto::identity::NoRandomness;
use osteon_proto::malformed::Malformed;
use osteon_transport::endpoint::Endpoint;
use osteon_transport::tls_failure::TlsFailure;
use thiserror::Error;
use tonic::Code;

/// An error that ends a worker.
#[derive(Debug, Error)]
pub enum WorkerError {
    /// The number of threads is out of range.
    #[error("a worker cannot have {threads} threads; give 1 to {max}")]
    Threads {
        /// Number of threads requested.
        threads: u32,
        /// Maximum number of threads of a worker.
        max: u32,
    },
    /// The operating system cannot create the threads.
    #[error("cannot start {threads} threads: {source}")]
    Pool {
        /// Number of threads requested.
        threads: u32,
        /// The thread pool's error.
        source: rayon::ThreadPoolBuildError,
    },
    /// The operating system provides no random numbers, so the worker has no unique instance
    /// number.
    #[error(transparent)]
    NoRandomness(#[from] NoRandomness),
    /// The coordinator refused this worker; trying again would change nothing.
    #[error("the coordinator at {endpoint} rejected this worker: {reason}")]
    Refused {
        /// Address of the coordinator.
        endpoint: Endpoint,
        /// The gRPC status code.
        code: Code,
        /// The coordinator's explanation.
        reason: String,
    },
    /// The host of this worker is banned for wrong answers.
    #[error("the coordinator at {endpoint} rejected this worker: {reason}")]
    Banned {
        /// Address of the coordinator.
        endpoint: Endpoint,
        /// The coordinator's explanation.
        reason: String,
    },
    /// This machine computes other bits than it should.
    #[error(
        "this machine computes wrongly: the digest of a known batch on {isa} is {found}, and must be \
         {KNOWN_DIGEST}; run `osteon doctor`, test its memory and processor, and report this if they are sound"
    )]
    ComputesWrongly {
        /// Name of the instruction set.
        isa: &'static str,
        /// The digest.
        found: String,
    },
    /// Coordinator and worker do not trust each other's certificates, or cannot establish TLS.
    #[error("no trust between this worker and the coordinator at {endpoint}: {failure}")]
    Distrust {
        /// Address of the coordinator.
        endpoint: Endpoint,
        /// The TLS failure.
        failure: TlsFailure,
    },
    /// No coordinator was reached within the allowed time.
    #[error("gave up after {seconds} s without the coordinator at {endpoint}; last: {last}")]
    GaveUp {
        /// Address of the coordinator.
        endpoint: Endpoint,
        /// Time without a coordinator, s.
        seconds: f64,
        /// Error of the last attempt.
        last: String,
    },
    /// A batch or an evaluation cannot be read; a guess could give wrong numbers.
    #[error("the coordinator at {endpoint} sent a message that cannot be read: {source}")]
    Malformed {
        /// Address of the coordinator.
        endpoint: Endpoint,
        /// The defect of the message.
        source: Malformed,
    },
    /// The solver panicked: a bug in the program, never an outcome.
    #[error(
        "the solver panicked ({message}) on {case}; this is a bug in osteon; please report it with this line"
    )]
    Panicked {
        /// The realization at which it panicked.
        case: Box<PanickedCase>,
        /// The panic's message.
        message: String,
    },
}

/// The data needed to reproduce a realization.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PanickedCase {
    /// Index of the realization.
    pub index: u64,
    /// Source of the germs.
    pub germs: GermSource,
    /// The point (a, δ).
    pub point: Point,
}

impl WorkerError {
    /// Returns whether the worker must not be started again before its machine is repaired.
    pub fn is_about_the_machine(&self) -> bool {
        matches!(self, Self::Banned { .. } | Self::ComputesWrongly { .. })
    }
}

impl fmt::Display for PanickedCase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "realization {} of seed {}", self.index, self.germs.seed)?;
        if let GermScheme::Sobol { points } = self.germs.scheme {
            write!(f, " (sobol, {points} points per scramble)")?;
        }
        f.write_str(" at")?;
        for (i, (parameter, value)) in self.point.given().enumerate() {
            let comma = if i == 0 { "" } else { "," };
            write!(f, "{comma} {} = {value:?}", parameter.name())?;
        }
        Ok(())
    }
}
