//! A batch of realizations, as the coordinator sends it to a worker, and the worker's answer.

use std::sync::Arc;

use osteon_common::limits::{BATCH_REALIZATIONS_MAX, REALIZATIONS_MAX};
use osteon_common::observables::PerObservable;
use osteon_common::outcome::{self, RealizationResult};

use crate::announced::Received;
use crate::evaluation::EvaluationInput;
use crate::malformed::Malformed;
use crate::observed;
use crate::v1;

/// Longest computing time that an answer may state, s: a hundred days, which no batch takes.
const ELAPSED_S_MAX: f64 = 1e7;

/// The work of one batch: realizations `first`, `first + 1`, … `first + count - 1` of one
/// evaluation.
#[derive(Debug, Clone, PartialEq)]
pub struct Work {
    /// The evaluation.
    pub evaluation: Arc<EvaluationInput>,
    /// Index of the first realization.
    pub first: u64,
    /// Number of realizations, 1 to [`BATCH_REALIZATIONS_MAX`].
    pub count: u32,
}

/// Returns the message of batch number `batch`.
pub fn to_message(batch: u64, work: &Work) -> v1::Batch {
    let Work { evaluation, first, count } = work;
    v1::Batch { batch, evaluation: evaluation.id, first: *first, count: *count, trace: None }
}

/// Returns the work of a batch, of an evaluation that was received before.
///
/// # Errors
/// If the evaluation is not among those received, or if a number is beyond its limit.
pub fn from_message(message: &v1::Batch, received: &Received) -> Result<Work, Malformed> {
    let count = f64::from(message.count);
    if message.count == 0 || message.count > BATCH_REALIZATIONS_MAX {
        let allowed = "it must be 1 to 65536";
        return Err(Malformed::OutOfRange { field: "count", value: count, allowed });
    }
    if message.first > REALIZATIONS_MAX - u64::from(message.count).min(REALIZATIONS_MAX) {
        let allowed = "the batch must end within 10^7 realizations";
        return Err(Malformed::OutOfRange { field: "first", value: message.first as f64, allowed });
    }
    let unknown = Malformed::UnknownEvaluation { evaluation: message.evaluation };
    let evaluation = Arc::clone(received.get(message.evaluation).ok_or(unknown)?);
    Ok(Work { evaluation, first: message.first, count: message.count })
}

/// Returns the answer to batch number `batch`: its realizations in index order, and the wall time
/// in seconds that they took.
pub fn answer_to_message(
    batch: u64,
    solved: &[RealizationResult],
    elapsed_s: f64,
) -> v1::BatchResult {
    let (codes, velocities) = solved.iter().map(|solved| outcome::encode(solved.outcome)).unzip();
    let estimated_errors = solved.iter().map(|solved| solved.estimated_error).collect();
    let columns = PerObservable::new(|one| {
        let has_values = solved.iter().any(|solved| solved.observables[one].to_bits() != 0);
        has_values.then(|| solved.iter().map(|solved| solved.observables[one]).collect())
    });
    let observables = observed::columns_to_messages(&columns);
    v1::BatchResult { batch, codes, velocities, elapsed_s, estimated_errors, observables }
}

/// Returns the realizations of an answer, in index order.
///
/// # Errors
/// If the lengths differ, if a code and a velocity do not encode an outcome, if an estimated error or an
/// observable is not allowed for its outcome or unknown, or if the computing time is none. Observables that
/// are not given are 0.
pub fn answer_from_message(message: &v1::BatchResult) -> Result<Vec<RealizationResult>, Malformed> {
    let v1::BatchResult { codes, velocities, estimated_errors, observables, elapsed_s, .. } =
        message;
    if !(0.0..=ELAPSED_S_MAX).contains(elapsed_s) {
        let allowed = "it must be from 0 to 10^7 s";
        return Err(Malformed::OutOfRange { field: "elapsed_s", value: *elapsed_s, allowed });
    }
    let expected = codes.len();
    for (field, found) in
        [("velocities", velocities.len()), ("estimated_errors", estimated_errors.len())]
    {
        if found != expected {
            return Err(Malformed::WrongLength { field, found, expected });
        }
    }
    let columns = observed::columns_from_messages(observables)?;
    if let Some((_, column)) = columns.present().find(|(_, column)| column.len() != expected) {
        let (field, found) = ("observables", column.len());
        return Err(Malformed::WrongLength { field, found, expected });
    }
    let rows = codes.iter().zip(velocities).zip(estimated_errors).enumerate();
    let mut results = Vec::with_capacity(expected);
    for (index, ((&code, &velocity), &estimated_error)) in rows {
        let outcome = outcome::decode(code, velocity);
        let outcome = outcome.ok_or(Malformed::Outcome { index, code, velocity })?;
        let observables =
            columns.as_ref().map(|column| column.as_ref().map_or(0.0, |all| all[index]));
        let solved = RealizationResult { outcome, estimated_error, observables };
        if !solved.has_valid_error() {
            return Err(Malformed::EstimatedError { index, value: estimated_error });
        }
        if let Some(observable) = solved.invalid_observable() {
            let value = observables[observable];
            return Err(Malformed::ObservedValue { index, observable, value });
        }
        results.push(solved);
    }
    Ok(results)
}

