//! An evaluation, as the coordinator sends it to a worker before the batches that refer to it.

use osteon_common::case::Setup;
use osteon_common::check;
use osteon_common::germ_source::{GermScheme, GermSource};
use osteon_common::job::Sampling;
use osteon_common::limits::{REALIZATIONS_MAX, SEED_MAX};
use osteon_common::observables::ObservableSet;
use osteon_common::parameters::Point;
use osteon_common::random_quantities::RandomQuantities;
use osteon_common::violations::Violations;

use crate::choice::SAMPLING;
use crate::malformed::Malformed;
use crate::observed;
use crate::parameter_values::{point_from_message, point_to_message};
use crate::setup::{self, SetupMessages, random_from_message, random_to_message};
use crate::v1;

/// The part that all batches of one evaluation have in common. With it, an index determines a
/// realization.
#[derive(Debug, Clone, PartialEq)]
pub struct EvaluationInput {
    /// Number of the evaluation, unique for the life of the coordinator.
    pub id: u64,
    /// Layers, probe, picking, solver.
    pub setup: Setup,
    /// The point (a, δ).
    pub point: Point,
    /// Source of the germs.
    pub germs: GermSource,
    /// Scatter of quantities of the setup.
    pub random: RandomQuantities,
    /// The observables of each realization that are asked for.
    pub observables: ObservableSet,
}

/// Returns the message of an evaluation.
pub fn to_message(evaluation: &EvaluationInput) -> v1::Evaluation {
    let SetupMessages { layers, probe, picking, solver, bone } =
        setup::to_messages(&evaluation.setup);
    let (sampling, points) = match evaluation.germs.scheme {
        GermScheme::Streams => (Sampling::MonteCarlo, None),
        GermScheme::Sobol { points } => (Sampling::Sobol, Some(points)),
    };
    v1::Evaluation {
        evaluation: evaluation.id,
        layers: Some(layers),
        probe: Some(probe),
        picking: Some(picking),
        solver: Some(solver),
        bone,
        point: Some(point_to_message(&evaluation.point)),
        seed: evaluation.germs.seed,
        sampling: SAMPLING.number(sampling),
        points_per_scramble: points,
        random: random_to_message(&evaluation.random),
        observables: observed::names(evaluation.observables),
    }
}

/// Returns the evaluation of a message.
///
/// # Errors
/// If the setup is incomplete (a worker must not fill in its own defaults) or invalid, if the point
/// does not have seven finite numbers, if a number is beyond its limit, or if an observable is unknown.
pub fn from_message(message: &v1::Evaluation) -> Result<EvaluationInput, Malformed> {
    if message.seed > SEED_MAX {
        let allowed = "it must be at most 2^63 - 1";
        return Err(Malformed::OutOfRange { field: "seed", value: message.seed as f64, allowed });
    }
    let mut violations = Violations::new();
    let setup = read_setup(message, &mut violations)?;
    let point = point_from_message(message.point.as_ref())?;
    let at_point = point.setup(&setup);
    if at_point != setup {
        check::setup(&at_point, &mut violations);
    }
    let random = read_random(message, &at_point, &mut violations)?;
    let sampling = SAMPLING.required(message.sampling, "sampling")?;
    violations.into_result(()).map_err(Malformed::InvalidSetup)?;
    let germs = GermSource { seed: message.seed, scheme: scheme(message, sampling)? };
    let observables = observed::set_from_names(&message.observables)?;
    Ok(EvaluationInput { id: message.evaluation, setup, point, germs, random, observables })
}

/// Returns the scheme by which germs are generated from the seed.
fn scheme(message: &v1::Evaluation, sampling: Sampling) -> Result<GermScheme, Malformed> {
    let points = message.points_per_scramble;
    let (value, allowed) = match (sampling, points) {
        (Sampling::MonteCarlo, None) => return Ok(GermScheme::Streams),
        (Sampling::MonteCarlo, Some(points)) => (points, "it must be absent without scrambles"),
        (Sampling::Sobol, Some(points @ 1..=REALIZATIONS_MAX)) => {
            return Ok(GermScheme::Sobol { points });
        }
        (Sampling::Sobol, Some(points)) => (points, "it must be 1 to 10^7"),
        (Sampling::Sobol, None) => {
            return Err(Malformed::Missing { field: "points_per_scramble" });
        }
    };
    let field = "points_per_scramble";
    Err(Malformed::OutOfRange { field, value: value as f64, allowed })
}

/// Reads the setup and checks that it is complete, i.e. that encoding it again gives the same
/// messages.
fn read_setup(message: &v1::Evaluation, violations: &mut Violations) -> Result<Setup, Malformed> {
    let (Some(layers), Some(probe), Some(picking), Some(solver)) =
        (&message.layers, &message.probe, &message.picking, &message.solver)
    else {
        return Err(Malformed::IncompleteSetup);
    };
    let bone = message.bone.as_ref();
    let setup = setup::from_messages(
        Some(layers),
        Some(probe),
        Some(picking),
        Some(solver),
        bone,
        violations,
    );
    check::setup(&setup, violations);
    if !violations.is_empty() {
        return Ok(setup);
    }
    let written = setup::to_messages(&setup);
    let complete = written.layers == *layers
        && written.probe == *probe
        && written.picking == *picking
        && written.solver == *solver
        && written.bone.as_ref() == bone;
    if complete { Ok(setup) } else { Err(Malformed::IncompleteSetup) }
}

