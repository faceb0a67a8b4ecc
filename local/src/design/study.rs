//! The standard deviations that the data of a job leave, and those that further measurements would leave.

use osteon_common::inference::data_noise;
use osteon_common::job::JobSpecification;
use osteon_common::moments::{MOMENTS, MomentMatrix};
use rayon::ThreadPool;

use super::error::DesignError;
use super::knowledge::Knowledge;
use super::measurement::{Accuracy, Measurement, MeasurementPlan};
use super::prediction::{
    Design, DesignRequest, DesignTarget, DesignedQuantity, PredictedDeviation,
};
use super::responses::{RespondingModel, Responses, Unknown};

/// Number of velocities of a job without data, if none is given.
pub(super) const VELOCITIES: u64 = 100;
/// More velocities than these are not looked at, in multiples of those of the job.
const WORTH_MAX: f64 = 1e6;
/// Step of the derivatives of √(c1111/ρ), in standard deviations.
const SMALL: f64 = 1e-4;

/// Measurements that are made together, each with the job in the setup in which it is made, if that is another one.
pub(super) type ArrangedPlan = Vec<(Measurement, Option<JobSpecification>)>;

/// The job's model and noise.
pub(super) struct DesignStudy<'a> {
    request: &'a DesignRequest<'a>,
    specification: JobSpecification,
    unknowns: Vec<Unknown>,
    pool: &'a ThreadPool,
    done: &'a (dyn Fn() + Sync),
    responses: Responses,
    /// Covariance of the errors of the moments of the data.
    noise: MomentMatrix,
    velocities: u64,
}

impl<'a> DesignStudy<'a> {
    /// Computes the responses of the job's own setup, with those of its observables if `observed`.
    pub(super) fn new(
        request: &'a DesignRequest<'a>,
        specification: JobSpecification,
        unknowns: Vec<Unknown>,
        observed: bool,
        (pool, done): (&'a ThreadPool, &'a (dyn Fn() + Sync)),
    ) -> Result<Self, DesignError> {
        let model = RespondingModel {
            specification: &specification,
            point: request.point,
            observed,
            isa: request.isa,
            pool,
            done,
        };
        let responses = known_responses(&model, &unknowns, "")?;
        let (noise, velocities) = noise(request, &responses)?;
        Ok(Self { request, specification, unknowns, pool, done, responses, noise, velocities })
    }

    /// Compares plans.
    pub(super) fn design(&self, plans: Vec<ArrangedPlan>) -> Result<Design, DesignError> {
        let now = self.knowledge(self.velocities, &self.responses);
        let mut after = Vec::new();
        for plan in plans {
            match self.after(&plan) {
                Ok(known) => after.push((plan.iter().map(|one| one.0).collect(), known)),
                // The usual ones are for those jobs that they fit.
                Err(_) if self.request.plans.is_none() => {}
                Err(error) => return Err(error),
            }
        }
        let quantities = self.targets().into_iter().map(|(target, value, gradient)| {
            let predicted = |(measured, known): &(Vec<Measurement>, Knowledge)| {
                let deviation = known.deviation(&gradient);
                let worth = self.worth(&gradient, deviation);
                PredictedDeviation { plan: MeasurementPlan(measured.clone()), deviation, worth }
            };
            let mut ranking: Vec<_> = after.iter().map(predicted).collect();
            ranking.sort_by(|a, b| a.deviation.total_cmp(&b.deviation));
            let prior = Knowledge::prior(self.unknowns.len()).deviation(&gradient);
            let deviation = now.deviation(&gradient);
            DesignedQuantity { target, value, prior, deviation, ranking }
        });
        Ok(Design { velocities: self.velocities, quantities: quantities.collect() })
    }

