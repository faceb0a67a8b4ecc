//! All outcomes of one evaluation, with the decays if the job has measured ones.

use std::ops::Deref;
use std::sync::Arc;

use crate::outcome::{Outcome, RealizationResult};

/// Outcomes of one evaluation in index order; dereferences to them. Copies share the memory.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcomes {
    velocities: Arc<Vec<Outcome>>,
    decays: Option<Arc<Vec<f64>>>,
}

impl Outcomes {
    /// Creates the outcomes of these realizations, `with_decays` or without.
    pub fn of_results(
        results: impl Iterator<Item = RealizationResult> + Clone,
        with_decays: bool,
    ) -> Self {
        let decays: Option<Vec<f64>> =
            with_decays.then(|| results.clone().map(|result| result.decay).collect());
        let velocities: Vec<Outcome> = results.map(|result| result.outcome).collect();
        Self::shared(Arc::new(velocities), decays.map(Arc::new))
    }

    /// Creates outcomes that share these lists, as many decays as outcomes.
    pub fn shared(velocities: Arc<Vec<Outcome>>, decays: Option<Arc<Vec<f64>>>) -> Self {
        Self { velocities, decays }
    }

    /// Returns them with these decays, dB/cm: as many as outcomes, 0 on failure; `None` for a job
    /// without measured decays.
    #[must_use]
    pub fn with_decays(self, decays: Option<Vec<f64>>) -> Self {
        Self { decays: decays.map(Arc::new), ..self }
    }

    /// Returns the decay of each realization along the array, dB/cm, 0 on failure; `None` for a job
    /// without measured decays.
    pub fn decays(&self) -> Option<&[f64]> {
        self.decays.as_deref().map(Vec::as_slice)
    }

    /// Returns whether both are copies of the same outcomes, without comparing these.
    pub fn are_copies_of(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.velocities, &other.velocities)
    }
}

impl Deref for Outcomes {
    type Target = [Outcome];

    fn deref(&self) -> &[Outcome] {
        &self.velocities
    }
}

impl From<Vec<Outcome>> for Outcomes {
    fn from(outcomes: Vec<Outcome>) -> Self {
        Self { velocities: Arc::new(outcomes), decays: None }
    }
}

impl<const N: usize> From<[Outcome; N]> for Outcomes {
    fn from(outcomes: [Outcome; N]) -> Self {
        Vec::from(outcomes).into()
    }
}

impl FromIterator<Outcome> for Outcomes {
    fn from_iter<I: IntoIterator<Item = Outcome>>(outcomes: I) -> Self {
        outcomes.into_iter().collect::<Vec<Outcome>>().into()
    }
}
