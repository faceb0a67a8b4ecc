//! Computes the velocity of one realization by the method that the setup requests.

use std::sync::Arc;

use osteon_common::case::{Bone, Setup};
use osteon_common::outcome::{FailureKind, Outcome, RealizationResult};
use osteon_common::realization::Ensemble;
use osteon_common::sampling;
use osteon_common::settings::Method;

use crate::exact::pass::ExactWorkspace;
use crate::exact::table_cache::TableMemory;
use crate::exact::{Exact, has_tables_of};
use crate::hybrid::{Hybrid, HybridWorkspace};
use crate::isa::Isa;

/// Solves cases of one setup; holds the tables that all its realizations share.
#[derive(Debug)]
pub struct Solver {
    setup: Setup,
    isa: Isa,
    exact: Exact,
    /// The exact method as a second source sees the bone; `None` if there is none, or if it would see the
    /// same.
    reversed: Option<Exact>,
    hybrid: Hybrid,
}

/// Scratch memory of one thread; its contents never reach a result.
#[derive(Debug, Default)]
pub struct Workspace {
    exact: ExactWorkspace,
    hybrid: HybridWorkspace,
}

/// A picked first arrival.
#[derive(Debug, Clone, PartialEq)]
pub struct Arrival {
    /// Velocity of the first arriving signal, m/s; of a bidirectional probe the harmonic mean of both
    /// directions.
    pub velocity: f64,
    /// Velocities from the first source and from the second, m/s, of a bidirectional probe.
    pub directions: Option<[f64; 2]>,
    /// Time of the picked extremum at each receiver, s, from the first source.
    pub times: Vec<f64>,
    /// Modulus of its pressure there, Pa, for a pulse of any one amplitude: only ratios mean something.
    pub amplitudes: Vec<f64>,
    /// Estimate of the velocity's relative error by discretisation, ≥ 0.
    pub estimated_error: f64,
    /// Sampling of the exact method; `None` for the hybrid method, whose discretisation is in the
    /// setup.
    pub passes: Option<PassSummary>,
}

/// Sampling of the exact method for one bone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PassSummary {
    /// Number of passes.
    pub count: u32,
    /// Total number of (frequency, wavenumber) pairs computed.
    pub pairs_computed: u64,
    /// Sampling of the last pass that contributed.
    pub last: Sampled,
}

/// Sampling of one pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sampled {
    /// Highest frequency, Hz.
    pub band: f64,
    /// Time after which the signal repeats, s.
    pub period: f64,
    /// (Frequency, wavenumber) pairs.
    pub pairs: u64,
}

/// Reason why a case has no velocity.
#[derive(Debug, Clone, PartialEq)]
pub struct Failure {
    /// Its kind.
    pub kind: FailureKind,
    /// Description as a sentence, which names the receiver where there is one.
    pub detail: String,
}

impl Arrival {
    /// Combines the arrivals of both directions. Both errors may have the same sign.
    fn with(self, other: &Self) -> Self {
        let [one, two] = [self.velocity, other.velocity];
        let passes = self.passes.zip(other.passes).map(|(one, two)| PassSummary {
            count: one.count + two.count,
            pairs_computed: one.pairs_computed + two.pairs_computed,
            last: one.last,
        });
        // The slownesses weigh the errors.
        let error = (self.estimated_error * two + other.estimated_error * one) / (one + two);
        Self {
            velocity: 2.0 / (1.0 / one + 1.0 / two),
            directions: Some([one, two]),
            estimated_error: error,
            passes,
            ..self
        }
    }
}

impl Solver {
    /// Creates a solver for cases of `setup`, which has passed validation.
    pub fn new(setup: &Setup) -> Self {
        Self::with_isa(setup, Isa::fastest())
    }

    /// Same as [`new`](Self::new), on one instruction set. The bits do not depend on it.
    pub fn with_isa(setup: &Setup, isa: Isa) -> Self {
        let memory = Arc::new(TableMemory::default());
        let probe = &setup.probe;
        let reversed = (probe.bidirectional && probe.tilt != 0.0).then(|| {
            let reversed = Setup { probe: probe.from_other_side(), ..*setup };
            Exact::new(&reversed, isa, &memory)
        });
        Self {
            setup: *setup,
            isa,
            exact: Exact::new(setup, isa, &memory),
            reversed,
            hybrid: Hybrid::with_isa(setup, isa),
        }
    }

    /// Makes this the solver for cases of `setup`. Tables that stay the same are kept.
    pub fn change_setup(&mut self, setup: &Setup) {
        if self.setup != *setup {
            *self = self.beside(setup);
        }
    }

    /// Returns a solver for another setup, which shares the tables if they are the same.
    pub(crate) fn beside(&self, setup: &Setup) -> Self {
        if !has_tables_of(setup, &self.setup) {
            return Self::with_isa(setup, self.isa);
        }
        let reversed = self
            .reversed
            .as_ref()
            .map(|exact| exact.sharing(&Setup { probe: setup.probe.from_other_side(), ..*setup }));
        Self {
            setup: *setup,
            isa: self.isa,
            exact: self.exact.sharing(setup),
            reversed,
            hybrid: Hybrid::with_isa(setup, self.isa),
        }
    }

    /// Returns the setup.
    pub fn setup(&self) -> &Setup {
        &self.setup
    }

    /// Returns the instruction set on which it computes.
    pub fn isa(&self) -> Isa {
        self.isa
    }