    /// Returns the quantities that are not known, with their values, and their changes by one standard deviation of
    /// each unknown.
    fn targets(&self) -> Vec<(DesignTarget, f64, Vec<f64>)> {
        let point = self.request.point;
        let structure = &self.specification.setup.structure;
        let mut targets = Vec::new();
        if let Ok(logarithm) = structure.bulk_logarithm(&point) {
            let velocity = libm::exp(logarithm);
            let change = |unknown: &Unknown| match unknown {
                Unknown::Searched(parameter, deviation) => {
                    let mut beside = point;
                    let step = SMALL * deviation;
                    beside.0[*parameter as usize] += step;
                    let there = structure.bulk_logarithm(&beside).unwrap_or(logarithm);
                    velocity * (there - logarithm) / SMALL
                }
                Unknown::OfSetup(_) => 0.0,
            };
            let gradient: Vec<f64> = self.unknowns.iter().map(change).collect();
            if gradient.iter().any(|change| *change != 0.0) {
                targets.push((DesignTarget::BulkVelocity, velocity, gradient));
            }
        }
        for (place, unknown) in self.unknowns.iter().enumerate() {
            if let Unknown::Searched(parameter, deviation) = unknown {
                let mut gradient = vec![0.0; self.unknowns.len()];
                gradient[place] = *deviation;
                let target = DesignTarget::Parameter(*parameter);
                targets.push((target, point.get(*parameter), gradient));
            }
        }
        targets
    }

    /// Returns what is known by so many velocities, which are these responses, and by whatever the data have with each.
    fn knowledge(&self, velocities: u64, of_velocities: &Responses) -> Knowledge {
        let factor = self.velocities as f64 / velocities as f64;
        let measured: Vec<usize> = (0..MOMENTS).filter(|k| self.noise[*k][*k] > 0.0).collect();
        let derivatives: Vec<Vec<f64>> = measured
            .iter()
            .map(|&axis| column(if axis < 2 { of_velocities } else { &self.responses }, axis))
            .collect();
        let of_row = |&i: &usize| measured.iter().map(|&j| factor * self.noise[i][j]).collect();
        let covariance: Vec<Vec<f64>> = measured.iter().map(of_row).collect();
        let mut known = Knowledge::prior(self.unknowns.len());
        known.measure_together(&derivatives, &covariance);
        known
    }

    /// Returns what would be known with a plan.
    fn after(&self, plan: &ArrangedPlan) -> Result<Knowledge, DesignError> {
        let mut count = self.velocities;
        let mut both_directions = None;
        for (measurement, arranged) in plan {
            match (measurement, arranged) {
                (Measurement::Velocities(given), _) => count = *given,
                (Measurement::BothDirections, Some(specification)) => {
                    both_directions = Some(self.responses_of(measurement, specification)?);
                }
                _ => {}
            }
        }
        let mut known = self.knowledge(count, both_directions.as_ref().unwrap_or(&self.responses));
        for (measurement, arranged) in plan {
            self.measure(&mut known, *measurement, arranged.as_ref())?;
        }
        Ok(known)
    }

    /// Takes up a measurement that is made beside the velocities.
    fn measure(
        &self,
        known: &mut Knowledge,
        measurement: Measurement,
        arranged: Option<&JobSpecification>,
    ) -> Result<(), DesignError> {
        match measurement {
            Measurement::Velocities(_) | Measurement::BothDirections => {}
            Measurement::Frequency(_) | Measurement::Height(_) => {
                let Some(specification) = arranged else { return Ok(()) };
                let there = self.responses_of(&measurement, specification)?;
                let share = 1.0 / self.velocities as f64;
                let covariance = there.scatter.map(|row| row.map(|entry| share * entry).to_vec());
                known.measure_together(&[column(&there, 0), column(&there, 1)], &covariance);
            }
            Measurement::Mean(observable, accuracy) => {
                let mean = self.responses.observables[observable].unwrap_or(f64::NAN);
                let error = accuracy.standard_error(mean) / mean;
                let derivatives = column(&self.responses, 2 + observable as usize);
                if !derivatives.iter().chain([&error]).all(|one| one.is_finite()) {
                    let title = observable.row().title;
                    let why = format!("no realization has a {title}");
                    return Err(DesignError::unfit(&measurement, &why));
                }
                known.measure(&derivatives, error * error);
            }
            Measurement::Searched(_, accuracy) | Measurement::OfSetup(_, accuracy) => {
                let (place, error) = self.measured_unknown(&measurement, accuracy)?;
                let mut derivatives = vec![0.0; self.unknowns.len()];
                derivatives[place] = 1.0;
                known.measure(&derivatives, error * error);
            }
        }
        Ok(())
    }

