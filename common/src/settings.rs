//! Settings of picking and of the wave solver.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The extremum of the first arriving packet that gives the time of flight.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Extremum {
    /// E1, the packet's first extremum (the paper's criterion).
    #[default]
    First,
    /// E2, the packet's next extremum.
    Second,
}

impl Extremum {
    /// All criteria, in the order of a user's file.
    pub const ALL: [Self; 2] = [Self::First, Self::Second];

    /// Returns the name used in files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::First => "first",
            Self::Second => "second",
        }
    }
}

/// The criterion of the first arriving signal.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Picking {
    /// The extremum of the packet.
    pub extremum: Extremum,
    /// An extremum opens the packet if its ratio to the packet's peak, in the median over the
    /// receivers, is above this threshold; 0 < threshold < 1.
    pub threshold: f64,
}

impl Default for Picking {
    fn default() -> Self {
        Self { extremum: Extremum::First, threshold: 0.05 }
    }
}

/// Method of computing the transient waves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Exact layers in the (frequency, wavenumber) domain.
    #[default]
    Exact,
    /// The paper's method: Fourier in x1, spectral elements in x3, time steps.
    Hybrid,
}

impl Method {
    /// All methods, in the order of a user's file.
    pub const ALL: [Self; 2] = [Self::Exact, Self::Hybrid];

    /// Returns the name used in files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Hybrid => "hybrid",
        }
    }
}

/// Settings of the wave solver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolverSettings {
    /// The method.
    pub method: Method,
    /// 0.5 to 16: larger is more accurate and slower. For the hybrid method, its square root
    /// divides element size and time step.
    pub refinement: f64,
    /// Largest element of the hybrid method along x3 at refinement 1, m, 1e-6 to 1e-2. Other
    /// methods have the default.
    pub element_size: f64,
    /// Polynomial degree of the hybrid method's elements, 2 to 12. Other methods have the default.
    pub element_order: u32,
    /// Time step of the hybrid method's first pass at refinement 1, s, above 0; `None`: chosen from
    /// the stability limit. Other methods have `None`.
    pub time_step: Option<f64>,
}

impl Default for SolverSettings {
    fn default() -> Self {
        Self {
            method: Method::Exact,
            refinement: 1.0,
            element_size: 0.5e-3,
            element_order: 8,
            time_step: None,
        }
    }
}
