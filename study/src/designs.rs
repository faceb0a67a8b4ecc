//! What a design predicts, and what identifications of simulated studies then leave open.

use osteon_common::case::Setup;
use osteon_common::group_settings::GroupSettings;
use osteon_common::inference::DerivedQuantity;
use osteon_common::job::{
    Data, JobKind, JobSpecification, Measurements, MonteCarlo, Objective, PosteriorPrior,
    PosteriorSettings, Range, Sampling, Search, SearchMethod,
};
use osteon_common::observables::{Observable, ObservableValues, ObservedColumns};
use osteon_common::parameters::Parameter;
use osteon_common::random_quantities::RandomQuantities;
use osteon_common::realization::{Ensemble, PointError};
use osteon_common::special::standard_normal_quantile;
use osteon_common::systematic::{Systematic, SystematicLaw, SystematicQuantity};
use osteon_local::design::{
    Accuracy, Design, DesignRequest, DesignTarget, Measurement, MeasurementPlan,
};
use osteon_solver::{Isa, Solver, Workspace};

use crate::blocks::{FinishedBlock, in_blocks};
use crate::draws::OPTIMUM;
use crate::generator::Generator;
use crate::identify::{RealizationCache, identify};
use crate::models::BOUNDS;
use crate::table::{MarkdownTable, two_digits};
use crate::twins::{Twins, data_seed};
use crate::{RowCallback, StudyError};

/// Default number of studies of each plan.
pub const STUDIES: u64 = 100;
/// Number of velocities of a study, unless the plan has another one.
const VELOCITIES: u64 = 100;
/// Number of realizations of the model.
const REALIZATIONS: u64 = 64;
/// Accuracies of the plans.
const DENSITY: f64 = 0.02;
const TILT: f64 = 8.7e-3;

/// What is measured beside a hundred velocities, and for which quantity.
#[derive(Debug, Clone, Copy, PartialEq)]
enum SimulatedPlan {
    AsItIs,
    More,
    Density,
    A0,
    BothDirections,
}

const PLANS: [SimulatedPlan; 5] = [
    SimulatedPlan::AsItIs,
    SimulatedPlan::More,
    SimulatedPlan::Density,
    SimulatedPlan::A0,
    SimulatedPlan::BothDirections,
];

/// Returns the standard deviations that a design predicts, and those of as many simulated studies on average.
///
/// # Errors
/// If a point has no ensemble, or an identification fails.
pub fn table(twins: &Twins, progress: RowCallback<'_>) -> Result<MarkdownTable, StudyError> {
    let mut table = MarkdownTable::new(&[
        "measured",
        "quantity",
        "studies",
        "predicted s.d.",
        "mean s.d. found",
        "predicted / found",
    ]);
    for plan in PLANS {
        let mut found: Vec<f64> = Vec::new();
        let mut observed: Vec<f64> = Vec::new();
        for block in in_blocks(twins.repetitions, |number| realized(twins, plan, number)) {
            let FinishedBlock { found: block, .. } = block?;
            found.extend(block.iter().map(|one| one.0));
            observed.extend(block.iter().map(|one| one.1));
        }
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let (key, predicted) = predicted(twins, plan, mean(&observed))?;
        table.push(vec![
            key,
            plan.target().name().to_owned(),
            found.len().to_string(),
            format!("{predicted:.4e}"),
            format!("{:.4e}", mean(&found)),
            two_digits(Some(predicted / mean(&found))),
        ]);
        progress(&table.last_row());
    }
    Ok(table)
}

impl SimulatedPlan {
    fn target(self) -> DesignTarget {
        match self {
            Self::AsItIs | Self::More | Self::BothDirections => DesignTarget::BulkVelocity,
            Self::Density => DesignTarget::Parameter(Parameter::Density),
            Self::A0 => DesignTarget::Parameter(Parameter::LongitudinalShearModulus),
        }
    }

    fn velocities(self) -> u64 {
        if self == Self::More { 4 * VELOCITIES } else { VELOCITIES }
    }

    /// Returns the plans that a design is to compare: this one, or none if nothing is added. `of_a0` is the relative
    /// standard error of the mean velocity of A0 in the simulated studies.
    fn plans(self, of_a0: f64) -> Vec<MeasurementPlan> {
        let one = match self {
            Self::AsItIs => return Vec::new(),
            Self::More => Measurement::Velocities(self.velocities()),
            Self::Density => Measurement::Searched(Parameter::Density, Accuracy::Relative(DENSITY)),
            Self::A0 => Measurement::Mean(Observable::A0Velocity, Accuracy::Relative(of_a0)),
            Self::BothDirections => Measurement::BothDirections,
        };
        vec![MeasurementPlan(vec![one])]
    }

    /// Returns the job of a study without data.
    fn job(self, seed: u64) -> JobSpecification {
        let mut parameters = OPTIMUM.0.map(Range::Fixed);
        let free: &[Parameter] = match self {
            // Whose intervals are those of linear theory.
            Self::BothDirections => &[Parameter::LongitudinalYoungModulus, Parameter::Dispersion],
            _ => &[
                Parameter::Density,
                Parameter::LongitudinalYoungModulus,
                Parameter::LongitudinalShearModulus,
                Parameter::Dispersion,
            ],
        };
        for &parameter in free {
            let (lower, upper) = BOUNDS[parameter as usize];
            let start = OPTIMUM.get(parameter);
            parameters[parameter as usize] = Range::Free { start, lower, upper };
        }
        let mut systematic = Systematic::default();
        if self == Self::BothDirections {
            let law = SystematicLaw { spread: Some(TILT), ..SystematicLaw::default() };
            systematic.laws[SystematicQuantity::Tilt as usize] = law;
        }
        let by = if self == Self::BothDirections {
            SearchMethod::Newton
        } else {
            SearchMethod::Posterior
        };
        JobSpecification {
            kind: JobKind::Identification,
            setup: Setup::default(),
            data: None,
            parameters,
            random: RandomQuantities::default(),
            systematic,
            groups: GroupSettings::default(),
            monte_carlo: MonteCarlo {
                realizations: REALIZATIONS,
                seed,
                sampling: Sampling::Sobol,
                control_variate: true,
                ..MonteCarlo::default()
            },
            objective: Objective::default(),
            search: Search::by(by),
            posterior: (by == SearchMethod::Posterior).then(PosteriorSettings::default),
        }
    }
}

