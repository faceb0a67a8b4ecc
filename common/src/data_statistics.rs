//! Statistics of measured velocities: how precisely they determine their moments, and whether they
//! can come from the model's law.

mod few;
mod form;
mod intervals;
mod kolmogorov;
mod lattice;
mod order;

use crate::job::Data;
use crate::limits;
use crate::results::DataSummary;
use crate::robust::outliers;
use crate::statistics::measured_observables;

pub use self::few::{FewIntervals, intervals_of_data};
pub use self::form::form_tests;
pub use self::intervals::{intervals_of_moments, moment_intervals};
pub use self::kolmogorov::{FittedMoments, kolmogorov_test, predictive_test};
pub use self::lattice::rounding;
pub use self::order::order_test;

/// Probability with which an interval contains the moment of the law.
pub const CONFIDENCE: f64 = 0.95;

impl DataSummary {
    /// Summarizes set number `set` of the data. Resamples the subjects, if there are any,
    /// which takes up to a fraction of a second.
    pub fn from_data(data: &Data, set: usize) -> Self {
        let given = data.set(set);
        let outliers = given.map(|given| outliers(given.velocities)).unwrap_or_default();
        Self {
            moments: data.moments(set),
            observables: given.as_ref().map(measured_observables).unwrap_or_default(),
            count: given.map(|given| given.velocities.len() as u64),
            intervals: match &given {
                Some(given) => moment_intervals(given),
                None => intervals_of_moments(data),
            },
            rounding: given.and_then(|given| rounding(given.velocities)),
            order: given
                .filter(|given| given.subjects.is_none())
                .and_then(|given| order_test(given.velocities)),
            outlier_count: outliers.len() as u64,
            outliers: outliers.into_iter().take(limits::OUTLIERS_LISTED_MAX).collect(),
        }
    }
}
