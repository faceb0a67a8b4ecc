//! Derivatives of a model's moments by the parameters and quantities of the setup that are not known.

use osteon_common::job::{JobSpecification, Range};
use osteon_common::moments::{MOMENTS, MomentVector, Moments};
use osteon_common::observables::{Observable, ObservableValues, PerObservable};
use osteon_common::parameters::{Parameter, Point};
use osteon_common::realization::PointError;
use osteon_common::statistics::moments;
use osteon_common::systematic::{Shift, SystematicQuantity, Uncertain};
use osteon_search::search_box::admissible;
use osteon_solver::{Isa, Solver, Workspace};
use rayon::ThreadPool;
use rayon::prelude::*;

/// Step of the differences to either side, in edges of the box.
const STEP: f64 = 5e-3;

/// A parameter or a quantity of the setup that is not known exactly.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Unknown {
    /// A parameter that the job searches, with the standard deviation of its prior, in its unit.
    Searched(Parameter, f64),
    /// A quantity of the setup that the job says is not known exactly.
    OfSetup(Uncertain),
}

impl Unknown {
    /// Returns the name of the parameter or quantity.
    pub(super) fn name(&self) -> &'static str {
        match self {
            Self::Searched(parameter, _) => parameter.name(),
            Self::OfSetup(uncertain) => uncertain.quantity.name(),
        }
    }

    /// Returns the number of points at which the model is evaluated to measure its effect.
    pub(super) fn points(&self) -> u64 {
        match self {
            Self::Searched(..) => 2,
            Self::OfSetup(uncertain) => uncertain.shifts().count() as u64,
        }
    }
}

/// A model in one setup, whose realizations are computed on common germs.
pub(super) struct RespondingModel<'a> {
    pub(super) specification: &'a JobSpecification,
    pub(super) point: Point,
    /// Whether all observables are computed, or the velocity alone.
    pub(super) observed: bool,
    pub(super) isa: Isa,
    pub(super) pool: &'a ThreadPool,
    /// Called after each realization.
    pub(super) done: &'a (dyn Fn() + Sync),
}

/// The model's moments in one setup, and their derivatives.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Responses {
    pub(super) velocities: Moments,
    /// Means of the other observables.
    pub(super) observables: ObservableValues,
    /// Covariance of (ln v, ln Δ) of one velocity: that of n velocities is an n-th of it.
    pub(super) scatter: [[f64; 2]; 2],
    /// Changes of ln v, ln Δ and the relative ones of the observables by one standard deviation of each unknown.
    /// Of an observable that is not known it is not a number.
    pub(super) effects: Vec<MomentVector>,
}

/// Realizations at one point, in index order; those that failed are `None`.
type ObservedSample = Vec<Option<(f64, ObservableValues)>>;

