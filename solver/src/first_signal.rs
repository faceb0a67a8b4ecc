//! Observables besides the velocity of the first signal: its other extremum, decay and frequency, and the
//! phase velocities of guided waves.

use osteon_common::array_decay::decay;
use osteon_common::bone::{BoneRef, CaseBone};
use osteon_common::case::Setup;
use osteon_common::line_fit::mean;
use osteon_common::observables::{Observable, ObservableSet, ObservableValues, PerObservable};
use osteon_common::outcome::{FailureKind, RealizationResult};
use osteon_common::realization::{Ensemble, Realization};
use osteon_common::settings::{Extremum, Picking};

use crate::arrival::Arrival;
use crate::exact::guided::GuidedWave;
use crate::failure::Failure;
use crate::solver::{Solver, Workspace};

/// Observables of a picked first signal.
#[derive(Debug, Clone, PartialEq)]
pub struct FirstSignal {
    /// The extremum that the case does not pick.
    pub other_extremum: Extremum,
    /// Its velocity, m/s: that of the case with the other extremum; or why it has none.
    pub other_velocity: Result<f64, Failure>,
    /// Decay of the picked extremum along the array, dB/cm: minus the least-squares slope of 20 log10 |p|
    /// against the distance along the probe, from the first source. Negative where |p| grows.
    pub decay: f64,
    /// Frequency of the signal, Hz: 1/(2 T), with T the mean over the receivers of the time between first and
    /// second extremum, in waves of the first source; `None` if one of them was not picked.
    pub center_frequency: Option<f64>,
}

/// One realization with a velocity, and all other observables.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObservedRealization {
    /// Velocity, m/s: that of [`Solver::realization`], to the bit.
    pub velocity: f64,
    /// The other observables, where there are any.
    pub observables: ObservableValues,
}

impl Solver {
    /// Computes a realization as [`Solver::realization`] does, and these observables of it. The decay costs
    /// nothing more; for other velocity and centre frequency the case is solved once more. A realization that
    /// lacks one of them is a failure: of the kind with which the other extremum failed, or `not_finite`.
    pub fn realization_with(
        &self,
        observables: ObservableSet,
        ensemble: &Ensemble,
        index: u64,
        workspace: &mut Workspace,
    ) -> RealizationResult {
        let solved = self.draw(ensemble, index).and_then(|(own, bone)| {
            let solver = own.as_ref().unwrap_or(self);
            let arrival = solver.arrival(&bone, workspace).map_err(|failure| failure.kind)?;
            let (found, other_failure) =
                solver.observables(observables, (&bone).into(), &arrival, workspace);
            if let Some(kind) = other_failure {
                return Err(kind);
            }
            let value = |one| found[one].unwrap_or(f64::NAN);
            Ok(RealizationResult {
                observables: PerObservable::new(
                    |one| if observables[one] { value(one) } else { 0.0 },
                ),
                ..RealizationResult::solved(arrival.velocity, arrival.estimated_error)
            })
        });
        match solved {
            Ok(solved) if solved.invalid_observable().is_none() => solved,
            Ok(_) => RealizationResult::failed(FailureKind::NotFinite),
            Err(kind) => RealizationResult::failed(kind),
        }
    }

    /// Computes all observables of realization `index` of an ensemble.
    ///
    /// # Errors
    /// If it has no velocity.
    pub fn observed_realization(
        &self,
        ensemble: &Ensemble,
        index: u64,
        workspace: &mut Workspace,
    ) -> Result<ObservedRealization, FailureKind> {
        let (own, bone) = self.draw(ensemble, index)?;
        let solver = own.as_ref().unwrap_or(self);
        let arrival = solver.arrival(&bone, workspace).map_err(|failure| failure.kind)?;
        let all = ObservableSet::new(|_| true);
        let (observables, _) = solver.observables(all, (&bone).into(), &arrival, workspace);
        Ok(ObservedRealization { velocity: arrival.velocity, observables })
    }

    /// Returns the bone at `index` of an ensemble, and the solver of its setup if it has its own.
    fn draw(
        &self,
        ensemble: &Ensemble,
        index: u64,
    ) -> Result<(Option<Self>, CaseBone), FailureKind> {
        let realization = ensemble.realization(index, self.setup());
        let Realization { own_setup, bone } = realization.map_err(|_| FailureKind::NotFinite)?;
        Ok((own_setup.map(|own| self.with_setup(&own)), bone))
    }

    /// Computes those observables of a bone that are wanted, and returns why the other extremum was not
    /// picked, if it was wanted.
    fn observables(
        &self,
        wanted: ObservableSet,
        bone: BoneRef<'_>,
        arrival: &Arrival,
        workspace: &mut Workspace,
    ) -> (ObservableValues, Option<FailureKind>) {
        let needs_other = wanted[Observable::OtherVelocity] || wanted[Observable::CenterFrequency];
        let other = needs_other.then(|| self.other_arrival(bone, workspace));
        let picked = other.as_ref().and_then(|other| other.as_ref().ok());
        let needs_waves = wanted[Observable::A0Velocity] || wanted[Observable::S0Velocity];
        let waves = needs_waves.then(|| self.guided_waves(bone));
        let phase_velocity = |wave: Option<GuidedWave>| Some(wave?.phase_velocity);
        let value = |observable| match observable {
            Observable::Decay => Some(self.decay(arrival)),
            Observable::OtherVelocity => Some(picked?.velocity),
            Observable::CenterFrequency => frequency(arrival, picked?),
            Observable::A0Velocity => phase_velocity(waves?.a0),
            Observable::S0Velocity => phase_velocity(waves?.s0),
        };
        let found = ObservableValues::new(|one| if wanted[one] { value(one) } else { None });
        (found, other.and_then(|other| other.err().map(|failure| failure.kind)))
    }

    /// Computes the other observables of the first signal of a bone, of which `arrival` is the arrival.
    /// The case is solved once more, with the other extremum.
    pub fn first_signal<'a>(
        &self,
        bone: impl Into<BoneRef<'a>>,
        arrival: &Arrival,
        workspace: &mut Workspace,
    ) -> FirstSignal {
        let other = self.other_arrival(bone.into(), workspace);
        FirstSignal {
            other_extremum: self.setup().picking.extremum.other(),
            decay: self.decay(arrival),
            center_frequency: other.as_ref().ok().and_then(|other| frequency(arrival, other)),
            other_velocity: other.map(|other| other.velocity),
        }
    }

    /// Returns the arrival of the extremum that the case does not pick.
    fn other_arrival(
        &self,
        bone: BoneRef<'_>,
        workspace: &mut Workspace,
    ) -> Result<Arrival, Failure> {
        let setup = self.setup();
        let picking = Picking { extremum: setup.picking.extremum.other(), ..setup.picking };
        self.with_setup(&Setup { picking, ..setup.clone() }).arrival(bone, workspace)
    }

    /// Returns the decay of an arrival along the array, dB/cm.
    fn decay(&self, arrival: &Arrival) -> f64 {
        // A random setup never moves receivers along the probe, and its tilt turns them with it.
        let distances: Vec<f64> = self.setup().probe.distances().collect();
        decay(&distances, &arrival.amplitudes)
    }
}

/// Returns the frequency, Hz, whose half period is the mean time between the extrema of two arrivals;
/// `None` if they are the same extremum.
fn frequency(one: &Arrival, other: &Arrival) -> Option<f64> {
    let half_period = (mean(&one.times) - mean(&other.times)).abs();
    (half_period > 0.0).then(|| 0.5 / half_period)
}
