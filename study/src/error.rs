//! Errors of studies.

use std::convert::Infallible;

use osteon_common::realization::PointError;
use osteon_local::design::DesignError;
use osteon_local::synthesis::SynthesisError;
use osteon_search::IdentifyError;
use thiserror::Error;

/// Reason why a study has no table.
#[derive(Debug, Error)]
pub enum StudyError {
    /// A point has no ensemble.
    #[error(transparent)]
    Point(#[from] PointError),
    /// An identification failed.
    #[error(transparent)]
    Identification(#[from] IdentifyError<Infallible>),
    /// There is no design.
    #[error(transparent)]
    Design(#[from] DesignError),
    /// There are no signals.
    #[error(transparent)]
    Signals(#[from] SynthesisError),
}