/// Reads and checks the random quantities, which must be complete.
fn read_random(
    message: &v1::Evaluation,
    setup: &Setup,
    violations: &mut Violations,
) -> Result<RandomQuantities, Malformed> {
    let Some(message) = &message.random else { return Ok(RandomQuantities::default()) };
    let random = random_from_message(message, violations);
    check::random_quantities(&random, setup, violations);
    let complete = !violations.is_empty() || random_to_message(&random).as_ref() == Some(message);
    if complete { Ok(random) } else { Err(Malformed::IncompleteSetup) }
}

#[cfg(test)]
mod tests {
    use osteon_fuzz::properties;
    use proptest::prelude::*;

    use super::*;

    const EVALUATION: fn(u64, f64, u64) -> EvaluationInput = |id, density, seed| EvaluationInput {
        id,
        setup: Setup::default(),
        point: Point::of_bone([density, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029]),
        random: RandomQuantities::default(),
        germs: GermSource::streams(seed),
        observables: ObservableSet::NONE,
    };

    properties! {
        fn an_evaluation_survives_the_wire(
            id in any::<u64>(),
            density in 1e-300..1e300,
            thickness in 1e-3..8e-3,
            seed in 0..=SEED_MAX,
            points in proptest::option::of(1..=REALIZATIONS_MAX),
            deviation in proptest::option::of(1e-6..1e-4),
            observables in any::<[bool; osteon_common::observables::OBSERVABLES]>(),
        ) {
            let mut evaluation = EVALUATION(id, density, seed);
            evaluation.observables = osteon_common::observables::PerObservable(observables);
            evaluation.setup.layers.bone_thickness = thickness;
            evaluation.random.bone_thickness.standard_deviation = deviation;
            if let Some(points) = points {
                evaluation.germs.scheme = GermScheme::Sobol { points };
            }
            let message = to_message(&evaluation);
            prop_assert_eq!(message.evaluation, id);
            prop_assert_eq!(from_message(&message), Ok(evaluation));
        }
    }

    fn refused(change: impl FnOnce(&mut v1::Evaluation)) -> Malformed {
        let mut message = to_message(&EVALUATION(1, 1598.8, 1));
        change(&mut message);
        from_message(&message).unwrap_err()
    }

    #[test]
    fn what_a_worker_must_not_guess_is_refused() {
        assert_eq!(refused(|message| message.layers = None), Malformed::IncompleteSetup);
        let without_density = |message: &mut v1::Evaluation| {
            message.layers.as_mut().unwrap().coupling.as_mut().unwrap().density = None;
        };
        assert_eq!(refused(without_density), Malformed::IncompleteSetup);
        let field = "sampling";
        assert_eq!(refused(|message| message.sampling = 0), Malformed::Missing { field });
        let unknown = Malformed::UnknownValue { field, value: 17 };
        assert_eq!(refused(|message| message.sampling = 17), unknown);
        let unspecified =
            |message: &mut v1::Evaluation| message.picking.as_mut().unwrap().extremum = 0;
        assert_eq!(refused(unspecified), Malformed::IncompleteSetup);
        let hybrid = |message: &mut v1::Evaluation| {
            message.solver.as_mut().unwrap().set_method(v1::SolverMethod::Hybrid);
        };
        assert_eq!(refused(hybrid), Malformed::IncompleteSetup);
        let element_size = |message: &mut v1::Evaluation| {
            message.solver.as_mut().unwrap().element_size = Some(0.5e-3);
        };
        assert!(matches!(refused(element_size), Malformed::InvalidSetup(_)));
        let negative = |message: &mut v1::Evaluation| {
            message.layers.as_mut().unwrap().coupling.as_mut().unwrap().density = Some(-1.0);
        };
        assert!(matches!(refused(negative), Malformed::InvalidSetup(_)));
        let scatter = |standard_deviation, distribution| {
            refused(|message| {
                let bone_thickness = Some(v1::Scatter { standard_deviation, distribution });
                message.random = Some(v1::RandomQuantities {
                    bone_thickness,
                    ..v1::RandomQuantities::default()
                });
            })
        };
        let normal = v1::RandomDistribution::Normal.into();
        assert_eq!(scatter(Some(1e-4), 0), Malformed::IncompleteSetup);
        assert!(matches!(scatter(None, normal), Malformed::InvalidSetup(_)));
        assert!(matches!(scatter(Some(1e-3), normal), Malformed::InvalidSetup(_)));
    }

    #[test]
    fn each_number_has_its_limit() {
        let field = |malformed| match malformed {
            Malformed::OutOfRange { field, .. } | Malformed::Missing { field } => field,
            other => panic!("{other}"),
        };
        assert_eq!(field(refused(|message| message.seed = SEED_MAX + 1)), "seed");
        let points = |sampling, points| {
            field(refused(|message| {
                message.set_sampling(sampling);
                message.points_per_scramble = points;
            }))
        };
        let (streams, sobol) = (v1::Sampling::MonteCarlo, v1::Sampling::Sobol);
        assert_eq!(points(streams, Some(1)), "points_per_scramble");
        assert_eq!(points(sobol, None), "points_per_scramble");
        assert_eq!(points(sobol, Some(0)), "points_per_scramble");
        assert_eq!(points(sobol, Some(REALIZATIONS_MAX + 1)), "points_per_scramble");
        assert_eq!(field(refused(|message| message.point = None)), "point");
        let of_point =
            |dispersion| refused(|message| message.point.as_mut().unwrap().dispersion = dispersion);
        assert_eq!(field(of_point(None)), "dispersion");
        assert_eq!(field(of_point(Some(f64::NAN))), "dispersion");
        let searched = |factor| {
            refused(|message| message.point.as_mut().unwrap().bone_quality_factor = factor)
        };
        assert!(matches!(searched(Some(1.5)), Malformed::InvalidSetup(_)));
        assert_eq!(field(searched(Some(-1.0))), "bone_quality_factor");
    }
}