impl RespondingModel<'_> {
    /// Computes the responses; `None` if the model has no moments at the point.
    ///
    /// # Errors
    /// If a point has no ensemble.
    pub(super) fn responses(&self, unknowns: &[Unknown]) -> Result<Option<Responses>, PointError> {
        let base = self.sample(&self.point)?;
        let velocities: Vec<f64> = base.iter().flatten().map(|(velocity, _)| *velocity).collect();
        let Some(found) = moments(&velocities).filter(|found| found.coefficient_of_variation > 0.0)
        else {
            return Ok(None);
        };
        let mut effects = Vec::new();
        for unknown in unknowns {
            effects.push(match unknown {
                Unknown::Searched(parameter, deviation) => {
                    self.slope(*parameter)?.map(|slope| slope * deviation)
                }
                Unknown::OfSetup(uncertain) => self.effect(uncertain, found, &base)?,
            });
        }
        let observables = PerObservable::new(|one| mean(&base, one));
        let scatter = scatter(&velocities, found);
        Ok(Some(Responses { velocities: found, observables, scatter, effects }))
    }

    /// Returns the derivatives by a parameter that is searched.
    fn slope(&self, parameter: Parameter) -> Result<MomentVector, PointError> {
        let range = self.specification.range(parameter);
        let Range::Free { lower, upper, .. } = range else { return Ok([0.0; MOMENTS]) };
        let value = self.point.get(parameter);
        let beside = |step: f64| {
            let mut point = self.point;
            point.0[parameter as usize] = (value + step).clamp(lower, upper);
            let structure = &self.specification.setup.structure;
            if admissible(structure, &point) { point } else { self.point }
        };
        let step = STEP * range.edge();
        let [from, to] = [beside(-step), beside(step)];
        let width = to.get(parameter) - from.get(parameter);
        let changes = change(&self.sample(&from)?, &self.sample(&to)?);
        Ok(changes.map(|change| change / width))
    }

    /// Returns the changes by one standard deviation of a quantity of the setup.
    fn effect(
        &self,
        uncertain: &Uncertain,
        found: Moments,
        base: &ObservedSample,
    ) -> Result<MomentVector, PointError> {
        if uncertain.quantity == SystematicQuantity::VelocityOffset {
            let relative = uncertain.above.value / found.mean;
            let mut changes = [0.0; MOMENTS];
            (changes[0], changes[1]) = (relative, -relative);
            return Ok(changes);
        }
        let shifted = |shift: Shift| {
            let mut changes = change(base, &self.sample(&self.point.shifted(Some(shift)))?);
            changes[0] -= shift.pitch_logarithm(&self.specification.setup);
            Ok::<_, PointError>(changes)
        };
        let above = shifted(uncertain.above)?;
        let Some(below) = uncertain.below else { return Ok(above) };
        let below = shifted(below)?;
        Ok(std::array::from_fn(|axis| 0.5 * (above[axis] - below[axis])))
    }

    fn sample(&self, point: &Point) -> Result<ObservedSample, PointError> {
        let ensemble = self.specification.ensemble(point)?;
        let setup = point.setup(&self.specification.setup);
        let solver = Solver::with_isa(&setup, self.isa);
        let solve = |workspace: &mut Workspace, index| {
            let found = if self.observed {
                let observed = solver.observed_realization(&ensemble, index, workspace);
                observed.ok().map(|found| (found.velocity, found.observables))
            } else {
                let velocity = solver.realization(&ensemble, index, workspace).outcome.ok();
                velocity.map(|velocity| (velocity, ObservableValues::default()))
            };
            (self.done)();
            found
        };
        let count = self.specification.monte_carlo.realizations;
        Ok(self
            .pool
            .install(|| (0..count).into_par_iter().map_init(Workspace::default, solve).collect()))
    }
}

/// Returns the changes from one sample to another, over the indices that both have.
fn change(from: &ObservedSample, to: &ObservedSample) -> MomentVector {
    let pairs =
        || from.iter().zip(to).filter_map(|(from, to)| Some((from.as_ref()?, to.as_ref()?)));
    let of = |side: fn((f64, f64)) -> f64| {
        moments(&pairs().map(|(from, to)| side((from.0, to.0))).collect::<Vec<f64>>())
    };
    let mut changes = [f64::NAN; MOMENTS];
    if let (Some(before), Some(after)) = (of(|pair| pair.0), of(|pair| pair.1)) {
        changes[0] = libm::log(after.mean / before.mean);
        changes[1] = libm::log(after.coefficient_of_variation / before.coefficient_of_variation);
    }
    for (slot, observable) in changes[2..].iter_mut().zip(Observable::ALL) {
        let (mut before, mut after) = (0.0, 0.0);
        for (from, to) in pairs() {
            if let (Some(from), Some(to)) = (from.1[observable], to.1[observable]) {
                before += from;
                after += to;
            }
        }
        *slot = (after - before) / before;
    }
    changes
}

fn mean(sample: &ObservedSample, observable: Observable) -> Option<f64> {
    let values: Vec<f64> = sample.iter().flatten().filter_map(|one| one.1[observable]).collect();
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// Returns the covariance of the influences of single velocities on both logarithms (the delta method).
fn scatter(
    velocities: &[f64],
    Moments { mean, coefficient_of_variation }: Moments,
) -> [[f64; 2]; 2] {
    let mut sums = [[0.0; 2]; 2];
    for velocity in velocities {
        let relative = velocity / mean - 1.0;
        let score = relative / coefficient_of_variation;
        let influences = [relative, 0.5 * (score * score - 1.0) - relative];
        for (row, own) in sums.iter_mut().zip(influences) {
            row.iter_mut().zip(influences).for_each(|(sum, other)| *sum += own * other);
        }
    }
    sums.map(|row| row.map(|sum| sum / velocities.len() as f64))
}
