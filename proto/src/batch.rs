//! A batch of realizations, as the coordinator sends it to a worker.

use osteon_common::case::Setup;
use osteon_common::check;
use osteon_common::germ_source::{GermScheme, GermSource};
use osteon_common::job::Sampling;
use osteon_common::limits::{BATCH_REALIZATIONS_MAX, REALIZATIONS_MAX, SEED_MAX};
use osteon_common::outcome::{self, Solved};
use osteon_common::parameters::Point;
use osteon_common::violations::Violations;

use crate::choice::SAMPLING;
use crate::malformed::Malformed;
use crate::parameter_values::{point_from_message, point_to_message};
use crate::realizations;
use crate::setup::{self, SetupMessages};
use crate::v1;

/// The work of one batch: realizations `first`, `first + 1`, … `first + count - 1` of one point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Work {
    /// Layers, probe, picking, solver.
    pub setup: Setup,
    /// The point (a, δ).
    pub point: Point,
    /// Source of the germs.
    pub germs: GermSource,
    /// Index of the first realization.
    pub first: u64,
    /// Number of realizations, 1 to [`BATCH_REALIZATIONS_MAX`].
    pub count: u32,
}

/// Returns the message of batch number `batch`.
pub fn to_message(batch: u64, work: &Work) -> v1::Batch {
    let SetupMessages { layers, probe, picking, solver } = setup::to_messages(&work.setup);
    let (sampling, points) = match work.germs.scheme {
        GermScheme::Streams => (Sampling::MonteCarlo, None),
        GermScheme::Sobol { points } => (Sampling::Sobol, Some(points)),
    };
    v1::Batch {
        batch,
        layers: Some(layers),
        probe: Some(probe),
        picking: Some(picking),
        solver: Some(solver),
        point: Some(point_to_message(&work.point)),
        seed: work.germs.seed,
        sampling: SAMPLING.number(sampling),
        first: work.first,
        count: work.count,
        points_per_scramble: points,
    }
}

/// Returns the work of a batch.
///
/// # Errors
/// If the setup is incomplete (a worker must not fill in its own defaults) or invalid, if the point
/// does not have seven finite numbers, or if a number is beyond its limit.
pub fn from_message(message: &v1::Batch) -> Result<Work, Malformed> {
    let count = f64::from(message.count);
    if message.count == 0 || message.count > BATCH_REALIZATIONS_MAX {
        let allowed = "it must be 1 to 65536";
        return Err(Malformed::OutOfRange { field: "count", value: count, allowed });
    }
    if message.first > REALIZATIONS_MAX - u64::from(message.count).min(REALIZATIONS_MAX) {
        let allowed = "the batch must end within 10^7 realizations";
        return Err(Malformed::OutOfRange { field: "first", value: message.first as f64, allowed });
    }
    if message.seed > SEED_MAX {
        let allowed = "it must be at most 2^63 - 1";
        return Err(Malformed::OutOfRange { field: "seed", value: message.seed as f64, allowed });
    }
    let mut violations = Violations::new();
    let setup = read_setup(message, &mut violations)?;
    let sampling = SAMPLING.required(message.sampling, "sampling")?;
    violations.into_result(()).map_err(Malformed::InvalidSetup)?;
    let germs = GermSource { seed: message.seed, scheme: scheme(message, sampling)? };
    let point = point_from_message(message.point.as_ref())?;
    Ok(Work { setup, point, germs, first: message.first, count: message.count })
}

