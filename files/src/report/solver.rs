//! The object `solver`: how velocities were computed.

use osteon_common::results;
use osteon_common::sampling::NominalSampling;
use osteon_common::settings::{Method, SolverSettings};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The method that computed the velocities, its sampling, and an estimate of their relative errors.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "method", rename_all = "snake_case")]
pub enum Solver<E> {
    /// Exact solution of the layered medium for each frequency and wavenumber. In the result of a job the
    /// sampling is the nominal one, at the usual speeds of bone, and a realization with faster waves may
    /// use another.
    Exact {
        /// Refinement of the sampling; 1 is the default.
        refinement: f64,
        /// Highest frequency, Hz.
        band: Option<f64>,
        /// Period, s.
        period: Option<f64>,
        /// Number of (frequency, wavenumber) pairs.
        pairs: Option<u64>,
        /// Estimated relative error of the velocity, or of a set of them, due to discretisation.
        estimated_error: E,
        /// Number of pairs that were computed in all; only of a simulation.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pairs_computed: Option<u64>,
        /// Number of passes for the bone; only of a simulation.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        passes: Option<u32>,
    },
    /// Fourier in x1, spectral elements in x3, time steps.
    Hybrid {
        /// Refinement of the discretisation; 1 is the default.
        refinement: f64,
        /// Largest element along x3 at refinement 1, m.
        element_size: f64,
        /// Polynomial degree of the elements.
        element_order: u32,
        /// Time step of the first pass at refinement 1, s; null for the stability limit.
        time_step: Option<f64>,
        /// Estimated relative error of the velocity, or of a set of them, due to discretisation.
        estimated_error: E,
    },
}

impl<E> Solver<E> {
    /// The object of these settings.
    pub fn new(
        settings: &SolverSettings,
        nominal: Option<NominalSampling>,
        estimated_error: E,
    ) -> Self {
        let SolverSettings { method, refinement, element_size, element_order, time_step } =
            *settings;
        match method {
            Method::Exact => Self::Exact {
                refinement,
                band: nominal.map(|nominal| nominal.band),
                period: nominal.map(|nominal| nominal.period),
                pairs: nominal.map(|nominal| nominal.pairs),
                estimated_error,
                pairs_computed: None,
                passes: None,
            },
            Method::Hybrid => {
                Self::Hybrid { refinement, element_size, element_order, time_step, estimated_error }
            }
        }
    }
}

/// Estimated relative errors, by discretisation, of the velocities of a set of realizations; null
/// where none has a velocity.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct EstimatedErrors {
    /// The median of the errors.
    pub median: Option<f64>,
    /// The largest of the errors.
    pub largest: Option<f64>,
}

impl From<Option<results::EstimatedError>> for EstimatedErrors {
    fn from(errors: Option<results::EstimatedError>) -> Self {
        Self {
            median: errors.map(|errors| errors.median),
            largest: errors.map(|errors| errors.largest),
        }
    }
}
