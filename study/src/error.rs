//! Why a study has no table.

use std::convert::Infallible;

use osteon_common::realization::PointError;
use osteon_search::IdentifyError;
use thiserror::Error;

/// Why a study has no table.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum StudyError {
    /// A point has no ensemble.
    #[error(transparent)]
    Point(#[from] PointError),
    /// An identification was not made.
    #[error(transparent)]
    Identification(#[from] IdentifyError<Infallible>),
}
