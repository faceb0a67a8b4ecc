//! How a velocity is picked, and how the waves are computed.

/// Which extremum of the first arriving packet gives the time of flight.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Extremum {
    /// E1, the packet's first extremum (the paper's criterion).
    #[default]
    First,
    /// E2, the packet's next extremum.
    Second,
}

impl Extremum {
    /// Every criterion, in the order of a user's file.
    pub const ALL: [Self; 2] = [Self::First, Self::Second];

    /// Name in files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::First => "first",
            Self::Second => "second",
        }
    }
}

/// The criterion of the first arriving signal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Picking {
    /// Which extremum of the packet.
    pub extremum: Extremum,
    /// An extremum opens the packet when its ratio to the packet's peak, in the median over the
    /// receivers, is above this threshold; 0 < threshold < 1.
    pub threshold: f64,
}

impl Default for Picking {
    fn default() -> Self {
        Self { extremum: Extremum::First, threshold: 0.05 }
    }
}

/// How the transient waves are computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// Exact layers in (frequency, wavenumber).
    #[default]
    Exact,
}

impl Method {
    /// Every method, in the order of a user's file.
    pub const ALL: [Self; 1] = [Self::Exact];

    /// Name in files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact",
        }
    }
}

/// Settings of the wave solver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolverSettings {
    /// The method.
    pub method: Method,
    /// 0.5 to 16: larger is more accurate and slower.
    pub refinement: f64,
}

impl Default for SolverSettings {
    fn default() -> Self {
        Self { method: Method::Exact, refinement: 1.0 }
    }
}
