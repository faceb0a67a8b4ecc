//! The data sets by which posteriors are calibrated.

use osteon_solver::Isa;

/// Data sets whose posteriors are computed.
#[derive(Debug, Clone, Copy)]
pub struct PosteriorCalibration {
    /// How the velocities are made.
    pub scenario: Scenario,
    /// Number of velocities of each data set.
    pub velocities: u64,
    /// Number of the first parameter set, to continue an earlier table.
    pub first: u64,
    /// Number of parameter sets.
    pub repetitions: u64,
    /// Seed of the parameter sets, the data and the germs.
    pub seed: u64,
    /// Instruction set, which affects only the time.
    pub isa: Isa,
}

/// How velocities are made from realizations of the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scenario {
    /// They are independent realizations.
    Independent,
    /// Each subject has four velocities; between a fifth and nearly all of the variance lies between
    /// subjects, often nearly all.
    Subjects,
    /// They are rounded to 10 m/s.
    Rounded,
    /// One in a hundred is half or twice the velocity.
    Outliers,
    /// Their deviations from the mean are scaled to those of Student's law with six degrees of
    /// freedom, with the same variance.
    HeavyTails,
}

impl Scenario {
    /// All scenarios.
    pub const ALL: [Self; 5] =
        [Self::Independent, Self::Subjects, Self::Rounded, Self::Outliers, Self::HeavyTails];

    /// Returns the name used on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Independent => "independent",
            Self::Subjects => "subjects",
            Self::Rounded => "rounded",
            Self::Outliers => "outliers",
            Self::HeavyTails => "heavy-tails",
        }
    }
}
