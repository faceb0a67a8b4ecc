//! All outcomes of one evaluation, with the decays if the job has measured ones.

use std::ops::Deref;
use std::sync::Arc;

use crate::outcome::{Outcome, RealizationResult};

/// Outcomes of one evaluation in index order; dereferences to them. Copies share the memory.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcomes {
    velocities: Arc<[Outcome]>,
    decays: Option<Arc<[f64]>>,
}

impl Outcomes {
    /// Creates the outcomes of these realizations, `with_decays` or without.
    pub fn of_results(
        results: impl Iterator<Item = RealizationResult> + Clone,
        with_decays: bool,
    ) -> Self {
        let decays = with_decays.then(|| results.clone().map(|result| result.decay).collect());
        Self { velocities: results.map(|result| result.outcome).collect(), decays }
    }

    /// Returns them with these decays, dB/cm: as many as outcomes, 0 on failure; `None` for a job
    /// without measured decays.
    #[must_use]
    pub fn with_decays(self, decays: Option<Arc<[f64]>>) -> Self {
        Self { decays, ..self }
    }

    /// Returns the decay of each realization along the array, dB/cm, 0 on failure; `None` for a job
    /// without measured decays.
    pub fn decays(&self) -> Option<&[f64]> {
        self.decays.as_deref()
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

impl From<Arc<[Outcome]>> for Outcomes {
    fn from(velocities: Arc<[Outcome]>) -> Self {
        Self { velocities, decays: None }
    }
}

impl From<Vec<Outcome>> for Outcomes {
    fn from(outcomes: Vec<Outcome>) -> Self {
        Arc::<[Outcome]>::from(outcomes).into()
    }
}

impl<const N: usize> From<[Outcome; N]> for Outcomes {
    fn from(outcomes: [Outcome; N]) -> Self {
        Arc::<[Outcome]>::from(outcomes).into()
    }
}

impl FromIterator<Outcome> for Outcomes {
    fn from_iter<I: IntoIterator<Item = Outcome>>(outcomes: I) -> Self {
        outcomes.into_iter().collect::<Arc<[Outcome]>>().into()
    }
}