/// Returns the key of a plan and the standard deviation that its design predicts.
fn predicted(twins: &Twins, plan: SimulatedPlan, of_a0: f64) -> Result<(String, f64), StudyError> {
    let job = plan.job(twins.seed);
    let request = DesignRequest {
        specification: &job,
        set: 0,
        point: OPTIMUM,
        velocities: Some(VELOCITIES),
        plans: Some(plan.plans(of_a0)),
        isa: twins.isa,
        threads: rayon::current_num_threads(),
    };
    let design = Design::compute(&request, &|_| {})?;
    let quantity = design.quantities.iter().find(|one| one.target == plan.target());
    let Some(quantity) = quantity else { return Ok((String::new(), f64::NAN)) };
    Ok(match quantity.ranking.first() {
        Some(found) => (found.plan.key(), found.deviation),
        None => ("as it is".to_owned(), quantity.deviation),
    })
}

/// Returns the standard deviation that study number `number` of a plan leaves, and the relative error of its mean
/// velocity of A0. `None` if it has too few velocities or no result.
fn realized(
    twins: &Twins,
    plan: SimulatedPlan,
    number: u64,
) -> Result<Option<(f64, f64)>, StudyError> {
    let mut job = plan.job(twins.seed + number);
    job.setup.probe.bidirectional = plan == SimulatedPlan::BothDirections;
    let seed = data_seed(twins.seed, number);
    let bones = bones(&job.setup, plan.velocities(), seed, twins.isa)?;
    if bones.len() < plan.velocities() as usize {
        return Ok(None);
    }
    let velocities: Vec<f64> = bones.iter().map(|bone| bone.0).collect();
    let a0: Vec<f64> = bones.iter().filter_map(|bone| bone.1[Observable::A0Velocity]).collect();
    let of_a0 = relative_error(&a0);
    let mut data = Data::from_velocities(velocities.clone());
    if plan == SimulatedPlan::A0 {
        let mut observables = ObservedColumns::default();
        observables[Observable::A0Velocity] = Some(a0);
        data.measurements = Measurements::Velocities { velocities, subjects: None, observables };
    }
    job.data = Some(data);
    if let (SimulatedPlan::Density, Some(posterior)) = (plan, &mut job.posterior) {
        let mut generator = Generator::for_index(!twins.seed, number);
        let error = standard_normal_quantile(generator.between(1e-9, 1.0 - 1e-9));
        let spread = DENSITY * OPTIMUM.density();
        let center = OPTIMUM.density() + error * spread;
        let law = PosteriorPrior::Normal { center, spread };
        posterior.priors[Parameter::Density as usize] = law;
    }
    let conclusions = identify(&job, &mut RealizationCache::new(), twins.isa)?.result.conclusions;
    let deviation = match (&conclusions.posterior, plan.target()) {
        (Some(posterior), DesignTarget::BulkVelocity) => {
            Some(posterior.bulk_velocity.standard_deviation)
        }
        (Some(posterior), DesignTarget::Parameter(parameter)) => {
            let place = posterior.free.iter().position(|one| *one == parameter);
            place.map(|place| posterior.parameters[place].standard_deviation)
        }
        (None, _) => conclusions.inference.and_then(|found| standard_error(found.bulk_velocity)),
    };
    Ok(deviation.map(|deviation| (deviation, of_a0)))
}

fn standard_error(quantity: DerivedQuantity) -> Option<f64> {
    quantity.known.map(|known| known.standard_error)
}

/// Returns the first `count` bones with a velocity, with their other observables.
fn bones(
    setup: &Setup,
    count: u64,
    seed: u64,
    isa: Isa,
) -> Result<Vec<(f64, ObservableValues)>, PointError> {
    let ensemble = Ensemble::new(&OPTIMUM, seed)?;
    let solver = Solver::with_isa(setup, isa);
    let mut workspace = Workspace::default();
    let observe = |index| {
        let found = solver.observed_realization(&ensemble, index, &mut workspace).ok()?;
        Some((found.velocity, found.observables))
    };
    Ok((0..2 * count).filter_map(observe).take(count as usize).collect())
}

/// Returns the relative standard error of the mean.
fn relative_error(values: &[f64]) -> f64 {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let square = values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>();
    (square / (count * (count - 1.0))).sqrt() / mean
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One study of each plan; its own standard deviation scatters with that of its velocities.
    #[test]
    fn studies_leave_about_what_is_predicted() {
        let table =
            table(&Twins { repetitions: 1, seed: 3, isa: Isa::fastest() }, &|_| {}).unwrap();
        assert_eq!(table.rows().len(), PLANS.len());
        for row in table.rows() {
            let ratio: f64 = row[5].parse().unwrap();
            assert!((0.7..1.4).contains(&ratio), "{table}");
        }
    }
}