    /// Computes the first arrival of one bone.
    ///
    /// ```
    /// use osteon_common::case::{Bone, Setup};
    /// use osteon_common::elasticity::EngineeringConstants;
    /// use osteon_solver::{Solver, Workspace};
    ///
    /// let constants = EngineeringConstants {
    ///     longitudinal_young_modulus: 17.717e9,
    ///     longitudinal_poisson_ratio: 0.3816,
    ///     longitudinal_shear_modulus: 4.795e9,
    ///     transverse_young_modulus: 9.8254e9,
    ///     transverse_poisson_ratio: 0.4495,
    /// };
    /// let bone = Bone { density: 1598.8, elasticity: constants.elasticity().unwrap() };
    /// let solver = Solver::new(&Setup::default());
    /// let arrival = solver.arrival(&bone, &mut Workspace::default()).unwrap();
    /// assert!((3900.0..3920.0).contains(&arrival.velocity));
    /// assert_eq!(arrival.times.len(), 14); // one for each receiver
    /// ```
    ///
    /// # Errors
    /// The failure, if the case has no velocity.
    pub fn arrival(&self, bone: &Bone, workspace: &mut Workspace) -> Result<Arrival, Failure> {
        let found = match self.setup.solver.method {
            Method::Exact => self.exact.arrival(bone, &mut workspace.exact),
            Method::Hybrid => self.hybrid.arrival(bone, &mut workspace.hybrid),
        }?;
        if !self.setup.probe.bidirectional {
            return Ok(found);
        }
        let Some(reversed) = &self.reversed else {
            // By reciprocity a plate is the same from both sides.
            return Ok(Arrival { directions: Some([found.velocity; 2]), ..found });
        };
        match reversed.arrival(bone, &mut workspace.exact) {
            Ok(other) => Ok(found.with(&other)),
            Err(Failure { kind, detail }) => {
                Err(Failure { kind, detail: format!("from the second source: {detail}") })
            }
        }
    }

    /// Same as [`arrival`](Self::arrival), reduced to the data that a job keeps.
    pub fn outcome(&self, bone: &Bone, workspace: &mut Workspace) -> Outcome {
        self.arrival(bone, workspace)
            .map(|arrival| arrival.velocity)
            .map_err(|failure| failure.kind)
    }

    /// Computes the realization at `index` of `ensemble`, as a worker returns it. A bone that
    /// cannot be drawn is the failure `not_finite`. If quantities of the setup are random, the
    /// realization has tables of its own, unless only the thickness of a thick bone is random.
    pub fn realization(
        &self,
        ensemble: &Ensemble,
        index: u64,
        workspace: &mut Workspace,
    ) -> RealizationResult {
        match self.arrival_of(ensemble, index, workspace) {
            Ok(Arrival { velocity, estimated_error, .. }) => {
                RealizationResult { outcome: Ok(velocity), estimated_error, decay: 0.0 }
            }
            Err(kind) => RealizationResult::failed(kind),
        }
    }

    /// Computes the arrival of the realization at `index` of `ensemble`.
    pub(crate) fn arrival_of(
        &self,
        ensemble: &Ensemble,
        index: u64,
        workspace: &mut Workspace,
    ) -> Result<Arrival, FailureKind> {
        let bone = ensemble.bone(index).map_err(|_| FailureKind::NotFinite)?;
        let arrival = match ensemble.own_setup(index, &self.setup) {
            Some(own) => self.beside(&own).arrival(&bone, workspace),
            None => self.arrival(&bone, workspace),
        };
        arrival.map_err(|failure| failure.kind)
    }
}

/// Refuses, before anything is computed, bones through which no wave can arrive first; `speed`
/// (m/s) is an upper bound of the speed of every wave.
pub(crate) fn check_direct_wave(setup: &Setup, speed: f64) -> Result<(), Failure> {
    for (r, place) in setup.probe.places().enumerate() {
        let x = place.x;
        let earliest = sampling::earliest_arrival(setup, place, speed);
        let direct = sampling::direct_arrival(setup, place);
        if earliest >= direct {
            return Err(Failure {
                kind: FailureKind::DirectWaveFirst,
                detail: format!(
                    "at receiver {} ({x:?} m from the source) the direct wave arrives at {} µs, a wave \
                     through the bone not before {} µs",
                    r + 1,
                    readable(direct * 1e6),
                    readable(earliest * 1e6)
                ),
            });
        }
    }
    Ok(())
}

/// Formats a number for a sentence: three decimals, or an exponent if these would all be zero.
pub(crate) fn readable(value: f64) -> String {
    if (1e-2..1e6).contains(&value.abs()) { format!("{value:.3}") } else { format!("{value:.3e}") }
}

/// Advice if a pressure is not finite.
pub(crate) const OUT_OF_SCALE: &str =
    "a number of layers, probe, density or elasticity is out of scale";

/// Returns the failure of a bone whose waves have no finite speed.
pub(crate) fn speed_not_finite() -> Failure {
    Failure {
        kind: FailureKind::NotFinite,
        detail: "the bone's wave speeds came out as NaN or infinite; density or elasticity is out of scale"
            .to_owned(),
    }
}

/// Returns the failure of a case whose pressure is not finite.
pub(crate) fn pressure_not_finite() -> Failure {
    Failure {
        kind: FailureKind::NotFinite,
        detail: format!("the pressure came out as NaN or infinite; {OUT_OF_SCALE}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_sentences_are_short() {
        for (value, expected) in [
            (14.26666, "14.267"),
            (-0.05, "-0.050"),
            (1e300, "1.000e300"),
            (6.7e-16, "6.700e-16"),
            (f64::INFINITY, "inf"),
        ] {
            assert_eq!(readable(value), expected);
        }
    }
}
