//! Why there is no design.

use osteon_common::realization::PointError;
use rayon::ThreadPoolBuildError;
use thiserror::Error;

use super::measurement::Measurement;

/// Error when there is no design.
#[derive(Debug, Error)]
pub enum DesignError {
    /// Nothing is searched.
    #[error("the job searches nothing: free a parameter, by bounds in [parameters]")]
    NothingFree,
    /// The data are moments of an unknown number of velocities.
    #[error(
        "the job does not say how many velocities its data are: give data.count, or --velocities"
    )]
    UnknownNumber,
    /// The model has no velocities in a setup.
    #[error(
        "the model has no velocities{0}: give another point, or look at them with `osteon observe`"
    )]
    NoVelocities(String),
    /// A derivative is not known.
    #[error("the effect of {0} is not known: too many realizations beside the point fail")]
    NoDerivative(&'static str),
    /// A measurement does not fit the job.
    #[error("--with {0}")]
    Unfit(String),
    /// A point has no ensemble.
    #[error(transparent)]
    Point(#[from] PointError),
    /// No threads can be started.
    #[error(transparent)]
    Threads(#[from] ThreadPoolBuildError),
}

impl DesignError {
    /// Returns the error of a measurement that does not fit the job.
    pub(super) fn unfit(measurement: &Measurement, why: &str) -> Self {
        Self::Unfit(format!("{}: {why}", measurement.key()))
    }
}