    /// Returns the place of the unknown that is measured, and the error of this in its standard deviations.
    fn measured_unknown(
        &self,
        measurement: &Measurement,
        accuracy: Accuracy,
    ) -> Result<(usize, f64), DesignError> {
        let unfit = |why: &str| DesignError::unfit(measurement, why);
        let name = measurement.name();
        let place = self.unknowns.iter().position(|unknown| unknown.name() == name);
        let place = place.ok_or_else(|| {
            unfit("the job takes it as known: it is neither searched nor in [systematic]")
        })?;
        let error = match &self.unknowns[place] {
            Unknown::Searched(parameter, deviation) => {
                accuracy.standard_error(self.request.point.get(*parameter)) / deviation
            }
            Unknown::OfSetup(uncertain) => {
                let setup = self.request.point.setup(&self.specification.setup);
                match (uncertain.quantity.value_in(&setup), accuracy) {
                    (Some(value), _) => {
                        accuracy.standard_error(value) / (uncertain.above.value - value).abs()
                    }
                    // What it may be is one standard deviation, of which a part is left.
                    (None, Accuracy::Relative(part)) => part,
                    (None, Accuracy::Absolute(_)) => {
                        return Err(unfit(
                            "the job has no value of it; give the accuracy in per cent",
                        ));
                    }
                }
            }
        };
        match error > 0.0 && error.is_finite() {
            true => Ok((place, error)),
            false => Err(unfit("a part of 0 is 0; give the accuracy in its unit")),
        }
    }

    fn responses_of(
        &self,
        measurement: &Measurement,
        specification: &JobSpecification,
    ) -> Result<Responses, DesignError> {
        let model = RespondingModel {
            specification,
            point: self.request.point,
            observed: false,
            isa: self.request.isa,
            pool: self.pool,
            done: self.done,
        };
        known_responses(&model, &self.unknowns, &format!(" with {}", measurement.key()))
    }

    /// Returns the smallest number of velocities with which the deviation is not larger than this.
    fn worth(&self, gradient: &[f64], deviation: f64) -> Option<u64> {
        let by = |count: f64| self.knowledge(count as u64, &self.responses).deviation(gradient);
        let enough = |count: f64| by(count) <= deviation * (1.0 + 1e-9);
        let (mut few, mut many) = (self.velocities as f64, WORTH_MAX * self.velocities as f64);
        if enough(few) {
            return Some(self.velocities);
        }
        if !enough(many) {
            return None;
        }
        while many > few * 1.001 && many - few > 1.0 {
            let middle = (few * many).sqrt();
            if enough(middle) { many = middle } else { few = middle }
        }
        Some(many.ceil() as u64)
    }
}

fn column(responses: &Responses, axis: usize) -> Vec<f64> {
    responses.effects.iter().map(|effect| effect[axis]).collect()
}

fn known_responses(
    model: &RespondingModel<'_>,
    unknowns: &[Unknown],
    place: &str,
) -> Result<Responses, DesignError> {
    let found = model.responses(unknowns)?;
    let found = found.ok_or_else(|| DesignError::NoVelocities(place.to_owned()))?;
    for (unknown, effect) in unknowns.iter().zip(&found.effects) {
        if !effect[..2].iter().all(|change| change.is_finite()) {
            return Err(DesignError::NoDerivative(unknown.name()));
        }
    }
    Ok(found)
}

/// Returns the covariance of the errors of the data's moments, and the number of velocities that it is for.
fn noise(
    request: &DesignRequest<'_>,
    model: &Responses,
) -> Result<(MomentMatrix, u64), DesignError> {
    let data = request.specification.data.as_ref();
    let of_data = data.and_then(|data| data_noise(data, request.set));
    let known = of_data.map(|found| (found.covariance, found.freedom + 1));
    let (mut covariance, count) = match (known, request.velocities) {
        (Some(known), _) => known,
        (None, None) if data.is_some() => return Err(DesignError::UnknownNumber),
        (None, given) => {
            let count = given.unwrap_or(VELOCITIES);
            let mut covariance = [[0.0; MOMENTS]; MOMENTS];
            for (row, scatter) in covariance.iter_mut().zip(model.scatter) {
                row[..2].copy_from_slice(&scatter.map(|entry| entry / count as f64));
            }
            (covariance, count)
        }
    };
    let wanted = request.velocities.unwrap_or(count);
    let factor = count as f64 / wanted as f64;
    covariance.iter_mut().flatten().for_each(|entry| *entry *= factor);
    Ok((covariance, wanted))
}