/// Returns the scheme by which germs are generated from the seed.
fn scheme(message: &v1::Batch, sampling: Sampling) -> Result<GermScheme, Malformed> {
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

/// Returns the answer to batch number `batch`: its realizations in index order, and the wall time
/// in seconds that they took.
pub fn answer_to_message(batch: u64, solved: &[Solved], elapsed_s: f64) -> v1::BatchResult {
    let (codes, velocities) = solved.iter().map(|solved| outcome::encode(solved.outcome)).unzip();
    let estimated_errors = solved.iter().map(|solved| solved.estimated_error).collect();
    v1::BatchResult { batch, codes, velocities, elapsed_s, estimated_errors }
}

/// Returns the realizations of an answer, in index order.
///
/// # Errors
/// If the lengths differ, if a code and a velocity do not encode an outcome, or if an estimated
/// error is not allowed for its outcome.
pub fn answer_from_message(message: &v1::BatchResult) -> Result<Vec<Solved>, Malformed> {
    let outcomes = realizations::unpack(&message.codes, &message.velocities)?;
    let (found, expected) = (message.estimated_errors.len(), outcomes.len());
    if found != expected {
        return Err(Malformed::WrongLength { field: "estimated_errors", found, expected });
    }
    let pairs = outcomes.into_iter().zip(&message.estimated_errors).enumerate();
    pairs
        .map(|(index, (outcome, &estimated_error))| {
            let solved = Solved { outcome, estimated_error };
            let unsound = Malformed::EstimatedError { index, value: estimated_error };
            solved.is_sound().then_some(solved).ok_or(unsound)
        })
        .collect()
}

/// Reads the setup and checks that it is complete, i.e. that encoding it again gives the same
/// messages.
fn read_setup(message: &v1::Batch, violations: &mut Violations) -> Result<Setup, Malformed> {
    let (Some(layers), Some(probe), Some(picking), Some(solver)) =
        (&message.layers, &message.probe, &message.picking, &message.solver)
    else {
        return Err(Malformed::IncompleteSetup);
    };
    let setup =
        setup::from_messages(Some(layers), Some(probe), Some(picking), Some(solver), violations);
    check::setup(&setup, violations);
    if !violations.is_empty() {
        return Ok(setup);
    }
    let written = setup::to_messages(&setup);
    let complete = written.layers == *layers
        && written.probe == *probe
        && written.picking == *picking
        && written.solver == *solver;
    if complete { Ok(setup) } else { Err(Malformed::IncompleteSetup) }
}

#[cfg(test)]
mod tests {
    use osteon_common::outcome::FailureKind;
    use osteon_fuzz::properties;
    use proptest::prelude::*;

    use super::*;

    const WORK: fn(f64, u64, u64, u32) -> Work = |density, seed, first, count| Work {
        setup: Setup::default(),
        point: Point([density, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029]),
        germs: GermSource::streams(seed),
        first,
        count,
    };

    properties! {
        fn work_survives_the_wire(
            number in any::<u64>(),
            density in 1e-300..1e300,
            seed in 0..=SEED_MAX,
            first in 0..REALIZATIONS_MAX - u64::from(BATCH_REALIZATIONS_MAX),
            count in 1..=BATCH_REALIZATIONS_MAX,
            points in proptest::option::of(1..=REALIZATIONS_MAX),
        ) {
            let mut work = WORK(density, seed, first, count);
            if let Some(points) = points {
                work.germs.scheme = GermScheme::Sobol { points };
            }
            let message = to_message(number, &work);
            prop_assert_eq!(message.batch, number);
            prop_assert_eq!(from_message(&message), Ok(work));
        }
    }

    #[test]
    fn answers_survive_the_wire_and_unsound_ones_do_not() {
        let solved = [
            Solved { outcome: Ok(3900.5), estimated_error: 2e-5 },
            Solved::failed(FailureKind::NoArrival),
            Solved { outcome: Ok(3901.5), estimated_error: 0.0 },
        ];
        let message = answer_to_message(7, &solved, 0.25);
        assert_eq!((message.batch, message.elapsed_s), (7, 0.25));
        assert_eq!(answer_from_message(&message).unwrap(), solved);
        let refused = |change: fn(&mut v1::BatchResult)| {
            let mut message = message.clone();
            change(&mut message);
            answer_from_message(&message).unwrap_err()
        };
        let (field, found, expected) = ("estimated_errors", 2, 3);
        assert_eq!(
            refused(|answer| answer.estimated_errors.truncate(2)),
            Malformed::WrongLength { field, found, expected }
        );
        let unsound = |index, value| Malformed::EstimatedError { index, value };
        assert_eq!(refused(|answer| answer.estimated_errors[0] = -1.0), unsound(0, -1.0));
        assert_eq!(refused(|answer| answer.estimated_errors[1] = 1e-5), unsound(1, 1e-5));
        let infinite = refused(|answer| answer.estimated_errors[2] = f64::INFINITY);
        assert_eq!(infinite, unsound(2, f64::INFINITY));
        let wrong_code = refused(|answer| answer.codes[0] = 1);
        assert!(matches!(wrong_code, Malformed::Outcome { index: 0, .. }));
    }

    fn refused(change: impl FnOnce(&mut v1::Batch)) -> Malformed {
        let mut message = to_message(1, &WORK(1598.8, 1, 0, 10));
        change(&mut message);
        from_message(&message).unwrap_err()
    }

    #[test]
    fn what_a_worker_must_not_guess_is_refused() {
        assert_eq!(refused(|batch| batch.layers = None), Malformed::IncompleteSetup);
        let without_density = |batch: &mut v1::Batch| {
            batch.layers.as_mut().unwrap().coupling.as_mut().unwrap().density = None;
        };
        assert_eq!(refused(without_density), Malformed::IncompleteSetup);
        let field = "sampling";
        assert_eq!(refused(|batch| batch.sampling = 0), Malformed::Missing { field });
        let unknown = Malformed::UnknownValue { field, value: 17 };
        assert_eq!(refused(|batch| batch.sampling = 17), unknown);
        let unspecified = |batch: &mut v1::Batch| batch.picking.as_mut().unwrap().extremum = 0;
        assert_eq!(refused(unspecified), Malformed::IncompleteSetup);
        let hybrid = |batch: &mut v1::Batch| {
            batch.solver.as_mut().unwrap().set_method(v1::SolverMethod::Hybrid);
        };
        assert_eq!(refused(hybrid), Malformed::IncompleteSetup);
        let element_size = |batch: &mut v1::Batch| {
            batch.solver.as_mut().unwrap().element_size = Some(0.5e-3);
        };
        assert!(matches!(refused(element_size), Malformed::InvalidSetup(_)));
        let negative = |batch: &mut v1::Batch| {
            batch.layers.as_mut().unwrap().coupling.as_mut().unwrap().density = Some(-1.0);
        };
        assert!(matches!(refused(negative), Malformed::InvalidSetup(_)));
    }

    #[test]
    fn each_number_has_its_limit() {
        let field = |malformed| match malformed {
            Malformed::OutOfRange { field, .. } | Malformed::Missing { field } => field,
            other => panic!("{other}"),
        };
        assert_eq!(field(refused(|batch| batch.count = 0)), "count");
        assert_eq!(field(refused(|batch| batch.count = BATCH_REALIZATIONS_MAX + 1)), "count");
        assert_eq!(field(refused(|batch| batch.first = REALIZATIONS_MAX - 9)), "first");
        assert_eq!(field(refused(|batch| batch.first = u64::MAX)), "first");
        assert_eq!(field(refused(|batch| batch.seed = SEED_MAX + 1)), "seed");
        let points = |sampling, points| {
            field(refused(|batch| {
                batch.set_sampling(sampling);
                batch.points_per_scramble = points;
            }))
        };
        let (streams, sobol) = (v1::Sampling::MonteCarlo, v1::Sampling::Sobol);
        assert_eq!(points(streams, Some(1)), "points_per_scramble");
        assert_eq!(points(sobol, None), "points_per_scramble");
        assert_eq!(points(sobol, Some(0)), "points_per_scramble");
        assert_eq!(points(sobol, Some(REALIZATIONS_MAX + 1)), "points_per_scramble");
        assert_eq!(field(refused(|batch| batch.point = None)), "point");
        let of_point =
            |dispersion| refused(|batch| batch.point.as_mut().unwrap().dispersion = dispersion);
        assert_eq!(field(of_point(None)), "dispersion");
        assert_eq!(field(of_point(Some(f64::NAN))), "dispersion");
    }
}
