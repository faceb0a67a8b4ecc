//! Which further measurement would narrow most what is known of a bone, by linear design (K. Chaloner and
//! I. Verdinelli, Statistical Science 10 (1995), Sec. 2).
//!
//! Unknown are the parameters that a job searches, with their priors, and the quantities of the setup that it says are
//! not known exactly. To first order about a point, the moments of the velocities and the means of the other observables
//! follow from them by derivatives on common germs. A measurement with a known error then reduces the covariance of
//! the unknowns, whatever it finds, so that its worth is known before it is made.

mod error;
mod knowledge;
mod measurement;
mod prediction;
mod responses;
mod study;
#[cfg(test)]
mod tests;
mod usual;

use osteon_common::check;
use osteon_common::job::{JobSpecification, MonteCarlo, Sampling};
use osteon_common::parameters::Point;
use osteon_common::violations::{Violation, Violations};
use osteon_search::prior_deviation;
use rayon::ThreadPoolBuilder;

use self::responses::Unknown;
use self::study::{ArrangedPlan, DesignStudy};

pub use self::error::DesignError;
pub use self::measurement::{Accuracy, Measurement, MeasurementPlan, NoMeasurement};
pub use self::prediction::{
    Design, DesignRequest, DesignTarget, DesignedQuantity, PredictedDeviation,
};

/// Number of realizations of each point. Differences on common germs hardly scatter.
const REALIZATIONS: u64 = 256;

impl Design {
    /// Computes the design. `progress` is called after each realization, with the number of all.
    ///
    /// # Errors
    /// See [`DesignError`].
    pub fn compute(
        request: &DesignRequest<'_>,
        progress: &(dyn Fn(u64) + Sync),
    ) -> Result<Self, DesignError> {
        let mut specification = request.specification.of_set(request.set);
        let seed = specification.monte_carlo.seed;
        let sampling = Sampling::Sobol;
        specification.monte_carlo =
            MonteCarlo { realizations: REALIZATIONS, seed, sampling, ..MonteCarlo::default() };
        let unknowns = unknowns(&specification, &request.point);
        if !unknowns.iter().any(|one| matches!(one, Unknown::Searched(..))) {
            return Err(DesignError::NothingFree);
        }
        let plans = chosen(request, &specification, &unknowns)?;
        let pool = ThreadPoolBuilder::new().num_threads(request.threads).build()?;
        let setups = 1 + plans.iter().flatten().filter(|one| one.1.is_some()).count() as u64;
        let points = 1 + unknowns.iter().map(Unknown::points).sum::<u64>();
        let all = setups * points * REALIZATIONS;
        let done = || progress(all);
        let is_mean = |one: &Measurement| matches!(one, Measurement::Mean(..));
        let observed = !request.specification.observables().is_empty()
            || plans.iter().flatten().any(|(one, _)| is_mean(one));
        let by = (&pool, &done as &(dyn Fn() + Sync));
        let study = DesignStudy::new(request, specification, unknowns, observed, by)?;
        study.design(plans)
    }
}

/// Returns what the job does not know.
fn unknowns(specification: &JobSpecification, point: &Point) -> Vec<Unknown> {
    let searched = specification.free().filter_map(|parameter| {
        Some(Unknown::Searched(parameter, prior_deviation(specification, parameter)?))
    });
    let uncertain = specification.uncertain(&point.setup(&specification.setup));
    searched.chain(uncertain.into_iter().map(Unknown::OfSetup)).collect()
}

/// Returns the plans that are compared, in the setups in which they are carried out.
fn chosen(
    request: &DesignRequest<'_>,
    specification: &JobSpecification,
    unknowns: &[Unknown],
) -> Result<Vec<ArrangedPlan>, DesignError> {
    let arranged = |measurement: Measurement| {
        let Some(setup) = measurement.setup(&specification.setup) else {
            return Ok((measurement, None));
        };
        let mut violations = Violations::new();
        check::setup(&setup, &mut violations);
        let there = JobSpecification { setup, ..specification.clone() };
        match violations.iter().next().map(Violation::to_string) {
            Some(violation) => Err(DesignError::unfit(&measurement, &violation)),
            None => Ok((measurement, Some(there))),
        }
    };
    match &request.plans {
        Some(given) => {
            given.iter().map(|plan| plan.0.iter().copied().map(arranged).collect()).collect()
        }
        None => {
            let usual = usual::usual(request, &specification.setup, unknowns).into_iter();
            Ok(usual.filter_map(|one| Some(vec![arranged(one).ok()?])).collect())
        }
    }
}
