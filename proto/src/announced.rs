//! The evaluations that a worker keeps: both ends of a stream have the same list.

use std::collections::VecDeque;
use std::sync::Arc;

use crate::evaluation::{self, EvaluationInput};
use crate::malformed::Malformed;
use crate::v1;

/// Number of evaluations that a worker keeps, those that were announced last. Any number keeps both
/// ends in step, because messages arrive in the order in which they are sent; with this one the
/// coordinator seldom announces an evaluation twice. By default 8 jobs are computed at the same
/// time, each with one evaluation that its search asked for and 8 speculative ones.
pub const EVALUATIONS_KEPT_MAX: usize = 128;

/// The evaluations announced last on one stream, the oldest first: with their contents at the worker
/// ([`Received`]), without at the coordinator.
#[derive(Debug, Clone, PartialEq)]
pub struct Announced<T> {
    kept: VecDeque<(u64, T)>,
}

/// The evaluations that a worker has received.
pub type Received = Announced<Arc<EvaluationInput>>;

impl<T> Default for Announced<T> {
    fn default() -> Self {
        Self { kept: VecDeque::new() }
    }
}

impl<T> Announced<T> {
    /// Returns the contents of evaluation `id`; `None` if it is not kept.
    pub fn get(&self, id: u64) -> Option<&T> {
        // The one that a batch refers to is usually among the last.
        self.kept.iter().rev().find(|(kept, _)| *kept == id).map(|(_, contents)| contents)
    }

    /// Appends evaluation `id`, in place of the oldest if there are [`EVALUATIONS_KEPT_MAX`].
    /// Returns whether it is new: one that is kept already stays as it is.
    pub fn announce(&mut self, id: u64, contents: T) -> bool {
        if self.get(id).is_some() {
            return false;
        }
        if self.kept.len() >= EVALUATIONS_KEPT_MAX {
            self.kept.pop_front();
        }
        self.kept.push_back((id, contents));
        true
    }
}

impl Received {
    /// Reads an evaluation and keeps it.
    ///
    /// # Errors
    /// As [`evaluation::from_message`], and if the evaluation is kept already.
    pub fn receive(&mut self, message: &v1::Evaluation) -> Result<(), Malformed> {
        let received = evaluation::from_message(message)?;
        let id = received.id;
        let repeated = Malformed::RepeatedEvaluation { evaluation: id };
        self.announce(id, Arc::new(received)).then_some(()).ok_or(repeated)
    }
}

#[cfg(test)]
mod tests {
    use osteon_common::case::Setup;
    use osteon_common::germ_source::GermSource;
    use osteon_common::parameters::Point;
    use osteon_common::random_quantities::RandomQuantities;
    use osteon_fuzz::properties;
    use proptest::prelude::*;

    use super::*;
    use crate::batch::{self, Work};

    fn evaluation(id: u64) -> EvaluationInput {
        let germs = GermSource::streams(id);
        EvaluationInput {
            id,
            setup: Setup::default(),
            point: Point::of_bone([1.0; 7]),
            germs,
            random: RandomQuantities::default(),
            observables: osteon_common::observables::ObservableSet::NONE,
        }
    }

    properties! {
        /// Batches of more evaluations than are kept, in any order: what the coordinator does not
        /// announce again, the worker still has.
        fn both_ends_of_a_stream_stay_in_step(
            ids in proptest::collection::vec(0..2 * EVALUATIONS_KEPT_MAX as u64, 0..1000),
        ) {
            let (mut sent, mut received) = (Announced::default(), Received::default());
            for (number, id) in (0..).zip(ids) {
                if sent.announce(id, ()) {
                    let message = evaluation::to_message(&evaluation(id));
                    prop_assert_eq!(received.receive(&message), Ok(()));
                }
                let work = Work { evaluation: Arc::new(evaluation(id)), first: number, count: 1 };
                let message = batch::to_message(number, &work);
                prop_assert_eq!(batch::from_message(&message, &received), Ok(work));
                prop_assert!(sent.kept.len() <= EVALUATIONS_KEPT_MAX);
                let ids = |kept: &Received| kept.kept.iter().map(|(id, _)| *id).collect::<Vec<_>>();
                let expected: Vec<u64> = sent.kept.iter().map(|(id, ())| *id).collect();
                prop_assert_eq!(ids(&received), expected);
            }
        }
    }

    #[test]
    fn the_oldest_is_forgotten() {
        let mut announced = Announced::default();
        let most = EVALUATIONS_KEPT_MAX as u64;
        assert!((0..most).all(|id| announced.announce(id, id)));
        // It does not become newer by this.
        assert!(!announced.announce(0, 17));
        assert_eq!(announced.get(0), Some(&0));
        assert!(announced.announce(most, most));
        assert_eq!([0, 1, most].map(|id| announced.get(id).copied()), [None, Some(1), Some(most)]);
        assert!(announced.announce(0, 17));
        assert_eq!([0, 1].map(|id| announced.get(id).copied()), [Some(17), None]);
    }

    #[test]
    fn an_evaluation_that_is_kept_is_refused() {
        let mut received = Received::default();
        let message = evaluation::to_message(&evaluation(3));
        assert_eq!(received.receive(&message), Ok(()));
        let other = v1::Evaluation { seed: 4, ..message };
        let repeated = Malformed::RepeatedEvaluation { evaluation: 3 };
        assert_eq!(received.receive(&other), Err(repeated));
        assert_eq!(received.get(3).map(|kept| kept.germs.seed), Some(3));
    }
}