#[cfg(test)]
mod tests {
    use osteon_common::case::Setup;
    use osteon_common::germ_source::GermSource;
    use osteon_common::observables::Observable;
    use osteon_common::outcome::FailureKind;
    use osteon_common::parameters::Point;
    use osteon_common::random_quantities::RandomQuantities;
    use osteon_fuzz::properties;
    use proptest::prelude::*;

    use super::*;
    use crate::evaluation;

    fn evaluation(id: u64) -> v1::Evaluation {
        evaluation::to_message(&EvaluationInput {
            id,
            setup: Setup::default(),
            point: Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029]),
            random: RandomQuantities::default(),
            observables: osteon_common::observables::ObservableSet::NONE,
            germs: GermSource::streams(1),
        })
    }

    properties! {
        fn a_batch_survives_the_wire(
            number in any::<u64>(),
            id in any::<u64>(),
            first in 0..REALIZATIONS_MAX - u64::from(BATCH_REALIZATIONS_MAX),
            count in 1..=BATCH_REALIZATIONS_MAX,
        ) {
            let mut received = Received::default();
            received.receive(&evaluation(id)).unwrap();
            let evaluation = Arc::clone(received.get(id).unwrap());
            let work = Work { evaluation, first, count };
            let message = to_message(number, &work);
            prop_assert_eq!((message.batch, message.evaluation), (number, id));
            prop_assert_eq!(from_message(&message, &received), Ok(work));
        }
    }

    #[test]
    fn answers_survive_the_wire_and_unsound_ones_do_not() {
        let solved = [
            RealizationResult::solved(3900.5, 2e-5),
            RealizationResult::failed(FailureKind::NoArrival),
            RealizationResult::solved(3901.5, 0.0),
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
        for change in [
            (|answer| answer.elapsed_s = f64::NAN) as fn(&mut v1::BatchResult),
            |answer| answer.elapsed_s = f64::INFINITY,
            |answer| answer.elapsed_s = -1.0,
            |answer| answer.elapsed_s = 1e300,
        ] {
            let found = refused(change);
            assert!(matches!(found, Malformed::OutOfRange { field: "elapsed_s", .. }), "{found}");
        }
        let wrong_code = refused(|answer| answer.codes[0] = 1);
        assert!(matches!(wrong_code, Malformed::Outcome { index: 0, .. }));
    }

    #[test]
    fn observables_survive_the_wire_and_none_take_no_bytes() {
        let with_decay = |mut solved: RealizationResult, decay| {
            solved.observables[Observable::Decay] = decay;
            solved
        };
        let solved = [
            with_decay(RealizationResult::solved(3900.5, 2e-5), 4.625),
            RealizationResult::failed(FailureKind::NoArrival),
            with_decay(RealizationResult::solved(3901.5, 0.0), -0.5),
        ];
        let message = answer_to_message(7, &solved, 0.25);
        assert_eq!(message.observables[0].values, [4.625, 0.0, -0.5]);
        assert_eq!(answer_from_message(&message).unwrap(), solved);
        let without = solved.map(|one| with_decay(one, 0.0));
        assert_eq!(answer_to_message(7, &without, 0.25).observables, []);
        let refused = |change: fn(&mut v1::BatchResult)| {
            let mut message = message.clone();
            change(&mut message);
            answer_from_message(&message).unwrap_err()
        };
        let (field, found, expected) = ("observables", 2, 3);
        let short = refused(|answer| answer.observables[0].values.truncate(2));
        assert_eq!(short, Malformed::WrongLength { field, found, expected });
        let wrong = |index, value| {
            let observable = Observable::Decay;
            Malformed::ObservedValue { index, observable, value }
        };
        let of_failure = refused(|answer| answer.observables[0].values[1] = 4.6);
        assert_eq!(of_failure, wrong(1, 4.6));
        let infinite = refused(|answer| answer.observables[0].values[2] = f64::INFINITY);
        assert_eq!(infinite, wrong(2, f64::INFINITY));
        let unknown = refused(|answer| answer.observables[0].observable.push('s'));
        assert_eq!(unknown, Malformed::Observable { name: "decays".to_owned() });
    }

    #[test]
    fn what_a_worker_must_not_guess_is_refused() {
        let mut received = Received::default();
        received.receive(&evaluation(7)).unwrap();
        let refused = |change: fn(&mut v1::Batch)| {
            let mut message =
                v1::Batch { batch: 1, evaluation: 7, first: 0, count: 10, trace: None };
            from_message(&message, &received).unwrap();
            change(&mut message);
            from_message(&message, &received).unwrap_err()
        };
        let unknown = Malformed::UnknownEvaluation { evaluation: 8 };
        assert_eq!(refused(|batch| batch.evaluation = 8), unknown);
        let field = |malformed| match malformed {
            Malformed::OutOfRange { field, .. } => field,
            other => panic!("{other}"),
        };
        assert_eq!(field(refused(|batch| batch.count = 0)), "count");
        assert_eq!(field(refused(|batch| batch.count = BATCH_REALIZATIONS_MAX + 1)), "count");
        assert_eq!(field(refused(|batch| batch.first = REALIZATIONS_MAX - 9)), "first");
        assert_eq!(field(refused(|batch| batch.first = u64::MAX)), "first");
    }
}
