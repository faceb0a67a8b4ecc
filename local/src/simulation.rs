//! One case, solved, as results state it.

use osteon_common::case::{Case, Setup};
use osteon_common::sampling::NominalSampling;
use osteon_common::version::Program;
use osteon_files::report::{
    self, CheckedSolution, FirstSignalReport, GuidedWaveReport, GuidedWavesReport, Receiver,
    Simulation,
};
use osteon_solver::check::{Check, Difference, MethodSolution};
use osteon_solver::{Arrival, Failure, FirstSignal, GuidedWave, GuidedWaves, Solver, Workspace};

/// What is known of one case.
#[derive(Debug, Clone)]
pub struct SolvedCase {
    /// Its setup.
    pub setup: Setup,
    /// The picked arrival, or the failure.
    pub arrival: Result<Arrival, Failure>,
    /// Other observables of the first signal, if there is an arrival.
    pub first_signal: Option<FirstSignal>,
    /// The guided waves of the bone.
    pub guided_waves: GuidedWaves,
    /// Comparison of other solutions of the same case, if requested.
    pub check: Option<Check>,
}

impl SolvedCase {
    /// Solves a case by the solver of its setup, without a check.
    pub fn solve(case: &Case, solver: &Solver) -> Self {
        let mut workspace = Workspace::default();
        let arrival = solver.arrival(&case.bone, &mut workspace);
        let signal = |arrival| solver.first_signal(&case.bone, arrival, &mut workspace);
        let first_signal = arrival.as_ref().ok().map(signal);
        let guided_waves = solver.guided_waves(&case.bone);
        Self { setup: case.setup.clone(), arrival, first_signal, guided_waves, check: None }
    }

    /// Returns the object `solver` of the result.
    pub fn solver(&self) -> report::Solver<Option<f64>> {
        solver_of(&self.setup, self.arrival.as_ref().ok())
    }

    /// Returns the result, computed by `program`.
    pub fn report(&self, program: Program) -> Simulation {
        let Self { setup, arrival, first_signal, guided_waves, check } = self;
        let Program { version, numerics, commit } = program;
        let (found, failed) = (arrival.as_ref().ok(), arrival.as_ref().err());
        let receivers = setup.probe.receivers.positions().enumerate().map(|(j, x1)| {
            let time = found.and_then(|arrival| arrival.times.get(j).copied());
            Receiver { x1, time }
        });
        Simulation {
            velocity: found.map(|arrival| arrival.velocity),
            directions: found.and_then(|arrival| arrival.directions),
            failure: failed.map(|failure| failure.kind),
            detail: failed.map(|failure| failure.detail.clone()),
            receivers: receivers.collect(),
            first_signal: first_signal.as_ref().map(first_signal_report),
            guided_waves: guided_waves_report(guided_waves),
            picking: setup.picking,
            solver: self.solver(),
            check: check.as_ref().map(|check| check.solutions().map(checked).collect()),
            version,
            numerics,
            commit,
        }
    }
}

/// Returns the object `solver` of one solved case, with the sampling that was decisive, if known.
fn solver_of(setup: &Setup, arrival: Option<&Arrival>) -> report::Solver<Option<f64>> {
    let error = arrival.map(|arrival| arrival.estimated_error);
    let mut solver = report::Solver::new(&setup.solver, NominalSampling::from_setup(setup), error);
    if let (Some(used), report::Solver::Exact { band, period, pairs, pairs_computed, passes, .. }) =
        (arrival.and_then(|arrival| arrival.passes), &mut solver)
    {
        (*band, *period) = (Some(used.last.band), Some(used.last.period));
        (*pairs, *pairs_computed) = (Some(used.last.pairs), Some(used.pairs_computed));
        *passes = Some(used.count);
    }
    solver
}

fn first_signal_report(signal: &FirstSignal) -> FirstSignalReport {
    let FirstSignal { other_extremum, other_velocity, decay, center_frequency } = signal;
    let failed = other_velocity.as_ref().err();
    FirstSignalReport {
        other_extremum: *other_extremum,
        other_velocity: other_velocity.as_ref().ok().copied(),
        other_failure: failed.map(|failure| failure.kind),
        other_detail: failed.map(|failure| failure.detail.clone()),
        decay: *decay,
        center_frequency: *center_frequency,
    }
}

fn guided_waves_report(waves: &GuidedWaves) -> GuidedWavesReport {
    let wave = |wave: GuidedWave| GuidedWaveReport {
        phase_velocity: wave.phase_velocity,
        group_velocity: wave.group_velocity,
    };
    GuidedWavesReport {
        frequency: waves.frequency,
        a0: waves.a0.map(wave),
        s0: waves.s0.map(wave),
        reason: waves.reason().map(str::to_owned),
    }
}

/// Converts one solution, with its outcome and its difference from the refined one.
fn checked(solution: &MethodSolution) -> CheckedSolution {
    let arrival = solution.arrival.as_ref();
    CheckedSolution {
        solver: solver_of(&solution.setup, arrival.ok()),
        velocity: arrival.ok().map(|arrival| arrival.velocity),
        failure: arrival.err().map(|failure| failure.kind),
        same_pick: solution.difference != Difference::Picks,
        time_difference: solution.difference.time(),
        relative_difference: solution.difference.velocity(),
    }
}
